"""Which simplices miss a target: a minimum 1/q, and the tangent of a minimum angle (0: none)."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.mean_ratio2 import shape_of
from gmsnet.kernels.star.pattern import count_of, pair_of, weights_of

ALL = (math.inf, 0.0)  # what each simplex misses


@inlined
def largest_product(px, py, qx, qy, weights):
    """The largest product of two edges from a node of the simplex (0, p, q), where its smallest angle is.

    At a square corner the product of the two edges that count: only that angle is one of the cell's.
    """
    corner = px * qx + py * qy
    at_p, at_q = px * px + py * py - corner, qx * qx + qy * qy - corner
    if weights is not None:
        if weights.opposite == 0.0:
            return corner
        if weights.a == 0.0:
            return at_q
        if weights.b == 0.0:
            return at_p
    return max(corner, max(at_p, at_q))


@inlined
def missing(px, py, qx, qy, quality, tangent, weights):
    """Does the simplex with these two sides miss a minimum 1/q, or the tangent of a minimum angle (0: none)?"""
    area = px * qy - py * qx
    wide = tangent == 0.0 or (area > 0.0 and area >= tangent * largest_product(px, py, qx, qy, weights))
    return not (wide and shape_of(px, py, qx, qy, weights) >= quality)


@part
def any_missing(ring, n, pattern, x, y, quality, tangent):
    """Does a simplex of the node at (x, y) miss the target? ring: x and y of each node around."""
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, bx, by = ring[2 * i] - x, ring[2 * i + 1] - y, ring[2 * j] - x, ring[2 * j + 1] - y
        if missing(ax, ay, bx, by, quality, tangent, weights_of(pattern, k, np.float64)):
            return True
    return False
