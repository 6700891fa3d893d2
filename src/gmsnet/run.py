"""One run: sweeps over the stars by colour, stop rules, and of all meshes on the way the best."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.arguments import ASPECT
from gmsnet.kernels import quality as kernels
from gmsnet.kernels.compile import LANES
from gmsnet.kernels.guard import LEVELS, Precision
from gmsnet.measure import QualityReport, measure, weighted_metric
from gmsnet.mesh import Mesh
from gmsnet.methods import Field, Smoother
from gmsnet.topology import Topology, planar_points, scale_exponent
from gmsnet.workers import Share, workers

Floats = NDArray[np.float64]

MAX_SWEEPS = "max sweeps"
NO_PROGRESS = "no progress"
TARGET_REACHED = "target reached"
CALLBACK = "stopped by callback"
INTERRUPTED = "interrupted"
NOTHING_TO_MOVE = "nothing to move"

PATIENCE = 10  # sweeps within which q̂ must rise by LEAST_GAIN, or a cell be mended, for the run to go on
LEAST_GAIN = 1e-4
ROUNDING = 1e-12  # a smaller gain in q̂ is no gain


@dataclass(frozen=True)
class Sweep:
    """What one sweep did, and the mesh after it. index counts from 1; moved, truncated, dropped count nodes."""

    index: int
    moved: int
    truncated: int
    dropped: int
    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float


class Run:
    """The state of one run: coordinates in memory order, the best so far, and the record."""

    def __init__(
        self, mesh: Mesh, topology: Topology, smoother: Smoother, threads: int, best_by: str, guard: str
    ) -> None:
        self.mesh, self.topology, self.smoother, self.best_by = mesh, topology, smoother, best_by
        self.start = planar_points(mesh)[topology.memory]
        precision = Precision.of(single=mesh.single, exponent=scale_exponent(mesh))
        self.field = Field(self.start.copy(), topology, precision, LEVELS.index(guard))
        self.threads = threads
        self.history: list[Sweep] = []
        self.sums = np.empty((-(-len(topology.near) // LANES), kernels.SUMS))
        self.best, self.best_standing = self.start, self._standing()

    def to_the_end(self, max_sweeps: int, target: float | None, callback: Callable[[Sweep], bool | None] | None) -> str:
        """Sweeps until a stop rule says why to stop."""
        if not len(self.topology.free):
            return NOTHING_TO_MOVE
        if target is not None and self.best_standing.min_shape >= target:
            return TARGET_REACHED
        try:
            with workers(self.threads, len(self.topology.stars.blocks.filled)) as share:
                while len(self.history) < max_sweeps:
                    sweep = self._sweep(share)
                    if callback is not None and callback(sweep):
                        return CALLBACK
                    if target is not None and self.best_standing.min_shape >= target:
                        return TARGET_REACHED
                    if sweep.moved == 0 or self.smoother.settled or self._stalled():
                        return NO_PROGRESS
        except KeyboardInterrupt:  # the best mesh so far is whole: it is a copy
            return INTERRUPTED
        return MAX_SWEEPS

    def _best_points(self) -> tuple[Floats, NDArray[np.bool_]]:
        """The best coordinates (N, dim) and which nodes they move. All others keep their very bits."""
        elsewhere = (self.best != self.start).any(axis=1)
        ids = self.topology.memory[elsewhere]
        points = self.mesh.points.copy()
        plane = self.mesh.plane
        assert plane is not None
        points[np.ix_(ids, plane)] = np.ldexp(self.best[elsewhere], scale_exponent(self.mesh))
        moved = np.zeros(len(points), dtype=bool)
        moved[ids] = True
        return points, moved

    def outcome(self, before: QualityReport) -> tuple[Floats, NDArray[np.bool_], QualityReport]:
        """Points, which of them moved, and their measures; those of the input if the quick sums misjudged it."""
        points, moved = self._best_points()
        if moved.any():
            after = measure(self.mesh.with_points(points), self.topology)
            if (after.inverted, -self._qhat(after)) <= (before.inverted, -self._qhat(before)):
                return points, moved, after
        return self.mesh.points, np.zeros(len(points), dtype=bool), before

    def _qhat(self, report: QualityReport) -> float:
        return report.qhat_aspect if self.best_by == ASPECT else report.qhat

    def _sweep(self, share: Share) -> Sweep:
        tally = self.smoother.sweep(self.field, share, lambda: self._keep_if_best(self._standing(share)))
        standing = self._standing(share)
        self._keep_if_best(standing)
        moved, truncated, dropped = tally.tolist()
        sweep = Sweep(
            len(self.history) + 1, moved, truncated, dropped, standing.inverted, standing.qhat, standing.min_shape,
            standing.mean_shape,
        )  # fmt: skip
        self.history.append(sweep)
        return sweep

    def _keep_if_best(self, standing: Standing) -> bool:
        better = standing.beats(self.best_standing)
        if better:
            self.best, self.best_standing = self.field.points.copy(), standing
        return better

    def _standing(self, share: Share | None = None) -> Standing:
        """The sums over all triangles of the coordinates as they are."""
        triangles, turn = self.topology.near, self.topology.near_turn

        def add(first: int, last: int) -> None:
            kernels.summarise(self.field.points, triangles, turn, first, last, self.best_by == ASPECT, self.sums)

        if share is None:
            add(0, len(self.sums))
        else:
            share(add, 0, len(self.sums))
        return Standing.of(self.sums, len(triangles), self.best_by)

    def _stalled(self) -> bool:
        """Has nothing been gained for PATIENCE sweeps?"""
        if len(self.history) <= PATIENCE:
            return False
        earlier, recent = self.history[:-PATIENCE], self.history[-PATIENCE:]
        fewest = min(s.inverted for s in earlier)
        if min(s.inverted for s in recent) < fewest:
            return False
        best = max(s.qhat for s in earlier if s.inverted == fewest)
        return max((s.qhat for s in recent if s.inverted == fewest), default=-math.inf) < best + LEAST_GAIN


@dataclass(frozen=True)
class Standing:
    """Where a mesh stands in the comparison of meshes on the way."""

    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float

    @classmethod
    def of(cls, sums: Floats, triangles: int, best_by: str) -> Standing:
        """From the rows of sums that kernels.quality.summarise leaves."""
        if triangles == 0:
            return cls(0, math.nan, math.inf, math.nan)
        low, high, shape = (float(sums[:, k].sum()) / triangles for k in range(3))
        worst_low, worst_high = float(sums[:, kernels.MIN_LOW].min()), float(sums[:, kernels.MAX_HIGH].max())
        worst_shape = float(sums[:, kernels.MIN_SHAPE].min())
        low, worst_low, worst_high, high = map(math.degrees, (low, worst_low, worst_high, high))
        mean, worst = shape, worst_shape
        if best_by == ASPECT:
            mean = float(sums[:, kernels.SUM_ASPECT].sum()) / triangles
            worst = float(sums[:, kernels.MIN_ASPECT].min())
        qhat = weighted_metric(low, worst_low, worst_high, high, mean, worst)
        return cls(int(sums[:, kernels.INVERTED].sum()), qhat, worst_shape, shape)

    def beats(self, other: Standing) -> bool:
        """Fewer inverted cells first, then a larger q̂, by more than rounding."""
        if self.inverted != other.inverted:
            return self.inverted < other.inverted
        return self.qhat > other.qhat + ROUNDING
