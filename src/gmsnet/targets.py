"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels import ranking
from gmsnet.kernels.quality import LOW, per_cell
from gmsnet.measure import QualityReport
from gmsnet.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.run import INTERRUPTED, MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED, Run, Sweep, precision_of
from gmsnet.topology import Ints, Topology

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = (1, 2, 4, 8)  # of free nodes that move with the corners of a cell that misses the target
FEWER, IDLE = 0.9, 2  # a round that leaves more of the cells below the target is idle; so many in a row are the last
SURE = 1.0 + 1e-12  # times the target: what is above it is so however it is measured


@dataclass(frozen=True)
class Target:
    """What every cell is to reach. quality: the least 1/q. angle: the least angle in degrees. None: no matter."""

    quality: float | None = None
    angle: float | None = None

    def __bool__(self) -> bool:
        return self.quality is not None or self.angle is not None

    def missed(self, shape: Floats, min_angle: Floats) -> Flags:
        """Which cells miss it, by their 1/q and their smallest angles in degrees."""
        missed: Flags = np.zeros(len(shape), dtype=bool)
        if self.quality is not None:
            missed |= ~(shape >= self.quality)
        if self.angle is not None:
            missed |= ~((min_angle >= self.angle) & (shape > 0.0))
        return missed

    def rank(self, report: QualityReport) -> tuple[int, int, float]:
        """Of two meshes that of the lesser rank is nearer: by inverted cells, cells that miss it, the worst one."""
        missed = self.missed(report.shape, report.min_angle)
        return report.inverted, int(missed.sum()), -float(report.shape[missed].min(initial=np.inf))

    @property
    def sure(self) -> float | None:
        """The least 1/q at which no way to measure it leaves a doubt."""
        return None if self.quality is None else self.quality * SURE

    @property
    def shape(self) -> float:
        """The least 1/q that a cell has which meets it: of all triangles with angles of α or more, (α, α, π − 2α)."""
        least = self.quality or 0.0
        if self.angle is not None:
            alpha = math.radians(self.angle)
            long = 2.0 * math.cos(alpha)  # the sides are 1, 1 and this, the height is sin α
            least = max(least, 2.0 * math.sqrt(3.0) * long * math.sin(alpha) / (2.0 + long * long))
        return least


def reach_target(
    mesh: Mesh, topology: Topology, create: Callable[[], Smoother], target: Target, points: Floats, *,
    threads: int, best_by: str, guard: str, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None,
    report: QualityReport | None = None,
) -> tuple[Floats, str, list[Sweep]]:  # fmt: skip
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    create: makes the method ready for a run on one set of patches. points: (N, 2) in memory order, not changed.
    report: the measures of these points, if they are known. Returns the new points, why it ended, and the record. A
    patch's result is taken if fewer of its cells miss the target, or as many and the worst of them is better.
    """
    history: list[Sweep] = []
    if report is None:
        corners = topology.near[look(points, topology, target, np.arange(len(topology.near), dtype=np.int32)).missed]
    else:
        corners = topology.places[topology.triangles[target.missed(report.shape, report.min_angle)]]
    if not len(corners):
        return points, TARGET_REACHED, history
    idle, precision = 0, precision_of(mesh)
    hopeless = not topology.near_free[corners].any(axis=1).all()  # cells that miss it and cannot change
    try:
        for rings in RINGS:
            active = around(topology, corners, rings)
            if not active.any():
                return points, NO_PROGRESS if history else NOTHING_TO_MOVE, history
            patch, rows = topology.restricted(active)
            before = look(points, topology, target, rows)
            run = Run(mesh, patch, create(), threads, best_by, guard, points, history, precision)
            reason = run.to_the_end(max_sweeps, target.sure if target.angle is None else None, callback)
            after = look(run.best, topology, target, rows)
            if after.beats(before):
                points, corners = run.best, topology.near[after.missed]
            if not len(after.missed):
                return points, NO_PROGRESS if hopeless else TARGET_REACHED, history
            if reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped from outside, or at the most sweeps
                return points, reason, history
            if run.sweeps >= max_sweeps:
                return points, MAX_SWEEPS, history
            idle = idle + 1 if len(after.missed) > FEWER * len(before.missed) else 0
            if idle == IDLE:
                break
    except KeyboardInterrupt:  # in a round itself the run has caught it
        return points, INTERRUPTED, history
    return points, NO_PROGRESS, history


@dataclass(frozen=True)
class Missed:
    """Which cells of some miss a target. missed: rows of ``near``. least: of their 1/q."""

    missed: NDArray[np.int32]
    least: float

    def beats(self, other: Missed) -> bool:
        """Fewer cells below the target, or as many and the worst of them better."""
        return (len(self.missed), -self.least) < (len(other.missed), -other.least)


def look(points: Floats, topology: Topology, target: Target, rows: Ints) -> Missed:
    """Which of these rows of ``near`` miss the target."""
    triangles, turn = topology.near, topology.near_turn
    shape, low = np.empty(len(rows)), np.zeros(len(rows))
    ranking.shapes_of(points, triangles, turn, rows, shape)
    if target.angle is not None:
        columns = np.empty((4, len(rows)))
        per_cell(points, triangles[rows], turn[rows], columns)
        low = columns[LOW]
    missed = target.missed(shape / SURE, low / SURE)
    return Missed(rows[missed], float(shape[missed].min(initial=np.inf)))


def around(topology: Topology, triangles: Ints, rings: int) -> Flags:
    """(N,) by places in memory: the free corners of the triangles, and ``rings − 1`` rings of free nodes around."""
    free, start, ring = topology.near_free, topology.near_start, topology.near_ring
    active, front = np.zeros(len(free), dtype=bool), np.zeros(len(free), dtype=bool)
    front[triangles] = True
    for _ in range(rings):
        nodes = np.flatnonzero(front & free & ~active)
        active[nodes] = True
        front[:] = False
        front[ring[spans(start, nodes)]] = True
    return active


def spans(start: NDArray[Any], chosen: NDArray[Any]) -> NDArray[np.int64]:
    """The places of the chosen rows of a CSR array, one after the other."""
    count = (start[chosen + 1] - start[chosen]).astype(np.int64)
    end = np.cumsum(count)
    within: NDArray[np.int64] = np.arange(int(count.sum())) + np.repeat(start[chosen] + count - end, count)
    return within
