"""The mean η of a volume with a wall: Newton steps on Σ[x/(1 + x) + w·(q/q_w)^P] over each star, x = q^(3/2).

The first term falls with η almost as the mean of η rises. The second one is nothing for cells that are better than the
wall, and steep for others: cells near the worst of the mesh go along the floor of the guard, which a power of q alone
runs against. So neither aim is in the other's way.

A wall at the worst cell leaves that where it is and brings the mean. One above it brings many bad cells together up to
it, which makes room for the worst.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.barrier3 import K3, Power3, sweep3
from gmsnet.kernels.star.block import Blocks, Visit
from gmsnet.kernels.star.guard import WORST, Guard
from gmsnet.methods.base import Field, StarSmoother, Tally
from gmsnet.methods.gains import low_shape, mean_shape
from gmsnet.parallel.executor import Executor

RELAXATION = 1.3  # ω, as of the barrier in space
MOST = 2.0  # times the least η: no wall is higher, lest its powers leave float32

# Where the worst cells are apart, by more than APART in η from where this share of all begins, the wall is that far
# below there from the first sweep on: what held nodes keep bad is no measure for the others.
FEW, APART, BELOW = 0.005, 1.3, 1.1


class Above(StarSmoother):
    """lift: where the wall is between the least η, 0, and the mean, 1. squarings: k of P = 3·2^k. weight: w.
    relaxation: ω of the steps.

    Where there are inverted cells, which have no wall, the steps are those of Σq^(3/2).
    """

    mean: float
    low: float | None = None
    floor: float | None = None

    def __init__(self, lift: float, squarings: int, weight: float, relaxation: float = RELAXATION) -> None:
        self.lift, self.squarings, self.weight, self.relaxation = lift, squarings, weight, relaxation

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        raise NotImplementedError

    def in_space(self, guard: Guard) -> Visit:
        """See StarSmoother."""
        return Visit(sweep3, (self._above(guard.floor if self.floor is None else self.floor), self.relaxation))

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        self.mean = mean_shape(field, executor) if self.lift else 0.0
        self.low = low_shape(field, FEW, executor) if self.low is None else self.low
        if field.level != WORST:  # else the guard knows it; a wall does not follow the worst cell downwards
            now = field.floor.of(field.points, field.topology, field.precision, executor)
            self.floor = now if self.floor is None else max(self.floor, now)
        return super().sweep(field, executor, test)

    def _above(self, floor: float) -> Power3:
        """floor: of D/S^(3/2), that of the worst cell."""
        if floor <= 0.0:
            return Power3.of(-1)
        least = (K3 * floor * floor) ** (1.0 / 3.0)
        wall = least + self.lift * max(self.mean - least, 0.0)
        if self.low is not None and self.low > APART * least:
            wall = max(wall, self.low / BELOW)
        return Power3.above(min(wall, MOST * least), self.squarings, self.weight)
