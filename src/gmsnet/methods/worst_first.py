"""The worst cells first: Newton's method on high powers of q, at the free nodes of the worst cells alone.

A cycle ranks the cells, takes a share of them, and visits their free nodes a number of times
(kernels/methods/worst_first.py), in the order of their ids. Where processes share a mesh, nodes that hang together are
visited by one of them. Cells are ranked among the candidates, which are the
worst of all when the list of cycles begins: a cell next to a mended one can become the worst, and is one of them.

A sweep is one cycle of CYCLES; after the last of them LAST goes on, with new candidates each time, until the worst cell
gains no more.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import ranking, shell
from gmsnet.kernels.methods.worst_first_cycles import visit_all
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.shell_measures import shell_shapes, shell_shapes_of
from gmsnet.kernels.star.guard import Guard, StarGuard
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.methods.base import ALL_CELLS, Field, Method, MethodOptions, Smoother, Tally
from gmsnet.methods.worst_in_space import WorstInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


class Cycle(NamedTuple):
    """share: of all cells. power: p = 2^power. sweeps: over their free nodes."""

    share: float
    power: int
    sweeps: int


CANDIDATES = 0.02  # the share of all cells that is ranked within a list of cycles
FEWEST, FEWEST_CANDIDATES = 12, 100  # cells
CYCLES = (
    Cycle(0.002, 3, 3),
    Cycle(0.002, 3, 3),
    Cycle(0.001, 4, 4),
    Cycle(0.001, 4, 4),
    Cycle(0.001, 5, 4),
    Cycle(0.0006, 5, 6),
    Cycle(0.0006, 6, 6),
    Cycle(0.0003, 6, 8),
    Cycle(0.0003, 7, 12),
)
LAST = (Cycle(0.0003, 7, 16), Cycle(0.0003, 8, 16))
HALVINGS = 24  # of the interval in which a limit is looked for: single precision has no more
GAIN = 1e-4  # in the minimum 1/q: less is none
LEAST = 1e-6  # of 1/q, where cells are inverted: the scale of q is taken from there


class WorstFirst(Smoother):
    """See the module. at_once: how many cycles a sweep makes; a ranking of all cells costs more than a late cycle.

    enough: a minimum 1/q with which no cycle is made. share: of volumes, so many times as many cells. least: the
    minimum 1/q after the last sweep. gained: what the last cycle of it has brought.
    """

    gained: float
    least: float
    cycles: tuple[Cycle, ...]
    at_once: int
    enough: float
    converged: bool
    next: int
    limit: np.float32
    dealt: NDArray[np.int32]

    least = gained = -math.inf
    shared_out = True

    def __init__(
        self, cycles: tuple[Cycle, ...] = CYCLES, at_once: int = 1, enough: float = math.inf, share: float = 1.0
    ) -> None:
        self.cycles, self.at_once, self.enough, self.share = cycles, at_once, enough, share
        self.converged = False
        self.cells: NDArray[np.int32] | None = None
        self.next = 0

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother. The visits depend on each other, so that they are made on one thread; but in space."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        if isinstance(topology, Volume):
            return self._in_space(field, executor, test)
        simplices = topology.changeable
        if self.cells is None or self.next >= len(self.cycles):
            self.cells, self.least, self.limit = candidates(field, executor)
        if self.least >= self.enough:
            self.converged = True
            return tally
        goes_on = self.next >= len(self.cycles)
        chosen = LAST if goes_on else self.cycles[self.next : self.next + self.at_once]
        count = executor.cell_count(simplices)
        plan = [(max(FEWEST, math.ceil(cycle.share * count)), cycle.power, cycle.sweeps) for cycle in chosen]
        guard = field.guard(executor)
        part = executor.dealt(field, self.cells)
        if isinstance(guard, StarGuard):
            guard = guard._replace(floors=executor.lent(guard.floors))
        patches = None if part is None else self._patches(part, field, guard)
        before, late, after, tally = executor.returned(field, part, _cycles(patches, plan, executor))
        self.next += len(chosen)
        self.converged = goes_on and after < before + GAIN
        self.least, self.gained = after, after - late
        return tally

    def _patches(self, part: Field, field: Field, guard: Guard) -> Patches:
        """part: the field, or the cells around some candidates of all processes.

        The candidates of these are the same cells, for they are all that were up to a limit.
        """
        cells = self.cells
        if part is not field:
            guard = guard._replace(constraint=part.constraint)
            if self.next == 0 or self.next >= len(self.cycles):
                self.dealt = up_to(self.limit, shapes_in(part, serial))
            cells = self.dealt
        assert cells is not None
        return Patches(part, cells, guard)

    def _in_space(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        inner = WorstInSpace(self.share)
        tally = inner.sweep(field, executor, test)
        self.least, self.gained, self.converged = inner.least, inner.gained, inner.gained < GAIN
        return tally


class Patches:
    """The stars of the free nodes of some cells, which the cycles visit. cells: rows of ``changeable``.

    shape: their 1/q.
    """

    shape: NDArray[np.float64]

    def __init__(self, field: Field, cells: NDArray[np.int32], guard: Guard) -> None:
        self.field, self.cells, self.guard = field, cells, guard
        self.mark = np.zeros(len(field.points), dtype=np.bool_)
        self.shape = np.empty(len(cells))
        self.rank()

    def rank(self) -> None:
        """How good the cells are now."""
        simplices = self.field.topology.changeable
        shapes = shell_shapes_of if isinstance(simplices, ShellSimplices) else ranking.shapes_of
        shapes(self.field.points, simplices, self.cells, self.shape)

    def visit(self, limit: float, doublings: int, sweeps: int, scale: float, tally: Tally) -> None:
        """Visits the free nodes of those up to a limit, so many times. tally: (3,), added to."""
        field, topology = self.field, self.field.topology
        assert isinstance(topology, Topology)
        nodes = ranking.free_nodes(
            topology.changeable.rows, self.cells, self.shape, limit, topology.near_free, topology.memory, self.mark
        )
        if isinstance(topology, Shell):
            stars = topology.stars_of(nodes)
            shell.visit(field.points, stars, nodes, self.guard, doublings, sweeps, scale, self.mark, tally)
        else:
            visit_all(
                field.points, nodes, topology.links, self.guard, doublings, sweeps, scale, self.mark, tally
            )  # fmt: skip
        self.rank()


def _cycles(
    patches: Patches | None, plan: list[tuple[int, int, int]], executor: Executor
) -> tuple[float, float, float, Tally]:
    """Makes the cycles of a plan; the minimum 1/q of all candidates before it, before its last cycle, and after it.

    And the tally of all processes. plan: of cells to take, log₂ of the power p, and visits to their free nodes.
    patches: of this process, None where it has none.
    """
    tally, none = np.zeros(3, dtype=np.int64), np.empty(0)

    def shape() -> NDArray[np.float64]:
        return none if patches is None else patches.shape

    def least() -> float:
        return executor.minimum(float(shape().min(initial=math.inf)))

    before = late = after = least()
    for wanted, doublings, sweeps in plan:
        late = after
        limit = executor.nth(shape(), wanted)
        if patches is not None:
            patches.visit(limit, doublings, sweeps, max(late, LEAST) / math.sqrt(3.0), tally)
        after = least()
    return before, late, after, executor.total(tally)


def candidates(field: Field, executor: Executor) -> tuple[NDArray[np.int32], float, np.float32]:
    """The worst cells, by their place among those that can change: at least the share CANDIDATES of them; the minimum
    1/q; and the 1/q up to which all are candidates.

    The floor of the guard is told of the worst of these.
    """
    shape = shapes_in(field, executor)
    wanted = max(FEWEST_CANDIDATES, math.ceil(CANDIDATES * executor.cell_count(field.topology.changeable)))
    limit = limit_of(shape, wanted, executor)
    cells = up_to(limit, shape)
    field.floor.watch(cells, shape[cells], executor)
    return cells, executor.minimum(float(shape[cells].min(initial=math.inf))), limit


def shapes_in(field: Field, executor: Executor) -> NDArray[np.float32]:
    """1/q of each corner simplex that can change."""
    simplices = field.topology.changeable
    assert isinstance(simplices, Simplices | ShellSimplices)
    shape = np.empty(len(simplices.rows), dtype=np.float32)
    shapes = shell_shapes if isinstance(simplices, ShellSimplices) else ranking.shapes

    def look(first: int, last: int) -> None:
        shapes(field.points, simplices, first, last, shape)

    executor.map(look, 0, -(-len(shape) // LANES))
    return shape


def limit_of(shape: NDArray[np.float32], wanted: int, executor: Executor = serial) -> np.float32:
    """The 1/q up to which there are as many as are wanted or a quarter more, or any number if many are equal.

    shape: (S,) between −1 and 1. The limit is found by halving.
    """
    low, high = -1.0, 1.0 + 1e-6
    count = executor.counted(np.ones(len(shape), dtype=bool))
    for _ in range(HALVINGS):
        if count <= wanted + wanted // 4:
            break
        middle = 0.5 * (low + high)
        fewer = executor.counted(shape <= np.float32(middle))
        if fewer < wanted:
            low = middle
        else:
            high, count = middle, fewer
    return np.float32(high)


def up_to(limit: np.float32, shape: NDArray[np.float32]) -> NDArray[np.int32]:
    """Where all those stand that are at most the limit."""
    return np.flatnonzero(shape <= limit).astype(np.int32)


def create(options: MethodOptions) -> WorstFirst:
    """There is nothing to choose."""
    return WorstFirst()


METHOD = Method(
    name="worst-first",
    summary="Newton steps on high powers of q at the free nodes of the worst cells alone",
    source="Freitag, Plassmann: Local optimization-based simplicial mesh untangling and improvement (2000), its aim",
    create=create,
    slides=True,
    surfaces=True,
    cells=ALL_CELLS,
)
