"""Measures of volumes of several kinds of cells: a cell is as good as its worst corner, and valid everywhere or not."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.jacobian3 import solid_workspace
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON, WEDGE, measured_as, same_cell3, shape_of, weights_at
from gmsnet.kernels.simplex.orientation3 import determinant_and_bound, spokes_of
from gmsnet.kernels.simplex.slack3 import slack_of
from gmsnet.kernels.simplex.tetra_measures import COARSE, COUNT, FINE, INVERTED, MINIMUM, UNCERTAIN
from gmsnet.kernels.simplex.validity3 import certified_solid


@inlined
def corner3(points, simplices, t):
    """η of a corner simplex, and whether a rounding error may have made it positive."""
    ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, simplices.rows, t)
    value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, 0.0)
    weights, sign = weights_at(simplices.shapes, t), np.float64(simplices.orientation[t])
    _, lengths, _, _, _, _, _, _ = measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights)
    return shape_of(sign * value, lengths), not sign * value > bound


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
    rows, work, solids = len(simplices.rows), solid_workspace(), simplices.solids
    t, end = first * LANES, min(last * LANES, rows)
    while 0 < t < rows and same_cell3(simplices.cells, t - 1, t):  # a cell that another part has begun
        t += 1
    while t < end:
        shape, doubtful = corner3(points, simplices, t)
        here = t
        t += 1
        while same_cell3(simplices.cells, here, t):
            other, uncertain = corner3(points, simplices, t)
            shape, doubtful = min(shape, other), doubtful or uncertain
            t += 1
        invalid = shape <= 0.0
        if not doubtful:
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
