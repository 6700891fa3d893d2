"""What a free node's place is worth: five objectives over the corner simplices of its star, with two derivatives.

Each is the mean over the simplices (p, r_i, r_j) of a number that depends on the free node p alone; what is around it
stays. With the spokes a = r_i − p and b = r_j − p, the rim e = b − a, and the doubled area D = a × b, of which w = ∇D =
(a_y − b_y, b_x − a_x) does not depend on p; with L = w_a |a|² + w_b |b|² + w_o |e|², N = L/2, the weights those of
kernels.simplex.mean_ratio2, P = w_a a + w_b b = −∇N and ω = w_a + w_b:

    metric          1 − s,  s = 1/q = 2√3 D/L      (the paper's equation 10; of triangles L = l² + m² + n²)
                    ∇s = (2√3 w + 2s P)/L,        ∇²s = (2 ∇s Pᵀ + 2 P ∇sᵀ − 2ωs I)/L
    q               κN/D,  κ = 1/√3
                    ∇q = −(κP + q w)/D,           ∇²q = (κω I − w ∇qᵀ − ∇q wᵀ)/D
    q2              q²:  2q ∇q,  2q ∇²q + 2 ∇q ∇qᵀ
    cosine          ⅓ Σ (cos θ − ½)² over the three angles of a triangle
    min-max-angle   the largest of the three angles of a triangle, in radians

The last two are for stars of triangles alone (fans): of what a square corner is to have they know nothing.

The angles, counter-clockwise, are φ_b − φ_a at the free node, φ_a + π − φ_e at r_{i−1} and φ_e − φ_b at r_i, φ the
direction of an edge. The rim stays, so their derivatives are made of

    ∇φ_a = (a_y, −a_x)/|a|²,   ∇²φ_a = [[2 a_x a_y, a_y² − a_x²], [a_y² − a_x², −2 a_x a_y]]/|a|⁴.

Where triangles degenerate. ``metric`` is signed: from 0 over 1 (flat) to 2 (inverted and equilateral), smooth all the
way; a triangle of a single point counts 1. ``cosine`` and ``min-max-angle`` are bounded, too, but take inverted
triangles for their mirror images; an angle at an edge of no length has cosine 0, and the largest angle of a triangle
with such an edge is π. ``q`` and ``q2`` are barriers: +∞, with derivatives of zero, from D ≤ 0 on.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.simplex.mean_ratio2 import TWO_SQRT3, half_lengths, pull, roundness
from gmsnet.kernels.simplex.measures import angle
from gmsnet.kernels.star.pattern import count_of, pair_of, weights_of

NAMES = ("metric", "q", "q2", "cosine", "min-max-angle")
METRIC, Q, Q2, COSINE, LARGEST_ANGLE = range(5)
OF_ANGLES = ("cosine", "min-max-angle")  # for triangles alone
KAPPA = 1.0 / math.sqrt(3.0)
THIRD = 1.0 / 3.0
SMALL = 1e-30  # a squared length that is none, in stars of size 1

VALUE, GRADIENT, LEAST = 0, 1, 3  # rows of ``out``: value, gradient (two), the minimum D of the star
OUT = 4


@inlined
def squares(ax, ay, bx, by, weights):
    """N = L/2; that of a triangle in the order of operations on which results have rested from the start."""
    if weights is None:
        return ax * ax + ay * ay + bx * bx + by * by - ax * bx - ay * by
    return half_lengths(ax, ay, bx, by, weights)


@inlined
def metric(ax, ay, bx, by, weights):
    """1 − 1/q of the simplex (0, a, b): value, gradient x y, Hessian xx xy yy."""
    sx, sy = pull(ax, bx, weights), pull(ay, by, weights)
    inverse = 1.0 / max(2.0 * squares(ax, ay, bx, by, weights), SMALL)
    s = TWO_SQRT3 * (ax * by - ay * bx) * inverse
    gx = (TWO_SQRT3 * (ay - by) + 2.0 * s * sx) * inverse
    gy = (TWO_SQRT3 * (bx - ax) + 2.0 * s * sy) * inverse
    even = 4.0 * roundness(s, weights)
    xx = (4.0 * gx * sx - even) * inverse
    xy = 2.0 * (gx * sy + gy * sx) * inverse
    yy = (4.0 * gy * sy - even) * inverse
    return 1.0 - s, -gx, -gy, -xx, -xy, -yy


@inlined
def aspect(ax, ay, bx, by, weights):
    """q of the simplex (0, a, b), as ``metric``."""
    d = ax * by - ay * bx
    inside = d > 0.0
    inverse = 1.0 / d if inside else 0.0
    wx, wy = ay - by, bx - ax
    q = KAPPA * squares(ax, ay, bx, by, weights) * inverse
    gx = -(KAPPA * pull(ax, bx, weights) + q * wx) * inverse
    gy = -(KAPPA * pull(ay, by, weights) + q * wy) * inverse
    even = roundness(KAPPA, weights)
    xx = 2.0 * (even - wx * gx) * inverse
    xy = -(wx * gy + wy * gx) * inverse
    yy = 2.0 * (even - wy * gy) * inverse
    return q if inside else np.inf, gx, gy, xx, xy, yy


@inlined
def aspect_squared(ax, ay, bx, by, weights):
    """q² of the simplex (0, a, b), as ``metric``."""
    q, gx, gy, xx, xy, yy = aspect(ax, ay, bx, by, weights)
    twice = 2.0 * q if q < np.inf else 0.0
    return (
        q * q,
        twice * gx,
        twice * gy,
        twice * xx + 2.0 * gx * gx,
        twice * xy + 2.0 * gx * gy,
        twice * yy + 2.0 * gy * gy,
    )


@inlined
def turning(ax, ay, inverse):
    """Derivatives in p of the direction φ of the spoke a: x, y; xx and xy (yy is −xx). inverse: 1/|a|²."""
    gx, gy = ay * inverse, -ax * inverse
    return gx, gy, -2.0 * gx * gy, gx * gx - gy * gy


@inlined
def away_from_60(cosine, sine):
    """(cos θ − ½)²/3 with its two derivatives in θ."""
    off = cosine - 0.5
    return THIRD * off * off, -2.0 * THIRD * off * sine, 2.0 * THIRD * (sine * sine - off * cosine)


@inlined
def cosines(ax, ay, bx, by):
    """⅓ Σ (cos θ − ½)² of the triangle (0, a, b), as ``metric``."""
    ex, ey = bx - ax, by - ay
    d = ax * by - ay * bx
    la = 1.0 / math.sqrt(max(ax * ax + ay * ay, SMALL))
    lb = 1.0 / math.sqrt(max(bx * bx + by * by, SMALL))
    le = 1.0 / math.sqrt(max(ex * ex + ey * ey, SMALL))
    f0, f1, f2 = away_from_60((ax * bx + ay * by) * la * lb, d * la * lb)  # at p: φ_b − φ_a
    g0, g1, g2 = away_from_60(-(ax * ex + ay * ey) * la * le, d * la * le)  # at r_{i−1}: φ_a and a constant
    h0, h1, h2 = away_from_60((bx * ex + by * ey) * lb * le, d * lb * le)  # at r_i: −φ_b and a constant
    ux, uy, uxx, uxy = turning(ax, ay, la * la)
    vx, vy, vxx, vxy = turning(bx, by, lb * lb)
    tx, ty = vx - ux, vy - uy
    along_a, along_b = g1 - f1, f1 - h1
    return (
        f0 + g0 + h0,
        along_a * ux + along_b * vx,
        along_a * uy + along_b * vy,
        along_a * uxx + along_b * vxx + f2 * tx * tx + g2 * ux * ux + h2 * vx * vx,
        along_a * uxy + along_b * vxy + f2 * tx * ty + g2 * ux * uy + h2 * vx * vy,
        -along_a * uxx - along_b * vxx + f2 * ty * ty + g2 * uy * uy + h2 * vy * vy,
    )


@inlined
def largest_angle(ax, ay, bx, by):
    """The largest angle of the triangle (0, a, b), as ``metric``; of equal ones that at p, then that at a, counts."""
    ex, ey = bx - ax, by - ay
    d = ax * by - ay * bx
    at_p = ax * bx + ay * by
    at_a = -(ax * ex + ay * ey)
    at_b = bx * ex + by * ey
    least = min(at_p, at_a, at_b)  # |D| is the same at all corners: the smallest product is that of the largest angle
    sign = 1.0 if d >= 0.0 else -1.0
    of_p, of_a = at_p == least, at_p != least and at_a == least
    ka = -sign if of_p else (sign if of_a else 0.0)
    kb = sign if of_p else (0.0 if of_a else -sign)
    ux, uy, uxx, uxy = turning(ax, ay, 1.0 / max(ax * ax + ay * ay, SMALL))
    vx, vy, vxx, vxy = turning(bx, by, 1.0 / max(bx * bx + by * by, SMALL))
    xx = ka * uxx + kb * vxx
    return angle(abs(d), least), ka * ux + kb * vx, ka * uy + kb * vy, xx, ka * uxy + kb * vxy, -xx


@part
def evaluate(objective, local, n, pattern, at, out, hessian):
    """The objective of a block of stars with their free nodes at ``at`` (2·LANES), in the frame of ``local``.

    out: OUT rows of LANES, see the names above. hessian: three rows (xx, xy, yy), or None if it is not wanted (which
    is known when it is compiled, so that nothing of it is computed then). COSINE, LARGEST_ANGLE: of fans alone.
    """
    out[: LEAST * LANES] = 0.0
    out[LEAST * LANES :] = np.inf
    if hessian is not None:
        hessian[:] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        if objective == METRIC:
            for lane in range(LANES):
                add(lane, at, p, q, metric(*spokes(lane, at, p, q), weights), out, hessian)
        elif objective == Q:
            for lane in range(LANES):
                add(lane, at, p, q, aspect(*spokes(lane, at, p, q), weights), out, hessian)
        elif objective == Q2:
            for lane in range(LANES):
                add(lane, at, p, q, aspect_squared(*spokes(lane, at, p, q), weights), out, hessian)
        elif pattern is not None:
            out[:] = np.nan  # angles of triangles say nothing of a quad: methods refuse those (methods/base.py)
        elif objective == COSINE:
            for lane in range(LANES):
                add(lane, at, p, q, cosines(*spokes(lane, at, p, q)), out, hessian)
        else:
            for lane in range(LANES):
                add(lane, at, p, q, largest_angle(*spokes(lane, at, p, q)), out, hessian)
    inverse = 1.0 / count_of(pattern, n)
    for k in range(LEAST * LANES):
        out[k] *= inverse
    if hessian is not None:
        for k in range(3 * LANES):
            hessian[k] *= inverse


@inlined
def spokes(lane, at, p, q):
    """The spokes a and b of one lane's triangle."""
    return (
        p[lane] - at[lane],
        p[LANES + lane] - at[LANES + lane],
        q[lane] - at[lane],
        q[LANES + lane] - at[LANES + lane],
    )


@inlined
def add(lane, at, p, q, triangle, out, hessian):
    """Adds one triangle's value and derivatives to the sums of its lane, and keeps the minimum D."""
    ax, ay, bx, by = spokes(lane, at, p, q)
    value, gx, gy, xx, xy, yy = triangle
    out[lane] += value
    out[LANES + lane] += gx
    out[2 * LANES + lane] += gy
    out[3 * LANES + lane] = min(out[3 * LANES + lane], ax * by - ay * bx)
    if hessian is not None:
        hessian[lane] += xx
        hessian[LANES + lane] += xy
        hessian[2 * LANES + lane] += yy


@part
def choose(tangled, other, shift):
    """Takes over the other shift (2·LANES) in the lanes where ``tangled`` (LANES) is 1."""
    for lane in range(LANES):
        shift[lane] = other[lane] if tangled[lane] > 0.0 else shift[lane]
        shift[LANES + lane] = other[LANES + lane] if tangled[lane] > 0.0 else shift[LANES + lane]
