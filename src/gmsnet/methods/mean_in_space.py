"""The mean η of a volume last: Newton steps on Σq^(3/16) over stars whose cells are all good, and stay so.

The sum of a low power is led by the many cells, that of q^(3/2) by the bad ones. No cell may fall below a floor, so
that no star with a cell below it moves: what the worst cells and the smallest angles have reached is kept.
"""

from __future__ import annotations

from collections.abc import Callable

from gmsnet.kernels.methods.barrier3 import Power3, sweep3
from gmsnet.kernels.star.guard import MeshGuard
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.volume import Volume

POWER = Power3.of(-4, trials=3)  # p = 3/16; stars with a cell below the floor refuse all
RELAXATION = 1.3  # ω, as of the barrier


class MeanInSpace(Smoother):
    """floor: of D/S^(3/2), in the place of the guard's. power, relaxation: of the steps."""

    phase = "mean of η"

    def __init__(self, floor: float, power: Power3 = POWER, relaxation: float = RELAXATION) -> None:
        self.floor, self.power, self.relaxation = floor, power, relaxation

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        assert isinstance(field.topology, Volume)
        if isinstance(field.topology, MixedVolume):
            field.topology.lend_slack(field)
        guard = MeshGuard(*field.precision, self.floor, field.constraint)

        def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
            sweep3(field.points, blocks, first, last, guard, self.power, self.relaxation, counts)

        return over_stars(visit, field.topology.stars, field.points, executor)
