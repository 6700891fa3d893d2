"""Smoothing only where a target is missed: patches around the cells below it, which grow where they do not suffice."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.sliding import Rails
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.kernels.topology.patch import around
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.target import Target
from gmsnet.measure.totals import totals_of
from gmsnet.methods.auto import Auto
from gmsnet.methods.base import Field
from gmsnet.methods.for_target import for_target
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.parallel.threads import serial
from gmsnet.preserve.protection import Protection
from gmsnet.run.dihedral_stage import floor_for_angles
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.run.score import Missing, Score
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


class Aim(NamedTuple):
    """What cannot be told from a patch. hopeless: cells without a free node miss the target. free: nodes of the whole
    mesh. floor: of volumes, see _floor_in_space.
    """

    hopeless: bool
    free: int
    floor: float | None


class Left(NamedTuple):
    """What misses the target still. corners: (K, 3 or 4) of the cells with a free node, on ranks of those that are
    here. clear: do all of them, however they are measured? at_first: how many there were of all processes, 0 before the
    first round. idle: rounds in a row that left most of them. over: nothing more is to be tried.
    """

    corners: NDArray[np.int32]
    clear: bool
    at_first: int = 0
    idle: int = 0
    over: bool = False


def reach_target(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Smooths patches around the cells that miss the target until none does, or nothing is gained any more.

    ``auto`` has a plan for each set of patches; another method is made anew for each. A patch's result is taken if
    fewer of its cells are inverted, or as many and fewer miss the target, or as many and the worst of them is better.
    """
    if state.stop_reason and isinstance(state.topology, Volume):  # the sweeps before (sweep_stage) have ended it
        return state
    near_free = state.topology.near_free.astype(np.float64)
    executor.exchange(near_free)
    free = near_free > 0.0
    corners, clear = cells_missing(state, options.target, free, executor)
    if not executor.total(np.array(len(corners))):
        return state.ended(TARGET_REACHED)
    able = free[corners].any(axis=1)
    if not executor.total(np.array(np.count_nonzero(able))):
        return _without_gain(state)
    aim = Aim(
        hopeless=bool(executor.total(np.array(np.count_nonzero(~able)))),
        free=int(executor.total(np.array(len(state.topology.free)))),
        floor=_floor_in_space(state, options, executor) if isinstance(state.topology, Volume) else None,
    )
    left = Left(corners[able], clear)
    try:
        with interruptible():
            for rings in NARROW if isinstance(state.smoother, Auto) else RINGS:
                state, left = _round(state, options, executor, aim, left, rings)
                if state.stop_reason:
                    return state
                if left.over:
                    break
    except KeyboardInterrupt as interruption:  # between rounds: in a round the run has caught it
        return state.interrupted(interruption)
    return state.ended(NO_PROGRESS)


def _round(
    state: State, options: SmoothOptions, executor: Executor, aim: Aim, left: Left, rings: int
) -> tuple[State, Left]:  # fmt: skip
    """After sweeps over one set of patches. Of several processes one makes them, with what lies around."""
    field = Field(state.points, state.topology, state.precision, constraint=state.constraint)
    part, corners = executor.gathered_around(field, left.corners, rings)
    if part is field:
        return _on_patches(state, options, executor, aim, left, rings)
    found: Any = None
    after = left
    if part is not None:
        sliding = None if part.constraint is None else Rails(part.constraint)
        inner = replace(
            state, protection=Protection(part.topology, []), start=part.points, points=part.points, sliding=sliding
        )
        alone = replace(options, callback=executor.called_alone(options.callback))
        done, after = _on_patches(inner, alone, serial, aim, left._replace(corners=corners), rings)
        moved, interrupted = done.points is not part.points, done.interruption is not None
        part.points = done.points
        found = done.history, done.stop_reason, moved, interrupted, after[1:]
    left = left._replace(corners=executor.cells_returned(part, after.corners))
    field.points = field.points.copy()
    history, reason, moved, interrupted, rest = executor.returned(field, part, found)
    state = replace(state, points=field.points if moved else state.points, history=history, totals=None)
    state = state.interrupted(KeyboardInterrupt()) if interrupted else state.ended(reason)
    return state, Left(left.corners, *rest)


def _without_gain(state: State) -> State:
    return state.ended(NO_PROGRESS if state.history else NOTHING_TO_MOVE)


