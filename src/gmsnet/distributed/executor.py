"""The executor of a rank: it works on its own stars, and forms figures with all others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.answered import Answered
from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.halo import Halo
from gmsnet.distributed.library import mpi
from gmsnet.distributed.loan import SHARE, Loan, around, read_alike
from gmsnet.distributed.numbering import NO_NUMBERS, Numbers
from gmsnet.distributed.part import Part
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.methods.base import Field
from gmsnet.parallel.executor import Executor, Figure, Figures, Result
from gmsnet.parallel.threads import serial
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]


class Ranks:
    """See Executor. numbers: of the cells of a part that are in ``changeable``. inner: carries out its work."""

    sequential = False
    part: Part
    comm: Any
    halo: Halo
    rows: Numbers
    numbers: NDArray[np.int64]
    inner: Executor
    count: int
    known: WeakKeyDictionary[Topology | Volume, Ranks]  # of what was restricted
    loan: Loan | None

    def __init__(self, part: Part, numbers: Numbers = NO_NUMBERS, inner: Executor = serial) -> None:
        self.part, self.comm, self.halo, self.rows, self.inner = part, part.comm, part.halo, numbers, inner
        self.numbers = numbers.blocks
        self.known = WeakKeyDictionary()
        self.count = int(self.comm.allreduce(int(self.numbers.max(initial=-1)) + 1, mpi().MAX))

    def map(self, work: Callable[[int, int], Result], first: int, last: int) -> list[Result]:
        """See Executor."""
        return self.inner.map(work, first, last)

    def swept(self, visit: Any, stars: Any, points: Floats, guard: Any) -> NDArray[np.int64] | None:
        """See Executor."""
        return None

    def remarks(self) -> tuple[str, ...]:
        """See Executor."""
        return ()

    def figures(
        self, summary: Any, points: Floats, cells: tuple[Any, ...], rest: tuple[Any, ...]
    ) -> Iterable[Floats] | None:
        """See Executor."""
        return None

    def after_colour(self, colour: int, points: Floats) -> None:
        """See Executor."""
        topology, rail = self.part.topology, self.part.rail
        if not isinstance(topology, MixedVolume):
            self.halo.after(colour, points, rail.parameter if isinstance(rail, Constraint) else None)
            return
        others = self.halo.of_others(colour)
        before = points[others, :3]
        self.halo.after(colour, points)
        topology.moved_elsewhere(points, others, before)

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
        keys = _keys(values)
        bound = self._bound(keys, many)
        chosen, equal = keys < bound, np.flatnonzero(keys == bound)
        room = many - self.comm.allreduce(int(np.count_nonzero(chosen)))
        before = self.comm.exscan(len(equal)) or 0
        chosen[equal[: max(room - before, 0)]] = True
        return np.asarray(chosen)

    def _bound(self, keys: NDArray[np.int64], many: int) -> int:
        """The least bound that so many of the keys of all ranks do not exceed."""
        low, high = -(2**63), 2**63 - 1
        while low < high:
            middle = (low + high) // 2
            if self.comm.allreduce(int(np.count_nonzero(keys <= middle))) >= many:
                high = middle
            else:
                low = middle + 1
        return low

    def lowest_rows(self, values: Floats, many: int, rows: NDArray[np.int32] | None = None) -> NDArray[np.int32]:
        """See Executor. A rank finds all that it has, those of others among them."""
        counted, numbers = (each if rows is None else each[rows] for each in (self.rows.counted, self.rows.rows))
        if many >= self.comm.allreduce(int(np.count_nonzero(counted))):
            return np.arange(len(values), dtype=np.int32)
        keys = _keys(values)
        bound = self._bound(keys[counted], many)
        less, equal = keys < bound, keys == bound
        room = many - self.comm.allreduce(int(np.count_nonzero(less & counted)))
        last = self._bound(numbers[equal & counted], room)
        return np.flatnonzero(less | (equal & (numbers <= last))).astype(np.int32)

    def nth(self, values: Floats, number: int) -> float:
        """See Executor."""
        count = self.comm.allreduce(len(values))
        return _value(self._bound(_keys(values), min(number, count))) if count else math.inf

    def counted(self, flags: NDArray[np.bool_]) -> int:
        """See Executor."""
        return int(self.comm.allreduce(int(np.count_nonzero(flags & self.rows.counted))))

    def cell_count(self, simplices: Any) -> int:
        """See Executor."""
        return int(self.comm.allreduce(self.rows.cells))

    def every(self, stride: int, length: int, size: int = 1) -> NDArray[np.int32]:
        """See Executor."""
        return np.flatnonzero(self.rows.counted & (self.rows.rows // size % stride == 0)).astype(np.int32)

    def row_numbers(self, rows: NDArray[np.int32]) -> NDArray[np.int64]:
        """See Executor."""
        return self.rows.rows[rows]

    def free_numbers(self, near_free: NDArray[np.bool_]) -> NDArray[np.int64]:
        """See Executor."""
        return self.part.numbered(near_free)

    def in_order(self, numbers: NDArray[np.int64], values: Floats) -> Floats:
        """See Executor."""
        came = self.comm.allgather((numbers, values))
        order = np.argsort(np.concatenate([each for each, _ in came]))
        found: Floats = np.concatenate([each for _, each in came])[order]
        return found

    def gathered(self, field: Field) -> Field | None:
        """See Executor."""
        self.loan = read_alike(self.part, field, None)
        return self.loan.field

    def dealt(self, field: Field, rows: NDArray[np.int32]) -> Field | None:
        """See Executor. Nodes that hang together are on one rank."""
        free, simplices = field.topology.near_free, field.topology.changeable
        active = np.zeros(len(free), dtype=bool)
        active[simplices.rows[rows]] = True
        still = rows[~free[simplices.rows[rows]].any(axis=1)]  # on surfaces, of cells whose other corners may move
        if len(still) and simplices.cells is not None:
            active[simplices.rows[np.isin(simplices.cells, simplices.cells[still])]] = True
        self.loan = read_alike(self.part, field, active & free, dealt=True)
        return self.loan.field

    def gathered_around(
        self, field: Field, corners: NDArray[np.int32], rings: int
    ) -> tuple[Field | None, NDArray[np.int32]]:
        """See Executor. Where these are most of the nodes, all are gathered."""
        topology = field.topology
        chosen = np.zeros(len(topology.memory), dtype=bool)
        chosen[corners] = True
        active = around(self.part, topology, chosen, rings)
        of_all = np.array([np.count_nonzero(active), len(topology.free)])
        some, free = self.comm.allreduce(of_all).tolist()
        self.loan = read_alike(self.part, field, active if some <= SHARE * free else None)
        return self.loan.field, self.loan.cells(self.part, corners)

    def cells_returned(self, part: Field | None, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """See Executor."""
        assert self.loan is not None
        return self.loan.cells_back(self.part, corners)

    def called_alone(self, callback: Callable[[Any], Any] | None) -> Callable[[Any], Any] | None:
        """See Executor."""
        return callback.own if isinstance(callback, Answered) else callback

    def restricted(self, topology: Topology | Volume, active: NDArray[np.bool_]) -> Topology | Volume:
        """See Executor."""
        active = active & topology.near_free
        return self._ready(replace(topology, near_free=active, free=np.sort(topology.memory[np.flatnonzero(active)])))

    def holding(self, topology: Topology | Volume, nodes: NDArray[np.bool_], reason: str) -> Topology | Volume:
        """See Executor."""
        return self._ready(topology.holding(nodes, reason))

    def _ready(self, topology: Topology | Volume) -> Topology | Volume:
        inner, numbers = self.part.ready(topology)
        self.known[inner] = Ranks(self.part, numbers, self.inner)
        return inner

    def of(self, topology: Topology | Volume) -> Executor:
        """See Executor."""
        return self.known.get(topology, self)

    def lent(self, values: Floats) -> Floats:
        """See Executor."""
        assert self.loan is not None
        return self.loan.at_nodes(self.part, values)

    def returned(self, field: Field, part: Field | None, result: Result) -> Result:
        """See Executor."""
        assert self.loan is not None
        self.loan.give_back(self.part, field.points)
        self.loan = None
        found: Result = self.comm.bcast(result)
        return found

    def blocks_with(self, rows: NDArray[np.int32], size: int) -> NDArray[np.int32]:
        """See Executor."""
        found = sorted_unique(np.concatenate(self.comm.allgather(sorted_unique(self.numbers[rows // size]))))
        return np.flatnonzero(np.isin(self.numbers, found)).astype(np.int32)

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


def _keys(values: Floats) -> NDArray[np.int64]:
    """Whole numbers in the order of the values."""
    bits = (values + 0.0).view(np.int64)  # 0.0 and -0.0 are one
    return np.where(bits < 0, bits ^ np.int64(2**63 - 1), bits)


def _value(key: int) -> float:
    """The value that has this key."""
    bits = np.int64(key)
    return float((bits if key >= 0 else bits ^ np.int64(2**63 - 1)).view(np.float64))
