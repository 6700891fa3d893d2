"""Work on ranges of blocks, and works apart, side by side on threads where that pays. The kernels release the GIL."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gmsnet.parallel.executor import Executor, Figure, Figures, Result

STRIDE = 32  # one value in so many tells about how low the lowest are
FEWEST_BLOCKS = 64  # in a piece: a tenth of a millisecond of work, ten times what handing it to a thread takes

One = TypeVar("One")
Other = TypeVar("Other")


class Process:
    """What executors of a single process have in common: the figures of the whole mesh are its own."""

    def swept(self, visit: Any, stars: Any, points: NDArray[np.float64], guard: Any) -> NDArray[np.int64] | None:
        """See Executor."""
        return None

    def remarks(self) -> tuple[str, ...]:
        """See Executor."""
        return ()

    def figures(
        self, summary: Any, points: NDArray[np.float64], cells: tuple[Any, ...], rest: tuple[Any, ...]
    ) -> Iterable[NDArray[np.float64]] | None:
        """See Executor."""
        return None

    def after_colour(self, colour: int, points: NDArray[np.float64]) -> None:
        """See Executor. All threads see the same points."""

    def exchange(self, values: NDArray[np.float64]) -> None:
        """See Executor."""

    def lowest(self, values: NDArray[np.float64], share: int, fewest: int) -> NDArray[np.int32]:
        """See Executor."""
        many = max(fewest, len(values) // share)
        if many >= len(values):
            return np.arange(len(values), dtype=np.int32)
        least = np.partition(values, many - 1)[many - 1]
        chosen = values < least
        chosen[np.flatnonzero(values == least)[: many - np.count_nonzero(chosen)]] = True
        return np.flatnonzero(chosen).astype(np.int32)

    def lowest_rows(
        self, values: NDArray[np.float64], many: int, rows: NDArray[np.int32] | None = None
    ) -> NDArray[np.int32]:
        """See Executor."""
        if many >= len(values):
            return np.arange(len(values), dtype=np.int32)
        some = values[::STRIDE]
        few = min(2 * many // STRIDE + STRIDE, len(some) - 1)
        likely = np.flatnonzero(values <= np.partition(some, few)[few])
        if len(likely) < many:
            likely = np.arange(len(values))
        found = values[likely]
        least = np.partition(found, many - 1)[many - 1]
        chosen = found < least
        chosen[np.flatnonzero(found == least)[: many - np.count_nonzero(chosen)]] = True
        lowest: NDArray[np.int32] = likely[chosen].astype(np.int32)
        return lowest

    def counted(self, flags: NDArray[np.bool_]) -> int:
        """See Executor."""
        return int(np.count_nonzero(flags))

    def cell_count(self, simplices: Any) -> int:
        """See Executor."""
        return int(simplices.cell_count)

    def every(self, stride: int, length: int, size: int = 1) -> NDArray[np.int32]:
        """See Executor."""
        first = np.arange(0, length, stride * size, dtype=np.int32)
        rows = (first[:, None] + np.arange(size, dtype=np.int32)).ravel()
        return rows[rows < length].astype(np.int32)

    def row_numbers(self, rows: NDArray[np.int32]) -> NDArray[np.int64]:
        """See Executor."""
        return rows.astype(np.int64)

    def free_numbers(self, near_free: NDArray[np.bool_]) -> NDArray[np.int64]:
        """See Executor."""
        return np.arange(np.count_nonzero(near_free))

    def in_order(self, numbers: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """See Executor."""
        return values

    def nth(self, values: NDArray[np.float64], number: int) -> float:
        """See Executor."""
        if not len(values):
            return math.inf
        place = min(number, len(values)) - 1
        return float(np.partition(values, place)[place])

    def gathered(self, field: Any) -> Any:
        """See Executor."""
        return field

    def dealt(self, field: Any, rows: NDArray[np.int32]) -> Any:
        """See Executor."""
        return field

    def gathered_around(self, field: Any, corners: NDArray[np.int32], rings: int) -> tuple[Any, NDArray[np.int32]]:
        """See Executor."""
        return field, corners

    def cells_returned(self, part: Any, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """See Executor."""
        return corners

    def called_alone(self, callback: Callable[[Any], Any] | None) -> Callable[[Any], Any] | None:
        """See Executor."""
        return callback

    def restricted(self, topology: Any, active: NDArray[np.bool_]) -> Any:
        """See Executor."""
        return topology.restricted(active)

    def holding(self, topology: Any, nodes: NDArray[np.bool_], reason: str) -> Any:
        """See Executor."""
        return topology.holding(nodes, reason)

    def lent(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """See Executor."""
        return values

    def returned(self, field: Any, part: Any, result: Result) -> Result:
        """See Executor."""
        return result

    def blocks_with(self, rows: NDArray[np.int32], size: int) -> NDArray[np.int32]:
        """See Executor."""
        return np.unique(rows // size)

    def minimum(self, value: Figure) -> Figure:
        """See Executor."""
        return value

    def total(self, figures: Figures) -> Figures:
        """See Executor."""
        return figures


class Serial(Process):
    """All of a range at once, in the calling thread."""

    sequential = True

    def map(self, work: Callable[[int, int], Result], first: int, last: int) -> list[Result]:
        """See Executor."""
        return [work(first, last)]

    def of(self, topology: Any) -> Executor:
        """See Executor."""
        return self

    def for_blocks(self, blocks: int) -> Executor:
        """See Executor."""
        return self


serial: Serial = Serial()


class Threads(Process):
    """Pieces of a range side by side, the calling thread among those that work.

    Threads take the next piece when they have done one, so that none waits long for another that was held up. They are
    started when there is first something for them to do, and stay until ``close``.
    """

    sequential = False

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool: ThreadPoolExecutor | None = None

    def map(self, work: Callable[[int, int], Result], first: int, last: int) -> list[Result]:
        """See Executor."""
        ends = pieces(first, last, self.threads)
        found: list[Any] = [None] * (len(ends) - 1)
        numbers = iter(range(len(found)))

        def take() -> None:
            for k in numbers:  # each number goes to one thread
                found[k] = work(ends[k], ends[k + 1])

        try:
            others = self._submit(take, min(self.threads, len(found)) - 1)
            take()
            for other in others:
                if not other.cancel():  # one that has not begun by now has nothing left to do
                    other.result()
        except BaseException:
            for _ in numbers:  # nobody begins another piece
                pass
            self.close()  # and those that were begun have ended before the caller looks at what they did
            raise
        return found

    def of(self, topology: Any) -> Executor:
        """See Executor."""
        return self

    def for_blocks(self, blocks: int) -> Executor:
        """See Executor."""
        return serial if blocks < 8 * FEWEST_BLOCKS else self

    def close(self) -> None:
        """Waits until no thread works any more, and ends them."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown()

    def _submit(self, take: Callable[[], None], times: int) -> list[Future[None]]:
        if not times:
            return []
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads - 1)
        return [self._pool.submit(take) for _ in range(times)]


@contextmanager
def workers(threads: int) -> Iterator[Executor]:
    """An executor of at most so many threads, which end with the context."""
    if threads == 1:
        yield serial
        return
    executor = Threads(threads)
    try:
        yield executor
    finally:
        executor.close()


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
