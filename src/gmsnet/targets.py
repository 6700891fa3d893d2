"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels import quality as kernels
from gmsnet.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.run import MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED, Run, Sweep
from gmsnet.topology import Ints, Topology

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = (1, 2, 4, 8)  # of free nodes that move with the corners of a cell that misses the target
OUTSIDE = "outside of the patches around cells below the target"


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

    @property
    def shape(self) -> float:
        """The least 1/q that a cell has which meets it: of all triangles with angles of α or more, (α, α, π − 2α)."""
        least = self.quality or 0.0
        if self.angle is not None:
            alpha = math.radians(self.angle)
            long = 2.0 * math.cos(alpha)  # the sides are 1, 1 and this, the height is sin α
            least = max(least, 2.0 * math.sqrt(3.0) * long * math.sin(alpha) / (2.0 + long * long))
        return least


@dataclass(frozen=True)
class Patches:
    """Where a run for a target stands. missed: rows of ``near`` below it. least: of their 1/q."""

    missed: NDArray[np.int64]
    least: float

    def beats(self, other: Patches) -> bool:
        """Fewer cells below the target, or as many and the worst of them better."""
        return (len(self.missed), -self.least) < (len(other.missed), -other.least)


def reach_target(
    mesh: Mesh, topology: Topology, create: Callable[[], Smoother], target: Target, points: Floats, *,
    threads: int, best_by: str, guard: str, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None,
) -> tuple[Floats, str, list[Sweep]]:  # fmt: skip
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    create: makes the method ready for a run on one set of patches. points: (N, 2) in memory order, not changed.
    Returns the new points, why it ended, and the record. A patch's result is taken if fewer cells miss the target, or
    as many and the worst of them is better.
    """
    history: list[Sweep] = []
    triangles = topology.near
    standing = look(points, topology, target, np.arange(len(triangles)))
    if not len(standing.missed):
        return points, TARGET_REACHED, history
    if not len(topology.free):
        return points, NOTHING_TO_MOVE, history
    for rings in RINGS:
        active = around(topology, triangles[standing.missed], rings)
        if not active.any():
            return points, NOTHING_TO_MOVE if not history else NO_PROGRESS, history
        patch, rows = restricted(topology, active)
        run = Run(mesh, patch, create(), threads, best_by, guard, points, history)
        reason = run.to_the_end(max_sweeps, target.quality if target.angle is None else None, callback)
        found = look(run.best, topology, target, np.union1d(rows, standing.missed))
        if found.beats(standing):
            points, standing = run.best, found
        if not len(standing.missed):
            return points, TARGET_REACHED, history
        if reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped from outside, or at the most sweeps
            return points, reason, history
        if run.sweeps >= max_sweeps:
            return points, MAX_SWEEPS, history
    return points, NO_PROGRESS, history


def look(points: Floats, topology: Topology, target: Target, rows: NDArray[np.int64]) -> Patches:
    """Which of these rows of ``near`` miss the target."""
    low, high, shape, aspect = (np.empty(len(rows)) for _ in range(4))
    kernels.per_cell(points, topology.near[rows], topology.near_turn[rows], low, high, shape, aspect)
    missed = target.missed(shape, np.degrees(low))
    return Patches(rows[missed], float(shape[missed].min(initial=np.inf)))


def around(topology: Topology, triangles: Ints, rings: int) -> Flags:
    """(N,) by places in memory: the free corners of the triangles, and ``rings − 1`` rings of free nodes around."""
    free, start, ring = topology.near_free, topology.near_start, topology.near_ring
    active = np.zeros(len(free), dtype=bool)
    front = np.unique(triangles)
    for _ in range(rings):
        front = front[free[front] & ~active[front]]
        active[front] = True
        front = np.unique(ring[spans(start, front)])
    return active


def spans(start: Ints, chosen: Ints) -> NDArray[np.int64]:
    """The places of the chosen rows of a CSR array, one after the other."""
    count = (start[chosen + 1] - start[chosen]).astype(np.int64)
    end = np.cumsum(count)
    return (
        np.arange(int(count.sum())) - np.repeat(end - count, count) + np.repeat(start[chosen].astype(np.int64), count)
    )


def restricted(topology: Topology, active: Flags) -> tuple[Topology, NDArray[np.int64]]:
    """The same with only the active nodes (by places in memory) free and only the triangles around them; their rows."""
    held = np.zeros(len(active), dtype=bool)
    held[topology.memory] = ~active
    rows = np.flatnonzero(active[topology.near].any(axis=1))
    inner = topology.holding(held, OUTSIDE)
    return replace(inner, near=topology.near[rows], near_turn=topology.near_turn[rows]), rows
