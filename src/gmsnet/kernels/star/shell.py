"""Stars of surfaces in space: how they are gathered, and which moves are allowed.

The star of a node v has the corner simplices (v, a, b) of its cells, as in the plane (kernels.star.pattern). With the
spokes a and b and c = a × b, a triangle has D = |c|, and the L of kernels.simplex.mean_ratio2, of edges in space: so
1/q = 2√3·D/L is the geometric one. At the corners of a quad D = c·m with the unit normal m of its diagonals as they
are, since a quad need not be plane.

D does not tell on which side a simplex shows. So each has a *side*: a vector n that is taken once, from the reference
(constraints/shell.py). A simplex is *upright* if c·n > 0. A move is allowed if after it each simplex of the star

- is certified upright: c·n exceeds its error bound; and
- is certified above its floor φ, or above 0: D − φL exceeds its error bound; and
- does not lean further from the reference's normal at the place where the node comes to lie than LEAN, or than before.

In float64, with coordinates known up to ±δ and the components of spokes up to m, a component of a spoke is off by
e = u·m + 2δ, one of c by 4me + 2e² + 6u·m². So D is off by less than 18u·m² + 14mδ and its own rounding, 14u·m²; c·n,
with |n| ≤ 1 + 2⁻²⁰, by as much; L is at most 18m² (of a quad's corner 6√3m²), off by 36me + 12e² + 144u·m², and φ is at
most 1/(2√3). In all that is less than 256·m(u·m + δ) = E. Of a quad, let m be of its edges and diagonals, too. The
product d of the diagonals is off by less than E/2, and so their unit normal by E/|d|: D by |c|E/|d| more.
What is proven of the levels in the plane (docs/guarantees.md) holds of D and L here word for word.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, kernel
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE, same_cell, weights_at_first
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import LARGEST, WITH_FLOORS
from gmsnet.kernels.star.pattern import Patterns, count_of, other_of, pair_of, weights_of

LEAN = 0.5  # the cosine of the angle up to which a triangle may lean
ROUNDING = 256.0
ROOT_3 = math.sqrt(3.0)


class ShellStars(NamedTuple):
    """The stars of a surface, in the order in which they are visited.

    node: (F,) the free nodes, colour after colour. start (N + 1,), around: the nodes around each; first: (N + 1,) where
    its simplices begin in side (M, 3). most: the largest number of nodes or simplices of a star. pattern, patterns: as
    in kernels.star.pattern.Stars.
    """

    node: NDArray[np.int32]
    start: NDArray[np.int32 | np.int64]
    around: NDArray[np.int32]
    first: NDArray[np.int64]
    side: NDArray[np.float32]
    most: int
    pattern: NDArray[np.int32] | None = None
    patterns: Patterns | None = None


class ShellBlocks(NamedTuple):
    """The stars of a surface of triangles in blocks of LANES, and the same by node."""

    blocks: Blocks
    stars: ShellStars


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
def crossed(ax, ay, az, bx, by, bz):
    """a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inlined
def square(x, y, z):
    """The squared length."""
    return (x * x + y * y) + z * z


@inlined
def half_lengths3(ax, ay, az, bx, by, bz, weights):
    """N = L/2 of edges in space."""
    opposite = square(bx - ax, by - ay, bz - az)
    if weights is None:
        return 0.5 * ((square(ax, ay, az) + square(bx, by, bz)) + opposite)
    return weights.half * (
        (weights.a * square(ax, ay, az) + weights.b * square(bx, by, bz)) + weights.opposite * opposite
    )


@inlined
def largest6(ax, ay, az, bx, by, bz):
    """The largest component of two spokes, without its sign."""
    return max(max(max(abs(ax), abs(ay)), abs(az)), max(max(abs(bx), abs(by)), abs(bz)))


@inlined
def error_bound_of(m, delta):
    """See the module."""
    return ROUNDING * m * (UNIT * m + delta) + ROUNDING * delta * delta + UNDERFLOW


