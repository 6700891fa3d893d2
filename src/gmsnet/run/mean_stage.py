"""After the dihedral angles of a volume the mean η, for which nothing of the least η nor of the least angle goes."""

from __future__ import annotations

from gmsnet.kernels.star.guard import LEVELS, STAR
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.dihedral import WIDE, below, most_shape_below, worst
from gmsnet.measure.totals import totals_of
from gmsnet.methods.base import Field
from gmsnet.methods.mean_in_space import MeanInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import floor_of, totals_at_end, with_sweep
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.topology.volume import Volume

# Shares of the η above which no cell has so small an angle as the smallest. With less than all of it angles rarely fall
# below that; where one does, as on large meshes, all of it is taken.
SHARES, LARGE = (0.94, 1.0), 50_000  # free nodes
ROUNDING = 1e-6  # relative, of a floor above the least η
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
    for share in SHARES if len(topology.free) <= LARGE else SHARES[-1:]:
        shape = max(share * min(most_shape_below(least, WIDE), 1.0), totals.shape_min * (1.0 + ROUNDING))
        field = Field(state.points.copy(), topology, state.precision, level, constraint=state.constraint)
        if isinstance(state.constraint, Surface):
            locate3(state.constraint, field.points)
        smoother = MeanInSpace(floor_of(shape))
        tally = smoother.sweep(field, executor, lambda: False)
        if share == SHARES[-1] or not len(below(field.points, topology.scored, least, WIDE, executor).rows):
            break
    after = totals_of(field.points, topology.scored, executor)
    assert after is not None
    if after.shape_mean < totals.shape_mean + GAIN or after.shape_min < totals.shape_min - 1e-12 or after.uncertain:
        return state
    return with_sweep(state, options, field.points, after, smoother.phase, tally)
