"""Angles and shape of triangles, 64 abreast and without branches.

With the edge vectors of a corner k, its angle is atan2(2|S|, dot_k); 2|S| is the same at all corners, so the largest
dot product belongs to the smallest angle and the smallest to the largest. Shape is 1/q = 4√3·S/(l² + m² + n²), aspect
1/q_V = 4√3·S/(l_max·(l₁ + l₂ + l₃)), both with the sign of the consistently wound area S.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.compile import LANES, inlined, kernel

TWO_SQRT3 = 2.0 * math.sqrt(3.0)
TAN_PI_8 = math.tan(math.pi / 8.0)
TINY = 1e-300  # stands in for a length of zero: the quotient is then zero, not a division by zero

# Sums of a block of triangles, in this order, those of aspect only where they are asked for:
SUM_LOW, SUM_HIGH, SUM_SHAPE, MIN_LOW, MAX_HIGH, MIN_SHAPE, INVERTED, SUM_ASPECT, MIN_ASPECT = range(9)
SUMS = 9


@kernel
def angle(y, x):
    """atan2(y, x) in radians for y ≥ 0 without a branch; π where both are zero (a corner that has collapsed).

    The argument is brought to [0, tan π/8], where a polynomial of degree ten in its square errs by 4e-17.
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
    r = p * t + (0.25 * math.pi if far else 0.0)
    r = 0.5 * math.pi - r if y > abs(x) else r
    return math.pi - r if x < 0.0 or (x == 0.0 and y == 0.0) else r


@kernel
def gather(points, triangles, turn, start, stop, block, sign):
    """Edge vectors b − a and c − a of the triangles start…stop into block (4·LANES); the lanes left over repeat."""
    for lane in range(LANES):
        t = min(start + lane, stop - 1)
        a, b, c = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
        block[lane] = points[b, 0] - points[a, 0]
        block[LANES + lane] = points[b, 1] - points[a, 1]
        block[2 * LANES + lane] = points[c, 0] - points[a, 0]
        block[3 * LANES + lane] = points[c, 1] - points[a, 1]
        sign[lane] = turn[t]


@kernel
def measure(block, sign, low, high, shape):
    """Smallest and largest angle (radians) and shape of the triangles in the lanes."""
    for lane in range(LANES):
        px, py = block[lane], block[LANES + lane]
        qx, qy = block[2 * LANES + lane], block[3 * LANES + lane]
        rx, ry = qx - px, qy - py
        cross = px * qy - py * qx
        at_a = px * qx + py * qy
        at_b = -(px * rx + py * ry)
        at_c = qx * rx + qy * ry
        largest = max(at_a, at_b, at_c)
        smallest = min(at_a, at_b, at_c)
        area = abs(cross)
        low[lane] = angle(area, largest) if largest > 0.0 else 0.0
        high[lane] = angle(area, smallest)
        lengths = px * px + py * py + qx * qx + qy * qy + rx * rx + ry * ry
        shape[lane] = TWO_SQRT3 * sign[lane] * cross / max(lengths, TINY)


@kernel
def aspects(block, sign, aspect):
    """Aspect of the triangles in the lanes."""
    for lane in range(LANES):
        px, py = block[lane], block[LANES + lane]
        qx, qy = block[2 * LANES + lane], block[3 * LANES + lane]
        rx, ry = qx - px, qy - py
        k, m, n = math.sqrt(px * px + py * py), math.sqrt(qx * qx + qy * qy), math.sqrt(rx * rx + ry * ry)
        lengths = max(k, m, n) * (k + m + n)
        aspect[lane] = TWO_SQRT3 * sign[lane] * (px * qy - py * qx) / max(lengths, TINY)


@kernel
def summarise(points, triangles, turn, first, last, with_aspect, sums):
    """Sums and extremes over the blocks first…last of LANES triangles, one row of ``sums`` (blocks, SUMS) each.

    A row does not depend on who computes it, so that the total is the same for any number of threads.
    """
    block = np.empty(4 * LANES)
    sign, low, high, shape, aspect = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.zeros(LANES)
    for number in range(first, last):
        start = number * LANES
        stop = min(start + LANES, len(triangles))
        gather(points, triangles, turn, start, stop, block, sign)
        measure(block, sign, low, high, shape)
        if with_aspect:
            aspects(block, sign, aspect)
        total(low, high, shape, aspect, stop - start, sums[number])


