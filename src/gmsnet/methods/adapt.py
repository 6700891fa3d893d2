"""Towards a metric: all free nodes at once go to where the cells are those of the metric, in shape and in size.

A sum over the corner simplices (methods/metric_sum.py) is minimised by conjugate gradients with multigrid
(methods/conjugate.py). Large meshes whose cells are near to the metric come to most of it by sweeps over single nodes
before. Between two rounds a metric that is a function is asked anew.

The metric is linear between nodes, and its slopes are large across slivers. There the gradient may tell nothing of the
way down, or all other cells may have to lose. Where not a step is found, the gradient takes the metric as constant.
Where a round ends with such a cell all the same, single nodes move first from then on.

The rounds: ΣE until it no longer falls; then a power of E for the worst cells, and ΣE again with a barrier that keeps
what these have gained, as long as that pays.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import VALID
from gmsnet.kernels.whole import steps
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.methods.conjugate import minimise
from gmsnet.methods.metric_sum import Problem
from gmsnet.metric.conformity import cell_qualities
from gmsnet.metric.field import Metric
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
NEAR, CLOSE, LARGE = 0.5, 0.75, 5000  # of the mean of 1/E, and of free nodes: so single nodes move first
STUCK = 0.01  # a least 1/E below, where a round gains little: single nodes move first from then on
REPAIRS = 4  # times at most is a round made that lowers the least 1/E


class Adapt(Smoother):
    """Each sweep is a round over all free nodes, taken if the guard allows each cell and the mesh is better for it.

    At the level WORST the least 1/E over all cells, as it is computed, never falls: where a round would lower it, it is
    made anew with a barrier, and with the nodes of the cells held that fell below all the same.
    """

    rounds: int
    passes: int
    slide: bool
    gained: float
    near: bool | None
    step: Callable[[Field], int]
    converged: bool

    stops_when_idle = False
    phase: str = PHASE

    def __init__(self, metric: Metric) -> None:
        self.metric = metric
        self.rounds, self.passes, self.gained, self.slide = 0, 0, 0.0, False
        self.near = None
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
        if self.near is None:  # where nodes have far to go, sweeps lead to other minima, which may be worse
            large = np.count_nonzero(field.planar.near_free) > LARGE
            self.near = bool(large and field.constraint is None and NEAR <= before[1] <= CLOSE)
        moved = self._round(field, before, floor=0.0)
        self.rounds += 1
        least, mean = self._standing(field.points, field)
        settled = not moved or mean - before[1] < ROUND_GAIN * before[1]
        if settled and least < STUCK and not self.near:
            self.near, settled = True, False
        if settled or self.rounds == ROUNDS:
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
        """A round of a power of E, for the worst cells: taken for what they gain, if the others do not lose more.

        Where single nodes move first it is judged with the round that keeps the worst cells.
        """
        self.phase = WORST_PHASE
        before = self._standing(field.points, field)
        moved, problem = 0, Problem.of(field, self.metric, self._free(field))
        least = problem.least(field.points)
        if len(problem.moved) and least > 0.0:
            problem.doublings, problem.top = DOUBLINGS, 1.0 / least
            found = field.written(self._lowest(problem, field.points))
            after = self._standing(found, field)
            if self.near and after[0] > before[0]:
                problem.doublings, problem.floor = 0, BELOW * problem.least(found)
                found = field.written(self._lowest(problem, found))
                after = self._standing(found, field)
            gained, lost = after[0] - before[0], before[1] - after[1]
            if self._certified(found, field) and gained >= 0.0 and TRADE * lost < gained:
                moved, self.gained = self._take(found, field), gained
        self.passes += 1
        self.step = self._worst if self.near else self._kept
        self.converged = not moved or (self.near is True and self._settled())
        return moved

    def _kept(self, field: Field) -> int:
        """A round of ΣE that keeps the worst cells above a barrier."""
        self.phase = KEPT_PHASE
        moved = self._round(field, self._standing(field.points, field), floor=BELOW)
        self.step = self._worst
        self.converged = self._settled()
        return moved

    def _settled(self) -> bool:
        """Is another pass over the worst cells not worth it?"""
        return self.passes == PASSES or self.gained < PASS_GAIN

    def _round(self, field: Field, before: tuple[float, float], floor: float) -> int:
        """Minimises ΣE with a barrier at a share ``floor`` of the least 1/E; how many nodes move."""
        free = self._free(field)
        for _ in range(REPAIRS):
            problem = Problem.of(field, self.metric, free)
            if not len(problem.moved):
                return 0
            problem.floor = floor * max(0.0, problem.least(field.points))
            found = field.written(self._lowest(problem, field.points))
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

    def _lowest(self, problem: Problem, points: Floats) -> Floats:
        """Where conjugate gradients lead from points (N, 2), after single nodes if these move first.

        If they lead nowhere, where they lead with the metric taken as constant.
        """
        start = problem.swept(points) if self.near and problem.sliders is None else points
        found = minimise(problem, start, SETTLED)
        if (found == start).all():
            problem.still = True
            found = minimise(problem, start, SETTLED)
            problem.still = False
        return found

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
