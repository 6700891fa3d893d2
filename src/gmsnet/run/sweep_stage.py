"""The sweeps of a method as a stage."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.rail import positions_on, relocate
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.measure.target import Nearness
from gmsnet.measure.totals import totals_of
from gmsnet.methods.auto import Auto
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import improve_dihedrals
from gmsnet.run.mean_stage import improve_mean
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run
from gmsnet.run.state import State
from gmsnet.run.stop import NO_PROGRESS
from gmsnet.run.target_run import reach_target
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]

# Shares of the cells, and cells: of so many that miss a target, one of η or of dihedral angles, all are smoothed.
MANY, MANY_ANGLES, FEW = 0.15, 0.02, 100
SOME, FEWER = 0.02, 20  # the same where patches around them come first, and do not bring all to it
SMALL = 50_000  # free nodes: on meshes of so many, all are smoothed then for any cell, if that is worth it


def sweep(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps of the method over all free nodes; for a target, over patches around the cells that miss it."""
    return _to_target(state, options, executor) if options.target else _sweep_all(state, options, executor)


def _to_target(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Patches around the cells that miss the target; before or after them all cells, where these are many."""
    where = None if state.constraint is None else positions_on(state.constraint).copy()
    large = (MANY if options.target.dihedral is None else MANY_ANGLES, FEW)
    if isinstance(state.topology, Volume) and _miss_it(state, options, executor, *large):
        first = _at_large(state, options, executor)
        if first.stop_reason != NO_PROGRESS or _closer(first, state, options, executor):
            return first
        second = reach_target(_put_back(state, where), options, executor)
        return closer_one(second, first, options, executor)
    first = reach_target(state, options, executor)
    if first.stop_reason != NO_PROGRESS:
        return first
    many = _miss_it(state, options, executor, SOME, FEWER)
    if not many and not (_is_small(state, executor) and _miss_it(first, options, executor, 0.0, 0)):
        return first
    found = _all_moved(first, first, many, options, executor)
    if found.stop_reason == NO_PROGRESS and _is_small(state, executor) and _differ(state, first, executor):
        # patches may have led to where sweeps end worse: once more without them, as a method that knows of no sweep
        again = replace(state, history=found.history, smoother=options.smoother()).ended_as(found)
        found = _all_moved(_put_back(again, where), found, many, options, executor)
    return found


def _put_back(state: State, where: NDArray[Any] | None) -> State:
    """The state, its nodes on the facets and curves where they were: of those between two either may be found."""
    if where is not None and state.constraint is not None:
        positions_on(state.constraint)[:] = where
    return state


def _all_moved(start: State, other: State, many: bool, options: SmoothOptions, executor: Executor) -> State:
    """All free nodes moved from a state on; another one, if that is not closer, or few miss it and little is gained."""
    later = _at_large(_going_on(start), options, executor)
    if not many and not _is_worth_it(later, other, options, executor):
        return _back_to(other, later)
    return closer_one(later, other, options, executor)


def _differ(state: State, other: State, executor: Executor) -> bool:
    """Are nodes of one state elsewhere in another?"""
    return bool(executor.total(np.array(np.count_nonzero(state.points != other.points))))


def closer_one(state: State, other: State, options: SmoothOptions, executor: Executor) -> State:
    """The one that is closer to the target, the other one if neither is; ended from outside if the first one is."""
    return state if _closer(state, other, options, executor) else _back_to(other, state)


def _back_to(state: State, later: State) -> State:
    """The state, ended from outside if a later one was, which is given up."""
    if state.constraint is not None:  # it has followed the nodes of the later one
        relocate(state.constraint, state.points)
    return state.ended_as(later)


def _is_small(state: State, executor: Executor) -> bool:
    """Has the mesh so few free nodes that all of them are smoothed for one cell?"""
    return int(executor.total(np.array(len(state.topology.free)))) <= SMALL


def _is_worth_it(state: State, other: State, options: SmoothOptions, executor: Executor) -> bool:
    """Have all nodes been moved for much: half of the cells that miss the target elsewhere, or a share of all?"""
    one, two = (rank_to_target(each, options, executor) for each in (state, other))
    cells = executor.cell_count(state.topology.changeable)
    return one.inverted <= two.inverted and much_fewer(one.missed, two.missed, cells)


def much_fewer(missed: int, before: int, cells: int) -> bool:
    """Is half of the cells that missed a target gone, or a share of all cells?"""
    return before - missed >= min(before / 2, SOME * cells)


def _closer(state: State, other: State, options: SmoothOptions, executor: Executor) -> bool:
    """Is a state closer to the target than another one?"""
    return rank_to_target(state, options, executor) < rank_to_target(other, options, executor)


def _miss_it(state: State, options: SmoothOptions, executor: Executor, share: float, few: int) -> bool:
    """Do more than so many of the cells that ``auto`` smooths miss the target?"""
    if not isinstance(state.smoother, Auto) or not executor.total(np.array(len(state.topology.free))):
        return False
    count = executor.cell_count(state.topology.changeable)
    return missing_in(state.topology, state.points, options, executor) > max(share * count, few)


def missing_in(topology: Topology | Volume, points: Floats, options: SmoothOptions, executor: Executor) -> int:
    """How many of the cells that can change miss the target. executor: for this topology."""
    cells, target = topology.changeable, options.target
    if isinstance(cells, Tetrahedra):
        rows, _ = target.tetrahedra_missing(points, cells)
    else:
        rows = target.corners_missing(points, cells)
        if cells.cells is not None:  # one of each cell
            rows = rows[np.diff(cells.cells[rows], prepend=-1) != 0]
    flags = np.zeros(len(cells.rows), dtype=bool)
    flags[rows] = True
    return executor.counted(flags)


def _at_large(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Sweeps over all free nodes, without a target, then patches; with the stage of the mean between, where that is
    closer to the target."""
    plain = options.without_target
    swept = _sweep_all(state, plain, executor)
    if swept.cut_short:
        return swept
    all_of_it = improve_dihedrals(swept, plain, executor)
    found = reach_target(_going_on(all_of_it), options, executor)
    if found.stop_reason != NO_PROGRESS or not isinstance(state.topology, Volume):
        return found
    raised = improve_mean(all_of_it, plain, executor)
    if raised is all_of_it or not _closer(raised, found, options, executor):
        return found if raised.interruption is None else found.interrupted(raised.interruption)
    return closer_one(reach_target(_going_on(raised), options, executor), raised, options, executor)


def _going_on(state: State) -> State:
    """The state, if it ended for want of progress, as one that has not ended."""
    return replace(state, stop_reason="") if state.stop_reason == NO_PROGRESS else state


def rank_to_target(state: State, options: SmoothOptions, executor: Executor) -> Nearness:
    """Of two states that of the lesser rank is closer to the target."""
    totals = totals_of(state.points, state.topology.scored, executor)
    missing = missing_in(state.topology, state.points, options, executor)
    inverted, worst = (0, math.inf) if totals is None else (totals.inverted, totals.shape_min)
    return Nearness.of(options.target, inverted, missing, worst, totals)


def _sweep_all(state: State, options: SmoothOptions, executor: Executor) -> State:
    run = Run(state.run_start(options.best_by), state.smoother, options, executor)
    stop_reason = run.to_the_end()
    totals = None if state.metric is not None else run.best_score.totals  # those are in the metric
    swept = replace(state, points=run.best, totals=totals, history=tuple(run.history))
    if isinstance(state.topology, Volume):  # elsewhere nobody asks, and the points would be kept for nothing
        floor = run.field.floor.first  # of the topology's cells: at the level of stars there is none
        swept = replace(swept, floor=floor, floor_of=state.points)
    return swept.ended(stop_reason, run.interruption)
