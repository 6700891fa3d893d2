"""Stars of surfaces in space: how they are gathered, and which moves are allowed.

The star of a node v has the corner simplices (v, a, b) of its cells, as in the plane (kernels.star.pattern). With the
spokes a and b and c = a × b, a triangle has D = |c|, and the L of kernels.simplex.mean_ratio2, of edges in space: so
1/q = 2√3·D/L is the geometric one. At the corners of a quad D = c·m with the unit normal m of its diagonals as they
are, since a quad need not be plane.

D does not tell on which side a simplex shows. So each has a *side*: a vector n that is taken once, from the reference
(constraints/shell.py). A simplex is *upright* if c·n > 0. A move is allowed if after it each simplex of the star

- is certified upright: c·n exceeds its error bound; and
- is certified turned by less than 60° from n: c·n − |c|/2 exceeds its error bound; or was not, and turns no more; and
- is certified above its floor φ, or above 0: D − φL exceeds its error bound; and
- does not lean further from the reference's normal at the place where the node comes to lie than LEAN, or than before.

In float64, with coordinates known up to ±δ and the components of spokes up to m, a component of a spoke is off by
e = u·m + 2δ, one of c by 4me + 2e² + 6u·m². So D is off by less than 18u·m² + 14mδ + 14δ² and its own rounding,
14u·m²; c·n, with |n| ≤ 1 + 2⁻²⁰, by as much; L is at most 18m² (of a quad's corner 6√3m²), off by 36me + 12e² +
144u·m², and φ is at most 1/(2√3). In all that is less than 84u·m² + 35mδ + 28δ², and less than
E = 256u·m² + 40mδ + 40δ². L is off by less than 2E. Of a quad, let m be of its edges and diagonals, too. The product d
of the diagonals is off by less than E/2, and so their unit normal by E/|d|: D by |c|E/|d| more.
What is proven of the levels in the plane (docs/guarantees.md) holds of D and L here word for word.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.pattern import Patterns, count_of, other_of, pair_of, weights_of

LEAN = 0.5  # the cosine of the angle up to which a simplex may lean from the reference
TURN = 0.5  # the cosine of the angle up to which it may turn from its side
ROUNDING, DATA = 256.0, 40.0  # of E
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
    """The stars of a surface of triangles in blocks of LANES, and the same by node. sides: their sides, those of a
    block from 3 times its offset on, [simplex][axis][lane]."""

    blocks: Blocks
    stars: ShellStars
    sides: NDArray[np.float32]


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
    return ROUNDING * UNIT * (m * m) + DATA * delta * (m + delta) + UNDERFLOW


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
def leans(star, i, j, was, normal, shows, double, cosine):
    """Does a simplex, with its c·n and |c| given, lean further from a normal n than with its node where it was, or did
    it lean there by less than the angle of this cosine?"""
    ax, ay, az = star[3 * i] - was[0], star[3 * i + 1] - was[1], star[3 * i + 2] - was[2]
    bx, by, bz = star[3 * j] - was[0], star[3 * j + 1] - was[1], star[3 * j + 2] - was[2]
    cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
    before, length = (cx * normal[0] + cy * normal[1]) + cz * normal[2], math.sqrt(square(cx, cy, cz))
    return before > cosine * length or shows * length < before * double


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
        shows = (cx * side[at + k, 0] + cy * side[at + k, 1]) + cz * side[at + k, 2]
        if not shows > bound:
            return False
        double = math.sqrt(square(cx, cy, cz))
        if not shows - TURN * double > bound and leans(star, i, j, was, side[at + k], shows, double, TURN):
            return False
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
        known = normal[0] != 0.0 or normal[1] != 0.0 or normal[2] != 0.0
        if known and upright < LEAN * double and leans(star, i, j, was, normal, upright, double, 1.0):
            return False
    return True
