"""Work on ranges of blocks, side by side on threads where that pays. The kernels release the GIL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

BLOCKS_PER_THREAD = 32  # fewer do not pay for handing them to a thread

Share = Callable[[Callable[[int, int], Any], int, int], list[Any]]


@contextmanager
def workers(threads: int, blocks: int) -> Iterator[Share]:
    """Gives a function that calls another on ranges first…last, in ``threads`` pieces side by side where that pays."""
    if threads == 1 or blocks < 2 * BLOCKS_PER_THREAD:
        yield lambda work, first, last: [work(first, last)]
        return
    with ThreadPoolExecutor(threads) as pool:

        def share(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
            pieces = max(1, min(threads, (last - first) // BLOCKS_PER_THREAD))
            ends = [first + (last - first) * k // pieces for k in range(pieces + 1)]
            return list(pool.map(work, ends[:-1], ends[1:]))

        yield share


def available_threads() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
