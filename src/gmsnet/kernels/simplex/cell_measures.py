"""Measures of cells that are made of corner simplices: a cell is as good as its worst corner.

Of a quad with the edges e₁ and e₂ from a corner, D = e₁ × e₂ in the sense in which the cell is wound,

    1/q = 2D/(|e₁|² + |e₂|²)  (mean ratio),   D/(|e₁||e₂|)  (scaled Jacobian),

both least over its four corners, and the smallest and the largest of its four angles. An angle at a corner that is not
convex is above 180°. Knupp: Algebraic mesh quality metrics (2001).
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import TINY, same_cell, shape_of, weights_at_first
from gmsnet.kernels.simplex.measures import degrees
from gmsnet.kernels.simplex.predicates import SHEWCHUK, UNDERFLOW

# What ``summarise_cells`` says: the sum of 1/q on the coarse and on the fine grid, its minimum, how many cells are
# inverted and how many are not certainly positive at all corners, and how many cells there are.
COARSE, FINE, MINIMUM, INVERTED, UNCERTAIN, COUNT = range(6)
FIGURES = 6
# Columns of ``per_quad``.
LOW, HIGH, SHAPE, SCALED_JACOBIAN = range(4)


@inlined
def corner(points, simplices, t):
    """1/q of a corner simplex, and whether a rounding error may have made it positive."""
    rows = simplices.rows
    a, b, c = rows[t, 0], rows[t, 1], rows[t, 2]
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    left, right, sign = px * qy, py * qx, np.float64(simplices.orientation[t])
    uncertain = not sign * (left - right) > SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW
    return sign * shape_of(px, py, qx, qy, weights_at_first(simplices.shapes, t, True)), uncertain


@kernel
def summarise_cells(points, simplices, first, last, coarse, fine):
    """The figures named above over the cells whose first corner simplex is in the blocks first…last of LANES.

    coarse, fine: see ``measures.grids``; the sums of parts are exact in any order.
    """
    out = np.empty(FIGURES)
    summarise_cells_into(points, simplices, first, last, coarse, fine, out)
    return out


@part
def summarise_cells_into(points, simplices, first, last, coarse, fine, out):
    """The same into out (FIGURES,)."""
    for k in range(FIGURES):
        out[k] = np.inf if k == MINIMUM else 0.0
    rows = len(simplices.rows)
    t, end = first * LANES, min(last * LANES, rows)
    while 0 < t < rows and same_cell(simplices.cells, t - 1, t):  # a cell that another part has begun
        t += 1
    while t < end:
        shape, doubtful = corner(points, simplices, t)
        here = t
        t += 1
        while same_cell(simplices.cells, here, t):
            other, uncertain = corner(points, simplices, t)
            shape, doubtful = min(shape, other), doubtful or uncertain
            t += 1
        high = (shape + coarse) - coarse
        out[COARSE] += high
        out[FINE] += ((shape - high) + fine) - fine
        out[MINIMUM] = min(out[MINIMUM], shape)
        out[INVERTED] += 1.0 if shape <= 0.0 else 0.0
        out[UNCERTAIN] += 1.0 if doubtful else 0.0
        out[COUNT] += 1.0


@kernel
def per_quad(points, quads, orientation, columns):
    """LOW, HIGH, SHAPE and SCALED_JACOBIAN of each quad (Q, 4) into columns (4, Q); angles in degrees."""
    for q in range(len(quads)):
        low, high, shape, scaled = 360.0, 0.0, np.inf, np.inf
        for k in range(4):
            v, after, before = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
            ax, ay = points[after, 0] - points[v, 0], points[after, 1] - points[v, 1]
            bx, by = points[before, 0] - points[v, 0], points[before, 1] - points[v, 1]
            d, dot = np.float64(orientation[q]) * (ax * by - ay * bx), ax * bx + ay * by
            a2, b2 = ax * ax + ay * ay, bx * bx + by * by
            angle = degrees(abs(d), dot)
            angle = 360.0 - angle if d < 0.0 else angle
            low, high = min(low, angle), max(high, angle)
            shape = min(shape, 2.0 * d / max(a2 + b2, TINY))
            scaled = min(scaled, d / max(math.sqrt(a2) * math.sqrt(b2), TINY))
        columns[LOW, q], columns[HIGH, q], columns[SHAPE, q], columns[SCALED_JACOBIAN, q] = low, high, shape, scaled
