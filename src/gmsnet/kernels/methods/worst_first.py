"""Newton's method on a high power of q at single stars, for the worst cells of a mesh.

For the triangles (x, r_{i−1}, r_i) of a star, with the spokes a and b, D = a × b, w = ∇D = (a_y − b_y, b_x − a_x),
N = |a|² + |b|² − a·b and Q = N/D = √3·q, the objective is F = Σ (Q/M)^p, M the star's largest Q before the step and p a
power of two. With u = −∇Q/Q = (a + b)/N + w/D and T = (Q/M)^p,

    g = −∇F/p = Σ T u,    H = ∇²F/p = Σ T ((p − 1) u uᵀ + 2I/N + (w uᵀ + u wᵀ)/D).

The larger p, the nearer F^(1/p) is to the star's worst Q. A step is H⁻¹g/(1 − (1 + 1/p)λ), λ = p·gᵀH⁻¹g/F: Newton's
of F^(−1/p), as in kernels.methods.barrier. It is halved until F falls; F is convex, so that the guard may halve what
follows.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.methods.barrier_star import newton_step
from gmsnet.kernels.star.guard import WITH_FLOORS, margin_above, margin_above_zero, permitted
from gmsnet.kernels.star.truncation import HALVINGS

MOST = 50.0  # times a Newton step: the longest one
STEPS, FAR = 8, 0.8  # of a visit, at maximum: on while a step brings F below FAR of what it was
SHORTENINGS = 30
SMALLEST = 1e-200  # F, with margin: below it powers underflow


@inlined
def power(t, doublings):
    """t to the power of 2^doublings."""
    for _ in range(doublings):
        t *= t
    return t


@part
def largest(ring, n, x, y):
    """The largest Q with the free node at (x, y), all triangles being positive. ring: x and y of each ring node."""
    most = 0.0
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        d = ax * by - ay * bx
        most = max(most, ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) / d)
        ax, ay = bx, by
    return most


@part
def value_at(ring, n, x, y, inverse, doublings):
    """F with the free node at (x, y), 1/M given; infinite where a triangle is not positive."""
    value = 0.0
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) / d
        value += power(q * inverse, doublings)
        ax, ay = bx, by
    return value


@part
def newton(ring, n, x, y, inverse, doublings):
    """F with the free node at (x, y), 1/M given; the step from there; and the minimum D."""
    p = 2.0**doublings
    least = np.inf
    value, gx, gy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
        least = min(least, d)
        square = (bx * bx + by * by) + (ay * wx - ax * wy)
        both = 1.0 / (square * d)
        per_square, per_d = d * both, square * both
        t = power(square * per_d * inverse, doublings)
        vx, vy = wx * per_d, wy * per_d
        ux, uy = (ax + bx) * per_square + vx, (ay + by) * per_square + vy
        value += t
        gx += t * ux
        gy += t * uy
        xx += t * (ux * ((p - 1.0) * ux + 2.0 * vx) + 2.0 * per_square)
        xy += t * ((p - 1.0) * (ux * uy) + (vx * uy + ux * vy))
        yy += t * (uy * ((p - 1.0) * uy + 2.0 * vy) + 2.0 * per_square)
        ax, ay = bx, by
    dx, dy = newton_step(gx, gy, xx, xy, yy)
    longer = 1.0 / max(1.0 - (p + 1.0) * (gx * dx + gy * dy) / value, 1.0 / MOST)
    return value, longer * dx, longer * dy, least


@part
def descend(ring, n, x, y, scale, doublings):
    """Where the free node at (x, y) is to go: nowhere else if F falls nowhere; to the mean if the star is tangled.

    scale: the value to take for 1/M if no power of it is lost to rounding with that; else the star's own is taken.
    """
    inverse = scale
    for step in range(STEPS):
        value, dx, dy, least = newton(ring, n, x, y, inverse, doublings)
        if step == 0 and not least > 0.0:
            return mean(ring, n)
        if not (SMALLEST < value < 1.0 / SMALLEST):
            inverse = 1.0 / largest(ring, n, x, y)
            value, dx, dy, least = newton(ring, n, x, y, inverse, doublings)
        after, whole = np.inf, True
        for _ in range(SHORTENINGS):
            after = value_at(ring, n, x + dx, y + dy, inverse, doublings)
            if after < value:
                break
            dx *= 0.5
            dy *= 0.5
            whole = False
        if not after < value:
            break
        x += dx
        y += dy
        if whole and after >= FAR * value:
            break
    return x, y


@part
def mean(ring, n):
    """Of the ring."""
    x, y = 0.0, 0.0
    for j in range(n):
        x += ring[2 * j] / n
        y += ring[2 * j + 1] / n
    return x, y


@part
def gather(points, i, start, around, guard, star):
    """Ring and floors of one star, and its largest coordinate, into ``star``.

    There: x and y of each ring node, the floor of each triangle, j lying before ring node j, and that coordinate.
    """
    n = start[i + 1] - start[i]
    reach = max(abs(points[i, 0]), abs(points[i, 1]))
    for j in range(n):
        k = around[start[i] + j]
        star[2 * j], star[2 * j + 1] = points[k, 0], points[k, 1]
        reach = max(reach, max(abs(points[k, 0]), abs(points[k, 1])))
        star[2 * n + j] = guard.floor
    if len(guard) == WITH_FLOORS:
        for j in range(n):
            before, after = around[start[i] + (n - 1 if j == 0 else j - 1)], around[start[i] + j]
            star[2 * n + j] = max(guard.floors[i], max(guard.floors[before], guard.floors[after]))
    star[3 * n] = reach
    return n


@part
def certified(star, n, tx, ty, delta):
    """Are all triangles certified above 0 and their floors with the free node at (tx, ty)?"""
    ax, ay = star[2 * n - 2] - tx, star[2 * n - 1] - ty
    least = np.inf
    for j in range(n):
        bx, by, floor = star[2 * j] - tx, star[2 * j + 1] - ty, star[2 * n + j]
        margin = margin_above(ax, ay, bx, by, delta, floor) if floor > 0.0 else margin_above_zero(ax, ay, bx, by, delta)
        least = margin if not margin >= least else least
        ax, ay = bx, by
    return least > 0.0


@part
def allowed(star, n, x, y, tx, ty, delta):
    """The rule of the guard for a free node that is to go from (x, y) to (tx, ty), inverted triangles and all."""
    was, now = np.empty(6), np.empty(6)
    was[4], was[5], now[4], now[5] = x, y, tx, ty
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        was[0], was[1], was[2], was[3] = star[2 * i], star[2 * i + 1], star[2 * j], star[2 * j + 1]
        for k in range(4):  # an assignment of slices would take seconds to compile
            now[k] = was[k]
        if not permitted(was, now, delta, star[2 * n + j]):
            return False
    return True


@part
def way_there(star, n, x, y, tx, ty, unit, grain, single):
    """How far (x, y) may go to (tx, ty): the halved shift that the guard allows (kernels.star.truncation), how often
    halved.

    No shift and HALVINGS if none is allowed.
    """
    dx, dy = tx - x, ty - y
    for halving in range(HALVINGS):
        tx, ty = x + dx, y + dy
        if single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        if tx == x and ty == y:
            break
        delta = unit * max(star[3 * n], max(abs(tx), abs(ty))) + grain
        if certified(star, n, tx, ty, delta) or allowed(star, n, x, y, tx, ty, delta):
            return tx, ty, halving
        dx *= 0.5
        dy *= 0.5
    return x, y, HALVINGS