@inlined
def shape_of(px, py, qx, qy):
    """1/q of the triangle (0, p, q)."""
    rx, ry = qx - px, qy - py
    lengths = (px * px + py * py) + (qx * qx + qy * qy) + (rx * rx + ry * ry)
    return TWO_SQRT3 * (px * qy - py * qx) / max(lengths, TINY)


@kernel
def glance(points, triangles, turn, stride):
    """The mean shape over every stride-th block of LANES triangles."""
    block, sign, shape = np.empty(4 * LANES), np.empty(LANES), np.empty(LANES)
    total_shape, count = 0.0, 0
    for start in range(0, len(triangles), stride * LANES):
        stop = min(start + LANES, len(triangles))
        gather(points, triangles, turn, start, stop, block, sign)
        for lane in range(LANES):
            px, py = block[lane], block[LANES + lane]
            qx, qy = block[2 * LANES + lane], block[3 * LANES + lane]
            shape[lane] = sign[lane] * shape_of(px, py, qx, qy)
        for lane in range(stop - start):
            total_shape += shape[lane]
        count += stop - start
    return total_shape / count


@kernel
def total(low, high, shape, aspect, count, row):
    """One row of sums (see the names above) over the first ``count`` lanes."""
    sum_low, sum_high, sum_shape, sum_aspect = 0.0, 0.0, 0.0, 0.0
    min_low, max_high, min_shape, min_aspect = np.inf, 0.0, np.inf, np.inf
    inverted = 0
    for lane in range(count):
        sum_low += low[lane]
        sum_high += high[lane]
        sum_shape += shape[lane]
        sum_aspect += aspect[lane]
        min_low = min(min_low, low[lane])
        max_high = max(max_high, high[lane])
        min_shape = min(min_shape, shape[lane])
        min_aspect = min(min_aspect, aspect[lane])
        inverted += shape[lane] <= 0.0
    row[SUM_LOW] = sum_low
    row[SUM_HIGH] = sum_high
    row[SUM_SHAPE] = sum_shape
    row[MIN_LOW] = min_low
    row[MAX_HIGH] = max_high
    row[MIN_SHAPE] = min_shape
    row[INVERTED] = inverted
    row[SUM_ASPECT] = sum_aspect
    row[MIN_ASPECT] = min_aspect


@kernel
def per_cell(points, triangles, turn, low, high, shape, aspect):
    """Smallest and largest angle (radians), shape and aspect of each triangle, into arrays of length T."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
        rx, ry = points[c, 0] - points[b, 0], points[c, 1] - points[b, 1]
        cross = px * qy - py * qx
        at_a, at_b, at_c = px * qx + py * qy, -(px * rx + py * ry), qx * rx + qy * ry
        largest = max(at_a, at_b, at_c)
        low[t] = math.atan2(abs(cross), largest) if largest > 0.0 else 0.0
        smallest = min(at_a, at_b, at_c)
        high[t] = math.atan2(abs(cross), smallest) if cross != 0.0 or smallest != 0.0 else math.pi
        k, m, n = math.hypot(px, py), math.hypot(qx, qy), math.hypot(rx, ry)
        signed = TWO_SQRT3 * turn[t] * cross
        shape[t] = signed / max(k * k + m * m + n * n, TINY)
        aspect[t] = signed / max(max(k, m, n) * (k + m + n), TINY)


@kernel
def per_surface_cell(points, triangles, low, high, shape, aspect):
    """The same for triangles in space (points N×3), unsigned: a surface has no orientation of its own."""
    for t in range(len(triangles)):
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        p, q, r = b - a, c - a, c - b
        nx = p[1] * q[2] - p[2] * q[1]
        ny = p[2] * q[0] - p[0] * q[2]
        nz = p[0] * q[1] - p[1] * q[0]
        area = math.sqrt(nx * nx + ny * ny + nz * nz)
        at_a = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
        at_b = -(p[0] * r[0] + p[1] * r[1] + p[2] * r[2])
        at_c = q[0] * r[0] + q[1] * r[1] + q[2] * r[2]
        largest, smallest = max(at_a, at_b, at_c), min(at_a, at_b, at_c)
        low[t] = math.atan2(area, largest) if largest > 0.0 else 0.0
        high[t] = math.atan2(area, smallest) if area != 0.0 or smallest != 0.0 else math.pi
        k = math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
        m = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
        n = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
        shape[t] = TWO_SQRT3 * area / max(k * k + m * m + n * n, TINY)
        aspect[t] = TWO_SQRT3 * area / max(max(k, m, n) * (k + m + n), TINY)
