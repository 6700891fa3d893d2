"""The sweeps of a method as a stage."""

from __future__ import annotations

from dataclasses import replace

from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.target_run import reach_target


def sweep(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps of the method over all free nodes; for a target, over patches around the cells that miss it."""
    if options.target:
        return reach_target(state, options, executor)
    run = Run(state.run_start(options.best_by), state.smoother, options, executor)
    stop_reason = run.to_the_end()
    totals = None if state.metric is not None else run.best_score.totals  # those are in the metric
    state = replace(state, points=run.best, totals=totals, history=tuple(run.history))
    return state.ended(stop_reason, run.interruption)
