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
TURNS = 5  # at most
GAIN = 0.01  # in that by which meshes are compared: the turn that gains less is the last one


def take_turns(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The mesh after one turn, and after more as long as corners may have been stopped and turns are worth it.

    A turn after the first is taken back if the mesh is not better for it by the rule of the last stage.
    """
    if state.second_order is None or not state.second_order.free.any():
        return state
    worth = _worth(state, options, executor)
    for turn in range(TURNS):
        after = carry_out_all(state, options, executor, TURN)
        now = _worth(after, options, executor)
        if turn and now <= worth:
            return state if after.interruption is None else state.interrupted(after.interruption)
        gained = [new - old for new, old in zip(now, worth, strict=True)]
        state, worth = after, now
        if not _goes_on(state) or max(gained) < GAIN:
            break
    return state


def _goes_on(state: State) -> bool:
    given = state.second_order
    assert given is not None
    return given.stopped and state.interruption is None and state.stop_reason != TARGET_REACHED


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
