"""Which rows go to which rank."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.rows import share


def cuts(total: int, size: int) -> NDArray[np.int64]:
    """(size + 1,) where the shares of so many things begin, and the end of all (``gmsnet.io.rows.share``)."""
    return np.array([share(total, rank, size)[0] for rank in range(size + 1)], dtype=np.int64)


def by_rank(ranks: NDArray[np.integer[Any]], size: int) -> list[NDArray[np.intp]]:
    """For each of so many ranks the rows that name it, ascending. ranks: (n,) of each row."""
    order = np.argsort(ranks, kind="stable")
    ends = np.searchsorted(ranks[order], np.arange(1, size))
    return np.split(order, ends)
