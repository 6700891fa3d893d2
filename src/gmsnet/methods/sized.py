"""Shape and size: each node goes to where its cells are good and as large as they were, by Newton steps.

The objective stands in kernels/methods/sized.py. WEIGHT says how much size counts beside shape.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import sized as kernels
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import Field, Method, StarSmoother, Tally
from gmsnet.parallel.executor import Executor
from gmsnet.topology.topology import Topology

WEIGHT = 4.0


class Sized(StarSmoother):
    """Keeps the areas that the cells have when the first sweep begins.

    start: (N, 2) in memory order, points whose areas are kept instead.
    """

    shared_out = False
    start: NDArray[np.float64] | None = None

    def __init__(self, weight: float = WEIGHT) -> None:
        self.weight = weight
        self.topology: Topology | None = None
        self.wanted: kernels.Wanted = kernels.Wanted(np.empty(0, dtype=np.int64), np.empty(0))

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if field.topology is not self.topology:
            self.topology = field.planar
            blocks = field.planar.stars.blocks
            assert isinstance(blocks, Blocks)
            first, count = places_of(blocks)
            self.wanted = kernels.Wanted(first, np.empty(count))
            points = field.points if self.start is None else self.start
            kernels.targets(points, field.planar.near, blocks, self.wanted)
        return super().sweep(field, executor, test)

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        kernels.sweep(points, blocks, self.wanted, self.weight, first, last, guard, tally)


def places_of(blocks: Blocks) -> tuple[NDArray[np.int64], int]:
    """Where the simplices of each block of stars begin, [simplex][lane], and how many there are."""
    count = blocks.degree
    if blocks.patterns is not None and blocks.pattern is not None:
        count = np.diff(blocks.patterns.first)[blocks.pattern]
    first = np.zeros(len(count) + 1, dtype=np.int64)
    np.cumsum(LANES * count.astype(np.int64), out=first[1:])
    return first[:-1], int(first[-1])


METHOD = Method(
    name="sized",
    summary="shape and size: to where the cells of the star are good and as large as they were",
    source="this package; Knupp: Algebraic mesh quality metrics (2001), the relative size metric",
    create=lambda options: Sized(),
    slides=True,
)
