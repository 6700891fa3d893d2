"""Which rows go to which rank."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def by_rank(ranks: NDArray[np.integer[Any]], size: int) -> list[NDArray[np.intp]]:
    """For each of so many ranks the rows that name it, ascending. ranks: (n,) of each row."""
    order = np.argsort(ranks, kind="stable")
    ends = np.searchsorted(ranks[order], np.arange(1, size))
    return np.split(order, ends)
