"""Circular arcs and segments: the nearest parameter to a point, the point at one, and the tangent there.

A piece from P to Q = P + c with the angle α between its first tangent and its chord is, with complex numbers,

    P + c·z(t),   z(t) = t·e / (1 − t + t·e),   e = cos α + i·sin α,   0 ≤ t ≤ 1:

z/(1 − z) = e·t/(1 − t) has the constant argument α, which is the theorem of the inscribed angle. So arcs and segments
(α = 0) need neither a centre nor angles, and sums, products and one square root give the same bits everywhere.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part


@inlined
def piece_parameter(piece, k, x, y):
    """t of the point of the circle of piece k that is nearest to (x, y): below 0 before its beginning, above 1 behind
    its end.

    With N, S the components of (x, y) − P along the first normal and tangent over |c|, and U the vector from the centre
    over the radius: U = (2 sin α·S, 1 + 2 sin α·N), and t = 2S/(|U| + 1 + 2 sin α·N + 2(1 − cos α)·S).
    """
    px, py, cosine, sine = piece[k, 0], piece[k, 1], piece[k, 4], piece[k, 5]
    cx, cy = piece[k, 2] - px, piece[k, 3] - py
    square = cx * cx + cy * cy
    if not square > 0.0:
        return 0.0
    dx, dy = x - px, y - py
    zx, zy = (dx * cx + dy * cy) / square, (dy * cx - dx * cy) / square
    s, n = cosine * zx + sine * zy, cosine * zy - sine * zx
    ux, uy = 2.0 * sine * s, 1.0 + 2.0 * sine * n
    below = np.sqrt(ux * ux + uy * uy) + uy + 2.0 * (sine * sine / (1.0 + cosine)) * s
    if below == 0.0:
        return 0.5 if s == 0.0 else np.copysign(np.inf, s)
    return 2.0 * s / below


@part
def piece_point(piece, k, t):
    """The point of piece k at t in [0, 1]: its very ends at 0 and 1. From the nearer end on, which rounds less."""
    cosine, sine = piece[k, 4], piece[k, 5]
    cx, cy = piece[k, 2] - piece[k, 0], piece[k, 3] - piece[k, 1]
    r = 1.0 - t
    below = r * r + 2.0 * r * t * cosine + t * t
    if t < 0.5:
        zx, zy = t * (r * cosine + t) / below, t * r * sine / below
        return piece[k, 0] + (cx * zx - cy * zy), piece[k, 1] + (cx * zy + cy * zx)
    zx, zy = r * (r + t * cosine) / below, -r * t * sine / below
    return piece[k, 2] - (cx * zx - cy * zy), piece[k, 3] - (cx * zy + cy * zx)


@part
def piece_tangent(piece, k, t):
    """The unit tangent of piece k at t: c/|c|·e·g²/|g|² with g = 1 − t + t·ē. (1, 0) where the piece has no length."""
    cosine, sine = piece[k, 4], piece[k, 5]
    cx, cy = piece[k, 2] - piece[k, 0], piece[k, 3] - piece[k, 1]
    gx, gy = 1.0 - t + t * cosine, -t * sine
    dx, dy = gx * gx - gy * gy, 2.0 * gx * gy
    ex, ey = cosine * dx - sine * dy, cosine * dy + sine * dx
    tx, ty = cx * ex - cy * ey, cx * ey + cy * ex
    length = np.sqrt(tx * tx + ty * ty)
    if not length > 0.0:
        return 1.0, 0.0
    return tx / length, ty / length
