"""What ``smooth`` does one after the other: untangling, sweeps, angles, cells near walls, second-order cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.run.dihedral_stage import improve_dihedrals
from gmsnet.run.mean_stage import improve_mean
from gmsnet.run.metric_stage import take_metric
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import write_back
from gmsnet.run.rest_stage import improve_rest
from gmsnet.run.room_stage import make_room, raise_bounds
from gmsnet.run.second_order import smooth_corners, untangle_second_order
from gmsnet.run.state import State
from gmsnet.run.sweep_stage import sweep
from gmsnet.run.untangle_stage import protect_untangled, untangle_all, untangle_protected
from gmsnet.run.wall_stage import improve_near_walls


class Stage(Protocol):
    """Makes a mesh better in one respect; returns the state as it is where there is nothing to do.

    A stage that is interrupted either returns what it has, with the interruption, or lets KeyboardInterrupt out.
    """

    def __call__(self, state: State, options: SmoothOptions, executor: Executor) -> State:
        """The state after it."""
        ...


STAGES: tuple[Stage, ...] = (
    untangle_all, untangle_protected, protect_untangled, take_metric, sweep, improve_rest, improve_dihedrals,
    improve_mean, improve_near_walls, untangle_second_order, smooth_corners, make_room, raise_bounds,
)  # fmt: skip


SWEEPS: tuple[Stage, ...] = (sweep, improve_rest, improve_dihedrals, improve_mean)  # of a valid mesh, without walls


def carry_out_all(state: State, options: SmoothOptions, executor: Executor, stages: Sequence[Stage] = SWEEPS) -> State:
    """The state after all stages, or after the one that was interrupted."""
    for stage in stages:
        try:
            with interruptible():
                state = stage(state, options, executor)
        except KeyboardInterrupt as interruption:  # a stage that has nothing of its own to keep
            state = state.interrupted(interruption)
        if state.interruption is not None:
            break
    return state


def carry_out(state: State, options: SmoothOptions, executor: Executor, stages: Sequence[Stage] = STAGES) -> State:
    """The state after all stages, or after the one that was interrupted, written back."""
    state = carry_out_all(state, options, executor, stages)
    last = interruptible()(write_back)
    try:
        return last(state, options, executor)
    except KeyboardInterrupt as interruption:  # nothing is lost by finishing what takes less time than a sweep
        return last(state.interrupted(interruption), options, executor)
