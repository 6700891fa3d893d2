"""The worst cells first: Newton's method on high powers of q, at the free nodes of the worst cells alone.

A cycle ranks the cells, takes a share of them, and visits their free nodes a number of times
(kernels/methods/worst_first.py), in the order of their ids. Cells are ranked among the candidates, which are the
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
from gmsnet.kernels.methods import ranking
from gmsnet.kernels.methods import worst_first_cycles as kernels
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.shell_measures import shell_shapes
from gmsnet.kernels.star.shell import ShellSimplices
from gmsnet.methods.base import ALL_CELLS, Field, Method, MethodOptions, Smoother, Tally
from gmsnet.methods.worst_in_space import WorstInSpace
from gmsnet.methods.worst_on_surface import cycles_on_surface
from gmsnet.parallel.executor import Executor
from gmsnet.topology.shell import Shell
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
GAIN = 1e-4  # in the minimum 1/q: less is none


class WorstFirst(Smoother):
    """See the module. at_once: how many cycles a sweep makes; a ranking of all cells costs more than a late cycle.

    enough: a minimum 1/q with which no cycle is made. least: the minimum 1/q after the last sweep. gained: what the
    last cycle of it has brought.
    """

    gained: float
    least: float
    cycles: tuple[Cycle, ...]
    at_once: int
    enough: float
    converged: bool
    next: int

    least = gained = -math.inf

    def __init__(self, cycles: tuple[Cycle, ...] = CYCLES, at_once: int = 1, enough: float = math.inf) -> None:
        self.cycles, self.at_once, self.enough = cycles, at_once, enough
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
            self.cells, self.least = candidates(field, executor)
        if self.least >= self.enough:
            self.converged = True
            return tally
        goes_on = self.next >= len(self.cycles)
        chosen = LAST if goes_on else self.cycles[self.next : self.next + self.at_once]
        count = simplices.cell_count
        plan = [(max(FEWEST, math.ceil(cycle.share * count)), cycle.power, cycle.sweeps) for cycle in chosen]
        if isinstance(topology, Shell):
            before, late, after = cycles_on_surface(field, topology, self.cells, field.guard(executor), plan, tally)
        else:
            before, late, after = kernels.cycles(
                field.points, simplices, self.cells, topology.near_free, topology.memory, topology.links,
                field.guard(executor), np.array(plan), tally,
            )  # fmt: skip
        self.next += len(chosen)
        self.converged = goes_on and after < before + GAIN
        self.least, self.gained = after, after - late
        return tally

    def _in_space(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        inner = WorstInSpace()
        tally = inner.sweep(field, executor, test)
        self.least, self.gained, self.converged = inner.least, inner.gained, inner.gained < GAIN
        return tally


def candidates(field: Field, executor: Executor) -> tuple[NDArray[np.int32], float]:
    """The worst cells, by their place among those that can change: at least the share CANDIDATES of them; and the
    minimum 1/q.

    The floor of the guard is told of the worst of these.
    """
    simplices = field.topology.changeable
    assert isinstance(simplices, Simplices | ShellSimplices)
    shape = np.empty(len(simplices.rows), dtype=np.float32)
    shapes = shell_shapes if isinstance(simplices, ShellSimplices) else ranking.shapes

    def look(first: int, last: int) -> None:
        shapes(field.points, simplices, first, last, shape)

    executor.map(look, 0, -(-len(shape) // LANES))
    wanted = max(FEWEST_CANDIDATES, math.ceil(CANDIDATES * simplices.cell_count))
    cells: NDArray[np.int32] = ranking.worst(shape, wanted)
    field.floor.watch(cells, shape[cells])
    return cells, float(shape[cells].min(initial=math.inf))


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