@inlined
def gather(points, stars, i, guard, star, floors):
    """The nodes around node i, three numbers each, into ``star``, the floor of each simplex into ``floors``.

    Returns how many nodes they are, and the largest coordinate.
    """
    start, around = stars.start, stars.around
    begin = start[i]
    n = start[i + 1] - begin
    reach = 0.0
    for j in range(n):
        k = np.uint32(around[begin + j])
        for axis in range(3):
            value = points[k, axis]
            star[3 * j + axis] = value
            reach = max(reach, abs(value))
    if len(guard) == WITH_FLOORS:
        for j in range(n):
            floors[j] = guard.floors[np.uint32(around[begin + j])]
        floors[n] = guard.floors[i]
    return n, reach


@inlined
def floor_of(guard, floors, n, i, j, other):
    """The floor of a simplex whose cell has these rows of the star."""
    floor = max(guard.floor, 0.0)
    if len(guard) == WITH_FLOORS:
        floor = max(max(floor, max(floors[i], floors[j])), max(floors[other], floors[n]))
    return floor


@inlined
def quad_rows(weights, i, j, other):
    """The rows of a, d and b of the quad (v, a, d, b) of a simplex with these weights (topology.links)."""
    if weights.opposite == 0.0:
        return i, other, j
    if weights.b == 0.0:
        return i, j, other
    return other, i, j


@inlined
def facing(cx, cy, cz, sx, sy, sz, tx, ty, tz, m, bound):
    """D of a quad's corner with the product c and the diagonals s and t, and its error bound, that of c given."""
    dx, dy, dz = crossed(sx, sy, sz, tx, ty, tz)
    area = math.sqrt(square(dx, dy, dz))
    if not area > 0.0:
        return 0.0, np.inf
    wide = max(1.0, (m / largest6(sx, sy, sz, tx, ty, tz)))
    double = ((cx * dx + cy * dy) + cz * dz) / area
    return double, bound * (1.0 + wide * math.sqrt(square(cx, cy, cz)) / area)


@inlined
def fourth_is_clear(star, a, d, b, x, y, z, delta, floor):
    """Is the corner opposite to the node of a quad certified above its floor? D of it hangs on the diagonals."""
    ax, ay, az = star[3 * b] - star[3 * d], star[3 * b + 1] - star[3 * d + 1], star[3 * b + 2] - star[3 * d + 2]
    bx, by, bz = star[3 * a] - star[3 * d], star[3 * a + 1] - star[3 * d + 1], star[3 * a + 2] - star[3 * d + 2]
    sx, sy, sz = x - star[3 * d], y - star[3 * d + 1], z - star[3 * d + 2]
    m = max(largest6(ax, ay, az, bx, by, bz), max(max(abs(sx), abs(sy)), abs(sz)))
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    double, bound = facing(
        cx, cy, cz, sx, sy, sz, bx - ax, by - ay, bz - az, m, error_bound_of(m, delta)
    )  # fmt: skip
    lengths = ROOT_3 * (square(ax, ay, az) + square(bx, by, bz))
    return double - floor * lengths > bound


