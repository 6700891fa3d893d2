"""Newton's method on Σq in float64 where the corners of all cells are all but alike: it brings grids back.

Sweeps in float32 end where nothing more is to be gained that they could tell from rounding, at 0.001 of an edge.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.methods.descent3 import sweep3
from gmsnet.kernels.simplex.objectives3 import Aim3, Q
from gmsnet.kernels.star.space import SpaceBlocks
from gmsnet.measure.dihedral import ratios_of
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

ALIKE = 1.03  # times the median of 432·η⁻³: else sweeps go on for little
PASSES, STILL = 60, 1e-9  # and of the mesh's extent: what no node moves by in the last one


class ToTheEnd(Smoother):
    """One sweep is all passes; none where corners are not alike."""

    def sweep(self, field: Field, executor: Executor, test: object) -> Tally:
        """See Smoother."""
        tally = np.zeros(3, dtype=np.int64)
        topology = field.topology
        assert isinstance(topology, Volume)
        ratios = ratios_of(field.points, topology.changeable, executor)
        if not len(ratios) or ratios.max() > ALIKE * float(np.median(ratios)):
            return tally
        guard, stars = field.guard(executor), field.topology.stars
        extent = float(np.ptp(field.points[:, :3], axis=0).max())

        def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
            sweep3(field.points, blocks, first, last, guard, Aim3(Q), 1, np.empty(0), counts)

        for _ in range(PASSES):
            before = field.points.copy()
            tally += over_stars(visit, stars, field.points, executor)
            if np.abs(field.points - before).max() <= STILL * extent:
                break
        return tally
