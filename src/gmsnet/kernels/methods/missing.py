"""Which triangles miss a target: a minimum 1/q, and the tangent of a minimum angle (0: none)."""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.measures import shape_of

ALL = (math.inf, 0.0)  # what each triangle misses


@inlined
def missing(px, py, qx, qy, quality, tangent):
    """Does the triangle with these two sides miss a minimum 1/q, or the tangent of a minimum angle (0: none)?

    Its smallest angle is where the product of two sides is largest.
    """
    corner = px * qx + py * qy
    most = max(corner, max(px * px + py * py - corner, qx * qx + qy * qy - corner))
    area = px * qy - py * qx
    wide = tangent == 0.0 or (area > 0.0 and area >= tangent * most)
    return not (wide and shape_of(px, py, qx, qy) >= quality)


@part
def any_missing(ring, n, x, y, quality, tangent):
    """Does a triangle around the node at (x, y) miss the target? ring: x and y of each ring node."""
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        if missing(ax, ay, bx, by, quality, tangent):
            return True
        ax, ay = bx, by
    return False
