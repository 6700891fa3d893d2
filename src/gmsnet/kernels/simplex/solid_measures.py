"""Measures of volumes of several kinds of cells: a cell is as good as its worst corner, and valid everywhere or not."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.jacobian3 import solid_workspace
from gmsnet.kernels.simplex.mean_ratio3 import (
    HEXAHEDRON,
    TINY,
    WEDGE,
    WEIGHTS3,
    determinant,
    measured_as,
    same_cell3,
    shape_of,
    square,
    weights_at,
)  # fmt: skip
from gmsnet.kernels.simplex.orientation3 import SHEWCHUK, determinant_and_bound, spokes_of
from gmsnet.kernels.simplex.predicates import UNDERFLOW
from gmsnet.kernels.simplex.slack3 import slack_of
from gmsnet.kernels.simplex.tetra_measures import COARSE, COUNT, FINE, INVERTED, MINIMUM, UNCERTAIN
from gmsnet.kernels.simplex.validity3 import certified_solid

MOST = 8  # corners of a cell, which hexahedra alone have
SHORTEST = 1e-80  # of S over the largest of a cell: its cube is a normal number
CUBE = float(WEIGHTS3[HEXAHEDRON, 0])
PLAIN = 1e-12  # of the cube of the largest component: far more than what rounding adds up to
SAME = 1e-12  # ratios that differ by less may be in another order than the roots of what they are made of


@inlined
def corner3(points, simplices, t):
    """D and S of a corner simplex, and whether a rounding error may have made D positive."""
    ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, simplices.rows, t)
    value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, 0.0)
    weights, sign = weights_at(simplices.shapes, t), np.float64(simplices.orientation[t])
    _, lengths, _, _, _, _, _, _ = measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights)
    return sign * value, lengths, not sign * value > bound


@part
def worst_corner(points, simplices, t, corners):
    """η of the worst corner of the cell whose corner simplices begin at t, whether one is in doubt, whether the cell is
    plainly valid, and where its simplices end.

    corners: (MOST, 3) to work with.
    """
    doubtful, plain, count, cell = False, False, 1, simplices.cells[t]
    while same_cell3(simplices.cells, t, t + count):
        count += 1
    if count == MOST:
        doubtful, plain = corners_of_hexahedron(points, simplices.solids.nodes[cell], corners)
    else:
        for k in range(count):
            corners[k, 0], corners[k, 1], uncertain = corner3(points, simplices, t + k)
            doubtful = doubtful or uncertain
    return least_shape(corners, count), doubtful, plain, t + count


@part
def least_shape(corners, count):
    """The least η of corners with these D and S. Cube roots are drawn only of those that may be the worst by D²/S³."""
    largest, least = TINY, np.inf
    for k in range(count):
        largest = max(largest, corners[k, 1])
    inverse = 1.0 / largest
    scale = inverse * math.sqrt(inverse)
    for k in range(count):
        double, lengths = corners[k, 0] * scale, max(corners[k, 1] * inverse, SHORTEST)
        corners[k, 2] = double * abs(double) / (lengths * lengths * lengths)
        least = min(least, corners[k, 2])
    bound, shape = least + SAME * abs(least), np.inf
    for k in range(count):
        if not corners[k, 2] > bound:
            shape = min(shape, shape_of(corners[k, 0], corners[k, 1]))
    return shape if shape < np.inf else np.nan


@inlined
def edge(points, i, j):
    """From node i to node j: the vector, its squared length by the weight of a cube, and its largest component."""
    x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    return x, y, z, square(x, y, z) * CUBE, max(max(abs(x), abs(y)), abs(z))


@inlined
def corner_of_edges(a, b, c, one, two, three):
    """D and S of a corner whose spokes run along these edges (1.0) or against them (−1.0)."""
    double = determinant(
        one * a[0], one * a[1], one * a[2], two * b[0], two * b[1], two * b[2], three * c[0], three * c[1], three * c[2]
    )
    return double, (a[3] + b[3]) + c[3]


@part
def corners_of_hexahedron(points, nodes, corners):
    """D and S of all corners, from twelve edges; the bits are those of ``corner3``.

    Returns whether a D is in doubt, and whether the cell is plainly valid: see ``spread``.
    """
    a, b, c, d = nodes[0], nodes[1], nodes[2], nodes[3]
    e, f, g, h = nodes[4], nodes[5], nodes[6], nodes[7]
    u0, u1, u2, u3 = edge(points, a, b), edge(points, d, c), edge(points, e, f), edge(points, h, g)
    v0, v1, v2, v3 = edge(points, a, d), edge(points, b, c), edge(points, e, h), edge(points, f, g)
    w0, w1, w2, w3 = edge(points, a, e), edge(points, b, f), edge(points, c, g), edge(points, d, h)
    corners[0, 0], corners[0, 1] = corner_of_edges(u0, v0, w0, 1.0, 1.0, 1.0)
    corners[1, 0], corners[1, 1] = corner_of_edges(v1, u0, w1, 1.0, -1.0, 1.0)
    corners[2, 0], corners[2, 1] = corner_of_edges(u1, v1, w2, -1.0, -1.0, 1.0)
    corners[3, 0], corners[3, 1] = corner_of_edges(v0, u1, w3, -1.0, 1.0, 1.0)
    corners[4, 0], corners[4, 1] = corner_of_edges(v2, u2, w0, 1.0, 1.0, -1.0)
    corners[5, 0], corners[5, 1] = corner_of_edges(u2, v3, w1, -1.0, 1.0, -1.0)
    corners[6, 0], corners[6, 1] = corner_of_edges(v3, u3, w2, -1.0, -1.0, -1.0)
    corners[7, 0], corners[7, 1] = corner_of_edges(u3, v2, w3, 1.0, -1.0, -1.0)
    largest = max(max(max(u0[4], u1[4]), max(u2[4], u3[4])), max(max(v0[4], v1[4]), max(v2[4], v3[4])))
    largest = max(largest, max(max(w0[4], w1[4]), max(w2[4], w3[4])))
    cubed = largest * largest * largest
    doubtful, bound = False, SHEWCHUK * (6.0 * cubed) + UNDERFLOW  # more than that of any corner
    for k in range(MOST):
        doubtful |= not corners[k, 0] > bound
    (p, u, du), (q, v, dv), (r, w, dw) = spread(u0, u1, u2, u3), spread(v0, v1, v2, v3), spread(w0, w1, w2, w3)
    volume = determinant(p[0], p[1], p[2], q[0], q[1], q[2], r[0], r[1], r[2])
    return doubtful, volume - ((u + du) * (v + dv) * (w + dw) - u * v * w) > PLAIN * cubed


@inlined
def spread(a, b, c, d):
    """The mean of four edges along one axis, its length, and how far the edges are from it at most.

    The columns of the Jacobian matrix are such means, with weights. So det J differs from the determinant of the three
    even means by (u + du)(v + dv)(w + dw) − u·v·w at most.
    """
    x, y, z = 0.25 * (a[0] + b[0] + c[0] + d[0]), 0.25 * (a[1] + b[1] + c[1] + d[1]), 0.25 * (a[2] + b[2] + c[2] + d[2])
    one, two = square(a[0] - x, a[1] - y, a[2] - z), square(b[0] - x, b[1] - y, b[2] - z)
    three, four = square(c[0] - x, c[1] - y, c[2] - z), square(d[0] - x, d[1] - y, d[2] - z)
    return (x, y, z), math.sqrt(square(x, y, z)), math.sqrt(max(max(one, two), max(three, four)))


@part
def certainly_valid(points, solids, cell, unit, grain, moved, x, y, z, work):
    """Is a cell, whose corner simplices are positive, certified to be valid everywhere? See ``certified_solid``."""
    kind = solids.kind[cell]
    if kind != HEXAHEDRON and kind != WEDGE:
        return True
    if slack_of(points, solids.nodes[cell], kind == HEXAHEDRON, unit, grain, moved, x, y, z, work) >= 0.0:
        return True
    form = solids.hexahedron if kind == HEXAHEDRON else solids.wedge
    return certified_solid(points, solids.nodes[cell], form, 1.0, unit, grain, moved, x, y, z, work)


@kernel
def summarise_solids(points, simplices, first, last, coarse, fine):
    """As tetra_measures.summarise_tetrahedra, over the cells whose first corner simplex is in the blocks first…last.

    Inverted are those with a corner that is, and those that are not certified to be valid between their corners.
    """
    out = np.zeros(6)
    out[MINIMUM] = np.inf
    rows, work, solids, corners = len(simplices.rows), solid_workspace(), simplices.solids, np.empty((MOST, 3))
    t, end = first * LANES, min(last * LANES, rows)
    while 0 < t < rows and same_cell3(simplices.cells, t - 1, t):  # a cell that another part has begun
        t += 1
    while t < end:
        here = t
        shape, doubtful, plain, t = worst_corner(points, simplices, t, corners)
        invalid = shape <= 0.0
        if not doubtful and not plain:
            cell = simplices.cells[here]
            doubtful = not certainly_valid(points, solids, cell, 0.0, 0.0, -1, 0.0, 0.0, 0.0, work)
            invalid = doubtful
        high = (shape + coarse) - coarse
        out[COARSE] += high
        out[FINE] += ((shape - high) + fine) - fine
        out[MINIMUM] = min(out[MINIMUM], shape)
        out[INVERTED] += 1.0 if invalid else 0.0
        out[UNCERTAIN] += 1.0 if doubtful else 0.0
        out[COUNT] += 1.0
    return out