def _on_patches(
    state: State, options: SmoothOptions, executor: Executor, aim: Aim, left: Left, rings: int
) -> tuple[State, Left]:  # fmt: skip
    """The same where all of it is here."""
    target, topology, own_plan = options.target, state.topology, isinstance(state.smoother, Auto)
    corners = left.corners
    left = left if left.at_first else left._replace(at_first=len(corners))
    if not len(corners):
        return _without_gain(state), left
    active = around(corners, rings, topology.near_free, topology.near_start, topology.near_ring)
    if own_plan and rings > 1 and too_large(rings, active, len(corners) / left.at_first, aim.free):
        return state, left._replace(over=True)
    patch = topology.restricted(active)
    fraction = len(corners) / (patch.simplices.cell_count if isinstance(patch, Volume) else len(patch.near))
    planned = for_target(target, fraction, rings=rings, floor=aim.floor) if own_plan else None
    smoother = planned or options.smoother()
    missing = partial(_changeable_missing, topology=topology, patch=patch, target=target)
    measure, positive = partial(totals_of, state.points, patch.scored), not state.before.inverted
    each = isinstance(topology, Volume) or topology.near_cells is None  # of these simplices is of another cell
    first = Missing.of(corners) if left.clear and each else missing(state.points)
    before = Score(measure, options.best_by, first, positive)
    run = Run(
        Start(patch, state.points, state.precision, before, state.history, state.constraint, state.curved),
        smoother,
        options,
        executor,
        missing,
    )
    reason = run.to_the_end()
    after = run.best_score
    state = replace(state, history=tuple(run.history), totals=None)
    if after.closer_to_target(before):
        state, left = replace(state, points=run.best), left._replace(corners=after.missing.corners, clear=True)
    if run.interruption is not None:
        state = state.interrupted(run.interruption)
    elif not after.missed:
        state = state.ended(NO_PROGRESS if aim.hopeless else TARGET_REACHED)
    elif reason not in (NO_PROGRESS, TARGET_REACHED):  # stopped by the callback, or at the most sweeps
        state = state.ended(reason)
    elif run.sweeps >= options.max_sweeps:
        state = state.ended(MAX_SWEEPS)
    idle = left.idle + 1 if after.missed > FEWER * before.missed else 0
    return state, left._replace(idle=idle, over=idle == IDLE)


def _floor_in_space(state: State, options: SmoothOptions, executor: Executor) -> float:
    """Of D/S^(3/2), while smallest dihedral angles gain: LEAST_SHARE of the least η, no less than that of the input."""
    totals = totals_of(state.points, state.topology.scored, executor)
    shape = 0.0 if totals is None else LEAST_SHARE * max(totals.shape_min, 0.0)
    return floor_for_angles(state, LEVELS.index(options.guard), shape, executor)


def cells_missing(
    state: State, target: Target, free: Flags, executor: Executor
) -> tuple[NDArray[np.int32], bool]:  # fmt: skip
    """The corners (K, 3 or 4) of the cells that miss the target; do all of them, however they are measured?

    free: (N,) the nodes that may move, on other processes, too.
    """
    topology, points, before = state.topology, state.points, state.before
    if points is not state.start or before.inverted:  # the report is of other points, or of more cells
        return corners_missing(points, topology, target, free), True
    if isinstance(topology, Volume):
        if state.second_order is not None or isinstance(topology, MixedVolume):
            # the report has more cells, or cells whole, where corners without a free node must be told apart
            return corners_missing(points, topology, target, free), True
        return topology.places[topology.cells[target.missed_in(before)]], False
    rows = rows_missing(points, topology, target, state.shapes if len(state.shapes) else None)
    corners = topology.near.take(_with_free(rows, topology, free), axis=0)
    clear = topology.near_shapes is not None or target.clearly_missed(points, topology.simplices.take(rows))
    if executor.minimum(float(clear)):
        return corners, True
    return topology.places[topology.triangles[target.missed_in(before)]], False


def _changeable_missing(
    points: Floats, topology: Topology | Volume, patch: Topology | Volume, target: Target
) -> Missing:  # fmt: skip
    """What misses the target in the patch, of the corners with a node that is free in the whole mesh.

    Of a cell that has one, simplices at its other corners may be without.
    """
    free = topology.near_free
    rows = _rows_missing(points, patch, target, free)
    rows = rows[free.take(patch.near.take(rows, axis=0)).any(axis=1)]
    cells = None if isinstance(patch, Volume) or patch.near_cells is None else patch.near_cells[rows]
    return Missing.of(patch.near.take(rows, axis=0), cells)


def too_large(rings: int, active: Flags, left: float, free: int) -> bool:
    """Do patches of so many active nodes take more than they bring? left: the share of the cells that still miss it.

    free: nodes of the whole mesh.
    """
    count = np.count_nonzero(active)
    return bool(count > SMALL and (count > LARGE * free or (rings == NARROW[-1] and left > FEW)))


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


def corners_missing(
    points: Floats, topology: Topology | Volume, target: Target, free: Flags
) -> NDArray[np.int32]:  # fmt: skip
    """The corners (K, 3 or 4) of these. free: (N,) the nodes that may move, on other processes, too."""
    return topology.near.take(_rows_missing(points, topology, target, free), axis=0)


def _rows_missing(
    points: Floats, topology: Topology | Volume, target: Target, free: Flags
) -> NDArray[np.integer[Any]]:  # fmt: skip
    """The rows of ``near``. free: (N,) the nodes that may move."""
    if isinstance(topology, Volume):
        return target.tetrahedra_missing(points, topology.simplices)[0]
    return _with_free(rows_missing(points, topology, target), topology, free)


def _with_free(
    rows: NDArray[np.integer[Any]], topology: Topology, free: Flags
) -> NDArray[np.integer[Any]]:  # fmt: skip
    """The rows, of quads in space others of the same cell where these have no free node: all four give its normal.

    Each of them once: processes count them.
    """
    if not isinstance(topology, Shell) or topology.near_cells is None:
        return rows
    able: Flags = np.asarray(free[topology.near].any(axis=1))
    some = np.flatnonzero(able)[::-1]
    one = np.full(int(topology.near_cells.max(initial=-1)) + 1, -1)
    one[topology.near_cells[some]] = some
    other = one[topology.near_cells[rows]]
    return sorted_unique(np.where(able[rows] | (other < 0), rows, other))
