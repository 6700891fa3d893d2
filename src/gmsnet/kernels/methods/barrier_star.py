"""Newton steps on F = Σ Q^p over the triangles of one star in float64, as many as pay: see kernels.methods.barrier."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part

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


@part
def derivatives(x, y, star, n, lane, power):
    """One star in float64 with its free node at (x, y): F, −∇F, the Hessian (xx, xy, yy), the minimum D."""
    value, gx, gy, xx, xy, yy, even, least = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.inf
    a = 2 * (n * LANES + lane)
    ax, ay = star[a] - x, star[a + 1] - y
    for j in range(n):
        b = 2 * ((j + 1) * LANES + lane)
        bx, by = star[b] - x, star[b + 1] - y
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
        least = min(least, d)
        inverse = 1.0 / d
        q = ((bx * bx + by * by) + (ay * wx - ax * wy)) * inverse
        ux = ((ax + bx) + q * wx) * inverse
        uy = ((ay + by) + q * wy) * inverse
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
        even += u
        ax, ay = bx, by
    return value, gx, gy, xx + 2.0 * even, xy, yy + 2.0 * even, least


@part
def value_at(x, y, star, n, lane, power):
    """F of one star with its free node at (x, y), infinite where a triangle is not positive."""
    value = 0.0
    a = 2 * (n * LANES + lane)
    ax, ay = star[a] - x, star[a + 1] - y
    for j in range(n):
        b = 2 * ((j + 1) * LANES + lane)
        bx, by = star[b] - x, star[b + 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) / d
        value += q * (power.one + q * (power.two + power.four * (q * q)))
        ax, ay = bx, by
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
def descend(star, n, lane, power):
    """The shift of one star from (x, y): steps, halved until F falls, on and on
    until a whole one leaves it above FAR of what it was.

    No shift where nothing is gained; that to the mean of the ring where a triangle is not positive.
    """
    x, y, dx, dy = star[2 * lane], star[2 * lane + 1], 0.0, 0.0
    for number in range(STEPS):
        value, gx, gy, xx, xy, yy, least = derivatives(x + dx, y + dy, star, n, lane, power)
        if number == 0 and not least > 0.0:
            for j in range(n):
                dx += star[2 * ((j + 1) * LANES + lane)] - x
                dy += star[2 * ((j + 1) * LANES + lane) + 1] - y
            return dx / n, dy / n
        sx, sy = newton_step(gx, gy, xx, xy, yy)
        share = 1.0 / max(1.0 - power.ratio * (gx * sx + gy * sy) / value, 1.0 / MOST)
        after, whole = np.inf, True
        for _ in range(HALVINGS):
            after = value_at(x + dx + share * sx, y + dy + share * sy, star, n, lane, power)
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
