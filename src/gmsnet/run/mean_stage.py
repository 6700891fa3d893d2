"""After the dihedral angles of a volume the mean η, for which nothing of the least η nor of the least angle goes."""

from __future__ import annotations

from gmsnet.kernels.star.guard import LEVELS, STAR
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.dihedral import WIDE, below, most_shape_below, worst
from gmsnet.measure.totals import totals_of
from gmsnet.methods.base import Field
from gmsnet.methods.mean_in_space import MeanInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import floor_for_angles, totals_at_end, with_sweep
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.topology.volume import Volume

# Shares of the η above which no cell has so small an angle as the smallest: the first with which no angle falls below
# that is taken, as with the last of them none can.
SHARES = (0.94, 1.0)
GAIN = 1e-4  # in the mean η: with less the mesh stays as it was


def improve_mean(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the mean η larger where ``auto`` has ended of itself; a mesh with inverted cells stays.

    No cell falls below an η so large that its angles are not the smallest.
    """
    totals, level = totals_at_end(state, options, executor), LEVELS.index(options.guard)
    if totals is None or level == STAR:
        return state
    topology = state.topology
    assert isinstance(topology, Volume)
    least = float(worst(state.points, topology.scored, 1, WIDE, executor).measure[0])
    for share in SHARES:
        shape = max(share * min(most_shape_below(least, WIDE), 1.0), totals.shape_min)
        smoother = MeanInSpace(floor_for_angles(state, level, shape, executor))
        field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
        if isinstance(state.constraint, Surface):
            locate3(state.constraint, field.points)
        tally = smoother.sweep(field, executor, lambda: False)
        if not len(below(field.points, topology.scored, least * (1.0 - 1e-9), WIDE, executor).rows):
            break
    after = totals_of(field.points, topology.scored, executor)
    assert after is not None
    if after.shape_mean < totals.shape_mean + GAIN or after.shape_min < totals.shape_min - 1e-12 or after.uncertain:
        return state
    return with_sweep(state, options, field.points, after, smoother.phase, tally)
