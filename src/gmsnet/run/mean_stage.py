"""The mean η of volumes of any kinds last, sweep by sweep: no cell falls below the least η.

Volumes of tetrahedra alone have their mean before: the last phase of ``auto`` there (methods/above.py). Where that has
lost much of the mean that there was before the worst cells had their turns, as where most cells are at the boundary,
a little of what the least η has gained is given for it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.barrier3 import Power3
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LEVELS, STAR
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods.auto import Auto
from gmsnet.methods.base import Field, Tally
from gmsnet.methods.floor import floor_of
from gmsnet.methods.mean_in_space import MeanInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import totals_at_end, with_sweep
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.topology.volume import Volume

GAIN = 1e-4  # in the mean η: with less the mesh stays as it was
SWEEPS = 8  # at most
LOST, GIVEN = 0.004, (0.98, 0.96)  # of the mean η of tetrahedra; shares of the least η, in turn, that are kept
LONG, LITTLE = 40, 0.00002  # sweeps for that at most, and what one must gain
SHARES = (1.0, 0.98, 0.95, 0.9)  # of the least η, in turn, where the mean has fallen by more than LOSS
LOSS = 0.001


def improve_mean(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the mean η larger where ``auto`` has ended of itself on a volume of other cells than tetrahedra alone.

    Where a valid mesh has lost more than LOSS of its mean, some of what the least has gained is given for it, if that
    brings it back. A mesh with inverted cells stays.
    """
    totals = totals_at_end(state, options, executor, mixed=True)
    topology = state.rest or state.topology
    if totals is None or LEVELS.index(options.guard) == STAR:
        return state
    assert isinstance(topology, Volume)
    outer, executor = executor, executor.of(topology)
    first = _totals_at_first(state, topology, executor)
    wanted = first.shape_mean - LOSS if not state.before.inverted else -math.inf
    tried = list[tuple[float, NDArray[np.float64], Totals, Tally]]()
    for share in SHARES:
        shape = max(share * totals.shape_min, min(first.shape_min, totals.shape_min))
        smoother = MeanInSpace(floor_of(shape))
        points, after, tally = _raised(state, topology, totals, smoother, options, executor, SWEEPS, GAIN)
        tried = [*tried[:1], (shape, points, after, tally)]
        if after.shape_mean >= wanted:
            break
    else:  # nothing brings it back
        shape, points, after, tally = tried[0]
    if after.shape_mean < totals.shape_mean + GAIN or after.shape_min < shape - 1e-12 or after.uncertain:
        return state
    return with_sweep(state, options, points, after, MeanInSpace.phase, tally, executor=outer)


def _totals_at_first(state: State, topology: Volume, executor: Executor) -> Totals:
    """Of the input, of the cells of a topology by which meshes are compared."""
    of, first = state.first or (None, None)
    found = first if of is topology else totals_of(state.start, topology.scored, executor)
    assert found is not None
    return found


def return_mean(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the mean η of tetrahedra larger, for a little of the least, where ``auto`` has lost more than LOST of it.

    No cell falls below the worst of the input, nor below GIVEN times the least η.
    """
    totals = None if state.rest else totals_at_end(state, options, executor)
    if totals is None or LEVELS.index(options.guard) == STAR:
        return state
    assert isinstance(state.smoother, Auto)
    assert isinstance(state.topology, Volume)
    lost = state.smoother.lost - LOST
    if lost <= 0.0:
        return state
    executor, outer = executor.of(state.topology), executor
    first = _totals_at_first(state, state.topology, executor)
    best: tuple[NDArray[np.float64], Totals, Tally] | None = None
    for share in GIVEN:
        shape = max(share * totals.shape_min, min(first.shape_min, totals.shape_min))
        smoother = MeanInSpace(floor_of(shape), Power3.above(shape, 5, 0.03), 1.6)
        found = _raised(state, state.topology, totals, smoother, options, executor, LONG, LITTLE)
        after = found[1]
        if after.uncertain or after.shape_min < shape - 1e-12 or after.shape_mean < totals.shape_mean + GAIN:
            break
        best = found
        if after.shape_mean >= totals.shape_mean + lost:
            break
    return state if best is None else with_sweep(state, options, *best[:2], MeanInSpace.phase, best[2], executor=outer)


def _raised(
    state: State,
    topology: Volume,
    totals: Totals,
    smoother: MeanInSpace,
    options: SmoothOptions,
    executor: Executor,
    sweeps: int,
    gain: float,
) -> tuple[NDArray[np.float64], Totals, Tally]:
    """Points after sweeps for the mean, their totals, and what moved. gain: what a sweep must bring for another."""
    level = LEVELS.index(options.guard)
    field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
    if isinstance(state.constraint, Surface):
        locate3(state.constraint, field.points)
    tally, after = np.zeros(3, dtype=np.int64), totals
    for _ in range(sweeps):
        mean = after.shape_mean
        found = smoother.sweep(field, executor, lambda: False)
        tally += found
        if not found[MOVED]:
            break
        measured = totals_of(field.points, topology.scored, executor)
        assert measured is not None
        after = measured
        if after.shape_mean < mean + gain:
            break
    return field.points, after, tally
