"""Newton's method on Σq in float64 where the corners of all cells are all but alike: it brings grids back.

Sweeps in float32 end where nothing more is to be gained that they could tell from rounding, at 0.001 of an edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.descent3 import sweep3
from gmsnet.kernels.simplex.objectives3 import Aim3, Q
from gmsnet.kernels.star.guard import WORST, plain_guard
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.measure.dihedral import ratios_of
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume

ALIKE = 1.03  # times the median of 432·η⁻³: else sweeps go on for little
FEW = 1000  # free nodes: of more the passes take longer than all else
SURE = 1e-12
PASSES, STILL = 60, 1e-9  # and of the mesh's extent: what no node moves by in the last one


class ToTheEnd(Smoother):
    """One sweep is all passes; none where corners are not alike, or nodes are many."""

    def sweep(self, field: Field, executor: Executor, test: object) -> Tally:
        """See Smoother."""
        tally = np.zeros(3, dtype=np.int64)
        topology = field.topology
        assert isinstance(topology, MixedVolume)
        if executor.total(np.array(len(topology.free))) > FEW:
            return tally
        ratios = _of_all(ratios_of(field.points, topology.changeable, executor), executor)
        if not len(ratios) or ratios.max() > ALIKE * float(np.median(ratios)):
            return tally
        guard, stars, start = field.guard(executor), topology.stars, field.points.copy()
        if field.level == WORST:  # no proof that a cell is above the worst one is had where all are alike: see below
            guard = plain_guard(field.precision, field.constraint)
        places = field.points[:, :3]
        low = executor.minimum(places.min(axis=0, initial=np.inf))
        extent = float((-executor.minimum(-places.max(axis=0, initial=-np.inf)) - low).max())

        def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
            sweep3(field.points, blocks, first, last, guard, Aim3(Q), 1, np.empty(0), counts)

        for _ in range(PASSES):
            before = field.points.copy()
            tally += over_stars(visit, stars, field.points, executor)
            farthest = float(np.abs(field.points - before).max(initial=0.0))
            if -executor.minimum(-farthest) <= STILL * extent:
                break
        if field.level == WORST and not self._gained(field, topology, float(ratios.max()), executor):
            field.points[:] = start
            tally[:] = 0
        return tally

    def _gained(self, field: Field, topology: MixedVolume, before: float, executor: Executor) -> bool:
        """Is the worst corner better, by more than rounding? What is known of the points is forgotten, if not."""
        worst = float(ratios_of(field.points, topology.changeable, executor).max(initial=-np.inf))
        gained = -executor.minimum(-worst) < (1.0 - SURE) * before
        if not gained:
            topology.forget_slack()
        return gained


def _of_all(values: NDArray[np.float64], executor: Executor) -> NDArray[np.float64]:
    """Those of all rows of ``changeable`` of the whole mesh. values: of those that are here."""
    rows = executor.every(1, len(values))
    return executor.in_order(executor.row_numbers(rows), values[rows])
