"""The last stage of second-order cells: corners, then room for the cells around them, in turns.

What stops a corner is a curved cell around it. Thin ones are given room after the corners have moved, so that those
that were stopped may go on from there.
"""

from __future__ import annotations

from dataclasses import replace

from gmsnet.parallel.executor import Executor
from gmsnet.run.carry_out import carry_out_all
from gmsnet.run.options import SmoothOptions
from gmsnet.run.room_stage import make_room, raise_bounds
from gmsnet.run.second_order import corners_alone, rank_at, smooth_corners
from gmsnet.run.state import State, with_corners
from gmsnet.run.stop import TARGET_REACHED
from gmsnet.run.sweep_stage import rank_to_target

TURN = (smooth_corners, make_room, raise_bounds)
TURNS = 8  # at most
GAIN, PATIENCE = 0.01, 2  # after so many turns that gain less in that by which meshes are compared, they end


def take_turns(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The best mesh of several turns: as many as corners may have been stopped, and are worth it.

    Room that one turn makes is what the next one gains by. What comes after the best mesh by the rule of the last stage
    is taken back.
    """
    if state.second_order is None or not state.second_order.free.any():
        return state
    best, most, idle = state, _worth(state, options, executor), 0
    for turn in range(TURNS):
        state = carry_out_all(state, options, executor, TURN)
        worth = _worth(state, options, executor)
        gained = max(new - old for new, old in zip(worth, most, strict=True))
        idle = 0 if gained >= GAIN else idle + 1
        if not turn or worth > most:
            best, most = state, worth
        if not _goes_on(state) or idle == PATIENCE:
            break
    return best.ended_as(state)


def _goes_on(state: State) -> bool:
    given = state.second_order
    assert given is not None
    return given.stopped and not state.cut_short and state.stop_reason != TARGET_REACHED


def _worth(state: State, options: SmoothOptions, executor: Executor) -> tuple[float, ...]:
    """Of two states that of the greater one is the better."""
    given = state.second_order
    assert given is not None
    rank: tuple[float, ...]
    if options.target:
        rank = rank_to_target(replace(state, protection=corners_alone(given)), options, executor)
    else:
        rank = rank_at(state.points, with_corners(state), options, executor)
    return tuple(-value for value in (given.invalid[1], *rank))
