"""One run: sweeps over the stars by colour, stop rules, and of all meshes on the way the best."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LEVELS, Precision
from gmsnet.kernels.topology.write_back import put_back
from gmsnet.measure.report import ASPECT, QualityReport, measure
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, Smoother, Tally
from gmsnet.parallel.threads import Share, serial, workers
from gmsnet.run.score import NONE, Score
from gmsnet.run.stop import CALLBACK, INTERRUPTED, MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED
from gmsnet.run.sweep import Sweep
from gmsnet.topology.topology import Topology, near_points

Floats = NDArray[np.float64]


PATIENCE = 10  # sweeps within which q̂ must rise by LEAST_GAIN, or a cell be untangled, for the run to go on
LEAST_GAIN = 1e-4


class Run:
    """The state of one run: coordinates in memory order, the best so far, and the record.

    points: to start from, in memory order (default: the mesh's own). history: to go on with. precision: of
    the mesh, where it is known; score: of those points, where it is. missing: the corners (K, 3) of the triangles
    that miss a target at given points; the run ends when there is none.
    """

    def __init__(
        self, mesh: Mesh, topology: Topology, smoother: Smoother, threads: int, best_by: str, guard: str,
        points: Floats | None = None, history: list[Sweep] | None = None, precision: Precision | None = None,
        score: Score | None = None, missing: Callable[[Floats], NDArray[np.int32]] | None = None,
    ) -> None:  # fmt: skip
        self.topology, self.smoother, self.best_by = topology, smoother, best_by
        start = near_points(mesh, topology) if points is None else points
        self.field = Field(start.copy(), topology, precision or precision_of(mesh), LEVELS.index(guard))
        self.threads, self.missing = threads, missing
        self.fewest: list[int] = []  # cells that missed the target, up to each look
        self.history: list[Sweep] = [] if history is None else history
        self.sweeps = self.history[-1].index if self.history else 0
        self.first = len(self.history)
        self.tally: Tally = np.zeros(3, dtype=np.int64)  # since the last look
        self.stages: dict[str, None] = {}  # since the last look, in their order
        self.best, self.best_score = start, score or self._score()

    def to_the_end(self, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None = None) -> str:
        """Sweeps until a stop rule says why to stop."""
        if not len(self.topology.free):
            return NOTHING_TO_MOVE
        if self._reached():
            return TARGET_REACHED
        try:
            with workers(self.threads, len(self.topology.free) // LANES) as share:
                while self.sweeps < max_sweeps:
                    moved = self._sweep(share)
                    converged = self.smoother.converged or (self.smoother.stops_when_idle and not moved)
                    if not (self.smoother.looks or converged or self.sweeps == max_sweeps):
                        continue
                    sweep = self._look(share, last=converged or self.sweeps == max_sweeps)
                    if callback is not None and callback(sweep):
                        return CALLBACK
                    if self._reached():
                        return TARGET_REACHED
                    if converged or self.smoother.converged or self._stalled():
                        return NO_PROGRESS
        except KeyboardInterrupt:  # what was made since the last look counts, too: the guard allows each move by itself
            with suppress(KeyboardInterrupt):
                self._keep_if_best(self._score())
            return INTERRUPTED
        return MAX_SWEEPS

    def _reached(self) -> bool:
        return self.missing is not None and not self.best_score.missed

    def _sweep(self, share: Share) -> int:
        """One sweep; returns how many nodes moved."""
        tally = self.smoother.sweep(self.field, share, lambda: self._keep_if_best(self._score(share)))
        self.tally += tally
        self.stages[self.smoother.stage] = None
        self.sweeps += 1
        return int(tally[MOVED])

    def _look(self, share: Share, *, last: bool) -> Sweep:
        """Measures the mesh as it is now, keeps it if it is the best, and writes the record. last: nothing follows."""
        score = self._score(share)
        self._keep_if_best(score, last=last)
        moved, truncated, dropped = self.tally.tolist()
        self.tally[:] = 0
        sweep = Sweep(
            self.sweeps, " + ".join(self.stages), moved, truncated, dropped, score.inverted, score.qhat,
            score.min_shape, score.mean_shape,
        )  # fmt: skip
        self.history.append(sweep)
        self.fewest.append(min([score.missed, *self.fewest[-1:]]))
        self.stages.clear()
        return sweep

    def _keep_if_best(self, score: Score, *, last: bool = False) -> bool:
        better = score.better_than(self.best_score)
        if better:
            points = self.field.points
            self.best, self.best_score = points if last else points.copy(), score
        return better

    def _score(self, share: Share = serial) -> Score:
        """The sums over all triangles of the coordinates as they are."""
        totals = totals_of(self.field.points, self.topology.scored, share)
        return Score.of(totals, self.best_by, self.missing(self.field.points) if self.missing else NONE)

    def _stalled(self) -> bool:
        """Has nothing been gained for PATIENCE looks?"""
        own = self.history[self.first :]
        if len(own) <= PATIENCE:
            return False
        if self.fewest[-1] < self.fewest[-1 - PATIENCE]:
            return False
        earlier, recent = own[:-PATIENCE], own[-PATIENCE:]
        fewest = min(s.inverted for s in earlier)
        if min(s.inverted for s in recent) < fewest:
            return False
        best = max(merit(s) for s in earlier if s.inverted == fewest)
        return max((merit(s) for s in recent if s.inverted == fewest), default=-math.inf) < best + LEAST_GAIN


def precision_of(mesh: Mesh) -> Precision:
    """How exactly the coordinates of a mesh are known, in the units of ``planar_points``."""
    return Precision.of(single=mesh.single, exponent=mesh.exponent)


def outcome(
    mesh: Mesh, topology: Topology, best: Floats, before: QualityReport, rank: Callable[[QualityReport], Any],
    start: Floats | None = None, threads: int = 1, totals: Totals | None = None,
) -> tuple[Floats, NDArray[np.bool_], QualityReport]:  # fmt: skip
    """Points (N, dim), which of them moved, and their measures; those of the input if the quick sums misjudged them.

    best: (N, 2) in memory order. All nodes that it does not move keep their very bits. rank: of two meshes that of the
    lesser rank is the better. start: ``near_points`` of the mesh, totals: of ``best``, where they are known.
    """
    start = near_points(mesh, topology) if start is None else start
    plane, factors = mesh.plane, _factors(mesh.exponent)
    assert plane is not None
    points, moved = mesh.points.copy(), np.zeros(len(mesh.points), dtype=bool)
    count, exact = put_back(best, start, topology.memory, plane, *factors, points, moved)
    if count:
        points.flags.writeable = False  # so that the mesh need not copy them
        whole = totals if topology.scored is topology.simplices else None
        known = (best, threads, whole) if exact else (None, threads)
        after = measure(mesh.with_points(points), topology, *known)
        if rank(after) <= rank(before):
            return points, moved, after
        moved[:] = False
    return mesh.points, moved, before


def _factors(exponent: int) -> tuple[float, float]:
    """Two normal powers of two by which to multiply one after the other for 2 to the power of the exponent.

    The first one is 1 unless the exponent is too large or too small for a single float.
    """
    most = max(min(exponent, 1000), -1000)
    return 2.0 ** (exponent - most), 2.0**most


def rank_by(best_by: str) -> Callable[[QualityReport], Any]:
    """Fewer inverted cells first, then the larger q̂, or the larger least and then mean 1/q if not all are triangles."""

    def rank(report: QualityReport) -> tuple[float, ...]:
        totals = report.totals
        if totals is None:
            return (report.inverted,)
        if math.isnan(totals.qhat):
            return report.inverted, -totals.shape_min, -totals.shape_mean
        return report.inverted, -(totals.qhat_aspect if best_by == ASPECT else totals.qhat)

    return rank


def merit(sweep: Sweep) -> float:
    """What must rise for a run to go on: q̂, or the least and the mean 1/q together if not all cells are triangles."""
    return sweep.min_shape + sweep.mean_shape if math.isnan(sweep.qhat) else sweep.qhat
