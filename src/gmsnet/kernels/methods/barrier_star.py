"""Newton steps on F = Σ Q^p over the triangles of one star in float64, as many as pay: see kernels.methods.barrier."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.simplex.mean_ratio2 import half_lengths, pull, roundness
from gmsnet.kernels.star.constraint import along_curve
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, weights_of

MOST = 50.0  # times a Newton step: the longest one
FAR = 0.7  # of F: below it a step has led far, and another one pays
STEPS, HALVINGS = 20, 30
FLAT = 1e-10  # of the square of a trace: a smaller determinant is not known


class Power(NamedTuple):
    """Q^p = Q(one + Q(two + four Q²)): which of the three is 1, the others are 0. ratio: 1 + 1/p."""

    one: float
    two: float
    four: float
    ratio: float

    @classmethod
    def of(cls, p: int) -> Power:
        """For p = 1, 2 or 4."""
        return cls(float(p == 1), float(p == 2), float(p == 4), 1.0 + 1.0 / p)


@inlined
def spoke(star, row, lane, x, y):
    """From (x, y) to the node in a row of one lane's star."""
    at = 2 * ((row + 1) * LANES + lane)
    return star[at] - x, star[at + 1] - y


@part
def derivatives(x, y, star, n, pattern, lane, power):
    """One star in float64 with its free node at (x, y): F, −∇F, the Hessian (xx, xy, yy), the minimum D."""
    value, gx, gy, xx, xy, yy, even, least = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay = spoke(star, i, lane, x, y)
        bx, by = spoke(star, j, lane, x, y)
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
        least = min(least, d)
        inverse = 1.0 / d
        q = half_lengths(ax, ay, bx, by, weights) * inverse
        ux = (pull(ax, bx, weights) + q * wx) * inverse
        uy = (pull(ay, by, weights) + q * wy) * inverse
        qq = q * q
        c = power.one + q * (2.0 * power.two + 4.0 * power.four * qq)
        e = 2.0 * power.two + 12.0 * power.four * qq
        u = c * inverse
        tx, ty = u * wx, u * wy
        value += q * (power.one + q * (power.two + power.four * qq))
        gx += c * ux
        gy += c * uy
        xx += ux * (e * ux + 2.0 * tx)
        xy += e * ux * uy + (ux * ty + tx * uy)
        yy += uy * (e * uy + 2.0 * ty)
        even += roundness(u, weights)
    return value, gx, gy, xx + 2.0 * even, xy, yy + 2.0 * even, least


@part
def value_at(x, y, star, n, pattern, lane, power):
    """F of one star with its free node at (x, y), infinite where a triangle is not positive."""
    value = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay = spoke(star, i, lane, x, y)
        bx, by = spoke(star, j, lane, x, y)
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = half_lengths(ax, ay, bx, by, weights) / d
        value += q * (power.one + q * (power.two + power.four * (q * q)))
    return value


@inlined
def newton_step(gx, gy, xx, xy, yy):
    """H⁻¹g; where H is too flat to be inverted (close to a sliver), the minimum of the same quadratic along g."""
    determinant, trace = xx * yy - xy * xy, xx + yy
    if determinant > FLAT * trace * trace:
        return (yy * gx - xy * gy) / determinant, (xx * gy - xy * gx) / determinant
    bend = gx * (xx * gx + xy * gy) + gy * (xy * gx + yy * gy)
    length = (gx * gx + gy * gy) / bend if bend > 0.0 else 0.0
    return length * gx, length * gy


@part
def descend(star, n, pattern, lane, power, constraint, node):
    """The shift of one star from (x, y): steps, halved until F falls, on and on
    until a whole one leaves it above FAR of what it was.

    No shift where nothing is gained; that to the mean of the ring where a triangle is not positive.
    """
    x, y, dx, dy = star[2 * lane], star[2 * lane + 1], 0.0, 0.0
    for number in range(STEPS):
        value, gx, gy, xx, xy, yy, least = derivatives(x + dx, y + dy, star, n, pattern, lane, power)
        if number == 0 and not least > 0.0:
            for j in range(n):
                weight = neighbour_weight(pattern, j)
                ax, ay = spoke(star, j, lane, x, y)
                dx += weight * ax
                dy += weight * ay
            return dx / neighbours(pattern, n), dy / neighbours(pattern, n)
        gx, gy, xx, xy, yy = along_curve(constraint, node, gx, gy, xx, xy, yy)
        sx, sy = newton_step(gx, gy, xx, xy, yy)
        share = 1.0 / max(1.0 - power.ratio * (gx * sx + gy * sy) / value, 1.0 / MOST)
        after, whole = np.inf, True
        for _ in range(HALVINGS):
            after = value_at(x + dx + share * sx, y + dy + share * sy, star, n, pattern, lane, power)
            if after < value:
                break
            share *= 0.5
            whole = False
        if not after < value:
            break
        dx += share * sx
        dy += share * sy
        if whole and after >= FAR * value:
            break
    return dx, dy