@inlined
def allowed(star, n, pattern, stars, at, floors, guard, reach, x, y, z, was, normal):
    """May the free node go to (x, y, z)? Are all its simplices certified there?

    at: where the simplices of the node begin in ``stars.side``. was: (3,) where it is. normal: (3,) that of the
    reference at (x, y, z), zero where there is none.
    """
    reach = max(max(reach, abs(x)), max(abs(y), abs(z)))
    delta, side = guard.unit * reach + guard.grain, stars.side
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        other = other_of(pattern, k, i)
        ax, ay, az = star[3 * i] - x, star[3 * i + 1] - y, star[3 * i + 2] - z
        bx, by, bz = star[3 * j] - x, star[3 * j + 1] - y, star[3 * j + 2] - z
        cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
        bound = error_bound_of(largest6(ax, ay, az, bx, by, bz), delta)
        nx, ny, nz = side[at + k, 0], side[at + k, 1], side[at + k, 2]
        if not (cx * nx + cy * ny) + cz * nz > bound:
            return False
        double = math.sqrt(square(cx, cy, cz))
        weights, floor, of_length = weights_of(pattern, k, np.float64), floor_of(guard, floors, n, i, j, other), double
        lengths = 2.0 * half_lengths3(ax, ay, az, bx, by, bz, weights)
        if pattern is not None and weights.a * weights.b * weights.opposite == 0.0:
            a, d, b = quad_rows(weights, i, j, other)
            sx, sy, sz = star[3 * d] - x, star[3 * d + 1] - y, star[3 * d + 2] - z
            tx, ty, tz = star[3 * b] - star[3 * a], star[3 * b + 1] - star[3 * a + 1], star[3 * b + 2] - star[3 * a + 2]
            m = max(largest6(ax, ay, az, bx, by, bz), largest6(sx, sy, sz, tx, ty, tz))
            of_length, bound = facing(cx, cy, cz, sx, sy, sz, tx, ty, tz, m, error_bound_of(m, delta))
            if weights.opposite == 0.0 and not fourth_is_clear(star, a, d, b, x, y, z, delta, floor):
                return False
        if not of_length - floor * lengths > bound:
            return False
        upright = (cx * normal[0] + cy * normal[1]) + cz * normal[2]
        if upright < LEAN * double and (normal[0] != 0.0 or normal[1] != 0.0 or normal[2] != 0.0):
            ax, ay, az = star[3 * i] - was[0], star[3 * i + 1] - was[1], star[3 * i + 2] - was[2]
            bx, by, bz = star[3 * j] - was[0], star[3 * j + 1] - was[1], star[3 * j + 2] - was[2]
            cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
            before = (cx * normal[0] + cy * normal[1]) + cz * normal[2]
            if upright * math.sqrt(square(cx, cy, cz)) < before * double:
                return False
    return True


@inlined
def spokes_of(points, rows, t, forth):
    """From node 0 of row t to its other two, in the order in which it is read."""
    v, a, b = rows[t, 0], rows[t, 1 if forth else 2], rows[t, 2 if forth else 1]
    x, y, z = points[v, 0], points[v, 1], points[v, 2]
    return (
        points[a, 0] - x, points[a, 1] - y, points[a, 2] - z, points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    )  # fmt: skip


@inlined
def double_of_row(points, rows, shapes, cells, t, cx, cy, cz):
    """D of row t, whose c is given, and how much wider its error bound is; all rows of a quad must be there."""
    if shapes is None or cells is None:
        return math.sqrt(square(cx, cy, cz)), 1.0
    if shapes[t] == SQUARE:
        first = t
        while first > 0 and cells[first - 1] == cells[t]:
            first -= 1
        p, q, s, r = rows[first, 0], rows[first, 1], rows[first, 2], rows[first + 2, 0]
        ax, ay, az = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1], points[r, 2] - points[p, 2]
        bx, by, bz = points[s, 0] - points[q, 0], points[s, 1] - points[q, 1], points[s, 2] - points[q, 2]
        return facing(cx, cy, cz, ax, ay, az, bx, by, bz, largest6(ax, ay, az, bx, by, bz), 1.0)
    return math.sqrt(square(cx, cy, cz)), 1.0


@inlined
def ratio_of_row(points, simplices, t, unit, grain):
    """The most that D/L of row t can be in exact arithmetic; 0 where it is not upright."""
    forth = simplices.orientation[t] > 0
    ax, ay, az, bx, by, bz = spokes_of(points, simplices.rows, t, forth)
    v, side = simplices.rows[t, 0], simplices.side
    m = largest6(ax, ay, az, bx, by, bz)
    reach = max(max(abs(points[v, 0]), abs(points[v, 1])), abs(points[v, 2])) + m
    bound = error_bound_of(m, unit * reach + grain)
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    if not (cx * side[t, 0] + cy * side[t, 1]) + cz * side[t, 2] > -bound:
        return 0.0
    lengths = 2.0 * half_lengths3(ax, ay, az, bx, by, bz, weights_at_first(simplices.shapes, t, forth)) - bound
    if not lengths > 0.0:
        return LARGEST
    double, wider = double_of_row(points, simplices.rows, simplices.shapes, simplices.cells, t, cx, cy, cz)
    return min(max(double + 4.0 * wider * bound, 0.0) / lengths * (1.0 + 16.0 * UNIT), LARGEST)


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
