"""After the dihedral angles of a volume the mean η, for which nothing of the least η nor of the least angle goes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import LEVELS, STAR
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.dihedral import WIDE, below, most_shape_below, worst
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods.base import Field, Tally
from gmsnet.methods.mean_in_space import MeanInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import floor_of, totals_at_end, with_sweep
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.volume import Volume

# Shares of the η above which no cell has so small an angle as the smallest. With less than all of it angles rarely fall
# below that; where one does, as on large meshes, all of it is taken.
SHARES, LARGE = (0.94, 1.0), 50_000  # free nodes
ROUNDING = 1e-6  # relative, of a floor above the least η
GAIN = 1e-4  # in the mean η: with less the mesh stays as it was
MIXED_SWEEPS = 8  # at most, over cells of other kinds: there are no angles to mind
MIXED_SHARES = (1.0, 0.98, 0.95, 0.9)  # of the least η, in turn, where the mean has fallen by more than LOSS
LOSS = 0.001


def improve_mean(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the mean η larger where ``auto`` has ended of itself; a mesh with inverted cells stays.

    No cell falls below an η so large that its angles are not the smallest.
    """
    level = LEVELS.index(options.guard)
    if level != STAR and isinstance(state.topology, MixedVolume):
        return _of_mixed(state, options, executor)
    totals = totals_at_end(state, options, executor)
    if totals is None or level == STAR:
        return state
    topology = state.rest or state.topology
    assert isinstance(topology, Volume)
    outer, executor = executor, executor.of(topology)
    least = worst(state.points, topology.changeable, 1, WIDE, executor).least
    for share in SHARES if executor.total(np.array(len(topology.free))) <= LARGE else SHARES[-1:]:
        shape = max(share * min(most_shape_below(least, WIDE), 1.0), totals.shape_min * (1.0 + ROUNDING))
        field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
        if isinstance(state.constraint, Surface):
            locate3(state.constraint, field.points)
        smoother = MeanInSpace(floor_of(shape))
        tally = smoother.sweep(field, executor, lambda: False)
        if share == SHARES[-1] or below(field.points, topology.changeable, least, WIDE, executor).least == math.inf:
            break
    after = totals_of(field.points, topology.scored, executor)
    assert after is not None
    if after.shape_mean < totals.shape_mean + GAIN or after.shape_min < totals.shape_min - 1e-12 or after.uncertain:
        return state
    return with_sweep(state, options, field.points, after, smoother.phase, tally, executor=outer)


def _of_mixed(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The same of volumes of any kinds, sweep by sweep: no cell falls below the least η.

    Where a valid mesh has lost more than LOSS of its mean, some of what the least has gained is given for it.
    """
    totals = totals_at_end(state, options, executor, mixed=True)
    topology = state.rest or state.topology
    if totals is None:
        return state
    assert isinstance(topology, Volume)
    outer, executor = executor, executor.of(topology)
    first = totals_of(state.start, topology.scored, executor)
    assert first is not None
    wanted = first.shape_mean - LOSS if not state.before.inverted else -math.inf
    for share in MIXED_SHARES:
        shape = max(share * totals.shape_min, min(first.shape_min, totals.shape_min))
        points, after, tally = _raised(state, topology, totals, shape, options, executor)
        if after.shape_mean >= wanted:
            break
    if after.shape_mean < totals.shape_mean + GAIN or after.shape_min < shape - 1e-12 or after.uncertain:
        return state
    return with_sweep(state, options, points, after, MeanInSpace.phase, tally, executor=outer)


def _raised(
    state: State, topology: Volume, totals: Totals, shape: float, options: SmoothOptions, executor: Executor
) -> tuple[NDArray[np.float64], Totals, Tally]:
    """Points after sweeps for the mean that leave no cell below an η, their totals, and what moved."""
    level = LEVELS.index(options.guard)
    field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
    if isinstance(state.constraint, Surface):
        locate3(state.constraint, field.points)
    smoother, tally, after = MeanInSpace(floor_of(shape)), np.zeros(3, dtype=np.int64), totals
    for _ in range(MIXED_SWEEPS):
        mean = after.shape_mean
        tally += smoother.sweep(field, executor, lambda: False)
        measured = totals_of(field.points, topology.scored, executor)
        assert measured is not None
        after = measured
        if after.shape_mean < mean + GAIN:
            break
    return field.points, after, tally
