"""The cells of a surface in space that miss a target."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL
from gmsnet.kernels.simplex.shell_measures import shape_of_row
from gmsnet.kernels.star.shell import crossed, square
from gmsnet.kernels.star.shell_simplices import spokes_of


@inlined
def narrow(double, dot, tangent):
    """Is the angle between two spokes with this product and cross product, at most 90°, smaller than asked for?"""
    return double < tangent * dot


@inlined
def is_triangle(shapes, t):
    """Does row t have three angles of its cell, and not the one at its corner?"""
    if shapes is None:
        return True
    return shapes[t] == EQUILATERAL


@kernel
def missed_on_surface(points, simplices, quality, tangent):
    """As kernels.methods.below.missed: the rows of corner simplices that miss it, or are not upright."""
    rows = np.empty(len(simplices.rows), dtype=np.int32)
    found = 0
    for t in range(len(rows)):
        shape = shape_of_row(points, simplices, t)
        short = not (shape > 0.0 and shape >= quality)
        if not short and tangent > 0.0:
            ax, ay, az, bx, by, bz = spokes_of(points, simplices.rows, t, simplices.orientation[t] > 0)
            cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
            double, dot = math.sqrt(square(cx, cy, cz)), (ax * bx + ay * by) + az * bz
            short = narrow(double, dot, tangent)
            if is_triangle(simplices.shapes, t):
                short |= narrow(double, square(ax, ay, az) - dot, tangent)
                short |= narrow(double, square(bx, by, bz) - dot, tangent)
        rows[found] = t
        found += short
    return rows[:found].copy()
