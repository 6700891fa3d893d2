"""Work on ranges of blocks, and works apart, side by side on threads where that pays. The kernels release the GIL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

FEWEST_BLOCKS = 64  # in a piece: a tenth of a millisecond of work, ten times what handing it to a thread takes

Share = Callable[[Callable[[int, int], Any], int, int], list[Any]]
One = TypeVar("One")
Other = TypeVar("Other")


def serial(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
    """All of the range at once, in this thread."""
    return [work(first, last)]


@contextmanager
def workers(threads: int, blocks: int) -> Iterator[Share]:
    """Gives a function that calls another on the pieces of a range first…last, side by side where that pays.

    Threads take the next piece when they have done one, so that none waits long for another that was held up. What
    the pieces return comes in their order. blocks: how many there are in all.
    """
    if threads == 1 or blocks < 8 * FEWEST_BLOCKS:
        yield serial
        return
    with ThreadPoolExecutor(threads - 1) as pool:

        def share(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
            ends = pieces(first, last, threads)
            found: list[Any] = [None] * (len(ends) - 1)
            numbers = iter(range(len(found)))

            def take() -> None:
                for k in numbers:  # each number goes to one thread
                    found[k] = work(ends[k], ends[k + 1])

            others = [pool.submit(take) for _ in range(min(threads, len(found)) - 1)]
            try:
                take()  # the caller works too
            except BaseException:
                for _ in numbers:  # nobody begins another piece
                    pass
                raise
            for other in others:
                if not other.cancel():  # one that has not begun by now has nothing left to do
                    other.result()
            return found

        yield share


def pieces(first: int, last: int, threads: int) -> list[int]:
    """Where the pieces of a range begin, and its end: large ones first, so that they are few and end together."""
    ends = [first]
    while last - ends[-1] >= 2 * FEWEST_BLOCKS:
        ends.append(ends[-1] + max((last - ends[-1]) // (2 * threads), FEWEST_BLOCKS))
    return [*ends, last]


def side_by_side(threads: int, one: Callable[[], One], other: Callable[[], Other]) -> tuple[One, Other]:
    """What two works return that have nothing to do with each other, each on a thread if there are two."""
    if threads == 1:
        return one(), other()
    with ThreadPoolExecutor(1) as pool:
        later = pool.submit(other)
        return one(), later.result()


def available_threads() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
