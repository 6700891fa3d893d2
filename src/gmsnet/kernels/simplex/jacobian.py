"""Is the Jacobian determinant of a second-order planar cell positive everywhere? Proofs in floating point.

The coefficients of kernels.simplex.bernstein are computed from the nodes relative to the first one, e_i = p_i − p_0.
Write δ for how far a coordinate may be off (see kernels.simplex.predicates), u = 2⁻⁵³, s for the largest |e_i| along an
axis, and w for the sum of the absolute weights of two control points: 6 (triangle6), 10 (quad8), 12 (quad9).

1. A difference of control points is a sum of nodes with weights of at most w together. Each node goes through at most
   8 roundings, 10 where middles are those of a first-order cell's edges. So it is off by at most η = w (δ + 16·u·s)
   along that axis, 1.6 times the rounding to first order or more.
2. Let a and b be the largest |U| and |V| along an axis. A cross product is then off by at most
   (a_x + b_x) η_y + (a_y + b_y) η_x + 2 η_x η_y and, for its own rounding, 3u (a_x b_y + a_y b_x).
3. A coefficient is 4 times a mean of cross products with positive weights, and so is each coefficient on a part of the
   cell. Sums, weights and 7 halvings of the cell are at most 53 further roundings of no more than a_x b_y + a_y b_x.

The bound is B = 4 (9/8 (…) + 128·u (a_x b_y + a_y b_x)) with the data's part (…) of step 2. The surplus covers the
rounding of the bound itself. Signs that B certifies are those of every reading of the coordinates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.bernstein import (
    COEFFICIENTS,
    CORNER_COEFFICIENTS,
    CORNERS,
    NODES,
    QUAD9,
    WIDEST,
    coefficients_of_quad,
    coefficients_of_triangle,
    differences_of_quad,
    differences_of_triangle,
    split_quad,
    split_triangle,
    straighten_edges,
)
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT, determinant_and_bound

DEPTH = 7  # a cell is cut into quarters at most so many times
STACK = 3 * DEPTH + 4  # parts that wait at once, at maximum
WEIGHTS = (6.0, 10.0, 12.0, 6.0, 10.0)  # w by kind
DATA, ROUNDING = 4.5, 512.0 * UNIT
TOLERANCE = 2.0**-8  # of a lower bound, in units of the largest coefficient


class CellWorkspace(NamedTuple):
    """The arrays in which one cell is judged. nodes: relative to the first one."""

    nodes: NDArray[np.float64]
    control: NDArray[np.float64]
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    whole: NDArray[np.float64]
    halves: NDArray[np.float64]
    stack: NDArray[np.float64]
    depth: NDArray[np.int64]


@part
def cell_workspace():
    """For cells of all kinds."""
    return CellWorkspace(
        np.zeros((WIDEST, 2)), np.empty((WIDEST, 2)), np.empty((6, 2)), np.empty((6, 2)), np.zeros(16), np.empty(16),
        np.empty((2, 16)), np.empty((STACK, 16)), np.empty(STACK, dtype=np.int64),
    )  # fmt: skip


@inlined
def gather_cell(points, cell, kind, work):
    """The nodes of a cell, relative to its first one, into the workspace; returns its largest coordinate."""
    x, y, reach = points[cell[0], 0], points[cell[0], 1], 0.0
    for k in range(NODES[kind]):
        px, py = points[cell[k], 0], points[cell[k], 1]
        work.nodes[k, 0], work.nodes[k, 1] = px - x, py - y
        reach = max(reach, max(abs(px), abs(py)))
    if NODES[kind] == CORNERS[kind]:
        straighten_edges(work.nodes, CORNERS[kind])
    return reach


@inlined
def expand(kind, delta, work):
    """Coefficients of det J of the gathered cell, into the workspace; returns their error bound B."""
    if CORNERS[kind] == 3:
        count = 3
        differences_of_triangle(work.nodes, work.control, work.first, work.second)
        coefficients_of_triangle(work.first, work.second, work.coefficients)
    else:
        count = 6
        differences_of_quad(work.nodes, kind == QUAD9, work.control, work.first, work.second)
        coefficients_of_quad(work.first, work.second, work.coefficients)
    sx, sy, ax, ay, bx, by = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    no_number = 0.0  # becomes one where a coordinate is none: max() would pass over it
    for k in range(NODES[kind]):
        no_number += 0.0 * (work.nodes[k, 0] + work.nodes[k, 1])
        sx, sy = max(sx, abs(work.nodes[k, 0])), max(sy, abs(work.nodes[k, 1]))
    for k in range(count):
        ax, ay = max(ax, abs(work.first[k, 0])), max(ay, abs(work.first[k, 1]))
        bx, by = max(bx, abs(work.second[k, 0])), max(by, abs(work.second[k, 1]))
    ex = WEIGHTS[kind] * (delta + 16.0 * UNIT * sx)
    ey = WEIGHTS[kind] * (delta + 16.0 * UNIT * sy)
    data = (ax + bx) * ey + (ay + by) * ex + 2.0 * ex * ey
    return DATA * data + ROUNDING * (ax * by + ay * bx) + UNDERFLOW + no_number


@inlined
def smallest(kind, coefficients):
    """The smallest coefficient, and the smallest that is a value of det J at a corner."""
    least, at_corner = coefficients[0], coefficients[0]
    for k in range(1, COEFFICIENTS[kind]):
        least = min(least, coefficients[k])
    for k in range(1, 4):
        at_corner = min(at_corner, coefficients[CORNER_COEFFICIENTS[kind][k]])
    return least, at_corner


@part
def start_parts(kind, work):
    """Puts the whole cell on the stack."""
    work.depth[0] = 0
    for k in range(COEFFICIENTS[kind]):
        work.stack[0, k] = work.coefficients[k]


@part
def replace_by_quarters(kind, top, work):
    """The part below ``top`` on the stack gives way to its quarters; returns the new top."""
    deeper = work.depth[top - 1] + 1
    for k in range(COEFFICIENTS[kind]):
        work.whole[k] = work.stack[top - 1, k]
    if CORNERS[kind] == 3:
        split_triangle(work.whole, work.stack, top - 1)
    else:
        split_quad(work.whole, work.stack, top - 1, work.halves)
    for k in range(4):
        work.depth[top - 1 + k] = deeper
    return top + 3


@inlined
def sign_everywhere(kind, bound, work):
    """+1: det J is certainly positive everywhere in the cell. −1: it certainly is not. 0: undecided.

    The cell's coefficients stand in the workspace, with their error bound. A value that cannot be told from zero ends
    the search: the cell cannot be certified any more.
    """
    least, _ = smallest(kind, work.coefficients)
    if least > bound:  # as in most cells
        return 1
    return sign_of_parts(kind, bound, work)


@part
def sign_of_parts(kind, bound, work):
    """``sign_everywhere`` by cutting the cell into quarters."""
    start_parts(kind, work)
    top = 1
    while top > 0:
        least, at_corner = smallest(kind, work.stack[top - 1])
        if at_corner < -bound:
            return -1
        if least > bound:
            top -= 1
        elif not at_corner > bound or work.depth[top - 1] == DEPTH:
            return 0
        else:
            top = replace_by_quarters(kind, top, work)
    return 1


@part
def minimum_bound(kind, bound, work):
    """What det J is certainly not below anywhere in the cell, sharp to TOLERANCE or as DEPTH allows.

    It is positive where ``sign_everywhere`` is.
    """
    start_parts(kind, work)
    largest = 0.0
    for k in range(COEFFICIENTS[kind]):
        largest = max(largest, abs(work.coefficients[k]))
    top, lower, upper = 1, np.inf, np.inf
    while top > 0:
        least, at_corner = smallest(kind, work.stack[top - 1])
        upper = min(upper, at_corner)
        sharp = least >= upper - TOLERANCE * largest and (least > bound or not upper > bound)
        if sharp or work.depth[top - 1] == DEPTH:
            lower = min(lower, least)
            top -= 1
        else:
            top = replace_by_quarters(kind, top, work)
    return lower - bound


@inlined
def straight_sign(kind, delta, work):
    """The sign of the cell with straight edges: +1 if the determinants at its corners are certainly positive, −1 if
    one certainly is negative, 0 if that is undecided."""
    nodes, corners, sign, size = work.nodes, CORNERS[kind], 1, 0.0
    for k in range(corners):
        size = max(size, max(abs(nodes[k, 0]), abs(nodes[k, 1])))
    for k in range(1 if corners == 3 else 4):
        after, last = k + 1 if k + 1 < corners else 0, k - 1 if k > 0 else corners - 1
        value, bound = determinant_and_bound(
            nodes[after, 0], nodes[after, 1], nodes[last, 0], nodes[last, 1], nodes[k, 0], nodes[k, 1],
            delta + UNIT * size,
        )  # fmt: skip
        if value < -bound:
            return -1
        if not value > bound:
            sign = 0
    return sign


@part
def straight_mean(kind, work):
    """The mean of det J over the cell with straight edges: a quad's area, twice a triangle's."""
    nodes = work.nodes
    if CORNERS[kind] == 3:
        return abs(nodes[1, 0] * nodes[2, 1] - nodes[1, 1] * nodes[2, 0])
    across_x, across_y = nodes[3, 0] - nodes[1, 0], nodes[3, 1] - nodes[1, 1]
    return 0.5 * abs(nodes[2, 0] * across_y - nodes[2, 1] * across_x)


@part
def quality_of(kind, bound, work):
    """The lower bound of det J over the mean of its size in the cell with straight edges (Johnen et al. 2013).

    1 for a parallelogram or a triangle with straight edges, not above 0 where the cell is not certainly valid, −inf
    where the cell with straight edges has no area.
    """
    mean = straight_mean(kind, work)
    return minimum_bound(kind, bound, work) / mean if mean > 0.0 else -np.inf


@kernel
def judge_cells(points, cells, kinds, unit, grain, first, last, sign, quality):
    """``sign_everywhere`` and ``quality_of`` of the cells first…last, into ``sign`` and ``quality`` (C,).

    points: (N, 2). cells: (C, 9), counter-clockwise. kinds: (C,). unit, grain: see kernels.star.guard.Precision.
    """
    work = cell_workspace()
    for c in range(first, last):
        kind = kinds[c]
        delta = unit * gather_cell(points, cells[c], kind, work) + grain
        bound = expand(kind, delta, work)
        sign[c] = sign_everywhere(kind, bound, work)
        quality[c] = quality_of(kind, bound, work)


@kernel
def straight_signs(points, cells, kinds, unit, grain, sign):
    """``straight_sign`` of each cell, into ``sign`` (C,). Arguments: see ``judge_cells``."""
    work = cell_workspace()
    for c in range(len(cells)):
        delta = unit * gather_cell(points, cells[c], kinds[c], work) + grain
        sign[c] = straight_sign(kinds[c], delta, work)
