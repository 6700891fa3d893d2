"""The last stage: near walls that a mesh is refined towards, shapes get better within bands of the areas.

Before it, nodes near walls stand still, and the worst cell may be one of theirs: then sweeps elsewhere end early. Where
a cell elsewhere is as bad as the worst one there afterwards, or any cell misses the target, sweeps go on, and the stage
follows once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.totals import totals_of
from gmsnet.methods.banded import PLAN, Banded
from gmsnet.parallel.executor import Executor
from gmsnet.run.carry_out import carry_out_all
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.stop import NO_PROGRESS, NOTHING_TO_MOVE
from gmsnet.run.sweep_stage import closer_one, missing_in, sweep
from gmsnet.topology.topology import Topology

RINGS = 3  # around the nodes that were held near walls, which move with them
PHASE = "near walls, areas kept"
ELSEWHERE, NEAR = "not near a wall", "near a wall"
TURNS = 2  # at most, after the first
GAIN = 0.005  # in the least 1/q elsewhere: the turn that gains less is the last one
AHEAD = 0.02  # in 1/q: the worst cell near a wall may be worse by so much, and sweeps elsewhere go on
Step = Callable[[State], State]


def improve_in_turns(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Cells near walls become better, then those elsewhere, as long as these are as bad and it is worth it."""

    def near(given: State) -> State:
        return carry_out_all(given, options, executor, [improve_near_walls])

    def elsewhere(given: State) -> State:
        return carry_out_all(given, options, executor, [sweep])

    return in_turns(state, near, elsewhere, options, executor)


def in_turns(state: State, near: Step, elsewhere: Step, options: SmoothOptions, executor: Executor) -> State:
    """See improve_in_turns. near: releases the nodes near walls; elsewhere: is for a state that holds them.

    executor: for the connectivity with these nodes free.
    """
    last, least = near(state), -math.inf
    for _ in range(TURNS):
        if not last.released or last.interruption is not None:
            break
        if options.target:
            if not missing_in(last.planar, last.points, options, executor):
                break
        else:
            of_all, now = _leasts(last, executor)
            if not least + GAIN < now < of_all + AHEAD:
                break
            least = now
        again = replace(last, released=False, totals=None, stop_reason="", smoother=options.smoother())
        swept = elsewhere(again)
        last = near(swept)
        if not last.released:  # sweeps have not ended of themselves
            last = replace(last, released=True, totals=None, protection=state.protection)
    return last


def _leasts(state: State, executor: Executor) -> tuple[float, float]:
    """The least 1/q of all cells with a free node, and of those with one that is not near a wall; infinite if none."""
    walls = state.protection.walls
    assert walls is not None
    outside = executor.holding(state.planar, with_rings(walls.nodes, state.planar, executor), NEAR)
    found = (totals_of(state.points, each.scored, executor.of(each)) for each in (state.planar, outside))
    of_all, elsewhere = (math.inf if totals is None else totals.shape_min for totals in found)
    return of_all, elsewhere


def improve_near_walls(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the nodes that were held near walls, and those around them, where the sweeps have ended of themselves.

    Other nodes stay. Each cell whose corners all were held keeps its area within its band (kernels.methods.bands). For
    a target they move where cells of theirs miss it: those around these cells, or all, if any cell misses it then.
    """
    walls = state.protection.walls
    if walls is None or state.stop_reason not in (NO_PROGRESS, NOTHING_TO_MOVE) or _no_sweep_is_left(state, options):
        return state
    released = replace(state, released=True, totals=None)
    if not options.target:
        return _moved(released, walls.nodes, options, executor)
    missed = _missed(released, options, executor)
    if not executor.total(np.array(np.count_nonzero(missed))):
        return state
    best = last = released
    for nodes in (missed, walls.nodes):
        last = _moved(replace(released, history=last.history), nodes, options, executor)
        best = closer_one(last, best, options, executor)
        reached = not missing_in(best.planar, best.points, options, executor)
        if reached or best.cut_short or _no_sweep_is_left(last, options):
            break
    return state.ended_as(best) if best.points is released.points else best


def _no_sweep_is_left(state: State, options: SmoothOptions) -> bool:
    """Would released nodes be free that no sweep sees any more?"""
    return bool(state.history) and state.history[-1].index >= options.max_sweeps


def _moved(state: State, nodes: NDArray[np.bool_], options: SmoothOptions, executor: Executor) -> State:
    """After the sweeps over these nodes (N,) by id, and those around them."""
    walls = state.protection.walls
    assert walls is not None
    zone = executor.holding(state.planar, ~with_rings(nodes, state.planar, executor), ELSEWHERE)
    smoother = Banded(state.start if state.untangled is None else state.untangled, walls.taken(zone.memory))
    smoother.phase = PHASE
    run = Run(state.run_start(options.best_by)._replace(topology=zone), smoother, options, executor.of(zone))
    stop_reason = run.to_the_end(min(run.sweeps + len(PLAN), options.max_sweeps))
    return replace(state, points=run.best, history=tuple(run.history)).ended(stop_reason, run.interruption)


def _missed(state: State, options: SmoothOptions, executor: Executor) -> NDArray[np.bool_]:
    """(N,) by id: the corners of the cells near walls that miss the target, as those have them who move a corner."""
    topology, walls = state.planar, state.protection.walls
    assert walls is not None
    near = executor.holding(topology, ~walls.nodes, ELSEWHERE)
    rows = near.changeable.rows[options.target.corners_missing(state.points, near.changeable)]
    found = np.zeros_like(walls.nodes)
    found[topology.memory[rows]] = True
    return found


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
