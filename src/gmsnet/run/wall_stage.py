"""The last stage: near walls that a mesh is refined towards, shapes get better within bands of the areas."""

from __future__ import annotations

from dataclasses import replace

from gmsnet.methods.sized import banded
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.stop import MAX_SWEEPS, NO_PROGRESS, NOTHING_TO_MOVE

SWEEPS = 20  # at most
PHASE = "near walls, areas kept"
ELSEWHERE = "not near a wall"


def improve_near_walls(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the nodes that were held near walls, where the sweeps have ended of themselves.

    Other nodes stay. Each cell whose corners all were held keeps its area in the input within a tenth.
    """
    kept = state.protection.kept
    if kept is None or options.target or state.stop_reason not in (NO_PROGRESS, NOTHING_TO_MOVE):
        return state
    state = replace(state, released=True, totals=None)
    zone = state.topology.holding(~kept, ELSEWHERE)
    smoother = banded(state.start, kept[zone.memory])
    smoother.phase = PHASE
    run = Run(state.run_start(options.best_by)._replace(topology=zone), smoother, options, executor)
    stop_reason = run.to_the_end(min(run.sweeps + SWEEPS, options.max_sweeps))
    if stop_reason == MAX_SWEEPS and run.sweeps < options.max_sweeps:
        stop_reason = NO_PROGRESS  # of the stage's own sweeps
    return replace(state, points=run.best, history=tuple(run.history)).ended(stop_reason, run.interruption)
