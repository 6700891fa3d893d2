"""Counting sorts of many items, in halves on two threads. The kernels release the GIL."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.parallel.threads import side_by_side

Counts = NDArray[np.int64]
Pass = Callable[[int, int, Counts], None]


def in_bins(items: int, bins: int, threads: int, count: Pass, write: Pass) -> Counts:
    """Where each bin begins (B + 1,) in an array of what is in the bins, one after the other; the items in their order.

    count(first, last, counts) adds what some of the items put into each bin to counts (B,). write(first, last, place)
    writes it there, from place (B,) on, and raises place by it. threads: one or two.
    """
    middle = items // 2 if threads > 1 else 0
    early, late = np.zeros((2, bins), dtype=np.int64)
    side_by_side(threads, partial(count, 0, middle, early), partial(count, middle, items, late))
    start = np.zeros(bins + 1, dtype=np.int64)
    late += early
    np.cumsum(late, out=start[1:])
    first, rest = late, early  # where the items before the middle begin, and the others; in the same memory
    first[:] = start[:-1]
    rest += start[:-1]
    side_by_side(threads, partial(write, 0, middle, first), partial(write, middle, items, rest))
    return start
