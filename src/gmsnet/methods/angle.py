"""Angle-based smoothing, averaged. The formula stands in kernels/methods/angle.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import angle as kernels
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother, Tally


class AngleBased(StarSmoother):
    """Each node turned onto the bisectors of the angles at its neighbours, on average."""

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        kernels.sweep(points, blocks, first, last, guard, tally)


METHOD = Method(
    name="angle",
    summary="to the mean of the places where the node would halve the angles at its neighbours",
    source="Zhou, Shimada: An angle-based approach to two-dimensional mesh smoothing (2000)",
    create=lambda options: AngleBased(),
    cells=TRIANGLES,
)
