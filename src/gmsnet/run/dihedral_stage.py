"""The last stage of ``auto`` on tetrahedra: the smallest dihedral angles, for which a little of the least η may go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gmsnet.kernels.star.guard import LEVELS, VALID
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.dihedral import REGULAR, Floats
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods.auto import Auto
from gmsnet.methods.base import Field, Tally
from gmsnet.methods.dihedral import CYCLES, LARGE_CYCLES, Dihedral
from gmsnet.methods.floor import Floor, floor_of
from gmsnet.methods.phases import LARGE_VOLUME
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.run.stop import CALLBACK, NO_PROGRESS
from gmsnet.run.sweep import Sweep
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.volume import Volume

# By so much may the largest q = 1/η grow, at first, and once more if the least η was at least ROOM.
SPENT, ROOM = (0.015, 0.06), 0.5
GAIN = 0.005  # in the merit, each time: with less the mesh stays as it was
MEAN = 0.003  # of the mean η: with more of it lost the mesh stays, too


def improve_dihedrals(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the smallest dihedral angles larger where ``auto`` has ended of itself; a mesh with inverted cells stays.

    No q = 1/η becomes more than the largest one and what is SPENT, nor, but at the level ``valid``, than the largest of
    the input. The result is taken where the merit gains GAIN.
    """
    totals = totals_at_end(state, options, executor)
    if totals is None:
        return state
    topology, level = state.rest or state.topology, LEVELS.index(options.guard)
    assert isinstance(topology, Volume)
    outer, executor = executor, executor.of(topology)
    field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
    if isinstance(state.constraint, Surface):
        locate3(state.constraint, field.points)
    large = executor.total(np.array(len(topology.free))) > LARGE_VOLUME
    best, taken, smoother = state.points, totals, Dihedral(LARGE_CYCLES if large else CYCLES)
    tally: Tally = np.zeros(3, dtype=np.int64)
    for spent in SPENT if totals.shape_min >= ROOM else SPENT[:1]:
        smoother.floor = floor_for_angles(state, level, 1.0 / (1.0 / totals.shape_min + spent), outer)
        found = smoother.sweep(field, executor, lambda: False)
        after = totals_of(field.points, topology.scored, executor)
        assert after is not None
        gained = merit(after, smoother.after) - merit(taken, smoother.before)
        if gained < GAIN or after.uncertain or after.shape_mean < totals.shape_mean - MEAN:
            break
        best, taken, tally = field.points.copy(), after, tally + found
    if taken is totals:
        return state
    return with_sweep(state, options, best, taken, smoother.phase, tally, executor=outer)


def totals_at_end(state: State, options: SmoothOptions, executor: Executor, *, mixed: bool = False) -> Totals | None:
    """Those of a volume of tetrahedra, all valid, on which ``auto`` has ended of itself, without a target; or None. Of
    the rest, where cells are set aside.

    mixed: of one of other cells, too.
    """
    topology = state.rest or state.topology
    if not ended_of_itself(state, options) or isinstance(topology, MixedVolume) != mixed:
        return None
    totals = None if state.rest else state.totals
    totals = totals or totals_of(state.points, topology.scored, executor)
    return None if totals is None or totals.uncertain else totals


def ended_of_itself(state: State, options: SmoothOptions) -> bool:
    """Has ``auto`` ended on a volume because there was nothing to gain, without a target?"""
    ended = state.stop_reason == NO_PROGRESS and _sweeps(state) < options.max_sweeps
    return isinstance(state.topology, Volume) and isinstance(state.smoother, Auto) and ended and not options.target


def with_sweep(
    state: State, options: SmoothOptions, points: Floats, totals: Totals | None, phase: str, tally: Tally,
    sweeps: int = 1, executor: Executor = serial,
) -> State:  # fmt: skip
    """The state after sweeps to these points, recorded and told. totals: theirs, if they are known of all cells."""
    if totals is None or state.rest:
        totals = totals_of(points, state.topology.scored, executor)
        assert totals is not None
    moved, truncated, dropped = tally.tolist()
    sweep = Sweep(
        _sweeps(state) + sweeps, phase, moved, truncated, dropped, totals.inverted, totals.qhat, totals.shape_min,
        totals.shape_mean,
    )  # fmt: skip
    state = replace(state, points=points, totals=totals, history=(*state.history, sweep))
    stopped = options.callback is not None and options.callback(sweep)
    return state.ended(CALLBACK) if stopped else state


def _sweeps(state: State) -> int:
    return state.history[-1].index if state.history else 0


def floor_for_angles(state: State, level: int, shape: float, executor: Executor) -> float:
    """c of D/S^(3/2) for an η, or for the level of the guard to hold from the untangled input on, if that is more."""
    start, floor = state.start if state.untangled is None else state.untangled, floor_of(shape)
    if level == VALID:
        return floor
    known = state.floor if state.floor_of is start else None
    return max(floor, Floor().of(start, state.topology, state.precision, executor) if known is None else known)


def merit(totals: Totals, least: float) -> float:
    """The least η, the mean η, and the least measure of the dihedral angles over that of a regular tetrahedron."""
    return totals.shape_min + totals.shape_mean + least / REGULAR
