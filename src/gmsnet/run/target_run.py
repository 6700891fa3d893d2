"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.below import missed
from gmsnet.kernels.topology.patch import around
from gmsnet.measure.report import QualityReport
from gmsnet.measure.target import Target
from gmsnet.measure.totals import totals_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.methods.auto import for_target
from gmsnet.run.run import Run, precision_of
from gmsnet.run.score import Score
from gmsnet.run.stop import INTERRUPTED, MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED
from gmsnet.run.sweep import Sweep
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = (1, 2, 4, 8)  # of free nodes that move with the corners of a cell that misses the target
NARROW = (1, 2, 4)  # those where the method looks for the cells itself
LARGE, SMALL = 0.25, 1000  # no larger patches around the cells that are left: of all free nodes, or so many
SINGLE = 1.0 + 1e-6  # times a 1/q: what is above it in single precision is above it
FEW = 0.02  # of the cells that missed it at first: for so few that are left, the largest patches are tried
FEWER, IDLE = 0.9, 2  # a round that leaves more of the cells below the target is idle; so many in a row are the last


def reach_target(
    mesh: Mesh, topology: Topology, create: Callable[[], Smoother] | None, target: Target, points: Floats, *,
    threads: int, best_by: str, guard: str, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None,
    report: QualityReport | None = None, shapes: NDArray[np.float32] | None = None,
) -> tuple[Floats, str, list[Sweep]]:  # fmt: skip
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    create: makes a method ready for a run on one set of patches; None for ``methods.auto``, which has a plan for each.
    points: (N, 2) in memory order, not changed. report: the measures of these points, if they are known; shapes: 1/q of
    the triangles in ``topology.near``, if it is. Returns the new points, why it ended, and the record. A patch's result
    is taken if fewer of its cells are inverted, or as many and fewer miss the target, or as many and the worst of them
    is better.
    """
    history: list[Sweep] = []
    rows = rows_missing(points, topology, target, shapes)
    corners = topology.near.take(rows, axis=0)
    clear = report is None or target.clearly_missed(points, topology.simplices.take(rows))
    if report is not None and not clear:
        corners = topology.places[topology.triangles[target.missed_in(report)]]
    if not len(corners):
        return points, TARGET_REACHED, history
    changeable = topology.near_free.take(corners).any(axis=1)
    hopeless = not changeable.all()  # cells that miss it and cannot change
    corners = corners[changeable]
    idle, at_first, precision = 0, len(corners), precision_of(mesh)
    positive = report is not None and report.signs is None
    try:
        for rings in RINGS if create else NARROW:
            if not len(corners):
                return points, NO_PROGRESS if history else NOTHING_TO_MOVE, history
            active = around(corners, rings, topology.near_free, topology.near_start, topology.near_ring)
            if create is None and rings > 1 and too_large(rings, active, len(corners) / at_first, topology):
                break
            patch = topology.restricted(active)
            share = len(corners) / len(patch.near)
            smoother = create() if create else for_target(target, share, rings=rings)
            missing = partial(corners_missing, topology=patch, target=target)
            measure = partial(totals_of, points, patch.scored)
            before = Score(measure, best_by, corners if clear else missing(points), positive)
            run = Run(
                mesh, patch, smoother, threads, best_by, guard, points, history, precision, before, missing
            )  # fmt: skip
            reason = run.to_the_end(max_sweeps, callback)
            after = run.best_score
            if after.closer_to_target(before):
                points, corners, clear = run.best, after.missing, True
            if not after.missed:
                return points, NO_PROGRESS if hopeless else TARGET_REACHED, history
            if reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped from outside, or at the most sweeps
                return points, reason, history
            if run.sweeps >= max_sweeps:
                return points, MAX_SWEEPS, history
            idle = idle + 1 if after.missed > FEWER * before.missed else 0
            if idle == IDLE:
                break
    except KeyboardInterrupt:  # in a round itself the run has caught it
        return points, INTERRUPTED, history
    return points, NO_PROGRESS, history


def too_large(rings: int, active: Flags, left: float, topology: Topology) -> bool:
    """Do patches of so many active nodes take more than they bring? left: the share of the cells that still miss it."""
    count = np.count_nonzero(active)
    return bool(count > SMALL and (count > LARGE * len(topology.free) or (rings == NARROW[-1] and left > FEW)))


def rows_missing(
    points: Floats, topology: Topology, target: Target, shapes: NDArray[np.float32] | None = None
) -> NDArray[np.integer[Any]]:
    """The cells in ``near`` that miss the target, or are not clear of it. shapes: their 1/q, where it is known."""
    simplices = topology.simplices
    rows: NDArray[np.integer[Any]]
    if shapes is None:
        rows = missed(points, simplices, *target.limits)
    else:
        some = np.flatnonzero(~(shapes > target.max_shape * SINGLE))
        rows = some[missed(points, simplices.take(some), *target.limits)]
    return rows


def corners_missing(points: Floats, topology: Topology, target: Target) -> NDArray[np.int32]:
    """The corners (K, 3) of these."""
    return topology.near.take(rows_missing(points, topology, target), axis=0)
