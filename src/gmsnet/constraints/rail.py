"""What nodes slide on as kernels have it, in a plane or in space, and where on it they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.constraint import Constraint, locate
from gmsnet.kernels.star.surface import Surface, locate3

Rail = Constraint | Surface


def positions_on(rail: Rail) -> NDArray[Any]:
    """(R,) where the nodes of its rows are, parameters of curves, or facets and pieces. Kernels change it in place."""
    return rail.parameter if isinstance(rail, Constraint) else rail.place


def relocate(rail: Rail, points: NDArray[np.float64]) -> None:
    """Writes anew where nodes are, of coordinates (N, …) in memory order."""
    (locate if isinstance(rail, Constraint) else locate3)(rail, points)
