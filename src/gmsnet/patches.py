"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels import ranking
from gmsnet.kernels.below import missed
from gmsnet.kernels.patch import around
from gmsnet.measure import QualityReport
from gmsnet.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.methods.auto import for_target
from gmsnet.run import INTERRUPTED, MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED, Run, Sweep, precision_of
from gmsnet.target import Target
from gmsnet.topology import Topology

Floats = NDArray[np.float64]

RINGS = (1, 2, 4, 8)  # of free nodes that move with the corners of a cell that misses the target
NARROW = (1, 2, 4)  # those where the method looks for the cells itself
LARGE = 0.25  # of all free nodes: no larger patches around the cells that are left
FEW = 0.02  # of the cells that missed it at first: for so few that are left, the largest patches are tried
FEWER, IDLE = 0.9, 2  # a round that leaves more of the cells below the target is idle; so many in a row are the last


def reach_target(
    mesh: Mesh, topology: Topology, create: Callable[[], Smoother] | None, target: Target, points: Floats, *,
    threads: int, best_by: str, guard: str, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None,
    report: QualityReport | None = None,
) -> tuple[Floats, str, list[Sweep]]:  # fmt: skip
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    create: makes a method ready for a run on one set of patches; None for ``methods.auto``, which has a plan for each.
    points: (N, 2) in memory order, not changed. report: the measures of these points, if they are known. Returns the
    new points, why it ended, and the record. A patch's result is taken if fewer of its cells miss the target, or as
    many and the worst of them is better.
    """
    history: list[Sweep] = []
    rows = look(points, topology, target).rows
    corners = topology.near[rows]
    if report is not None and not target.clearly_missed(points, corners, topology.near_turn[rows]):
        corners = topology.places[topology.triangles[target.missed_in(report)]]
    if not len(corners):
        return points, TARGET_REACHED, history
    idle, at_first, precision = 0, len(corners), precision_of(mesh)
    hopeless = not topology.near_free[corners].any(axis=1).all()  # cells that miss it and cannot change
    try:
        for rings in RINGS if create else NARROW:
            active = around(corners, rings, topology.near_free, topology.near_start, topology.near_ring)
            if not active.any():
                return points, NO_PROGRESS if history else NOTHING_TO_MOVE, history
            if (
                create is None
                and rings > 1
                and (
                    np.count_nonzero(active) > LARGE * len(topology.free)
                    or (rings == NARROW[-1] and len(corners) > FEW * at_first)
                )
            ):
                break
            patch = topology.restricted(active)
            before = look(points, patch, target)
            smoother = create() if create else for_target(target, len(before.rows) / len(patch.near), rings=rings)
            run = Run(
                mesh, patch, smoother, threads, best_by, guard, points, history, precision,
                missed=partial(how_many, topology=patch, target=target),
            )  # fmt: skip
            reason = run.to_the_end(max_sweeps, target.sure if target.angle is None else None, callback)
            after = look(run.best, patch, target)
            if after.beats(before):
                points, corners = run.best, patch.near[after.rows]
            if not len(after.rows):
                return points, NO_PROGRESS if hopeless else TARGET_REACHED, history
            if reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped from outside, or at the most sweeps
                return points, reason, history
            if run.sweeps >= max_sweeps:
                return points, MAX_SWEEPS, history
            idle = idle + 1 if len(after.rows) > FEWER * len(before.rows) else 0
            if idle == IDLE:
                break
    except KeyboardInterrupt:  # in a round itself the run has caught it
        return points, INTERRUPTED, history
    return points, NO_PROGRESS, history


@dataclass(frozen=True)
class Missed:
    """Which cells of some miss a target. rows: of ``near``. least: of their 1/q."""

    rows: NDArray[np.int32]
    least: float

    def beats(self, other: Missed) -> bool:
        """Fewer cells below the target, or as many and the worst of them better."""
        return (len(self.rows), -self.least) < (len(other.rows), -other.least)


def look(points: Floats, topology: Topology, target: Target) -> Missed:
    """Which of the cells in ``near`` miss the target, or are not clear of it."""
    triangles, turn = topology.near, topology.near_turn
    rows = missed(points, triangles, turn, *target.limits)
    shape = np.empty(len(rows))
    ranking.shapes_of(points, triangles, turn, rows, shape)
    return Missed(rows, float(shape.min(initial=np.inf)))


def how_many(points: Floats, topology: Topology, target: Target) -> int:
    """How many of the cells in ``near`` miss the target, or are not clear of it."""
    return len(missed(points, topology.near, topology.near_turn, *target.limits))
