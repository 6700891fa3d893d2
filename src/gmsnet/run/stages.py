"""What ``smooth`` does one after the other: untangling, sweeps (for a target, on patches), the cells near walls."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import write_back
from gmsnet.run.run import Run
from gmsnet.run.second_order import improve_second_order
from gmsnet.run.state import State
from gmsnet.run.target_run import reach_target
from gmsnet.run.untangle_stage import untangle_all, untangle_protected
from gmsnet.run.wall_stage import improve_near_walls


class Stage(Protocol):
    """Makes a mesh better in one respect; returns the state as it is where there is nothing to do.

    A stage that is interrupted either returns what it has, with the interruption, or lets KeyboardInterrupt out.
    """

    def __call__(self, state: State, options: SmoothOptions, executor: Executor) -> State:
        """The state after it."""
        ...


def sweep(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps of the method over all free nodes; for a target, over patches around the cells that miss it."""
    if options.target:
        return reach_target(state, options, executor)
    run = Run(state.run_start(options.best_by), state.smoother, options, executor)
    stop_reason = run.to_the_end()
    state = replace(state, points=run.best, totals=run.best_score.totals, history=tuple(run.history))
    return state.ended(stop_reason, run.interruption)


STAGES: tuple[Stage, ...] = (untangle_all, untangle_protected, sweep, improve_near_walls, improve_second_order)


def carry_out(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The state after all stages, or after the one that was interrupted, written back."""
    for stage in STAGES:
        try:
            state = interruptible()(stage)(state, options, executor)
        except KeyboardInterrupt as interruption:  # a stage that has nothing of its own to keep
            state = state.interrupted(interruption)
        if state.interruption is not None:
            break
    last = interruptible()(write_back)
    try:
        return last(state, options, executor)
    except KeyboardInterrupt as interruption:  # nothing is lost by finishing what takes less time than a sweep
        return last(state.interrupted(interruption), options, executor)
