"""The corner simplices of the cells of a surface, each with its side, and their floors (kernels.star.shell)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, kernel
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE, same_cell, weights_at_first
from gmsnet.kernels.simplex.predicates import UNIT
from gmsnet.kernels.star.guard import LARGEST
from gmsnet.kernels.star.shell import crossed, error_bound_of, facing, half_lengths3, largest6, square


class ShellSimplices(NamedTuple):
    """Corner simplices of the cells of a surface: see kernels.simplex.mean_ratio2.Simplices. side: (S, 3) their n."""

    rows: NDArray[np.int32]
    orientation: NDArray[np.int8]
    shapes: NDArray[np.uint8] | None
    cells: NDArray[np.int32] | None
    side: NDArray[np.float32]

    @property
    def cell_count(self) -> int:
        """How many cells they belong to."""
        if self.cells is None:
            return len(self.rows)
        return int(np.count_nonzero(np.diff(self.cells))) + (len(self.cells) > 0)

    def take(self, rows: NDArray[np.integer]) -> ShellSimplices:
        """Some of them."""
        shapes = None if self.shapes is None else self.shapes.take(rows)
        cells = None if self.cells is None else self.cells.take(rows)
        return ShellSimplices(
            self.rows.take(rows, axis=0), self.orientation.take(rows), shapes, cells, self.side.take(rows, axis=0)
        )


@inlined
def spokes_of(points, rows, t, forth):
    """From node 0 of row t to its other two, in the order in which it is read."""
    v, a, b = rows[t, 0], rows[t, 1 if forth else 2], rows[t, 2 if forth else 1]
    x, y, z = points[v, 0], points[v, 1], points[v, 2]
    return (
        points[a, 0] - x, points[a, 1] - y, points[a, 2] - z, points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    )  # fmt: skip


@inlined
def double_of_row(points, rows, shapes, cells, t, cx, cy, cz, m, delta):
    """D of row t, whose c is given, and its error bound; all rows of a quad must be there. m: of its spokes."""
    if shapes is None or cells is None:
        return math.sqrt(square(cx, cy, cz)), error_bound_of(m, delta)
    if shapes[t] == SQUARE:
        first = t
        while first > 0 and cells[first - 1] == cells[t]:
            first -= 1
        p, q, s, opposite = rows[first, 0], rows[first, 1], rows[first, 2], first + 2
        while rows[opposite, 0] == p or rows[opposite, 0] == q:  # rows of a rank may stand there twice
            opposite += 1
        r = rows[opposite, 0]
        ax, ay, az = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1], points[r, 2] - points[p, 2]
        bx, by, bz = points[s, 0] - points[q, 0], points[s, 1] - points[q, 1], points[s, 2] - points[q, 2]
        wide = max(m, largest6(ax, ay, az, bx, by, bz))
        return facing(cx, cy, cz, ax, ay, az, bx, by, bz, wide, error_bound_of(wide, delta))
    return math.sqrt(square(cx, cy, cz)), error_bound_of(m, delta)


@inlined
def ratio_of_row(points, simplices, t, unit, grain):
    """The most that D/L of row t can be in exact arithmetic; 0 where it is not upright."""
    forth = simplices.orientation[t] > 0
    ax, ay, az, bx, by, bz = spokes_of(points, simplices.rows, t, forth)
    v, side = simplices.rows[t, 0], simplices.side
    m = largest6(ax, ay, az, bx, by, bz)
    reach = max(max(abs(points[v, 0]), abs(points[v, 1])), abs(points[v, 2])) + m
    delta = unit * reach + grain
    bound = error_bound_of(m, delta)
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    if not (cx * side[t, 0] + cy * side[t, 1]) + cz * side[t, 2] > -bound:
        return 0.0
    lengths = 2.0 * half_lengths3(ax, ay, az, bx, by, bz, weights_at_first(simplices.shapes, t, forth))
    lengths -= 2.0 * bound
    if not lengths > 0.0:
        return LARGEST
    rows, shapes, cells = simplices.rows, simplices.shapes, simplices.cells
    double, bound = double_of_row(points, rows, shapes, cells, t, cx, cy, cz, m, delta)
    return min(max(double + bound, 0.0) / lengths * (1.0 + 16.0 * UNIT), LARGEST)


@kernel
def ratio_upper_bounds_of_shell(points, simplices, blocks, unit, grain, first, last, least):
    """As guard.ratio_upper_bounds: the minimum over each of the blocks of LANES simplices, into ``least``."""
    for number in range(first, last):
        start = blocks[number] * LANES
        ratio = np.inf
        for t in range(start, min(start + LANES, len(simplices.rows))):
            ratio = min(ratio, ratio_of_row(points, simplices, t, unit, grain))
        least[number] = ratio


@kernel
def star_floors_of_shell(points, simplices, ringed, unit, grain, floors):
    """As guard.star_floors."""
    rows = simplices.rows
    for i in range(len(floors)):
        floors[i] = np.inf if ringed[i] else -np.inf
    t = 0
    while t < len(rows):
        ratio, end = ratio_of_row(points, simplices, t, unit, grain), t + 1
        while same_cell(simplices.cells, t, end):
            ratio = min(ratio, ratio_of_row(points, simplices, end, unit, grain))
            end += 1
        for k in range(t, end):
            for corner in range(3):
                floors[rows[k, corner]] = min(floors[rows[k, corner]], ratio)
        t = end


@kernel
def list_sides(rows, orientation, side, start, around, pattern, patterns, begin, of_node, first, out):
    """Writes the side of each simplex of each star.

    rows (S, 3), orientation, side (S, 3): of all simplices. start, around, pattern, patterns: of the stars. begin
    (N + 1,), of_node: which rows each node is in. first: (N + 1,) where the simplices of each star begin in out (M, 3).
    Returns how many were not found.
    """
    missing = 0
    for i in range(len(start) - 1):
        count = first[i + 1] - first[i]
        n = start[i + 1] - start[i]
        for k in range(count):
            if patterns is None:
                a, b = (n - 1 if k == 0 else k - 1), k
            else:
                row = patterns.first[pattern[i]] + k
                a, b = patterns.pair[row, 0], patterns.pair[row, 1]
            p, q = around[start[i] + a], around[start[i] + b]
            found = False
            for at in range(begin[i], begin[i + 1]):
                t = of_node[at]
                u, v, w = rows[t, 0], rows[t, 1], rows[t, 2]
                if orientation[t] < 0:
                    v, w = w, v
                if (u == i and v == p and w == q) or (v == i and w == p and u == q) or (w == i and u == p and v == q):
                    for axis in range(3):
                        out[first[i] + k, axis] = side[t, axis]
                    found = True
                    break
            missing += not found
    return missing


@inlined
def side_of(simplices, t, points):
    """c·n of row t."""
    ax, ay, az, bx, by, bz = spokes_of(points, simplices.rows, t, simplices.orientation[t] > 0)
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    return (cx * simplices.side[t, 0] + cy * simplices.side[t, 1]) + cz * simplices.side[t, 2]


@kernel
def arrange_sides(blocks, first, side, out):
    """Writes the sides of the stars in blocks: see shell.ShellBlocks."""
    for block in range(len(blocks.degree)):
        begin = 3 * blocks.offset[block]
        for lane in range(LANES):
            at = first[blocks.centre[block * LANES + lane]]
            for k in range(blocks.degree[block]):
                for axis in range(3):
                    out[begin + (3 * k + axis) * LANES + lane] = side[at + k, axis]
