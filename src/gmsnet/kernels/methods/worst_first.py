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
from gmsnet.kernels.simplex.mean_ratio2 import half_lengths, pull, roundness
from gmsnet.kernels.star.constraint import along_curve, on_curve
from gmsnet.kernels.star.guard import WITH_FLOORS, margin_above, margin_above_zero, permitted
from gmsnet.kernels.star.pattern import (
    count_of,
    neighbour_weight,
    neighbours,
    other_of,
    pair_of,
    pattern_at,
    weights_of,
)
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
def largest(ring, n, pattern, x, y):
    """The largest Q with the free node at (x, y), all triangles being positive. ring: x and y of each ring node."""
    most = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay, bx, by = ring[2 * i] - x, ring[2 * i + 1] - y, ring[2 * j] - x, ring[2 * j + 1] - y
        d = ax * by - ay * bx
        most = max(most, half_lengths(ax, ay, bx, by, weights) / d)
    return most


@part
def value_at(ring, n, pattern, x, y, inverse, doublings):
    """F with the free node at (x, y), 1/M given; infinite where a triangle is not positive."""
    value = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay, bx, by = ring[2 * i] - x, ring[2 * i + 1] - y, ring[2 * j] - x, ring[2 * j + 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = half_lengths(ax, ay, bx, by, weights) / d
        value += power(q * inverse, doublings)
    return value


@part
def newton(ring, n, pattern, x, y, inverse, doublings, constraint, node):
    """F with the free node at (x, y), 1/M given; the step from there; and the minimum D."""
    p = 2.0**doublings
    least = np.inf
    value, gx, gy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay, bx, by = ring[2 * i] - x, ring[2 * i + 1] - y, ring[2 * j] - x, ring[2 * j + 1] - y
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
        least = min(least, d)
        square = half_lengths(ax, ay, bx, by, weights)
        both = 1.0 / (square * d)
        per_square, per_d = d * both, square * both
        t = power(square * per_d * inverse, doublings)
        vx, vy = wx * per_d, wy * per_d
        ux, uy = pull(ax, bx, weights) * per_square + vx, pull(ay, by, weights) * per_square + vy
        even = roundness(2.0 * per_square, weights)
        value += t
        gx += t * ux
        gy += t * uy
        xx += t * (ux * ((p - 1.0) * ux + 2.0 * vx) + even)
        xy += t * ((p - 1.0) * (ux * uy) + (vx * uy + ux * vy))
        yy += t * (uy * ((p - 1.0) * uy + 2.0 * vy) + even)
    gx, gy, xx, xy, yy = along_curve(constraint, node, gx, gy, xx, xy, yy)
    dx, dy = newton_step(gx, gy, xx, xy, yy)
    longer = 1.0 / max(1.0 - (p + 1.0) * (gx * dx + gy * dy) / value, 1.0 / MOST)
    return value, longer * dx, longer * dy, least


@part
def descend(ring, n, pattern, x, y, scale, doublings, constraint, node):
    """Where the free node at (x, y) is to go: nowhere else if F falls nowhere; to the mean if the star is tangled.

    scale: the value to take for 1/M if no power of it is lost to rounding with that; else the star's own is taken.
    """
    inverse = scale
    for step in range(STEPS):
        value, dx, dy, least = newton(ring, n, pattern, x, y, inverse, doublings, constraint, node)
        if step == 0 and not least > 0.0:
            return mean(ring, n, pattern)
        if not (SMALLEST < value < 1.0 / SMALLEST):
            inverse = 1.0 / largest(ring, n, pattern, x, y)
            value, dx, dy, least = newton(ring, n, pattern, x, y, inverse, doublings, constraint, node)
        after, whole = np.inf, True
        for _ in range(SHORTENINGS):
            after = value_at(ring, n, pattern, x + dx, y + dy, inverse, doublings)
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
def mean(ring, n, pattern):
    """Of the neighbours."""
    x, y, share = 0.0, 0.0, neighbours(pattern, n)
    for j in range(n):
        if pattern is None:
            x += ring[2 * j] / n
            y += ring[2 * j + 1] / n
        else:
            weight = neighbour_weight(pattern, j) / share
            x += weight * ring[2 * j]
            y += weight * ring[2 * j + 1]
    return x, y


@part
def gather(points, i, stars, guard, star):
    """The nodes around node i, the floors of its simplices, and its largest coordinate, into ``star``.

    There: x and y of each node around, the floor of each simplex, and that coordinate. Returns the number of
    nodes around, and the pattern of the star.
    """
    start, around = stars.start, stars.around
    n, pattern = start[i + 1] - start[i], pattern_at(stars.patterns, stars.pattern, i)
    reach = max(abs(points[i, 0]), abs(points[i, 1]))
    for j in range(n):
        k = around[start[i] + j]
        star[2 * j], star[2 * j + 1] = points[k, 0], points[k, 1]
        reach = max(reach, max(abs(points[k, 0]), abs(points[k, 1])))
    count = count_of(pattern, n)
    for k in range(count):
        star[2 * n + k] = guard.floor
    if len(guard) == WITH_FLOORS:
        for k in range(count):
            a, b = pair_of(pattern, n, k)
            other = other_of(pattern, k, a)
            floor = max(guard.floors[around[start[i] + a]], guard.floors[around[start[i] + b]])
            star[2 * n + k] = max(guard.floors[i], max(floor, guard.floors[around[start[i] + other]]))
    star[2 * n + count] = reach
    return n, pattern


@part
def certified(star, n, pattern, tx, ty, delta):
    """Are all simplices certified above 0 and their floors with the free node at (tx, ty)?"""
    least = np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, bx, by = star[2 * i] - tx, star[2 * i + 1] - ty, star[2 * j] - tx, star[2 * j + 1] - ty
        floor = star[2 * n + k]
        if floor > 0.0:
            margin = margin_above(ax, ay, bx, by, delta, floor, weights_of(pattern, k, np.float64))
        else:
            margin = margin_above_zero(ax, ay, bx, by, delta)
        least = margin if not margin >= least else least
    return least > 0.0


@part
def allowed(star, n, pattern, x, y, tx, ty, delta):
    """The rule of the guard for a free node that is to go from (x, y) to (tx, ty), inverted simplices and all."""
    was, now = np.empty(6), np.empty(6)
    was[4], was[5], now[4], now[5] = x, y, tx, ty
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        was[0], was[1], was[2], was[3] = star[2 * i], star[2 * i + 1], star[2 * j], star[2 * j + 1]
        for c in range(4):  # an assignment of slices would take seconds to compile
            now[c] = was[c]
        if not permitted(was, now, delta, star[2 * n + k], weights_of(pattern, k, np.float64)):
            return False
    return True


@part
def way_there(star, n, pattern, x, y, tx, ty, guard, node):
    """How far (x, y) may go to (tx, ty): the halved shift that the guard allows (kernels.star.truncation), how often
    halved.

    No shift and HALVINGS if none is allowed.
    """
    dx, dy, reach = tx - x, ty - y, star[2 * n + count_of(pattern, n)]
    for halving in range(HALVINGS):
        tx, ty = x + dx, y + dy
        if guard.single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        tx, ty = on_curve(guard.constraint, node, tx, ty)
        if tx == x and ty == y:
            break
        delta = guard.unit * max(reach, max(abs(tx), abs(ty))) + guard.grain
        if certified(star, n, pattern, tx, ty, delta) or allowed(star, n, pattern, x, y, tx, ty, delta):
            return tx, ty, halving
        dx *= 0.5
        dy *= 0.5
    return x, y, HALVINGS
