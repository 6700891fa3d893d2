"""The sweeps of a method as a stage."""

from __future__ import annotations

from dataclasses import replace

from gmsnet.measure.totals import totals_of
from gmsnet.methods.auto import Auto
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import improve_dihedrals
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.score import Score
from gmsnet.run.state import State
from gmsnet.run.stop import NO_PROGRESS
from gmsnet.run.target_run import corners_missing, reach_target
from gmsnet.topology.volume import Volume

# Shares of the cells, and cells: of so many that miss a target, one of η or of dihedral angles, all are smoothed.
MANY, MANY_ANGLES, FEW = 0.15, 0.02, 100
SOME, FEWER = 0.02, 20  # the same where patches around them come first, and do not bring all to it


def sweep(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps of the method over all free nodes; for a target, over patches around the cells that miss it."""
    return _to_target(state, options, executor) if options.target else _sweep_all(state, options, executor)


def _to_target(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Patches around the cells that miss the target; before or after them all of a volume where these are many."""
    if _miss_it(state, options, executor, MANY if options.target.dihedral is None else MANY_ANGLES, FEW):
        return reach_target(_at_large(state, options, executor), options, executor)
    first = reach_target(state, options, executor)
    if first.stop_reason != NO_PROGRESS or not _miss_it(state, options, executor, SOME, FEWER):
        return first
    start = _at_large(replace(first, stop_reason=""), options, executor)
    second = reach_target(start, options, executor)
    if _score(second, options, executor).closer_to_target(_score(first, options, executor)):
        return second
    return first if second.interruption is None else first.interrupted(second.interruption)


def _miss_it(state: State, options: SmoothOptions, executor: Executor, share: float, few: int) -> bool:
    """Do more than so many cells of a volume that ``auto`` smooths miss the target?"""
    topology = state.topology
    if not (isinstance(topology, Volume) and isinstance(state.smoother, Auto) and len(topology.changeable.rows)):
        return False
    missing = len(options.target.tetrahedra_missing(state.points, topology.changeable)[0])
    return missing > max(share * executor.cell_count(topology.changeable), few)


def _at_large(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The state after sweeps over all free nodes, without a target."""
    plain = replace(options, target_quality=None, target_dihedral=None)
    state = improve_dihedrals(_sweep_all(state, plain, executor), plain, executor)
    return replace(state, stop_reason="") if state.stop_reason == NO_PROGRESS else state


def _score(state: State, options: SmoothOptions, executor: Executor) -> Score:
    missing = corners_missing(state.points, state.topology, options.target)
    return Score.of(totals_of(state.points, state.topology.scored, executor), options.best_by, missing)


def _sweep_all(state: State, options: SmoothOptions, executor: Executor) -> State:
    run = Run(state.run_start(options.best_by), state.smoother, options, executor)
    stop_reason = run.to_the_end()
    totals = None if state.metric is not None else run.best_score.totals  # those are in the metric
    state = replace(state, points=run.best, totals=totals, history=tuple(run.history))
    return state.ended(stop_reason, run.interruption)
