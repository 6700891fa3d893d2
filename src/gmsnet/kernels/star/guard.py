"""Which moves are allowed: the rule of the guard, exact about signs and about the worst elements.

A triangle has the doubled area D and the sum L of its squared sides; 1/q = 2√3·D/L. A computed D is off by at most the
bound of kernels.simplex.predicates, with coordinates known up to ±δ, δ the file's unit of rounding times the largest
coordinate around plus the grain of the numbers next to zero. L is off by at most 8u·L + 8δ·A + 24δ², u = 2⁻⁵³ and A
the sum of the absolute components of two sides: each side's square is off by its rounding and by 4δ times its
components, and the third side's components are at most the sum of the others'. Twice that is used.

A triangle is *certified above* a floor φ if D − φ·L exceeds the sum of these errors: then D > φ·L in exact arithmetic,
in float64, and as written. A move is allowed if after it each triangle of the star

- is certified above 0, or was certainly inverted before and is certainly less so after it; and,
- where the level is WORST or STAR, is certified above its floor.

VALID knows no floors. WORST has one for the mesh: the minimum of an upper bound of D/L over the triangles that have a
free node. STAR has one for each node with a ring, the minimum over those of its triangles that have a free node; a
triangle's floor is the largest of its nodes'. Floors are taken at the start of a sweep. What follows is proven in
docs/guarantees.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import (
    lengths,
    put_weights,
    same_cell,
    sensitivity,
    weights_at_last,
    weights_in,
)
from gmsnet.kernels.simplex.predicates import SHEWCHUK, UNDERFLOW, UNIT, determinant_and_bound
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.surface import Surface

LEVELS = ("valid", "worst", "star")
VALID, WORST, STAR = range(3)
ROUNDING_L = 16.0 * UNIT  # of L, relative
LARGEST = 1.0 / (2.0 * math.sqrt(3.0))  # D/L of an equilateral triangle
ROUNDED = 2.0**-24  # by float32, relative


class Precision(NamedTuple):
    """How exactly the coordinates of a mesh are known once they are written.

    unit: the largest relative error (2⁻⁵³ for float64, decimal text and float32; 2⁻²⁴ for text that is read as float32
    or as more). grain: the largest absolute error next to zero, where floats are evenly spaced. single: round every new
    coordinate to float32, because the file will.
    """

    unit: float = 2.0**-53
    grain: float = 0.0
    single: bool = False

    @classmethod
    def of(cls, *, single: bool, exponent: int, exact: bool = True) -> Precision:
        """For coordinates that have been divided by 2 to the power of ``exponent``. exact: see ``Mesh.exact``."""
        if single:
            return cls(2.0**-53 if exact else ROUNDED, math.ldexp(1.0, -150 - exponent), single=True)
        grain = math.ldexp(1.0, -1075 - exponent)
        return cls(grain=grain if grain > 1e-290 else 0.0)  # a subnormal one would only be slow

    @property
    def before_rounding(self) -> Precision:
        """Of new coordinates that are judged first, and rounded to float32 after that."""
        return self._replace(unit=self.unit + ROUNDED, single=False) if self.single else self

    def rounded(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """New points as the mesh will keep them."""
        return points.astype(np.float32).astype(np.float64) if self.single else points

    def coarser(self, unit: float, grain: float) -> Precision:
        """Of coordinates that are rounded once more, by the relative and the absolute error at most, when written."""
        return self._replace(unit=self.unit + unit, grain=self.grain + grain)


class MeshGuard(NamedTuple):
    """What a sweep must keep. unit, grain, single: see Precision.

    floor: of D/L for the whole mesh, −∞ at the level VALID. constraint: what nodes slide on; None: no node
    does.
    """

    unit: float
    grain: float
    single: bool
    floor: float
    constraint: Constraint | Surface | None = None


class StarGuard(NamedTuple):
    """What a sweep must keep at the level STAR. floors: (N,) for each node in memory order, −∞ where it has no ring."""

    unit: float
    grain: float
    single: bool
    floor: float
    constraint: Constraint | Surface | None
    floors: NDArray[np.float64]


Guard = MeshGuard | StarGuard
# ``len(guard) == WITH_FLOORS`` is known when a kernel is compiled: what only one level needs is left out for the other.
WITH_FLOORS = len(StarGuard._fields)


def plain_guard(
    precision: Precision = Precision(),  # noqa: B008 (a tuple of constants)
    constraint: Constraint | Surface | None = None,
) -> MeshGuard:
    """The guard of the level VALID."""
    return MeshGuard(*precision, -math.inf, constraint)


@inlined
def unit_of_steps(guard):
    """The unit of a place that is judged by the step there, and rounded after that."""
    return guard.unit + ROUNDED if guard.single else guard.unit


@inlined
def margin_above_zero(px, py, qx, qy, delta):
    """By how much D of the triangle (0, p, q) exceeds its error bound."""
    left = px * qy
    right = py * qx
    around = abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta
    return (left - right) - (SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW + 4.0 * delta * around)


@inlined
def margin_above(px, py, qx, qy, delta, floor, weights):
    """By how much D of the simplex (0, p, q) exceeds floor·L and the error bounds of both."""
    left = px * qy
    right = py * qx
    square = lengths(px, py, qx, qy, weights)
    around = abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta
    bound = SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW + 4.0 * delta * around
    bound += abs(floor) * (ROUNDING_L * square + sensitivity(weights) * delta * around)
    return (left - right) - floor * square - bound


@inlined
def ratio_upper_bound(px, py, qx, qy, delta, weights):
    """The most that D/L of the simplex (0, p, q) can be in exact arithmetic; LARGEST where nothing is certain."""
    left = px * qy
    right = py * qx
    square = lengths(px, py, qx, qy, weights)
    around = abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta
    top = (left - right) + (SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW + 4.0 * delta * around)
    error_bound = ROUNDING_L * square + sensitivity(weights) * delta * around
    # An inverted triangle is the less inverted, the larger L is; a positive one the better, the smaller.
    below = square - error_bound if top > 0.0 else square + error_bound
    ratio = top / below if below > 0.0 else LARGEST
    return min(ratio + 4.0 * UNIT * abs(ratio), LARGEST)


@part
def permitted(was, now, delta, floor, weights):
    """May a simplex with the nodes a, b, v in ``was`` (6 numbers) become ``now``? The scalar form of the rule."""
    after, error_bound = determinant_and_bound(now[0], now[1], now[2], now[3], now[4], now[5], delta)
    if floor > -np.inf:
        px, py, qx, qy = now[0] - now[4], now[1] - now[5], now[2] - now[4], now[3] - now[5]
        if not margin_above(px, py, qx, qy, delta, floor, weights) > 0.0:
            return False
    if after > error_bound:
        return True
    before, error_bound_before = determinant_and_bound(was[0], was[1], was[2], was[3], was[4], was[5], delta)
    return before < -error_bound_before and after - error_bound > before + error_bound_before


@kernel
def ratio_upper_bounds(points, simplices, blocks, unit, grain, first, last, least):
    """The minimum ``ratio_upper_bound`` over each of the blocks of LANES simplices with the places first…last, into
    ``least``."""
    rows, orientation = simplices.rows, simplices.orientation
    block, ratio = np.empty(6 * LANES), np.empty(LANES)
    weight = np.empty(3 * LANES)
    for number in range(first, last):
        start = blocks[number] * LANES
        for lane in range(LANES):
            t = min(start + lane, len(rows) - 1)
            a, b, c = np.uint32(rows[t, 0]), np.uint32(rows[t, 1]), np.uint32(rows[t, 2])
            block[lane], block[LANES + lane] = points[a, 0], points[a, 1]
            block[2 * LANES + lane], block[3 * LANES + lane] = points[b, 0], points[b, 1]
            block[4 * LANES + lane], block[5 * LANES + lane] = points[c, 0], points[c, 1]
            ratio[lane] = orientation[t]
            put_weights(weights_at_last(simplices.shapes, t, orientation[t] > 0), weight, lane)
        for lane in range(LANES):
            px, py = block[lane] - block[4 * LANES + lane], block[LANES + lane] - block[5 * LANES + lane]
            qx, qy = (
                block[2 * LANES + lane] - block[4 * LANES + lane],
                block[3 * LANES + lane] - block[5 * LANES + lane],
            )
            size = (abs(px) + abs(py)) + (abs(qx) + abs(qy))
            reach = max(abs(block[4 * LANES + lane]), abs(block[5 * LANES + lane])) + size
            # Turned over, the simplex has −D: the components of one side change sides.
            forth = ratio[lane] > 0.0
            ax, ay, bx, by = px if forth else qx, py if forth else qy, qx if forth else px, qy if forth else py
            weights = weights_in(simplices.shapes, weight, lane)
            ratio[lane] = ratio_upper_bound(ax, ay, bx, by, unit * reach + grain, weights)
        width = LANES
        while width > 1:  # in halves, which go in SIMD lanes, where one after the other would not
            width //= 2
            for lane in range(width):
                ratio[lane] = min(ratio[lane], ratio[width + lane])
        least[number] = ratio[0]


@inlined
def ratio_of(points, a, b, c, unit, grain, weights):
    """``ratio_upper_bound`` of the simplex with the nodes a, b, c, its spokes from c."""
    px, py, qx, qy = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    px, py, qx, qy = px - points[c, 0], py - points[c, 1], qx - points[c, 0], qy - points[c, 1]
    reach = max(abs(points[c, 0]), abs(points[c, 1])) + ((abs(px) + abs(py)) + (abs(qx) + abs(qy)))
    return ratio_upper_bound(px, py, qx, qy, unit * reach + grain, weights)


@inlined
def ratio_of_row(points, simplices, t, unit, grain):
    """The same of row t, read in its orientation."""
    rows, forth = simplices.rows, simplices.orientation[t] > 0
    a, b, c = rows[t, 0 if forth else 1], rows[t, 1 if forth else 0], rows[t, 2]
    return ratio_of(points, a, b, c, unit, grain, weights_at_last(simplices.shapes, t, forth))


@kernel
def star_floors(points, simplices, ringed, unit, grain, floors):
    """For each node with a star the minimum ``ratio_upper_bound`` over the cells around it; −∞ for the others."""
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
