"""How near corner simplices come to the unit simplex of a metric, and the sum of that over a mesh with its gradient.

A metric M at a place is kept as its logarithm in three numbers (t, u, v),

    log M = t·I + [[u, v], [v, −u]],   M = e^t M̂,   M̂ = cosh r·I + (sinh r/r) [[u, v], [v, −u]],   r² = u² + v²,

so that e^t is √det M and det M̂ = 1. A simplex has the mean of its nodes' logarithms (Arsigny, Fillard, Pennec, Ayache:
Log-Euclidean metrics, Magnetic Resonance in Medicine 56, 2006). With the spokes a and b and the ideal corner W, whose
doubled area is D₀, and T = M^½ A W⁻¹,

    1/q = 2√3·D/L,   L = Σ w_e eᵀ M̂ e,   τ = det T = e^t D/D₀,
    E = q (τ + 1/τ)/2 = (‖T‖² + ‖T⁻¹‖²)/4,

the symmetric Dirichlet energy of the map from the ideal simplex (metric 7 of Knupp: Metric type in the target-matrix
mesh optimization paradigm, Lawrence Livermore 2020). It is 1 where the simplex is ideal in shape and size, larger
elsewhere, and infinite where the area is 0. 1/E is the quality in the metric: 1/q times 2τ/(1 + τ²), both at most 1.

    dE/E = dL/L + (s − 1) dD/D + s dt,   s = (τ² − 1)/(τ² + 1).
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.simplex.mean_ratio2 import TWO_SQRT3

THIRD = 1.0 / 3.0
SMALL = 1e-4  # of r: below, the series are exact
# Of a simplex with the weights 1, 1, 1 and of a square corner: D₀.
EQUILATERAL_AREA, SQUARE_AREA = 0.5 * math.sqrt(3.0), 1.0
SHARE, LENGTH, TENSION = range(3)  # columns of what a simplex contributes to the Laplacian


@inlined
def hyperbolic(r2):
    """cosh r, sinh r/r, and (cosh r − sinh r/r)/r², from r²."""
    if r2 < SMALL:
        return 1.0 + r2 * (0.5 + r2 / 24.0), 1.0 + r2 * (THIRD * 0.5 + r2 / 120.0), THIRD + r2 / 30.0
    r = math.sqrt(r2)
    grown = math.exp(r)
    c, s = 0.5 * (grown + 1.0 / grown), 0.5 * (grown - 1.0 / grown) / r
    return c, s, (c - s) / r2


@inlined
def ideal(table, t):
    """The weights of simplex t of a table (S, 3), None: all are equilateral; and D₀."""
    if table is None:
        return 1.0, 1.0, 1.0, EQUILATERAL_AREA
    smallest = min(table[t, 0], table[t, 1], table[t, 2])
    return table[t, 0], table[t, 1], table[t, 2], EQUILATERAL_AREA if smallest > 0.0 else SQUARE_AREA


@inlined
def square(x, y, c, s, u, v):
    """eᵀ M̂ e."""
    return c * (x * x + y * y) + s * (u * (x * x - y * y) + 2.0 * v * x * y)


@inlined
def length_of(ax, ay, bx, by, weights, c, s, u, v):
    """L of a simplex."""
    wa, wb, wo = weights
    length = wa * square(ax, ay, c, s, u, v) + wb * square(bx, by, c, s, u, v)
    return length + wo * square(bx - ax, by - ay, c, s, u, v)


@inlined
def parts_of_length(ax, ay, bx, by, weights, u, v):
    """c, s and bend of ``hyperbolic``; Σ w_e of x² + y², of x² − y² and of 2xy; what u and v make of the last two."""
    wa, wb, wo = weights
    c, s, bend = hyperbolic(u * u + v * v)
    ex, ey = bx - ax, by - ay
    plain = wa * (ax * ax + ay * ay) + wb * (bx * bx + by * by) + wo * (ex * ex + ey * ey)
    along = wa * (ax * ax - ay * ay) + wb * (bx * bx - by * by) + wo * (ex * ex - ey * ey)
    across = 2.0 * (wa * ax * ay + wb * bx * by + wo * ex * ey)
    return c, s, bend, plain, along, across, u * along + v * across


@kernel
def qualities(points, cells, table, logs, out):
    """1/E of each simplex (S,); 0 or less, as 1/q is, where the area is not positive.

    points: (N, 2). cells: (S, 3) counter-clockwise. table: (S, 3) weights of the edges 01, 02 and 12, None where all
    are 1. logs: (N, 3) of the metric at each node.
    """
    for n in range(len(cells)):
        i, j, k = cells[n, 0], cells[n, 1], cells[n, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        t = THIRD * (logs[i, 0] + logs[j, 0] + logs[k, 0])
        u = THIRD * (logs[i, 1] + logs[j, 1] + logs[k, 1])
        v = THIRD * (logs[i, 2] + logs[j, 2] + logs[k, 2])
        c, s, _ = hyperbolic(u * u + v * v)
        wa, wb, wo, area = ideal(table, n)
        d = ax * by - ay * bx
        length = length_of(ax, ay, bx, by, (wa, wb, wo), c, s, u, v)
        shape = TWO_SQRT3 * d / length if length > 0.0 else 0.0
        tau = math.exp(t) * d / area
        out[n] = shape * (2.0 / (tau + 1.0 / tau)) if d > 0.0 else min(shape, 0.0)


@kernel
def energy(points, cells, table, logs, slopes, floor, doublings, top, gradient, share):
    """ΣE, or Σ(E/top)^p, p = 2^doublings, and its gradient by all nodes (N, 2); +∞ where a simplex has no area.

    With a floor, E/(1 − floor·E) stands for E: it becomes infinite where 1/E falls to the floor. slopes: (N, 3, 2) of
    the logarithms by the place of each node. share: (S,) how stiff each simplex is: the sum's second derivative by the
    square of a length in M̂. The rest is as in ``qualities``.
    """
    gradient[:] = 0.0
    total, p = 0.0, 2.0**doublings
    for n in range(len(cells)):
        i, j, k = cells[n, 0], cells[n, 1], cells[n, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        t = THIRD * (logs[i, 0] + logs[j, 0] + logs[k, 0])
        u = THIRD * (logs[i, 1] + logs[j, 1] + logs[k, 1])
        v = THIRD * (logs[i, 2] + logs[j, 2] + logs[k, 2])
        wa, wb, wo, area = ideal(table, n)
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        c, s, bend, plain, along, across, skew = parts_of_length(ax, ay, bx, by, (wa, wb, wo), u, v)
        ex, ey = bx - ax, by - ay
        length = c * plain + s * skew
        tau = math.exp(t) * d / area
        value = length / (TWO_SQRT3 * d) * 0.5 * (tau + 1.0 / tau)
        steep = value  # d of the term by d ln E
        if floor > 0.0:
            left = 1.0 - floor * value
            if not left > 0.0:
                return np.inf
            value = value / left
            steep = value / left
        if doublings > 0:
            power = value / top
            for _ in range(doublings):
                power *= power
            steep *= p * power / value
            value = power
        if not value < np.inf:
            return np.inf
        total += value
        size = (tau - 1.0 / tau) / (tau + 1.0 / tau)
        by_length, by_area = steep / length, steep * (size - 1.0) / d
        share[n] = 2.0 * by_length
        by_u, by_v = (
            by_length * (s * (u * plain + along) + bend * u * skew),
            by_length * (s * (v * plain + across) + bend * v * skew),
        )
        by_t = steep * size
        # M̂ times the weighted edges
        fx, fy = wa * ax - wo * ex, wa * ay - wo * ey
        gx, gy = wb * bx + wo * ex, wb * by + wo * ey
        m11, m12, m22 = c + s * u, s * v, c - s * u
        jx = 2.0 * by_length * (m11 * fx + m12 * fy) + by_area * by
        jy = 2.0 * by_length * (m12 * fx + m22 * fy) - by_area * bx
        kx = 2.0 * by_length * (m11 * gx + m12 * gy) - by_area * ay
        ky = 2.0 * by_length * (m12 * gx + m22 * gy) + by_area * ax
        gradient[j, 0] += jx
        gradient[j, 1] += jy
        gradient[k, 0] += kx
        gradient[k, 1] += ky
        gradient[i, 0] -= jx + kx
        gradient[i, 1] -= jy + ky
        for corner in range(3):
            i = cells[n, corner]
            for axis in range(2):
                moved = by_t * slopes[i, 0, axis] + by_u * slopes[i, 1, axis] + by_v * slopes[i, 2, axis]
                gradient[i, axis] += THIRD * moved
    return total
