"""The paper's CVT smoothing: its equation 1, circumcentres weighted by areas (kernels/methods/cvt.py).

Elsewhere the formula goes by the name of optimal Delaunay triangulation (ODT) smoothing; the centroid of a Voronoi
region, from which CVT has its name, weights otherwise.
"""

from __future__ import annotations

from gmsnet.kernels.methods import cvt as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother


class Circumcentres(StarSmoother):
    """Each node to the mean of its triangles' circumcentres by area."""

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (True,))


METHOD = Method(
    name="cvt",
    summary="to the mean of the circumcentres of the triangles, weighted by their areas (also called ODT)",
    source="Chen: Mesh smoothing schemes based on optimal Delaunay triangulations (2004)",
    create=lambda options: Circumcentres(),
    cells=TRIANGLES,
)
