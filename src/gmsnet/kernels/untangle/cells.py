"""Of corner simplices of cells: which are certified, which are to be untangled, and what must not come of them.

A simplex is *certified* if its determinant exceeds the error bound of kernels.simplex.predicates with all coordinates
known up to ±δ, δ = unit·(its largest coordinate) + grain: then it is positive as it is written, too. A cell is
certified if all its corner simplices are. Simplices are those of kernels.simplex.mean_ratio2.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import lengths, same_cell, weights_at_first
from gmsnet.kernels.simplex.predicates import determinant_and_bound
from gmsnet.kernels.star.guard import margin_above, ratio_of


@part
def margin(points, a, b, c, unit, grain):
    """By how much the determinant of the simplex a, b, c exceeds its bound; positive: certified."""
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[c, 0], points[c, 1]
    reach = max(max(max(abs(ax), abs(ay)), max(abs(bx), abs(by))), max(abs(cx), abs(cy)))
    value, bound = determinant_and_bound(ax, ay, bx, by, cx, cy, unit * reach + grain)
    return value - bound


@inlined
def has_moved(points, before, a, b, c):
    """Is one of the nodes a, b and c elsewhere than before?"""
    moved = points[a, 0] != before[a, 0] or points[a, 1] != before[a, 1]
    moved = moved or points[b, 0] != before[b, 0] or points[b, 1] != before[b, 1]
    return moved or points[c, 0] != before[c, 0] or points[c, 1] != before[c, 1]


@inlined
def row_of(simplices, t):
    """The nodes of row t, counter-clockwise, its corner first, and its weights."""
    rows, forth = simplices.rows, simplices.orientation[t] > 0
    weights = weights_at_first(simplices.shapes, t, forth)
    return rows[t, 0], rows[t, 1 if forth else 2], rows[t, 2 if forth else 1], weights


@kernel
def find_bad(points, before, simplices, was_bad, unit, grain, bad):
    """Marks the simplices that are to be untangled: not certified, and was_bad or with a node that has moved.

    points, before: (N, 2), now and at first. was_bad, bad: (S,) bool. Returns how many.
    """
    count = 0
    for t in range(len(simplices.rows)):
        a, b, c, _ = row_of(simplices, t)
        bad[t] = was_bad[t] or has_moved(points, before, a, b, c)
        if bad[t]:
            bad[t] = not margin(points, a, b, c, unit, grain) > 0.0
            count += bad[t]
    return count


@kernel
def find_violated(points, before, simplices, was_bad, floor, unit, grain, violated):
    """Marks the simplices with a node that has moved which stand against taking the points.

    Those are the ones of cells that were positive that are not certified, and those of other cells that are not
    certified, and not certified above floor either, a D/L of at most 0 (L as in kernels.simplex.mean_ratio2). Returns
    how many cells have such simplices.
    """
    count, last = 0, -1
    for t in range(len(simplices.rows)):
        a, b, c, weights = row_of(simplices, t)
        violated[t] = has_moved(points, before, a, b, c)
        if not violated[t]:
            continue
        violated[t] = not margin(points, a, b, c, unit, grain) > 0.0
        if violated[t] and was_bad[t]:
            violated[t] = not surplus_over(points, a, b, c, unit, grain, floor, weights) > 0.0
        if violated[t]:
            count += last < 0 or not same_cell(simplices.cells, last, t)
            last = t
    return count


@kernel
def find_slivers(points, before, simplices, limit, slivers):
    """Marks the simplices with a node that has moved whose D/L is below a limit."""
    for t in range(len(simplices.rows)):
        a, b, c, weights = row_of(simplices, t)
        slivers[t] = has_moved(points, before, a, b, c) and share(points, a, b, c, weights) < limit


@part
def share(points, a, b, c, weights):
    """D/L of the simplex a, b, c, weights as seen from a; 0 where all its nodes are in one place."""
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    if weights is None:
        square = 2.0 * (px * px + py * py + qx * qx + qy * qy - px * qx - py * qy)
    else:
        square = lengths(px, py, qx, qy, weights)
    return (px * qy - py * qx) / square if square > 0.0 else 0.0


@part
def surplus_over(points, a, b, c, unit, grain, floor, weights):
    """By how much D of the simplex a, b, c exceeds floor·L and the bounds of both; positive: certified above it."""
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    reach = max(abs(points[a, 0]), abs(points[a, 1])) + ((abs(px) + abs(py)) + (abs(qx) + abs(qy)))
    return margin_above(px, py, qx, qy, unit * reach + grain, floor, weights)


@kernel
def least_ratio(points, simplices, unit, grain):
    """The minimum that a bound of D/L from above is over the simplices (kernels.star.guard); 1/q is 2√3 times that."""
    least = np.inf
    for t in range(len(simplices.rows)):
        a, b, c, weights = row_of(simplices, t)
        least = min(least, ratio_of(points, b, c, a, unit, grain, weights))
    return least
