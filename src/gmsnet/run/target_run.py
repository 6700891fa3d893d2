"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import LEVELS
from gmsnet.kernels.topology.patch import around
from gmsnet.measure.target import Target
from gmsnet.measure.totals import totals_of
from gmsnet.methods.auto import Auto, for_target
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.run.dihedral_stage import floor_for_angles
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.run.score import Score
from gmsnet.run.state import State
from gmsnet.run.stop import MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = (1, 2, 4, 8)  # of free nodes that move with the corners of a cell that misses the target
NARROW = (1, 2, 4)  # those where the method looks for the cells itself
LARGE, SMALL = 0.25, 1000  # no larger patches around the cells that are left: of all free nodes, or so many
SINGLE = 1.0 + 1e-6  # times a 1/q: what is above it in single precision is above it
FEW = 0.02  # of the cells that missed it at first: for so few that are left, the largest patches are tried
LEAST_SHARE = 0.7  # of the least η must be left when smallest dihedral angles are to reach a target
FEWER, IDLE = 0.9, 2  # a round that leaves more of the cells below the target is idle; so many in a row are the last


def reach_target(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    ``auto`` has a plan for each set of patches; another method is made anew for each. A patch's result is taken if
    fewer of its cells are inverted, or as many and fewer miss the target, or as many and the worst of them is better.
    """
    if state.stop_reason and isinstance(state.topology, Volume):  # the sweeps before (sweep_stage) have ended it
        return state
    try:
        with interruptible():
            for reached in _rounds(state, options, executor):
                state = reached
                if state.stop_reason:
                    break
    except KeyboardInterrupt as interruption:  # between rounds: in a round the run has caught it
        return state.interrupted(interruption)
    return state


def _rounds(state: State, options: SmoothOptions, executor: Executor) -> Iterator[State]:
    """The state after each set of patches; the last one has a reason to stop."""
    target, topology, own_plan = options.target, state.topology, isinstance(state.smoother, Auto)
    corners, clear = cells_missing(state, target)
    if not len(corners):
        yield state.ended(TARGET_REACHED)
        return
    every, corners = len(corners), _changeable(corners, topology)
    hopeless = len(corners) < every
    idle, at_first, precision = 0, len(corners), state.precision
    positive = state.before.signs is None
    floor = _floor_in_space(state, options, executor) if isinstance(topology, Volume) else None
    for rings in NARROW if own_plan else RINGS:
        if not len(corners):
            yield state.ended(NO_PROGRESS if state.history else NOTHING_TO_MOVE)
            return
        active = around(corners, rings, topology.near_free, topology.near_start, topology.near_ring)
        if own_plan and rings > 1 and too_large(rings, active, len(corners) / at_first, topology):
            break
        patch = topology.restricted(active)
        fraction = len(corners) / (patch.simplices.cell_count if isinstance(patch, Volume) else len(patch.near))
        planned = for_target(target, fraction, rings=rings, floor=floor) if own_plan else None
        smoother = planned or options.smoother()
        missing = partial(_changeable_missing, topology=topology, patch=patch, target=target)
        measure = partial(totals_of, state.points, patch.scored)
        before = Score(measure, options.best_by, corners if clear else missing(state.points), positive)
        run = Run(
            Start(patch, state.points, precision, before, state.history, state.constraint, state.curved),
            smoother,
            options,
            executor,
            missing,
        )
        reason = run.to_the_end()
        after = run.best_score
        state = replace(state, history=tuple(run.history), totals=None)
        if after.closer_to_target(before):
            state, corners, clear = replace(state, points=run.best), after.missing, True
        if run.interruption is not None:
            state = state.interrupted(run.interruption)
        elif not after.missed:
            state = state.ended(NO_PROGRESS if hopeless else TARGET_REACHED)
        elif reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped by the callback, or at the most sweeps
            state = state.ended(reason)
        elif run.sweeps >= options.max_sweeps:
            state = state.ended(MAX_SWEEPS)
        yield state
        idle = idle + 1 if after.missed > FEWER * before.missed else 0
        if idle == IDLE:
            break
    yield state.ended(NO_PROGRESS)


def _floor_in_space(state: State, options: SmoothOptions, executor: Executor) -> float:
    """Of D/S^(3/2), while smallest dihedral angles gain: LEAST_SHARE of the least η, no less than that of the input."""
    totals = totals_of(state.points, state.topology.scored, executor)
    shape = 0.0 if totals is None else LEAST_SHARE * max(totals.shape_min, 0.0)
    return floor_for_angles(state, LEVELS.index(options.guard), shape, executor)


def cells_missing(state: State, target: Target) -> tuple[NDArray[np.int32], bool]:
    """The corners (K, 3 or 4) of the cells that miss the target; do all of them, however they are measured?"""
    topology, points, before = state.topology, state.points, state.before
    if isinstance(topology, Volume):
        if points is not state.start or state.second_order is not None or isinstance(topology, MixedVolume):
            # the report has more cells, or cells whole, where corners without a free node must be told apart
            return corners_missing(points, topology, target), True
        return topology.places[topology.cells[target.missed_in(before)]], False
    rows = rows_missing(points, topology, target, state.shapes if points is state.start else None)
    corners = topology.near.take(rows, axis=0)
    if (
        before.inverted
        or topology.near_shapes is not None
        or target.clearly_missed(points, topology.simplices.take(rows))
    ):
        return corners, True
    return topology.places[topology.triangles[target.missed_in(before)]], False


def _changeable(corners: NDArray[np.int32], topology: Topology | Volume) -> NDArray[np.int32]:
    """Those with a node that is free. Of a cell that has one, simplices at its other corners may be without."""
    return corners[topology.near_free.take(corners).any(axis=1)]


def _changeable_missing(
    points: Floats, topology: Topology | Volume, patch: Topology | Volume, target: Target
) -> NDArray[np.int32]:
    """The corners of the cells in the patch that miss the target and have a node that is free in the whole mesh."""
    return _changeable(corners_missing(points, patch, target), topology)


def too_large(rings: int, active: Flags, left: float, topology: Topology | Volume) -> bool:
    """Do patches of so many active nodes take more than they bring? left: the share of the cells that still miss it."""
    count = np.count_nonzero(active)
    return bool(count > SMALL and (count > LARGE * len(topology.free) or (rings == NARROW[-1] and left > FEW)))


def rows_missing(
    points: Floats, topology: Topology, target: Target, shapes: NDArray[np.float32] | None = None
) -> NDArray[np.integer[Any]]:
    """The cells in ``near`` that miss the target, or are not clear of it. shapes: their 1/q, NaN where not known."""
    simplices = topology.simplices
    if shapes is None or isinstance(topology, Shell):
        return target.corners_missing(points, simplices)
    some = np.flatnonzero(~(shapes > target.max_shape * SINGLE))
    rows: NDArray[np.integer[Any]] = some[target.corners_missing(points, simplices.take(some))]
    return rows


def corners_missing(points: Floats, topology: Topology | Volume, target: Target) -> NDArray[np.int32]:
    """The corners (K, 3 or 4) of these."""
    if isinstance(topology, Volume):
        return topology.near.take(target.tetrahedra_missing(points, topology.simplices)[0], axis=0)
    return topology.near.take(rows_missing(points, topology, target), axis=0)
