"""Orientation of triangles in float64 with a forward error bound.

With u = 2⁻⁵³ the computed determinant of

    D = (ax − cx)(by − cy) − (ay − cy)(bx − cx)                                (twice the signed area)

is off by at most (3 + 16u)·u·(|l| + |r|), l and r its two products (Shewchuk 1997, section 4.3, bound A). If the
coordinates themselves are only known up to ±δ (a decimal text is not quite its float64; a file keeps float32), each
difference is off by 2δ more, which adds 2·2δ·(|px| + |py| + |qx| + |qy|)/2 + 2·(2δ)² to it. Twice that is used, so
that the bound's own rounding does not matter.
"""

from __future__ import annotations

from gmsnet.kernels.jit.compile import kernel, part

UNIT = 2.0**-53
SHEWCHUK = (3.0 + 16.0 * UNIT) * UNIT
UNDERFLOW = 1e-290  # below it a product may have lost digits


@part
def determinant_and_bound(ax, ay, bx, by, cx, cy, delta):
    """D of the triangle a, b, c, and how far it may be from the true one if coordinates are known up to ±delta."""
    px = ax - cx
    py = ay - cy
    qx = bx - cx
    qy = by - cy
    left = px * qy
    right = py * qx
    bound = SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW
    bound += 4.0 * delta * (abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta)
    return left - right, bound


@kernel
def signs(points, triangles, orientation, delta, out):
    """Sign of each triangle's area times its orientation: +1 or −1 where it is certain, 0 where the bound leaves a
    doubt.

    points: (N, 2) float64; triangles: (T, 3); orientation: (T,) ±1; delta: see above; out: (T,) int8. Returns the
    doubts.
    """
    uncertain = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        value, bound = determinant_and_bound(
            points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1], delta
        )
        if value > bound:
            out[t] = orientation[t]
        elif value < -bound:
            out[t] = -orientation[t]
        else:
            out[t] = 0
            uncertain += 1
    return uncertain
