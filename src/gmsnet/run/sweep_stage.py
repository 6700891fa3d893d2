"""The sweeps of a method as a stage."""

from __future__ import annotations

from dataclasses import replace

from gmsnet.methods.auto import Auto
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import improve_dihedrals
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.stop import NO_PROGRESS
from gmsnet.run.target_run import reach_target
from gmsnet.topology.volume import Volume

# Shares of the cells, and cells: of so many that miss a target, one of η or of dihedral angles, all are smoothed.
MANY, MANY_ANGLES, FEW = 0.15, 0.02, 100


def sweep(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps of the method over all free nodes; for a target, over patches around the cells that miss it."""
    if options.target:
        return reach_target(_at_large(state, options, executor), options, executor)
    return _sweep_all(state, options, executor)


def _at_large(state: State, options: SmoothOptions, executor: Executor) -> State:
    """A volume so many cells of which miss the target that all are worth smoothing, after that; else as it is."""
    topology, target = state.topology, options.target
    if not (isinstance(topology, Volume) and isinstance(state.smoother, Auto) and len(topology.changeable.rows)):
        return state
    missing = len(target.tetrahedra_missing(state.points, topology.changeable)[0])
    if missing <= max((MANY if target.dihedral is None else MANY_ANGLES) * len(topology.changeable.rows), FEW):
        return state
    plain = replace(options, target_quality=None, target_dihedral=None)
    state = improve_dihedrals(_sweep_all(state, plain, executor), plain, executor)
    return replace(state, stop_reason="") if state.stop_reason == NO_PROGRESS else state


def _sweep_all(state: State, options: SmoothOptions, executor: Executor) -> State:
    run = Run(state.run_start(options.best_by), state.smoother, options, executor)
    stop_reason = run.to_the_end()
    totals = None if state.metric is not None else run.best_score.totals  # those are in the metric
    state = replace(state, points=run.best, totals=totals, history=tuple(run.history))
    return state.ended(stop_reason, run.interruption)
