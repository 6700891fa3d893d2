"""Angles, shape and aspect of triangles, 64 in SIMD lanes and without branches, and their sums.

With the edge vectors of a corner k, its angle is atan2(2|S|, dot_k); 2|S| is the same at all corners, so the largest
dot product belongs to the smallest angle and the smallest to the largest. Shape is 1/q = 4√3·S/(l² + m² + n²), aspect
1/q_V = 4√3·S/(l_max·(l₁ + l₂ + l₃)), both with the sign of the consistently wound area S.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import TINY, TWO_SQRT3
from gmsnet.kernels.simplex.predicates import SHEWCHUK, UNDERFLOW

TAN_PI_8 = math.tan(math.pi / 8.0)
DEGREES = 180.0 / math.pi

# What ``summarise`` says of triangles, angles in degrees: sums on the coarse and on the fine grid, extremes, counts.
LOW, HIGH, SHAPE, ASPECT = range(4)
COARSE, FINE, EXTREME, INVERTED, UNCERTAIN = 0, 4, 8, 12, 13
FIGURES = 14

SIGN, TOTALS = 6, 7  # rows of a workspace of doubles, after the edge vectors
ROWS = TOTALS + FIGURES
LEAST, MOST = (EXTREME + LOW, EXTREME + SHAPE, EXTREME + ASPECT), (EXTREME + HIGH,)  # figures that are no sums


@inlined
def folded(y, x):
    """arctan of y/|x|, y ≥ 0, brought to [0, tan π/8], and whether π/4 is to be added to it.

    There a polynomial of degree ten in the square of the argument errs by 4e-17.
    """
    big = max(y, abs(x))
    small = min(y, abs(x))
    far = small > TAN_PI_8 * big
    t = (small - big if far else small) / max(small + big if far else big, TINY)
    u = t * t
    p = 0.021135371536498415
    p = p * u - 0.04348052083340628
    p = p * u + 0.056883491809884175
    p = p * u - 0.06640233921673451
    p = p * u + 0.07689953495298942
    p = p * u - 0.0909077307473686
    p = p * u + 0.11111106180452865
    p = p * u - 0.14285714180976392
    p = p * u + 0.19999999998855109
    p = p * u - 0.3333333333332844
    p = p * u + 1.0
    return p * t, far


@part
def angle(y, x):
    """atan2(y, x) in radians for y ≥ 0 without a branch; π where both are zero (a corner that has collapsed)."""
    r, far = folded(y, x)
    r = r + (0.25 * math.pi if far else 0.0)
    r = 0.5 * math.pi - r if y > abs(x) else r
    return math.pi - r if x < 0.0 or (x == 0.0 and y == 0.0) else r


@inlined
def degrees(y, x):
    """The same in degrees, where 45, 90 and 180 are what they are."""
    r, far = folded(y, x)
    r = DEGREES * r + (45.0 if far else 0.0)
    r = 90.0 - r if y > abs(x) else r
    return 180.0 - r if x < 0.0 or (x == 0.0 and y == 0.0) else r


@inlined
def figures(double, at_a, at_b, at_c, k2, m2, n2):
    """Smallest and largest angle in degrees, shape and aspect of a triangle.

    double: 2S. at_a, at_b, at_c: the dot product of the two edges from each corner. k2, m2, n2: squared sides.
    """
    largest, smallest = max(at_a, at_b, at_c), min(at_a, at_b, at_c)
    low = degrees(abs(double), largest) if largest > 0.0 else 0.0
    high = degrees(abs(double), smallest)
    k, m, n = math.sqrt(k2), math.sqrt(m2), math.sqrt(n2)
    shape = TWO_SQRT3 * double / max(k2 + m2 + n2, TINY)
    aspect = TWO_SQRT3 * double / max(max(k, m, n) * (k + m + n), TINY)
    return low, high, shape, aspect


@inlined
def planar_figures(work, lane):
    """The same of the triangle in a lane of a workspace, and whether a rounding error may have made it positive."""
    px, py = work[lane], work[LANES + lane]
    qx, qy = work[2 * LANES + lane], work[3 * LANES + lane]
    rx, ry = work[4 * LANES + lane], work[5 * LANES + lane]
    left, right = px * qy, py * qx
    double = work[SIGN * LANES + lane] * (left - right)
    error_bound = not double > SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW
    at_a, at_b, at_c = px * qx + py * qy, -(px * rx + py * ry), qx * rx + qy * ry
    low, high, shape, aspect = figures(
        double, at_a, at_b, at_c, px * px + py * py, qx * qx + qy * qy, rx * rx + ry * ry
    )
    return low, high, shape, aspect, error_bound


@inlined
def gather(points, triangles, orientation, start, count, work):
    """Edge vectors b − a, c − a and c − b of the triangles from ``start`` on, and their orientations, into a
    workspace."""
    for lane in range(count):
        t = start + lane
        a, b, c = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
        work[lane] = points[b, 0] - points[a, 0]
        work[LANES + lane] = points[b, 1] - points[a, 1]
        work[2 * LANES + lane] = points[c, 0] - points[a, 0]
        work[3 * LANES + lane] = points[c, 1] - points[a, 1]
        work[4 * LANES + lane] = points[c, 0] - points[b, 0]
        work[5 * LANES + lane] = points[c, 1] - points[b, 1]
        work[SIGN * LANES + lane] = orientation[t]


@inlined
def add(work, at, value, coarse, fine):
    """Adds a value to the sum on the coarse grid at a place of a workspace, its rest to the one on the fine grid."""
    high = (value + coarse) - coarse
    work[at] += high
    work[at + FINE * LANES] += ((value - high) + fine) - fine


def grids(count: int) -> tuple[float, float]:
    """What to add to a float of up to 256, and to take off again, for it to lie on a grid; for sums of ``count``.

    Sums of multiples of a grid's width are exact, in whatever order, as long as they need no more than 53 bits: so do
    count·2⁸ in units of the coarse width and count/2 coarse widths in units of the fine one (the reproducible sums
    of Demmel and Nguyen, 2013). The fine width is at most 4·2⁻⁹⁷·count²: 2⁻⁴⁹ for ten million triangles.
    """
    workspace = 2.0 ** math.frexp(count)[1]
    return 384.0 * workspace, 1.5 * 2.0**-45 * workspace * workspace


@inlined
def take_in_space(px, py, pz, qx, qy, qz, sign, work, lane):
    """What ``figures`` asks of a triangle in space with the edges p and q from its first corner, into a lane."""
    rx, ry, rz = qx - px, qy - py, qz - pz
    nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    work[lane] = sign * math.sqrt((nx * nx + ny * ny) + nz * nz)
    work[LANES + lane] = px * qx + py * qy + pz * qz
    work[2 * LANES + lane] = -(px * rx + py * ry + pz * rz)
    work[3 * LANES + lane] = qx * rx + qy * ry + qz * rz
    work[4 * LANES + lane] = px * px + py * py + pz * pz
    work[5 * LANES + lane] = qx * qx + qy * qy + qz * qz
    work[6 * LANES + lane] = rx * rx + ry * ry + rz * rz


@inlined
def figures_in_space(work, lane):
    """The figures of that triangle."""
    return figures(
        work[lane], work[LANES + lane], work[2 * LANES + lane], work[3 * LANES + lane],
        work[4 * LANES + lane], work[5 * LANES + lane], work[6 * LANES + lane],
    )  # fmt: skip


@part
def begin(work):
    """Totals of no triangle, in a workspace."""
    for k in range(ROWS * LANES):
        work[k] = 0.0
    for lane in range(LANES):
        work[(TOTALS + EXTREME + LOW) * LANES + lane] = np.inf
        work[(TOTALS + EXTREME + SHAPE) * LANES + lane] = np.inf
        work[(TOTALS + EXTREME + ASPECT) * LANES + lane] = np.inf


@inlined
def count_in(work, lane, low, high, shape, aspect, uncertain, coarse, fine):
    """Adds the figures of the triangle in a lane to its totals."""
    at = TOTALS * LANES + lane
    add(work, at + LOW * LANES, low, coarse, fine)
    add(work, at + HIGH * LANES, high, coarse, fine)
    add(work, at + SHAPE * LANES, shape, coarse, fine)
    add(work, at + ASPECT * LANES, aspect, coarse, fine)
    k = at + EXTREME * LANES
    work[k + LOW * LANES] = min(work[k + LOW * LANES], low)
    work[k + HIGH * LANES] = max(work[k + HIGH * LANES], high)
    work[k + SHAPE * LANES] = min(work[k + SHAPE * LANES], shape)
    work[k + ASPECT * LANES] = min(work[k + ASPECT * LANES], aspect)
    work[at + INVERTED * LANES] += 1.0 if shape <= 0.0 else 0.0
    work[at + UNCERTAIN * LANES] += 1.0 if uncertain else 0.0


@part
def total(work, out):
    """The totals of all lanes together into out (FIGURES,)."""
    for figure in range(FIGURES):
        value = work[(TOTALS + figure) * LANES]
        for lane in range(1, LANES):
            other = work[(TOTALS + figure) * LANES + lane]
            if figure == EXTREME + HIGH:
                value = max(value, other)
            elif EXTREME <= figure < INVERTED:
                value = min(value, other)
            else:
                value += other
        out[figure] = value


@kernel
def summarise(points, triangles, orientation, first, last, coarse, fine, shapes):
    """The figures (FIGURES,) named above over the blocks first…last of LANES triangles. coarse, fine: their ``grids``.

    The sums of all blocks follow from those of parts exactly, so they do not depend on how the blocks are shared out,
    nor on the order of the triangles, or of a triangle's corners but for the rounding of its own measures. shapes: (T,)
    float32, for 1/q of each triangle, or (0,).
    """
    out = np.empty(FIGURES)
    summarise_into(points, triangles, orientation, first, last, coarse, fine, shapes, out)
    return out


@part
def summarise_into(points, triangles, orientation, first, last, coarse, fine, shapes, out):
    """The same into out (FIGURES,)."""
    work = np.empty(ROWS * LANES)
    begin(work)
    for start in range(first * LANES, min(last * LANES, len(triangles)), LANES):
        count = min(LANES, len(triangles) - start)
        gather(points, triangles, orientation, start, count, work)
        for lane in range(count):
            low, high, shape, aspect, error_bound = planar_figures(work, lane)
            count_in(work, lane, low, high, shape, aspect, error_bound, coarse, fine)
            work[lane] = shape  # its edges are not needed any more
        if len(shapes):
            for lane in range(count):
                shapes[start + lane] = work[lane]
    total(work, out)


@kernel
def per_cell(points, triangles, orientation, columns):
    """LOW, HIGH, SHAPE and ASPECT of each triangle into columns (4, T); angles in degrees."""
    work = np.zeros(ROWS * LANES)
    for start in range(0, len(triangles), LANES):
        count = min(LANES, len(triangles) - start)
        gather(points, triangles, orientation, start, count, work)
        for lane in range(count):
            low, high, shape, aspect, _ = planar_figures(work, lane)
            work[(TOTALS + LOW) * LANES + lane] = low
            work[(TOTALS + HIGH) * LANES + lane] = high
            work[(TOTALS + SHAPE) * LANES + lane] = shape
            work[(TOTALS + ASPECT) * LANES + lane] = aspect
        for column in range(4):
            for lane in range(count):
                columns[column, start + lane] = work[(TOTALS + column) * LANES + lane]


@kernel
def per_surface_cell(points, triangles, columns):
    """The same for triangles in space (points N×3), unsigned: a surface has no orientation of its own."""
    work = np.empty(ROWS * LANES)
    for start in range(0, len(triangles), LANES):
        count = min(LANES, len(triangles) - start)
        for lane in range(count):
            t = start + lane
            a, b, c = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
            x, y, z = points[a, 0], points[a, 1], points[a, 2]
            take_in_space(
                points[b, 0] - x, points[b, 1] - y, points[b, 2] - z,
                points[c, 0] - x, points[c, 1] - y, points[c, 2] - z, 1.0, work, lane,
            )  # fmt: skip
        for lane in range(count):
            low, high, shape, aspect = figures_in_space(work, lane)
            at = TOTALS * LANES + lane
            work[at + LOW * LANES], work[at + HIGH * LANES] = low, high
            work[at + SHAPE * LANES], work[at + ASPECT * LANES] = shape, aspect
        for column in range(4):
            for lane in range(count):
                columns[column, start + lane] = work[(TOTALS + column) * LANES + lane]
