"""What ``smooth`` does one after the other: untangling, sweeps, angles, cells near walls, second-order cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.run.carry_out import Stage, carry_out_all
from gmsnet.run.dihedral_stage import improve_dihedrals
from gmsnet.run.mean_stage import improve_mean, return_mean
from gmsnet.run.metric_stage import take_metric
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import write_back
from gmsnet.run.rest_stage import improve_rest
from gmsnet.run.second_order import untangle_second_order
from gmsnet.run.second_order_turns import take_turns
from gmsnet.run.state import State
from gmsnet.run.sweep_stage import sweep
from gmsnet.run.untangle_stage import protect_untangled, untangle_all, untangle_left, untangle_protected
from gmsnet.run.wall_stage import improve_in_turns

# Of a valid mesh, without walls.
SWEEPS: tuple[Stage, ...] = (sweep, improve_rest, return_mean, improve_dihedrals, improve_mean)
AGAIN = 3  # times, at most, that the cells which untangling left are tried again
MOST = 0.5  # of the inverted cells: where more were left, they are not


def untangle_again(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Mends the few cells that were left, once sweeps have moved what is around them, in turns with sweeps."""
    before = state.before.inverted
    for _ in range(AGAIN):
        if not 0 < len(state.reasons) <= MOST * before or state.cut_short:
            break
        before, tried = len(state.reasons), untangle_left(state, executor)
        if tried is None:
            break
        again = replace(tried, totals=None, stop_reason="", smoother=options.smoother())
        state = carry_out_all(again, options, executor, SWEEPS)
    return state


STAGES: tuple[Stage, ...] = (
    untangle_all, untangle_protected, protect_untangled, take_metric, sweep, improve_rest, return_mean,
    improve_dihedrals, improve_mean, untangle_again, improve_in_turns, untangle_second_order, take_turns,
)  # fmt: skip


def carry_out(state: State, options: SmoothOptions, executor: Executor, stages: Sequence[Stage] = STAGES) -> State:
    """The state after all stages, or after the one that was interrupted, written back."""
    state = carry_out_all(state, options, executor, stages)
    last = interruptible()(write_back)
    try:
        return last(state, options, executor)
    except KeyboardInterrupt as interruption:  # nothing is lost by finishing what takes less time than a sweep
        return last(state.interrupted(interruption), options, executor)
