"""The last stage of second-order cells: corners, then room for the cells around them, in turns.

What stops a corner is a curved cell around it. Thin ones are given room after the corners have moved, so that those
that were stopped may go on from there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gmsnet.kernels.star.guard import LEVELS, VALID
from gmsnet.methods import planar_cells, solid_cells
from gmsnet.parallel.executor import Executor
from gmsnet.run.carry_out import carry_out_all
from gmsnet.run.options import SmoothOptions
from gmsnet.run.room_stage import make_room, raise_bounds
from gmsnet.run.second_order import corners_alone, mend_rest, rank_at, smooth_corners
from gmsnet.run.state import SecondOrder, State, with_corners
from gmsnet.run.sweep_stage import SMALL, much_fewer, rank_to_target

TURN = (smooth_corners, make_room, raise_bounds, mend_rest)
TURNS = 8  # at most
MISSING = 2  # where a worth has the cells that miss a target
GAIN, PATIENCE = 0.01, 2  # after so many turns that gain less in that by which meshes are compared, they end


def take_turns(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The best mesh of several turns: as many as corners may have been stopped, and are worth it.

    Room that one turn makes is what the next one gains by. What comes after the best mesh by the rule of the last stage
    is taken back.
    """
    given = state.second_order
    if given is None or not given.free.any():
        return state
    if options.guard != LEVELS[VALID]:
        state = replace(state, second_order=replace(given, room=_room(given)))
    best, most = _turns(state, options, executor)
    if not options.target or best.cut_short or not most[MISSING] or np.count_nonzero(given.free) > SMALL:
        return best
    # What a target asks of few cells may end where curved cells are in the way: once more for the shape of all.
    used = best.history[-1].index if best.history else 0
    asked = replace(options.without_target, max_sweeps=options.max_sweeps + used)
    other, _ = _turns(replace(state, history=best.history), asked, executor)
    worth = _worth(other, options, executor)
    fewer = much_fewer(int(-worth[MISSING]), int(-most[MISSING]), len(given.cells))
    if worth[:MISSING] >= most[:MISSING] and fewer:
        return other
    return best.ended_as(other)


def _turns(state: State, options: SmoothOptions, executor: Executor) -> tuple[State, tuple[float, ...]]:
    """The best mesh of the turns, and its worth."""
    best, most, idle = state, _worth(state, options, executor), 0
    for turn in range(TURNS):
        state = carry_out_all(state, options, executor, TURN)
        worth = _worth(state, options, executor)
        gained = max(new - old for new, old in zip(worth, most, strict=True))
        idle = 0 if gained >= GAIN else idle + 1
        if not turn or worth > most:
            best, most = state, worth
        if not _goes_on(state, worth, options) or idle == PATIENCE:
            break
    return best.ended_as(state), most


def _room(given: SecondOrder) -> float:
    """The least bound of a valid cell, LOW at most. Later turns may use what room the first one makes."""
    assert given.quality is not None
    low = (solid_cells if given.solid else planar_cells).LOW
    return float(given.quality[(given.sign == 1) & given.curved].min(initial=low))


def _goes_on(state: State, worth: tuple[float, ...], options: SmoothOptions) -> bool:
    """Not where a target is met by the corners as they are: the method may have met it by straight cells alone."""
    given = state.second_order
    assert given is not None
    return given.stopped and not state.cut_short and not (options.target and worth[MISSING] == 0)


def _worth(state: State, options: SmoothOptions, executor: Executor) -> tuple[float, ...]:
    """Of two states that of the greater one is the better. With a target, minus those that miss it at MISSING."""
    given = state.second_order
    assert given is not None
    rank: tuple[float, ...]
    if options.target:
        rank = rank_to_target(replace(state, protection=corners_alone(given)), options, executor).counts
    else:
        rank = rank_at(state.points, with_corners(state), options, executor)
    return tuple(-value for value in (given.invalid[1], *rank))
