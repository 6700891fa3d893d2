"""One node after the other towards a metric: Newton's method on the sum over the simplices of its star.

With the spokes a and b from a node at x, D is linear in x and L, in the metric as it is there, a quadratic form. With E
and s of quality.py,

    ∂E/E = ∂L/L + (s − 1) ∂D/D + s ∂t,
    ∂²E/E = ∂²L/L + (s − 1) (∂L ∂Dᵀ + ∂D ∂Lᵀ)/(L D) + 3 (1 − s) ∂D ∂Dᵀ/D²,   ∂²L = 2 (w_a + w_b) M̂,

where the second derivative takes the metric as constant. Where it is not positive definite, its middle term is left
out, without which it always is. A step is taken if the sum falls by it, with the metric as it is where it leads.

A node sleeps after a visit until a node of its star has moved by more than AWAKE of a spoke.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.metric.places import barycentric, found_at, locate
from gmsnet.kernels.metric.quality import EQUILATERAL_AREA, SQUARE_AREA, THIRD, hyperbolic, length_of, parts_of_length
from gmsnet.kernels.simplex.mean_ratio2 import TWO_SQRT3

HALVINGS, ARMIJO = 6, 1e-4
AWAKE = 1e-3


class Around(NamedTuple):
    """The simplices of nodes. cells: (S, 3) counter-clockwise. table: (S, 3) weights of the edges 01, 02 and 12, None
    where all are 1. start: (n + 1,) and entries: 3t + c for corner c of simplex t, of each of n nodes."""

    cells: NDArray[np.int32]
    table: NDArray[np.float64] | None
    start: NDArray[np.int64]
    entries: NDArray[np.int32]


class Term(NamedTuple):
    """What is summed: (E/(1 − floor·E)/top)^p, p = 2^doublings."""

    floor: float
    doublings: int
    top: float


@kernel
def around(cells, number, count):
    """start and entries of an ``Around``. number: (N,) the row of each node, −1 of others; count: of the rows."""
    start = np.zeros(count + 1, dtype=np.int64)
    for t in range(len(cells)):
        for c in range(3):
            row = number[cells[t, c]]
            if row >= 0:
                start[row + 1] += 1
    for i in range(count):
        start[i + 1] += start[i]
    end, entries = start[:-1].copy(), np.empty(start[count], dtype=np.int32)
    for t in range(len(cells)):
        for c in range(3):
            row = number[cells[t, c]]
            if row >= 0:
                entries[end[row]] = 3 * t + c
                end[row] += 1
    return start, entries


@inlined
def weighted(table, t, c):
    """The weights of the edges from corner c of simplex t to the next corner, to the last, and between these; D₀."""
    if table is None:
        return 1.0, 1.0, 1.0, EQUILATERAL_AREA
    wa, wb, wo = table[t, 0], table[t, 1], table[t, 2]
    area = EQUILATERAL_AREA if min(wa, min(wb, wo)) > 0.0 else SQUARE_AREA
    if c == 0:
        return wa, wb, wo, area
    if c == 1:
        return wo, wa, wb, area
    return wb, wo, wa, area


@inlined
def seen(star, entry):
    """The other two nodes of a simplex, counter-clockwise, and its ``weighted``."""
    t, c = entry // 3, entry % 3
    wa, wb, wo, area = weighted(star.table, t, c)
    return star.cells[t, (c + 1) % 3], star.cells[t, (c + 2) % 3], wa, wb, wo, area


@inlined
def term_of(energy, term):
    """What E contributes, and its first and second derivative by E; +∞ beyond the barrier."""
    value, first, second = energy, 1.0, 0.0
    if term.floor > 0.0:
        left = 1.0 - term.floor * energy
        if not left > 0.0:
            return np.inf, 0.0, 0.0
        value = energy / left
        first = 1.0 / (left * left)
        second = 2.0 * term.floor * first / left
    if term.doublings > 0:
        power, p = value / term.top, 2.0**term.doublings
        for _ in range(term.doublings):
            power *= power
        slope = p * power / value
        second = slope * second + (p - 1.0) * slope / value * first * first
        first *= slope
        value = power
    return value, first, second


@part
def value_at(star, term, row, points, logs, x, y, own_t, own_u, own_v):
    """The sum over the star of a node at (x, y) with this logarithm; +∞ where a simplex has no area."""
    total = 0.0
    for k in range(star.start[row], star.start[row + 1]):
        p, r, wa, wb, wo, area = seen(star, star.entries[k])
        ax, ay, bx, by = points[p, 0] - x, points[p, 1] - y, points[r, 0] - x, points[r, 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        t = THIRD * (own_t + logs[p, 0] + logs[r, 0])
        u, v = THIRD * (own_u + logs[p, 1] + logs[r, 1]), THIRD * (own_v + logs[p, 2] + logs[r, 2])
        c, s, _ = hyperbolic(u * u + v * v)
        length = length_of(ax, ay, bx, by, (wa, wb, wo), c, s, u, v)
        tau = math.exp(t) * d / area
        value, _, _ = term_of(length / (TWO_SQRT3 * d) * 0.5 * (tau + 1.0 / tau), term)
        total += value
    return total


@part
def model(star, term, row, points, logs, slopes, i):
    """The sum over the star of node i, its gradient, the second derivative in two parts (the whole one, and what is
    to be taken from it where it is not positive definite), and the mean square of the spokes."""
    x, y = points[i, 0], points[i, 1]
    total, gx, gy, hxx, hxy, hyy, mxx, mxy, myy, spokes = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(star.start[row], star.start[row + 1]):
        p, r, wa, wb, wo, area = seen(star, star.entries[k])
        ax, ay, bx, by = points[p, 0] - x, points[p, 1] - y, points[r, 0] - x, points[r, 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf, gx, gy, hxx, hxy, hyy, mxx, mxy, myy, spokes
        t = THIRD * (logs[i, 0] + logs[p, 0] + logs[r, 0])
        u, v = THIRD * (logs[i, 1] + logs[p, 1] + logs[r, 1]), THIRD * (logs[i, 2] + logs[p, 2] + logs[r, 2])
        c, s, bend, plain, along, across, skew = parts_of_length(ax, ay, bx, by, (wa, wb, wo), u, v)
        length = c * plain + s * skew
        tau = math.exp(t) * d / area
        energy = length / (TWO_SQRT3 * d) * 0.5 * (tau + 1.0 / tau)
        value, first, second = term_of(energy, term)
        if not value < np.inf:
            return np.inf, gx, gy, hxx, hxy, hyy, mxx, mxy, myy, spokes
        total += value
        spokes += ax * ax + ay * ay
        size = (tau - 1.0 / tau) / (tau + 1.0 / tau)
        m11, m12, m22 = c + s * u, s * v, c - s * u
        fx, fy, dx, dy = wa * ax + wb * bx, wa * ay + wb * by, (ay - by) / d, (bx - ax) / d
        lx, ly = -2.0 * (m11 * fx + m12 * fy) / length, -2.0 * (m12 * fx + m22 * fy) / length
        by_u, by_v = (
            (s * (u * plain + along) + bend * u * skew) / length,
            (s * (v * plain + across) + bend * v * skew) / length,
        )
        ex = lx + (size - 1.0) * dx + THIRD * (size * slopes[i, 0, 0] + by_u * slopes[i, 1, 0] + by_v * slopes[i, 2, 0])
        ey = ly + (size - 1.0) * dy + THIRD * (size * slopes[i, 0, 1] + by_u * slopes[i, 1, 1] + by_v * slopes[i, 2, 1])
        steep = first * energy
        gx += steep * ex
        gy += steep * ey
        bent = second * energy * energy
        twice, push = 2.0 * (wa + wb) / length, 3.0 * (1.0 - size)
        hxx += steep * (twice * m11 + push * dx * dx) + bent * ex * ex
        hxy += steep * (twice * m12 + push * dx * dy) + bent * ex * ey
        hyy += steep * (twice * m22 + push * dy * dy) + bent * ey * ey
        mixed = steep * (size - 1.0)
        mxx += mixed * 2.0 * lx * dx
        mxy += mixed * (lx * dy + ly * dx)
        myy += mixed * 2.0 * ly * dy
    return total, gx, gy, hxx, hxy, hyy, mxx, mxy, myy, spokes / max(1, star.start[row + 1] - star.start[row])


@inlined
def solved(gx, gy, hxx, hxy, hyy):
    """−H⁻¹g, and whether H is positive definite."""
    determinant = hxx * hyy - hxy * hxy
    if not (hxx > 0.0 and determinant > 1e-6 * hxx * hyy):
        return 0.0, 0.0, False
    return (hxy * gy - hyy * gx) / determinant, (hxy * gx - hxx * gy) / determinant, True


@part
def log_at(background, t, x, y):
    """The logarithm of the metric at a place in triangle t, or at the nearest place of it."""
    one, two, three = barycentric(background, t, x, y)
    one, two, three = max(one, 0.0), max(two, 0.0), max(three, 0.0)
    inverse = 1.0 / (one + two + three)
    i, j, k = background.triangles[t, 0], background.triangles[t, 1], background.triangles[t, 2]
    at = background.logs
    return (
        (one * at[i, 0] + two * at[j, 0] + three * at[k, 0]) * inverse,
        (one * at[i, 1] + two * at[j, 1] + three * at[k, 1]) * inverse,
        (one * at[i, 2] + two * at[j, 2] + three * at[k, 2]) * inverse,
    )


@kernel
def sweep(points, nodes, star, term, background, where, logs, slopes, awake):
    """Visits the nodes (n,) that are awake, in their order; by how much the sum falls.

    star: an ``Around`` of these nodes, by their rows. where: (N,) a triangle of the background near each node; logs
    (N, 3), slopes (N, 3, 2): of the metric at the nodes. All are written, as ``points`` (N, 2) and awake (N,) are.
    """
    fallen = 0.0
    for row in range(len(nodes)):
        i = nodes[row]
        if not awake[i]:
            continue
        awake[i] = False
        total, gx, gy, hxx, hxy, hyy, mxx, mxy, myy, spokes = model(star, term, row, points, logs, slopes, i)
        if not total < np.inf:
            continue
        sx, sy, definite = solved(gx, gy, hxx + mxx, hxy + mxy, hyy + myy)
        if not definite:
            sx, sy, definite = solved(gx, gy, hxx, hxy, hyy)
        promised = gx * sx + gy * sy
        if not (definite and promised < 0.0):
            continue
        length = 1.0
        for _ in range(HALVINGS):
            x, y = points[i, 0] + length * sx, points[i, 1] + length * sy
            found = locate(background, where[i], x, y)
            t, u, v = log_at(background, found, x, y)
            after = value_at(star, term, row, points, logs, x, y, t, u, v)
            if after <= total + ARMIJO * length * promised:
                points[i, 0], points[i, 1], where[i] = x, y, found
                found_at(background, found, x, y, logs, slopes, i)
                fallen += total - after
                if length * length * (sx * sx + sy * sy) > AWAKE * AWAKE * spokes:
                    awake[i] = True
                    for k in range(star.start[row], star.start[row + 1]):
                        for c in range(3):
                            awake[star.cells[star.entries[k] // 3, c]] = True
                break
            length *= 0.5
    return fallen
