"""The last stage of ``auto`` on volumes: the smallest dihedral angles, for which a little of the least η may go."""

from __future__ import annotations

import math
from dataclasses import replace

from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.kernels.star.guard import LEVELS, VALID
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.dihedral import REGULAR, WIDE, Floats, worst
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods.auto import Auto
from gmsnet.methods.base import Field, Tally
from gmsnet.methods.dihedral import Dihedral
from gmsnet.methods.floor import Floor
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.run.stop import CALLBACK, NO_PROGRESS
from gmsnet.run.sweep import Sweep
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.volume import Volume

SPENT = 0.06  # by so much may the largest q = 1/η grow
GAIN = 0.005  # in the merit: with less the mesh stays as it was


def improve_dihedrals(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the smallest dihedral angles larger where ``auto`` has ended of itself; a mesh with inverted cells stays.

    No q = 1/η becomes more than the largest one and SPENT, nor, but at the level ``valid``, than the largest of the
    input. The result is taken where the merit gains GAIN.
    """
    totals = totals_at_end(state, options, executor)
    if totals is None:
        return state
    topology = state.topology
    assert isinstance(topology, Volume)
    level = LEVELS.index(options.guard)
    floor = floor_for_angles(state, level, 1.0 / (1.0 / totals.shape_min + SPENT), executor)
    field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
    if isinstance(state.constraint, Surface):
        locate3(state.constraint, field.points)
    smoother = Dihedral(floor=floor)
    tally = smoother.sweep(field, executor, lambda: False)
    after = totals_of(field.points, topology.scored, executor)
    assert after is not None
    least = worst(field.points, topology.changeable, 1, WIDE, executor).least
    gained = merit(after, least) - merit(totals, smoother.least)
    if gained < GAIN or after.uncertain:
        return state
    return with_sweep(state, options, field.points, after, smoother.phase, tally)


def totals_at_end(state: State, options: SmoothOptions, executor: Executor, *, mixed: bool = False) -> Totals | None:
    """Those of a volume of tetrahedra, all valid, on which ``auto`` has ended of itself, without a target; or None.

    mixed: of one of other cells, too.
    """
    topology, auto = state.topology, isinstance(state.smoother, Auto)
    ended = state.stop_reason == NO_PROGRESS and _sweeps(state) < options.max_sweeps
    if not (isinstance(topology, Volume) and auto and ended) or options.target:
        return None
    if isinstance(topology, MixedVolume) != mixed:
        return None
    totals = state.totals or totals_of(state.points, topology.scored, executor)
    return None if totals is None or totals.uncertain else totals


def with_sweep(state: State, options: SmoothOptions, points: Floats, totals: Totals, phase: str, tally: Tally) -> State:
    """The state after a sweep to these points, recorded and told."""
    moved, truncated, dropped = tally.tolist()
    sweep = Sweep(
        _sweeps(state) + 1, phase, moved, truncated, dropped, totals.inverted, totals.qhat, totals.shape_min,
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
    return floor if level == VALID else max(floor, Floor().of(start, state.topology, state.precision, executor))


def floor_of(shape: float) -> float:
    """c of D/S^(3/2) for an η."""
    return math.sqrt(shape**3 / K3)


def merit(totals: Totals, least: float) -> float:
    """The least η, the mean η, and the least measure of the dihedral angles over that of a regular tetrahedron."""
    return totals.shape_min + totals.shape_mean + least / REGULAR
