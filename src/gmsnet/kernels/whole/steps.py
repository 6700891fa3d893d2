"""Steps of all nodes of a mesh together: how far they may go, and whether the guard allows where they lead."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.untangle.cells import has_moved, row_of, surplus_over


@kernel
def largest_step(points, cells, direction):
    """The least share of the shifts ``direction`` (N, 2) at which a simplex has no area left; +∞ if none ever has.

    D is a quadratic function of the share.
    """
    least = np.inf
    for t in range(len(cells)):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        ux, uy = direction[j, 0] - direction[i, 0], direction[j, 1] - direction[i, 1]
        vx, vy = direction[k, 0] - direction[i, 0], direction[k, 1] - direction[i, 1]
        constant, linear, square = ax * by - ay * bx, ax * vy - ay * vx + ux * by - uy * bx, ux * vy - uy * vx
        discriminant = linear * linear - 4.0 * square * constant
        if not discriminant >= 0.0:
            continue
        root = math.sqrt(discriminant)
        twice = -(linear + root) if linear >= 0.0 else root - linear
        one, other = 0.5 * twice / square, 2.0 * constant / twice  # infinite or NaN where there is no such root
        if one > 0.0:
            least = min(least, one)
        if other > 0.0:
            least = min(least, other)
    return least


@kernel
def count_below(points, before, simplices, floor, unit, grain):
    """How many simplices with a node that has moved are not certified above a floor of D/L, which is not negative."""
    count = 0
    for t in range(len(simplices.rows)):
        a, b, c, weights = row_of(simplices, t)
        if has_moved(points, before, a, b, c):
            count += not surplus_over(points, a, b, c, unit, grain, floor, weights) > 0.0
    return count
