"""Measures of the cells of a surface in space: those of the plane, with the sign of the side that a cell shows.

A cell shows the other side where c·n ≤ 0 (kernels.star.shell): its 1/q is then negative.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel
from gmsnet.kernels.simplex import measures as triangles
from gmsnet.kernels.simplex.cell_measures import (
    COARSE,
    COUNT,
    FINE,
    HIGH,
    INVERTED,
    LOW,
    MINIMUM,
    SCALED_JACOBIAN,
    SHAPE,
    UNCERTAIN,
)
from gmsnet.kernels.simplex.mean_ratio2 import TINY, TWO_SQRT3, same_cell, weights_at_first
from gmsnet.kernels.star.shell import crossed, half_lengths3, square
from gmsnet.kernels.star.shell_simplices import double_of_row, spokes_of


@inlined
def shape_of_row(points, simplices, t):
    """1/q of row t."""
    forth = simplices.orientation[t] > 0
    ax, ay, az, bx, by, bz = spokes_of(points, simplices.rows, t, forth)
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    lengths = 2.0 * half_lengths3(ax, ay, az, bx, by, bz, weights_at_first(simplices.shapes, t, forth))
    double, _ = double_of_row(points, simplices.rows, simplices.shapes, simplices.cells, t, cx, cy, cz, 0.0, 0.0)
    shape = TWO_SQRT3 * double / max(lengths, TINY)
    shows = (cx * simplices.side[t, 0] + cy * simplices.side[t, 1]) + cz * simplices.side[t, 2]
    return shape if shows > 0.0 else -abs(shape)


@kernel
def shell_shapes(points, simplices, first, last, shape):
    """1/q of the simplices in the blocks first…last of LANES, into shape (S,)."""
    for t in range(first * LANES, min(last * LANES, len(simplices.rows))):
        shape[t] = shape_of_row(points, simplices, t)


@kernel
def shell_shapes_of(points, simplices, chosen, shape):
    """1/q of some of the simplices, into shape (len(chosen),)."""
    for k in range(len(chosen)):
        shape[k] = shape_of_row(points, simplices, chosen[k])


@kernel
def summarise_shell(points, simplices, first, last, coarse, fine):
    """As measures.summarise, of the triangles in the blocks first…last of LANES."""
    work = np.empty(triangles.ROWS * LANES)
    triangles.begin(work)
    for start in range(first * LANES, min(last * LANES, len(simplices.rows)), LANES):
        count = min(LANES, len(simplices.rows) - start)
        for lane in range(count):
            t = start + lane
            px, py, pz, qx, qy, qz = spokes_of(points, simplices.rows, t, simplices.orientation[t] > 0)
            cx, cy, cz = crossed(px, py, pz, qx, qy, qz)
            shows = (cx * simplices.side[t, 0] + cy * simplices.side[t, 1]) + cz * simplices.side[t, 2] > 0.0
            triangles.take_in_space(px, py, pz, qx, qy, qz, 1.0 if shows else -1.0, work, lane)
        for lane in range(count):
            low, high, shape, aspect = triangles.figures_in_space(work, lane)
            triangles.count_in(work, lane, low, high, shape, aspect, shape <= 0.0, coarse, fine)
    out = np.empty(triangles.FIGURES)
    triangles.total(work, out)
    return out


@kernel
def summarise_shell_cells(points, simplices, first, last, coarse, fine):
    """As cell_measures.summarise_cells, of the cells that begin in the blocks first…last of LANES."""
    out = np.zeros(6)
    out[MINIMUM] = np.inf
    rows = len(simplices.rows)
    t, end = first * LANES, min(last * LANES, rows)
    while 0 < t < rows and same_cell(simplices.cells, t - 1, t):  # a cell that another part has begun
        t += 1
    while t < end:
        shape, here = shape_of_row(points, simplices, t), t
        t += 1
        while same_cell(simplices.cells, here, t):
            shape = min(shape, shape_of_row(points, simplices, t))
            t += 1
        high = (shape + coarse) - coarse
        out[COARSE] += high
        out[FINE] += ((shape - high) + fine) - fine
        out[MINIMUM] = min(out[MINIMUM], shape)
        out[INVERTED] += 1.0 if shape <= 0.0 else 0.0
        out[UNCERTAIN] += 1.0 if shape <= 0.0 else 0.0
        out[COUNT] += 1.0
    return out


@kernel
def per_quad_in_space(points, quads, orientation, columns):
    """As cell_measures.per_quad, of points (N, 3); the normal of its diagonals says which corners are inverted."""
    for q in range(len(quads)):
        low, high, shape, scaled = 360.0, 0.0, np.inf, np.inf
        o, e = points[quads[q, 0]], points[quads[q, 1]]
        f, g = points[quads[q, 2]], points[quads[q, 3]]
        mx, my, mz = crossed(f[0] - o[0], f[1] - o[1], f[2] - o[2], g[0] - e[0], g[1] - e[1], g[2] - e[2])
        area = max(math.sqrt(square(mx, my, mz)), TINY)
        for k in range(4):
            v, after, before = points[quads[q, k]], points[quads[q, (k + 1) % 4]], points[quads[q, (k + 3) % 4]]
            ax, ay, az = after[0] - v[0], after[1] - v[1], after[2] - v[2]
            bx, by, bz = before[0] - v[0], before[1] - v[1], before[2] - v[2]
            cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
            d, dot = ((cx * mx + cy * my) + cz * mz) / area, (ax * bx + ay * by) + az * bz
            a2, b2 = square(ax, ay, az), square(bx, by, bz)
            angle = triangles.degrees(math.sqrt(square(cx, cy, cz)), dot)
            angle = 360.0 - angle if d < 0.0 else angle
            low, high = min(low, angle), max(high, angle)
            shape = min(shape, 2.0 * d / max(a2 + b2, TINY))
            scaled = min(scaled, d / max(math.sqrt(a2) * math.sqrt(b2), TINY))
        columns[LOW, q], columns[HIGH, q], columns[SHAPE, q], columns[SCALED_JACOBIAN, q] = low, high, shape, scaled
