"""Newton sweeps on Σq^(3/2) over tetrahedra, some of which are so flat that float32 does not tell on which side.

The steps of kernels/methods/barrier3.py are found in float32, for which a cell of η below 10⁻⁴ has no volume. The stars
of the nodes of such cells descend on Σq in float64 after the first sweep, until none is left or none moves.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.kernels.methods.descent3 import sweep3
from gmsnet.kernels.methods.newton import STEPS
from gmsnet.kernels.simplex.objectives3 import Aim3, Q
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.dihedral import ratios_of
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import Field, Tally, over_stars
from gmsnet.methods.floor import floor_of
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.volume import Volume

FLAT = 1e-3  # an η
SWEEPS = 12  # at most
NO_SIZES = np.empty(0)


class OnQ(Barrier):
    """See the module."""

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        tally = super().sweep(field, executor, test)
        first = field.floor.first  # of D/S^(3/2), of the input; not known at all levels
        if self.sweeps == 1 and (first is None or first < floor_of(FLAT)):
            tally += unflattened(field, executor)
        return tally


def unflattened(field: Field, executor: Executor) -> Tally:
    """Descends over the stars of flat cells that are not inverted."""
    topology, tally = field.topology, np.zeros(3, dtype=np.int64)
    if not isinstance(topology, Volume) or isinstance(topology, MixedVolume):
        return tally
    cells = topology.changeable
    for _ in range(SWEEPS):
        ratios = ratios_of(field.points, cells, executor)
        nodes = sorted_unique(cells.rows[np.isfinite(ratios) & (ratios > K3 / FLAT**3)])
        nodes = nodes[topology.near_free[nodes]]
        if not executor.total(np.array(len(nodes))):
            break
        guard, stars = field.guard(executor), topology.stars_of(nodes.astype(np.int64))

        def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally, guard: object = guard) -> None:
            sweep3(field.points, blocks, first, last, guard, Aim3(Q), STEPS, NO_SIZES, counts)

        found = over_stars(visit, stars, field.points, executor)
        tally += found
        if not found[MOVED]:
            break
    return tally
