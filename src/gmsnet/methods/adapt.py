"""Towards a metric: all free nodes at once go to where the cells are those of the metric, in shape and in size.

The sum over the corner simplices of E, the symmetric Dirichlet energy of each against the unit simplex of the metric
(kernels/metric/quality.py), is minimised by conjugate gradients with multigrid (methods/conjugate.py). What depends on
the place of the nodes through the metric is part of the gradient (Dobrev, Knupp, Kolev, Mittal, Tomov: The
target-matrix optimization paradigm for high-order meshes, SIAM Journal on Scientific Computing 41, 2019; Huang,
Russell: Adaptive moving mesh methods, Springer 2011). Between two rounds a metric that is a function is asked anew.

The rounds: ΣE until it no longer falls; then a power of E for the worst cells, and ΣE again with a barrier that keeps
what these have gained, as long as that pays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.metric import places
from gmsnet.kernels.metric.places import Background
from gmsnet.kernels.metric.quality import energy, qualities
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import VALID
from gmsnet.kernels.untangle.cells import find_bad
from gmsnet.kernels.whole import graph, steps
from gmsnet.kernels.whole.graph import Matrix
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.methods.conjugate import minimise
from gmsnet.methods.multigrid import Multigrid
from gmsnet.methods.sliders import Sliders
from gmsnet.metric.conformity import cell_qualities, oriented
from gmsnet.metric.field import Metric
from gmsnet.metric.tensors import tensors_of
from gmsnet.parallel.executor import Executor

Floats = NDArray[np.float64]

PHASE = "towards the metric"
WORST_PHASE = "towards the metric, worst cells"
KEPT_PHASE = "towards the metric, worst kept"
SETTLED = 1e-4  # a smaller share of the sum, gained in an iteration, is little
ROUNDS, ROUND_GAIN = 12, 2e-4  # of ΣE at most; a smaller share of the mean of 1/E gained in one is the end
PASSES, PASS_GAIN = 4, 0.002  # over the worst cells; what one must gain in the least 1/E for the next
DOUBLINGS = 3  # E⁸
TRADE = 1.0  # what the least 1/E must gain for what it costs in the mean, most of which comes back
BELOW = 0.99  # times the least 1/E: where the barrier stands that keeps it
REPAIRS = 4  # times at most is a round made that lowers the least 1/E


@dataclass(eq=False)
class Problem:
    """ΣE, or Σ(E/top)^p, p = 2^doublings, as a function of the places of some nodes. See ``conjugate.Sum``.

    table: (S, 3) weights of edges, None where all are 1. number: (N,) the rows of the nodes that move, −1 of others.
    sliders: those of them that slide.
    background: the metric between nodes; start: (N,) where each node was in it. logs, slopes: of the metric at the
    nodes. floor: of 1/E, 0 for none. least: the least 1/E of these simplices at first; no point below it is accepted.
    """

    cells: NDArray[np.int32]
    table: Floats | None
    moved: NDArray[np.intp]
    number: NDArray[np.int32]
    matrix: Matrix
    background: Background
    start: NDArray[np.int32]
    logs: Floats
    slopes: Floats
    floor: float = 0.0
    doublings: int = 0
    top: float = 1.0
    sliders: Sliders | None = None

    @classmethod
    def of(cls, field: Field, metric: Metric, free: NDArray[np.bool_]) -> Problem:
        """Of the nodes (N,) that are free and have no simplex that is not certified positive."""
        simplices, free = field.planar.changeable, free.copy()
        precision, count = field.precision, len(simplices.rows)
        bad, every = np.empty(count, dtype=bool), np.ones(count, dtype=bool)
        if find_bad(field.points, field.points, simplices, every, precision.unit, precision.grain, bad):
            free[simplices.rows[bad]] = False
        cells, table = oriented(simplices)
        good = free[cells].any(axis=1)
        cells, table = cells[good], None if table is None else table[good]
        moved = np.flatnonzero(free)
        number = np.full(len(free), -1, dtype=np.int32)
        number[moved] = np.arange(len(moved), dtype=np.int32)
        start, column = graph.neighbours(cells, table, number, len(moved))
        matrix = Matrix(start, column, np.empty(len(column)), np.empty(len(moved)))
        background = metric.background(field.points)
        logs, slopes = np.empty((len(free), 3)), np.empty((len(free), 3, 2))
        problem = cls(cells, table, moved, number, matrix, background, metric.first.copy(), logs, slopes)
        places.evaluate(background, field.points, problem.start, logs, slopes)
        slopes[~free] = 0.0
        problem.sliders = Sliders.of(field, free)
        return problem

    def look(self, points: Floats) -> None:
        """Takes the metric from where the nodes are now."""
        logs, slopes = np.empty((len(self.moved), 3)), np.empty((len(self.moved), 3, 2))
        start = self.start[self.moved]
        places.evaluate(self.background, points[self.moved], start, logs, slopes)
        self.start[self.moved], self.logs[self.moved], self.slopes[self.moved] = start, logs, slopes

    def least(self, points: Floats) -> float:
        """The least 1/E of these simplices."""
        self.look(points)
        values = np.empty(len(self.cells))
        qualities(points, self.cells, self.table, self.logs, values)
        return float(values.min(initial=1.0))

    def value(self, points: Floats, gradient: Floats) -> float:
        """See ``conjugate.Sum``."""
        total = self._value(points, gradient)[0]
        if self.sliders is not None:
            self.sliders.along(gradient, self.sliders.nodes)
        return total

    def _value(self, points: Floats, gradient: Floats) -> tuple[float, Floats]:
        share = np.empty(len(self.cells))
        self.look(points)
        total: float = energy(
            points,
            self.cells,
            self.table,
            self.logs,
            self.slopes,
            self.floor,
            self.doublings,
            self.top,
            gradient,
            share,
        )
        return total, share

    def inverse(self, points: Floats) -> Callable[[Floats], Floats]:
        """Multigrid on the Laplacian of the mesh in the metric, each node in the frame of its own tensor."""
        _, share = self._value(points, np.empty_like(points))
        table = np.repeat(share[:, None], 3, axis=1) if self.table is None else share[:, None] * self.table
        graph.assemble(points, self.cells, table, self.number, True, self.matrix)
        cycle = Multigrid(self.matrix)
        a, b, c = tensors_of(self.logs[self.moved] * np.array([0.0, -0.5, -0.5])).T

        def apply(residual: Floats) -> Floats:
            x, y = residual.T
            inner = cycle(np.column_stack([a * x + b * y, b * x + c * y]))
            x, y = inner.T
            found = np.column_stack([a * x + b * y, b * x + c * y])
            return found if sliders is None else sliders.along(found, self.number[sliders.nodes])

        sliders = self.sliders
        return apply


class Adapt(Smoother):
    """Each sweep is a round over all free nodes, taken if the guard allows each cell and the mesh is better for it.

    At the level WORST the least 1/E over all cells, as it is computed, never falls: where a round would lower it, it is
    made anew with a barrier, and with the nodes of the cells held that fell below all the same.
    """

    rounds: int
    passes: int
    slide: bool
    gained: float
    step: Callable[[Field], int]
    converged: bool

    stops_when_idle = False
    phase: str = PHASE

    def __init__(self, metric: Metric) -> None:
        self.metric = metric
        self.rounds, self.passes, self.gained, self.slide = 0, 0, 0.0, False
        self.step = self._even

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        tally = np.zeros(3, dtype=np.int64)
        tally[MOVED] = self.step(field)
        return tally

    def _even(self, field: Field) -> int:
        """A round of ΣE."""
        self.phase = PHASE
        before = self._standing(field.points, field)
        moved = self._round(field, before, floor=0.0)
        self.rounds += 1
        gained = self._standing(field.points, field)[1] - before[1]
        if not moved or gained < ROUND_GAIN * before[1] or self.rounds == ROUNDS:
            if field.constraint is None or self.slide:
                self.step = self._worst
            self.slide, self.rounds = True, 0
        return moved

    def _free(self, field: Field) -> NDArray[np.bool_]:
        """The nodes (N,) that may move now: those that slide not before the others have settled."""
        constraint = field.constraint
        return (
            field.planar.near_free
            if constraint is None or self.slide
            else field.planar.near_free & (constraint.row < 0)
        )

    def _worst(self, field: Field) -> int:
        """A round of a power of E, for the worst cells: taken for what they gain, if the others do not lose more."""
        self.phase = WORST_PHASE
        before = self._standing(field.points, field)
        moved, problem = 0, Problem.of(field, self.metric, self._free(field))
        least = problem.least(field.points)
        if len(problem.moved) and least > 0.0:
            problem.doublings, problem.top = DOUBLINGS, 1.0 / least
            found = field.written(minimise(problem, field.points, SETTLED))
            after = self._standing(found, field)
            if self._certified(found, field) and TRADE * (before[1] - after[1]) < after[0] - before[0]:
                moved, self.gained = self._take(found, field), after[0] - before[0]
        self.passes += 1
        self.step = self._kept
        self.converged = not moved
        return moved

    def _kept(self, field: Field) -> int:
        """A round of ΣE that keeps the worst cells above a barrier."""
        self.phase = KEPT_PHASE
        moved = self._round(field, self._standing(field.points, field), floor=BELOW)
        self.step = self._worst
        self.converged = self.passes == PASSES or self.gained < PASS_GAIN
        return moved

    def _round(self, field: Field, before: tuple[float, float], floor: float) -> int:
        """Minimises ΣE with a barrier at a share ``floor`` of the least 1/E; how many nodes move."""
        free = self._free(field)
        for _ in range(REPAIRS):
            problem = Problem.of(field, self.metric, free)
            if not len(problem.moved):
                return 0
            problem.floor = floor * max(0.0, problem.least(field.points))
            found = field.written(minimise(problem, field.points, SETTLED))
            if not self._certified(found, field):
                return 0
            if field.level == VALID or self._standing(found, field)[0] >= before[0]:
                return self._take(found, field) if self._standing(found, field)[1] > before[1] else 0
            scored = field.planar.scored
            below = cell_qualities(found, scored, self.metric.at(found)) < before[0]
            rows = below if scored.cells is None else below[np.unique(scored.cells, return_inverse=True)[1]]
            free, floor = free.copy(), BELOW
            free[scored.rows[rows]] = False
        return 0

    def _standing(self, points: Floats, field: Field) -> tuple[float, float]:
        """The least and the mean 1/E of the cells that are compared."""
        values = cell_qualities(points, field.planar.scored, self.metric.at(points))
        return float(values.min(initial=1.0)), float(values.mean()) if len(values) else 1.0

    def _certified(self, points: Floats, field: Field) -> bool:
        """Does the guard allow all nodes to go there at once?"""
        unit, grain = field.precision.unit, field.precision.grain
        return not steps.count_below(points, field.points, field.planar.changeable, 0.0, unit, grain)

    def _take(self, points: Floats, field: Field) -> int:
        moved = int((points != field.points).any(axis=1).sum())
        field.points[:] = points
        field.floor.forget()
        return moved
