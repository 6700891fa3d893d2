"""Shape and size: each node goes to where its cells are good and as large as they were, by Newton steps.

The objective stands in kernels/methods/sized.py. WEIGHT says how much size counts beside shape.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import sized as kernels
from gmsnet.kernels.methods.bands import Bands, no_bands
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import Field, Method, StarSmoother, Tally
from gmsnet.parallel.executor import Executor
from gmsnet.topology.topology import Topology

WEIGHT = 4.0
BAND = 0.099  # a tenth, and room for the rounding of what is written


class Sized(StarSmoother):
    """Keeps the areas that the cells have when the first sweep begins. bands: areas that stay within hard bounds."""

    def __init__(self, weight: float = WEIGHT, bands: Bands | None = None) -> None:
        self.weight, self.bands = weight, bands or no_bands()
        self.topology: Topology | None = None
        self.wanted = kernels.Wanted(np.empty(0, dtype=np.int64), np.empty(0))

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if field.topology is not self.topology:
            self.topology = field.planar
            blocks = field.planar.stars.blocks
            assert isinstance(blocks, Blocks)
            self.wanted = room_for(blocks)
            kernels.targets(field.points, field.topology.near, blocks, self.wanted)
        return super().sweep(field, executor, test)

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        kernels.sweep(points, blocks, self.wanted, self.weight, self.bands, first, last, guard, tally)


def room_for(blocks: Blocks) -> kernels.Wanted:
    """For the targets of all simplices of the stars."""
    count = blocks.degree
    if blocks.patterns is not None and blocks.pattern is not None:
        count = np.diff(blocks.patterns.first)[blocks.pattern]
    first = np.zeros(len(count) + 1, dtype=np.int64)
    np.cumsum(LANES * count.astype(np.int64), out=first[1:])
    return kernels.Wanted(first[:-1], np.empty(first[-1]))


def banded(start: NDArray[np.float64], kept: NDArray[np.bool_]) -> Sized:
    """For cells whose areas are to stay: shape alone, with each area within BAND of what it is in ``start``.

    start: (N, 2) points in memory order. kept: (N,) bool, in memory order: cells all of whose corners are kept stay.
    """
    return Sized(0.0, Bands(np.ascontiguousarray(start), kept, BAND))


METHOD = Method(
    name="sized",
    summary="shape and size: to where the cells of the star are good and as large as they were",
    source="this package; Knupp: Algebraic mesh quality metrics (2001), the relative size metric",
    create=lambda options: Sized(),
    slides=True,
)
