"""The executor of a rank: it works on its own stars, and forms figures with all others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.halo import Halo
from gmsnet.distributed.library import mpi
from gmsnet.parallel.executor import Executor, Figure, Figures, Result
from gmsnet.parallel.threads import serial

Floats = NDArray[np.float64]


class Ranks:
    """See Executor. numbers: of each block of cells of this rank, its number among those of the whole mesh.

    inner: carries out the work of this rank.
    """

    sequential = False
    comm: Any
    halo: Halo
    numbers: NDArray[np.int64]
    inner: Executor
    count: int

    def __init__(self, comm: Any, halo: Halo, numbers: NDArray[np.int64], inner: Executor = serial) -> None:
        self.comm, self.halo, self.numbers, self.inner = comm, halo, numbers, inner
        self.count = int(comm.allreduce(int(numbers.max(initial=-1)) + 1, mpi().MAX))

    def map(self, work: Callable[[int, int], Result], first: int, last: int) -> list[Result]:
        """See Executor."""
        return self.inner.map(work, first, last)

    def after_colour(self, colour: int, points: Floats) -> None:
        """See Executor."""
        self.halo.after(colour, points)

    def exchange(self, values: Floats) -> None:
        """See Executor."""
        values[:] = self.halo.spread(values)

    def lowest(self, values: Floats, share: int, fewest: int) -> NDArray[np.int32]:
        """See Executor. A block has parts on several ranks, and the least value of these."""
        many = max(fewest, self.count // share)
        if many >= self.count:
            return np.arange(len(values), dtype=np.int32)
        size = self.comm.size
        home = self.numbers * size // max(self.count, 1)
        lists = by_rank(home, size)
        came = self.comm.alltoall([(self.numbers[rows], values[rows]) for rows in lists])
        number = np.concatenate([numbers for numbers, _ in came])
        known, which = np.unique(number, return_inverse=True)
        least = np.full(len(known), np.inf)
        np.minimum.at(least, which, np.concatenate([each for _, each in came]))
        chosen = self._lowest(least, many)[which]
        back = np.split(chosen, np.cumsum([len(numbers) for numbers, _ in came])[:-1])
        found = np.zeros(len(values), dtype=bool)
        for rows, flags in zip(lists, self.comm.alltoall(back), strict=True):
            found[rows] = flags
        return np.flatnonzero(found).astype(np.int32)

    def _lowest(self, values: Floats, many: int) -> NDArray[np.bool_]:
        """Which of the values of all ranks are the lowest ones; of equal ones, those that come first in their order."""
        bits = (values + 0.0).view(np.int64)  # 0.0 and -0.0 are one
        keys = np.where(bits < 0, bits ^ np.int64(2**63 - 1), bits)  # whole numbers in the order of the floats
        low, high = -(2**63), 2**63 - 1
        while low < high:  # the least bound that so many values do not exceed
            middle = (low + high) // 2
            if self.comm.allreduce(int(np.count_nonzero(keys <= middle))) >= many:
                high = middle
            else:
                low = middle + 1
        chosen, equal = keys < low, np.flatnonzero(keys == low)
        room = many - self.comm.allreduce(int(np.count_nonzero(chosen)))
        before = self.comm.exscan(len(equal)) or 0
        chosen[equal[: max(room - before, 0)]] = True
        return np.asarray(chosen)

    def minimum(self, value: Figure) -> Figure:
        """See Executor."""
        found: Figure = self._reduced(value, mpi().MIN)
        return found

    def total(self, figures: Figures) -> Figures:
        """See Executor."""
        found: Figures = self._reduced(figures, mpi().SUM)
        return found

    def for_blocks(self, blocks: int) -> Executor:
        """See Executor."""
        return self

    def _reduced(self, value: Any, operation: Any) -> Any:
        given = np.atleast_1d(np.ascontiguousarray(value))
        found = np.empty_like(given)
        self.comm.Allreduce(given, found, operation)
        return float(found[0]) if isinstance(value, float) else found.reshape(np.shape(value))
