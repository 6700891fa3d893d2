"""Centroidal patch triangulation: equation 1 with centroids in the place of circumcentres (kernels/methods/cvt.py).

The centroid of a triangle holds a third of the node itself, so this is the ``area`` variant of the Laplacian with two
thirds of its shift.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import cvt as kernels
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother, Tally


class Centroids(StarSmoother):
    """Each node to the centroid of its star."""

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        kernels.sweep(points, blocks, first, last, guard, False, tally)


METHOD = Method(
    name="cpt",
    summary="to the centroid of the star: the mean of the triangles' centroids, weighted by their areas",
    source="Chen, Holst: Efficient mesh optimization schemes based on optimal Delaunay triangulations (2011)",
    create=lambda options: Centroids(),
    cells=TRIANGLES,
)
