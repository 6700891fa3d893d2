"""One run: sweeps over the stars by colour, stop rules, and of all meshes on the way the best."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.rail import relocate
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.guard import LEVELS, Precision
from gmsnet.kernels.star.surface import Surface
from gmsnet.measure.totals import totals_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, Smoother, Tally
from gmsnet.methods.curved import Corners, Curved
from gmsnet.metric.field import Metric
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.score import NONE, Missing, Score, in_metric
from gmsnet.run.stop import CALLBACK, INTERRUPTED, MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED
from gmsnet.run.sweep import Sweep
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]


PATIENCE = 10  # sweeps within which q̂ must rise by LEAST_GAIN, or a cell be untangled, for the run to go on
LEAST_GAIN = 1e-4


class Start(NamedTuple):
    """Where a run starts. points: (N, 2) in memory order, not changed. precision: of the mesh (``precision_of``).

    score: of the points, where it is known. history: to go on with. constraint: the curves that nodes slide on.
    curved: the second-order cells whose corners move. metric: in which meshes are compared, if not in the plain one.
    """

    topology: Topology | Volume
    points: Floats
    precision: Precision
    score: Score | None = None
    history: Sequence[Sweep] = ()
    constraint: Constraint | Surface | None = None
    curved: Curved | None = None
    metric: Metric | None = None

    @classmethod
    def of(cls, mesh: Mesh, topology: Topology) -> Start:
        """The mesh as it is."""
        return cls(topology, near_points(mesh, topology), precision_of(mesh))


class Run:
    """The state of one run: coordinates in memory order, the best so far, and the record.

    options: how many sweeps, what is called after them, the guard, and which mesh is the best. missing: the corners
    (K, 3) of the triangles that miss a target at given points; the run ends when there is none. interruption: what
    ended the sweeps, if they were interrupted.
    """

    topology: Topology | Volume
    options: SmoothOptions
    missing: Callable[[Floats], Missing] | None
    metric: Metric | None
    smoother: Smoother | Corners
    executor: Executor
    field: Field
    sweeps: int
    first: int
    best: Floats
    best_score: Score

    def __init__(
        self, start: Start, smoother: Smoother, options: SmoothOptions, executor: Executor = serial,
        missing: Callable[[Floats], Missing] | None = None,
    ) -> None:  # fmt: skip
        self.topology, self.options, self.missing = start.topology, options, missing
        self.metric = start.metric
        self.smoother = smoother if start.curved is None else Corners(smoother, start.curved)
        self.executor = executor.for_blocks(len(start.topology.free) // LANES)
        level = LEVELS.index(options.guard)
        self.field = Field(start.points.copy(), start.topology, start.precision, level, constraint=start.constraint)
        if start.constraint is not None:
            relocate(start.constraint, self.field.points)
        self.fewest: list[int] = []  # cells that missed the target, up to each look
        self.history: list[Sweep] = [*start.history]
        self.sweeps = self.history[-1].index if self.history else 0
        self.first = len(self.history)
        self.tally: Tally = np.zeros(3, dtype=np.int64)  # since the last look
        self.phases: dict[str, None] = {}  # since the last look, in their order
        self.looked: Score | None = None  # of the last look
        self.best, self.best_score = start.points, start.score or self._score()
        self.interruption: KeyboardInterrupt | None = None

    def to_the_end(self, most: int | None = None) -> str:
        """Sweeps until a stop rule says why to stop. most: sweeps, if fewer than the options allow."""
        if not self.executor.total(np.array(len(self.topology.free))):
            return NOTHING_TO_MOVE
        if self._reached():
            return TARGET_REACHED
        try:
            return self._until_stopped(self.options.max_sweeps if most is None else most)
        except KeyboardInterrupt as interruption:
            self.interruption = interruption
            with suppress(KeyboardInterrupt), interruptible():  # one is enough
                self._keep_if_best(self._score())  # each move since the last look is allowed by the guard itself
            return INTERRUPTED

    @interruptible()
    def _until_stopped(self, max_sweeps: int) -> str:
        callback = self.options.callback
        while self.sweeps < max_sweeps:
            moved = self._sweep()
            converged = self.smoother.converged or (self.smoother.stops_when_idle and not moved)
            if not (self.smoother.looks or converged or self.sweeps == max_sweeps):
                continue
            sweep = self._look(last=converged or self.sweeps == max_sweeps)
            if callback is not None and callback(sweep):
                return CALLBACK
            if self._reached():
                return TARGET_REACHED
            if converged or self.smoother.converged or self._stalled():
                return NO_PROGRESS
        return MAX_SWEEPS

    def _reached(self) -> bool:
        return self.missing is not None and not self.best_score.missed

    def _sweep(self) -> int:
        """One sweep; returns how many nodes moved."""
        tally = self.smoother.sweep(self.field, self.executor, lambda: self._keep_if_best(self._score()))
        self.tally += tally
        self.phases[self.smoother.phase] = None
        self.sweeps += 1
        return int(tally[MOVED])

    def _look(self, *, last: bool) -> Sweep:
        """Measures the mesh as it is now, keeps it if it is the best, and writes the record. last: nothing follows."""
        score = self.looked
        if score is None or self.tally[MOVED]:
            score = self.looked = self._score()
        self._keep_if_best(score, last=last)
        moved, truncated, dropped = self.tally.tolist()
        self.tally[:] = 0
        sweep = Sweep(
            self.sweeps, " + ".join(self.phases), moved, truncated, dropped, score.inverted, score.qhat,
            score.min_shape, score.mean_shape,
        )  # fmt: skip
        self.history.append(sweep)
        self.fewest.append(min([score.missed, *self.fewest[-1:]]))
        self.phases.clear()
        return sweep

    def _keep_if_best(self, score: Score, *, last: bool = False) -> bool:
        better = score.better_than(self.best_score)
        if better:
            points = self.field.points
            self.best, self.best_score = points if last else points.copy(), score
        return better

    def _score(self) -> Score:
        """The sums over all triangles of the coordinates as they are."""
        points = self.field.points
        totals = totals_of(points, self.topology.scored, self.executor)
        if self.metric is not None and totals is not None:
            totals = in_metric(totals, points, self.field.planar.scored, self.metric)
        return Score.of(totals, self.options.best_by, self.missing(points) if self.missing else NONE)

    def _stalled(self) -> bool:
        """Has nothing been gained for PATIENCE looks? Not asked of methods that know themselves when they are done."""
        own = self.history[self.first :]
        if len(own) <= PATIENCE or not self.smoother.stops_when_idle:
            return False
        if self.fewest[-1] < self.fewest[-1 - PATIENCE]:
            return False
        earlier, recent = own[:-PATIENCE], own[-PATIENCE:]
        fewest = min(s.inverted for s in earlier)
        if min(s.inverted for s in recent) < fewest:
            return False
        best = max(merit(s) for s in earlier if s.inverted == fewest)
        return max((merit(s) for s in recent if s.inverted == fewest), default=-math.inf) < best + LEAST_GAIN


def merit(sweep: Sweep) -> float:
    """What must rise for a run to go on: q̂, or the least and the mean 1/q together if not all cells are triangles."""
    return sweep.min_shape + sweep.mean_shape if math.isnan(sweep.qhat) else sweep.qhat


def precision_of(mesh: Mesh) -> Precision:
    """How exactly the coordinates of a mesh are known, in the units of ``planar_points``."""
    precision = Precision.of(single=mesh.single, exact=mesh.exact, exponent=mesh.exponent)
    return (
        precision
        if mesh.rounding is None
        else precision.coarser(mesh.rounding.unit, math.ldexp(mesh.rounding.grain, -mesh.exponent))
    )
