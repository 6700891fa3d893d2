"""Centroidal patch triangulation: equation 1 with centroids in the place of circumcentres (kernels/methods/cvt.py).

The centroid of a triangle holds a third of the node itself, so this is the ``area`` variant of the Laplacian with two
thirds of its shift.
"""

from __future__ import annotations

from gmsnet.kernels.methods import cvt as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother


class Centroids(StarSmoother):
    """Each node to the centroid of its star."""

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (False,))


METHOD = Method(
    name="cpt",
    summary="to the centroid of the star: the mean of the triangles' centroids, weighted by their areas",
    source="Chen, Holst: Efficient mesh optimization schemes based on optimal Delaunay triangulations (2011)",
    create=lambda options: Centroids(),
    cells=TRIANGLES,
)
