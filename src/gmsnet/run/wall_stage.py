"""The last stage: near walls that a mesh is refined towards, shapes get better within bands of the areas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.methods.banded import PLAN, Banded
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.stop import NO_PROGRESS, NOTHING_TO_MOVE
from gmsnet.topology.topology import Topology

RINGS = 3  # around the nodes that were held near walls, which move with them
PHASE = "near walls, areas kept"
ELSEWHERE = "not near a wall"


def improve_near_walls(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the nodes that were held near walls, and those around them, where the sweeps have ended of themselves.

    Other nodes stay. Each cell whose corners all were held keeps its area within its band (kernels.methods.bands).
    """
    walls = state.protection.walls
    if walls is None or options.target or state.stop_reason not in (NO_PROGRESS, NOTHING_TO_MOVE):
        return state
    state = replace(state, released=True, totals=None)
    zone = executor.holding(state.planar, ~with_rings(walls.nodes, state.planar, executor), ELSEWHERE)
    smoother = Banded(state.start if state.untangled is None else state.untangled, walls.taken(zone.memory))
    smoother.phase = PHASE
    run = Run(state.run_start(options.best_by)._replace(topology=zone), smoother, options, executor.of(zone))
    stop_reason = run.to_the_end(min(run.sweeps + len(PLAN), options.max_sweeps))
    return replace(state, points=run.best, history=tuple(run.history)).ended(stop_reason, run.interruption)


def with_rings(nodes: NDArray[np.bool_], topology: Topology, executor: Executor) -> NDArray[np.bool_]:
    """(N,) by id: the nodes, and RINGS rings around them; nothing where there are none."""
    for _ in range(RINGS):
        nodes = _everywhere(nodes, topology, executor)
        touched = [corners[nodes[corners].any(axis=1)] for corners in (topology.triangles, topology.quads)]
        for corners in touched:
            nodes[corners] = True
    return _everywhere(nodes, topology, executor)


def _everywhere(nodes: NDArray[np.bool_], topology: Topology, executor: Executor) -> NDArray[np.bool_]:
    """A copy, (N,) by id, as those have it who move the nodes."""
    values = nodes[topology.memory].astype(np.float64)
    executor.exchange(values)
    return values[topology.places] > 0.0
