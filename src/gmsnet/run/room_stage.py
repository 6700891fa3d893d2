"""The stages that give second-order cells room: where certified bounds are low, of tetrahedra where they are lowest."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LEVELS, WORST
from gmsnet.methods import Field, planar_cells, solid_cells
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.methods.solid_cells import SolidCells
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.second_order import corners_alone, judged, opened, rank_at
from gmsnet.run.state import State, with_corners
from gmsnet.run.stop import CALLBACK, NO_PROGRESS, NOTHING_TO_MOVE
from gmsnet.run.sweep_stage import rank_to_target

Floats = NDArray[np.float64]

SWEEPS = 10
ABOVE, HIGHEST = 0.3, 1.0  # bounds are raised towards the least one and so much more, and none is asked to be higher
LOWEST = 0.05  # of bounds less than this above the least one, cells are visited
ENOUGH = 0.95  # of a least bound
RISE, PATIENCE = 1e-3, 2  # after so many rounds without such a rise of the least bound, raising ends


def make_room(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the nodes around second-order cells whose certified bound is low, inner middles first.

    Corners stay where their moves would leave a mesh that ranks below the input, which would be taken instead.
    """
    given = state.second_order
    if given is None or state.stop_reason == CALLBACK or not given.free.any():
        return state
    cells = _with_room(state, options, executor, corners=True)
    if cells is not None and not given.invalid[0]:
        now, first = (_rank(state, points, options, executor) for points in (cells.points, state.start))
        if now > first:
            cells = _with_room(state, options, executor, corners=False)
    if state.stop_reason == NOTHING_TO_MOVE:
        state = state.ended(NO_PROGRESS)
    return state if cells is None else judged(state, cells)


def _rank(state: State, points: Floats, options: SmoothOptions, executor: Executor) -> tuple[float, ...]:
    """Of two places of the corners those of the lesser rank are the better: closer to the target, if there is one."""
    rank = rank_at(points, with_corners(state), options, executor)
    if not options.target:
        return rank
    assert state.second_order is not None
    there = replace(state, points=points, protection=corners_alone(state.second_order))
    return (*rank_to_target(there, options, executor).counts[:2], *rank)


def _with_room(
    state: State, options: SmoothOptions, executor: Executor, *, corners: bool
) -> PlanarCells | SolidCells | None:
    """The cells with more room, None where nothing has moved. Straight cells keep a floor for the least of them at each
    level of the guard."""
    given = state.second_order
    assert given is not None
    assert given.quality is not None
    if (given.quality >= (solid_cells if given.solid else planar_cells).LOW).all():
        return None
    cells, topology = opened(state), given.protection.topology
    inner, outer = np.flatnonzero(cells.inner), np.flatnonzero(cells.free & topology.near_free & corners)
    level, tally = max(LEVELS.index(options.guard), WORST), np.zeros(3, dtype=np.int64)
    for _ in range(min(SWEEPS, options.max_sweeps)):
        moved = int(tally[MOVED])
        guard = Field(cells.points, topology, state.precision, level).guard(executor)
        cells.improve(inner, cells.low, guard, tally)
        cells.improve(outer, cells.low, guard, tally)
        if tally[MOVED] == moved:
            break
    return cells if tally[MOVED] else None


def raise_bounds(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves nodes that are no corners around those tetrahedra whose certified bounds are lowest.

    Other cells with straight edges have low bounds, too, and would be bent.
    """
    given = state.second_order
    if given is None or not given.tetrahedra.any() or not given.free.any():
        return state
    if options.target or state.stop_reason == CALLBACK:
        return state
    assert given.quality is not None
    cells = opened(state)
    assert isinstance(cells, SolidCells)
    level, tally = LEVELS.index(options.guard), np.zeros(3, dtype=np.int64)
    guard = Field(cells.points, given.protection.topology, state.precision, level).guard(executor)
    some = np.flatnonzero(given.tetrahedra & (given.sign == 1) & (given.quality < HIGHEST))
    least, stuck = -math.inf, 0
    for _ in range(min(SWEEPS, options.max_sweeps)):
        bounds = cells.bounds(some, HIGHEST)
        now = bounds.min(initial=HIGHEST)
        stuck = 0 if now > least + RISE else stuck + 1
        least, moved = float(now), int(tally[MOVED])
        if stuck == PATIENCE or least >= ENOUGH:
            break
        cells.raise_bounds(some[bounds < least + LOWEST], min(least + ABOVE, HIGHEST), least, guard, tally)
        if tally[MOVED] == moved:
            break
    return judged(state, cells) if tally[MOVED] else state
