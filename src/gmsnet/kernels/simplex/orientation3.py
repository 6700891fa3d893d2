"""Orientation of tetrahedra in float64 with a forward error bound.

With u = 2⁻⁵³ the computed determinant of

    D = (a − d)·((b − d) × (c − d))                                        (six times the signed volume)

is off by at most (7 + 56u)·u·P, P its permanent: the same sum with all products taken positive (Shewchuk 1997, section
4.4, bound A). If the coordinates themselves are only known up to ±δ, each difference is off by 2δ more. With m the
largest of the nine differences, D is a sum of six products of three, which changes by at most
6·((m + 2δ)³ − m³) = 36δ·m² + 72δ²·m + 48δ³ with that. Twice that is used, so that the bound's own rounding does not
matter.
"""

from __future__ import annotations

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT

SHEWCHUK = (7.0 + 56.0 * UNIT) * UNIT


@inlined
def largest_component(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Of three spokes, without its sign."""
    m = max(max(max(abs(ax), abs(ay)), abs(az)), max(max(abs(bx), abs(by)), abs(bz)))
    return max(m, max(max(abs(cx), abs(cy)), abs(cz)))


@inlined
def determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, delta):
    """D of the spokes a, b, c, and how far it may be from the true one if coordinates are known up to ±delta."""
    bc, cb, ca, ac, ab, ba = bx * cy, cx * by, cx * ay, ax * cy, ax * by, bx * ay
    value = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)  # as mean_ratio3.determinant
    permanent = abs(az) * (abs(bc) + abs(cb)) + abs(bz) * (abs(ca) + abs(ac)) + abs(cz) * (abs(ab) + abs(ba))
    m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
    return value, SHEWCHUK * permanent + UNDERFLOW + delta * (72.0 * m * m + delta * (144.0 * m + 96.0 * delta))


@inlined
def spokes_of(points, rows, t):
    """From node 0 of row t to its nodes 1, 2 and 3."""
    d, a, b, c = rows[t, 0], rows[t, 1], rows[t, 2], rows[t, 3]
    x, y, z = points[d, 0], points[d, 1], points[d, 2]
    return (
        points[a, 0] - x, points[a, 1] - y, points[a, 2] - z,
        points[b, 0] - x, points[b, 1] - y, points[b, 2] - z,
        points[c, 0] - x, points[c, 1] - y, points[c, 2] - z,
    )  # fmt: skip


@kernel
def signs(points, rows, orientation, delta, out):
    """Sign of each volume times the cell's orientation: ±1 where it is certain, 0 where the bound leaves a doubt.

    points: (N, 3 or more) float64; rows: (T, 4); orientation: (T,) ±1; delta: see above; out: (T,) int8. Returns the
    doubts.
    """
    uncertain = 0
    for t in range(len(rows)):
        ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
        value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, delta)
        if value > bound:
            out[t] = orientation[t]
        elif value < -bound:
            out[t] = -orientation[t]
        else:
            out[t] = 0
            uncertain += 1
    return uncertain


@kernel
def count_signs(points, rows):
    """How many tetrahedra have a positive volume, and how many a negative one, as computed."""
    positive, negative = 0, 0
    for t in range(len(rows)):
        ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
        value, _ = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, 0.0)
        positive += value > 0.0
        negative += value < 0.0
    return positive, negative
