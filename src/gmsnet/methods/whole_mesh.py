"""All free nodes at once: conjugate gradients on Σq over the mesh, preconditioned by multigrid.

Where a mesh is deformed as a whole, over n rows of cells, sweeps over single stars need about n² of themselves. Here
long waves go as fast as short ones. The start is the mesh as it is, or harmonic places (Tutte: How to draw a graph,
1963), where these have no inverted cell and a smaller Σq. From there come nonlinear conjugate gradients (Polak and
Ribière; Nocedal, Wright: Numerical Optimization, section 5.2) with the Laplacian of kernels.whole.graph, which follows
the mesh, for a preconditioner. No step goes as far as where a first cell has no area left.

The same on q⁸ or q⁴ is for the worst cells, where these are many: what one of them needs, its neighbours need, too, and
no node alone can give it.

It is a transaction: what comes out is taken if the guard allows each cell, and Σq is smaller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio2 import WEIGHTS
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import VALID
from gmsnet.kernels.untangle.barrier import energy
from gmsnet.kernels.untangle.cells import find_bad
from gmsnet.kernels.whole import graph, multigrid, powers, steps
from gmsnet.kernels.whole.graph import Matrix
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.methods.conjugate import minimise
from gmsnet.methods.multigrid import Multigrid, approach
from gmsnet.methods.sliders import Sliders
from gmsnet.methods.worst_first import WorstFirst
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

HARMONIC_ITERATIONS = 30
ACCURATE = (1e-2, 1e-4, 1e-6)  # of the first residual: the next one is for harmonic places with inverted cells
ALIKE = 1.1  # times Σq of the points; where a cell is inverted it is far more
# A smaller share of Σq, or of a power of q, gained in an iteration is little; and of Σq where the minimum is near.
SETTLED, CLOSE, CLOSEST = 1e-4, 1e-6, 1e-12
TRADE, LEAST_GAIN = 0.2, 1e-4  # in 1/q; most of the mean comes back in the sweeps that follow
REPAIRS = 3  # lists of cycles on the worst cells, where they are worse than the guard allows


@dataclass(eq=False)
class Problem:
    """Σq over corner simplices as a function of the places of some nodes.

    cells: (S, 3) counter-clockwise. table: (S, 3) weights, None where all are 1. moved: (n,) the nodes that move.
    number: (N,) their rows, −1 for others. matrix: the Laplacian. nothing: (N,) zeros. sliders: the nodes that slide.
    doublings: with some,
    Σ(q/top)^p, p = 2^doublings, instead, top the largest q at first.
    """

    cells: Ints
    table: Floats | None
    moved: NDArray[np.intp]
    number: Ints
    matrix: Matrix
    nothing: Floats
    doublings: int = 0
    top: float = 1.0
    sliders: Sliders | None = None

    @classmethod
    def of(cls, field: Field, doublings: int = 0, *, slide: bool = False) -> Problem:
        """Of the free nodes that have no cell that is not certified positive; slide: those that slide, too."""
        topology, precision = field.planar, field.precision
        simplices, free = topology.changeable, topology.near_free.copy()
        if field.constraint is not None and not slide:
            free[field.constraint.row >= 0] = False
        bad, every = np.empty(len(simplices.rows), dtype=bool), np.ones(len(simplices.rows), dtype=bool)
        if find_bad(field.points, field.points, simplices, every, precision.unit, precision.grain, bad):
            free[simplices.rows[bad]] = False
        rows, orientation = simplices.rows, simplices.orientation
        table = None if simplices.shapes is None else WEIGHTS[simplices.shapes]
        good = free[rows].any(axis=1)
        cells = np.where(orientation[:, None] > 0, rows, rows[:, [0, 2, 1]])[good]
        table = None if table is None else table[good]
        moved = np.flatnonzero(free)
        number = np.full(len(free), -1, dtype=np.int32)
        number[moved] = np.arange(len(moved), dtype=np.int32)
        start, column = graph.neighbours(cells, table, number, len(moved))
        matrix = Matrix(start, column, np.empty(len(column)), np.empty(len(moved)))
        cells = np.ascontiguousarray(cells)
        top = 1.0
        if doublings and len(cells):
            least, _ = powers.shapes(field.points, cells, table)
            top = 1.0 / least
        sliders = Sliders.of(field, free) if slide else None
        return cls(cells, table, moved, number, matrix, np.zeros(len(free)), doublings, top, sliders)

    def inverse(self, points: Floats) -> Callable[[Floats], Floats]:
        """Of the Laplacian for the points as they are; of nodes that slide, along their curves."""
        cycle, sliders = self.cycle(points), self.sliders
        return cycle if sliders is None else lambda rest: sliders.along(cycle(rest), self.number[sliders.nodes])

    def cycle(self, points: Floats, *, even: bool = False) -> Multigrid:
        """Of the Laplacian for the points as they are; even: of the mesh alone."""
        table = self.table
        if self.doublings and not even:
            _, table = self._weighted(points)
        graph.assemble(points, self.cells, table, self.number, even, self.matrix)
        return Multigrid(self.matrix)

    def value(self, points: Floats, gradient: Floats) -> float:
        """Σq, and its gradient (N, 2); more than any mesh has where a cell is inverted."""
        if self.doublings:
            total, weights = self._weighted(points)
            if total < math.inf:
                energy(points, self.cells, weights, self.nothing, 0.0, gradient)
        else:
            total = energy(points, self.cells, self.table, self.nothing, 0.0, gradient)
        if self.sliders is not None and total < math.inf:  # else there is no gradient
            self.sliders.along(gradient, self.sliders.nodes)
        return float(total)

    def _weighted(self, points: Floats) -> tuple[float, Floats]:
        """See ``powers.weighted``."""
        weights = np.empty((len(self.cells), 3))
        total: float = powers.weighted(points, self.cells, self.table, self.top, self.doublings, weights)
        return total, weights

    def harmonic(self, points: Floats) -> Iterator[Floats]:
        """Each node that moves at the weighted mean of its neighbours, more and more exactly."""
        inverse = self.cycle(points, even=True)
        rest = np.empty((len(self.moved), 2))
        graph.pull_of_neighbours(points, self.cells, self.table, self.number, rest)
        goals = list(ACCURATE)
        for x, left, first in islice(
            approach(partial(multigrid.times, self.matrix), inverse, rest), HARMONIC_ITERATIONS
        ):
            if left <= goals[0] * goals[0] * first:
                goals.pop(0)
                found = points.copy()
                found[self.moved] += x
                yield found
            if not goals:
                return

    def start(self, points: Floats) -> Floats:
        """The points, or harmonic places where these have a smaller Σq."""
        if self.doublings:
            return points
        gradient = np.empty_like(points)
        value = self.value(points, gradient)
        for harmonic in self.harmonic(points):
            there = self.value(harmonic, gradient)
            if there < value:
                return harmonic
            if there < ALIKE * value:  # no cell is inverted there, and more exact ones are about as good
                break
        return points

    def is_better(self, points: Floats, before: Floats) -> bool:
        """Is that worth taking?"""
        if not self.doublings:
            gradient = np.empty_like(points)
            return self.value(points, gradient) < self.value(before, gradient)
        (least, mean), (old_least, old_mean) = (
            powers.shapes(each, self.cells, self.table) for each in (points, before)
        )
        gain: float = least - old_least
        return gain >= LEAST_GAIN and gain >= TRADE * (old_mean - mean)


class WholeMesh(Smoother):
    """One sweep moves all nodes. Not for the level STAR, whose floors such moves do not know.

    doublings: of the power of q, tried in turn until something is taken. With a power, for the worst cells, that is
    what gains in the least 1/q at least TRADE times what it costs in the mean. settled: see SETTLED. best: what makes
    the mesh the best so far, instead.
    """

    doublings: Sequence[int]
    settled: float
    best: bool

    stops_when_idle = False

    def __init__(self, doublings: Sequence[int] = (0,), settled: float = SETTLED, *, best: bool = False) -> None:
        self.doublings, self.settled, self.best = doublings, settled, best

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        self.converged = True
        tally = np.zeros(3, dtype=np.int64)
        for doublings in self.doublings:
            before, floor = field.points.copy(), max(field.guard(executor).floor, 0.0)
            whole = executor.gathered(field)  # on one process
            inner = executor if whole is field else serial
            can, taken = executor.returned(
                field, whole, (False, False) if whole is None else self._taken(whole, doublings, floor, inner)
            )
            if not can:
                break
            if taken:
                field.floor.forget()
            if taken and self.best and not test():
                field.points[:] = before
                continue
            slid = (taken or not self.best) and self._slide(field, executor, doublings)
            if not (taken or slid):
                continue
            moved = (field.points != before).any(axis=1) & field.topology.near_free
            tally[MOVED] = executor.total(np.array(np.count_nonzero(moved)))
            break
        return tally

    def _taken(self, field: Field, doublings: int, floor: float, executor: Executor) -> tuple[bool, bool]:
        """Whether nodes can move, and whether they are where they were found to be better."""
        problem = Problem.of(field, doublings)
        if not len(problem.moved):
            return False, False
        start, settled = problem.start(field.points), CLOSE if doublings else self.settled
        found = self._allowed(minimise(problem, start, settled), floor, field, executor)
        if found is None or not (self.best or problem.is_better(found, field.points)):
            return True, False
        field.points[:] = found
        return True, True

    def _slide(self, field: Field, executor: Executor, doublings: int) -> bool:
        """The same once more with the nodes that slide. Whether that was taken."""
        if field.constraint is None:
            return False
        floor = max(field.guard(executor).floor, 0.0)
        whole = executor.gathered(field)  # on one process
        inner = executor if whole is field else serial
        taken = whole is not None and self._slid(whole, doublings, floor, inner)
        taken = executor.returned(field, whole, taken)
        if taken:
            field.floor.forget()
        return taken

    def _slid(self, field: Field, doublings: int, floor: float, executor: Executor) -> bool:
        """Whether these nodes are where that was found to be better."""
        problem = Problem.of(field, doublings, slide=True)
        if problem.sliders is None:
            return False
        found = self._allowed(minimise(problem, field.points, CLOSE), floor, field, executor)
        taken = found is not None and problem.is_better(found, field.points)
        if taken:
            field.points[:] = found
        problem.sliders.back(field.points)
        return taken

    def _allowed(self, points: Floats, floor: float, field: Field, executor: Executor) -> Floats | None:
        """The points as they can be taken, perhaps after cycles on the worst cells; None if they cannot be."""
        for repair in range(REPAIRS + 1):
            points = field.written(points)
            below = steps.count_below(
                points, field.points, field.topology.changeable, floor, field.precision.unit, field.precision.grain
            )
            if not below:
                return points
            if repair == REPAIRS or not floor > 0.0:
                return None
            points = points.copy()
            aside = Field(points, field.topology, field.precision, VALID, constraint=field.constraint)
            worst_first = WorstFirst()
            for _ in worst_first.cycles:
                worst_first.sweep(aside, executor, lambda: False)
        return None
