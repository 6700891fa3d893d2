"""Angle-based smoothing, averaged. The formula stands in kernels/methods/angle.py."""

from __future__ import annotations

from gmsnet.kernels.methods import angle as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother


class AngleBased(StarSmoother):
    """Each node turned onto the bisectors of the angles at its neighbours, on average."""

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep)


METHOD = Method(
    name="angle",
    summary="to the mean of the places where the node would halve the angles at its neighbours",
    source="Zhou, Shimada: An angle-based approach to two-dimensional mesh smoothing (2000)",
    create=lambda options: AngleBased(),
    cells=TRIANGLES,
)
