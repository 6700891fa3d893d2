"""Work on ranges of blocks, side by side on threads where that pays. The kernels release the GIL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

BLOCKS_PER_THREAD = 256  # about a millisecond of work: for less, waking a thread can cost more than it brings

Share = Callable[[Callable[[int, int], Any], int, int], list[Any]]


def serial(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
    """All of the range at once, in this thread."""
    return [work(first, last)]


@contextmanager
def workers(threads: int, blocks: int) -> Iterator[Share]:
    """Gives a function that calls another on ranges first…last, in ``threads`` pieces side by side where that pays."""
    if threads == 1 or blocks < 2 * BLOCKS_PER_THREAD:
        yield serial
        return
    with ThreadPoolExecutor(threads - 1) as pool:

        def share(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
            pieces = max(1, min(threads, (last - first) // BLOCKS_PER_THREAD))
            ends = [first + (last - first) * k // pieces for k in range(pieces + 1)]
            others = [pool.submit(work, *ends[k : k + 2]) for k in range(1, pieces)]
            return [work(first, ends[1]), *(other.result() for other in others)]  # the caller works too

        yield share


def available_threads() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
