"""Newton's method on a high power of q at single stars, for the worst cells of a mesh.

For the triangles (x, r_{i−1}, r_i) of a star, with the spokes a and b, D = a × b, w = ∇D = (a_y − b_y, b_x − a_x),
N = |a|² + |b|² − a·b and Q = N/D = √3·q, the objective is F = Σ (Q/M)^p, M the star's largest Q before the step and p a
power of two. With u = −∇Q/Q = (a + b)/N + w/D and T = (Q/M)^p,

    g = −∇F/p = Σ T u,    H = ∇²F/p = Σ T ((p − 1) u uᵀ + 2I/N + (w uᵀ + u wᵀ)/D).

The larger p, the nearer F^(1/p) is to the star's worst Q. A step is H⁻¹g/(1 − (1 + 1/p)λ), λ = p·gᵀH⁻¹g/F: Newton's
of F^(−1/p), as in kernels.barrier. It is halved until F falls; F is convex, so that the guard may halve what follows.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import inlined, kernel
from gmsnet.kernels.guard import STAR, permitted, surplus_above, surplus_above_zero
from gmsnet.kernels.stars import DROPPED, HALVINGS, MOVED, TRUNCATED

MOST = 50.0  # times a Newton step: the longest one
STEPS, FAR = 8, 0.8  # of a visit, at most: on while a step brings F below FAR of what it was
SHORTENINGS = 30


@inlined
def power(t, doublings):
    """t to the power of 2^doublings."""
    for _ in range(doublings):
        t *= t
    return t


@kernel
def largest(ring, n, x, y):
    """The largest Q with the free node at (x, y), infinite where a triangle is not positive. ring: x, y of each."""
    most = 0.0
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        most = max(most, ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) / d)
        ax, ay = bx, by
    return most


@kernel
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


@kernel
def newton(ring, n, x, y, inverse, doublings):
    """F with the free node at (x, y), 1/M given, and the step from there: none where rounding hides it."""
    p = 2.0**doublings
    value, gx, gy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ax, ay = ring[2 * n - 2] - x, ring[2 * n - 1] - y
    for j in range(n):
        bx, by = ring[2 * j] - x, ring[2 * j + 1] - y
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
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
    determinant = xx * yy - xy * xy
    if not determinant > 0.0:  # F is convex: only rounding does that
        return value, 0.0, 0.0
    dx, dy = (yy * gx - xy * gy) / determinant, (xx * gy - xy * gx) / determinant
    longer = 1.0 / max(1.0 - (p + 1.0) * (gx * dx + gy * dy) / value, 1.0 / MOST)
    return value, longer * dx, longer * dy


@kernel
def descend(ring, n, x, y, doublings):
    """Where the free node at (x, y) is to go: nowhere else if F falls nowhere; to the mean if the star is tangled."""
    most = largest(ring, n, x, y)
    if not most < np.inf:
        x, y = 0.0, 0.0
        for j in range(n):
            x += ring[2 * j] / n
            y += ring[2 * j + 1] / n
        return x, y
    for _ in range(STEPS):
        inverse = 1.0 / most
        value, dx, dy = newton(ring, n, x, y, inverse, doublings)
        after = np.inf
        for _ in range(SHORTENINGS):
            after = value_at(ring, n, x + dx, y + dy, inverse, doublings)
            if after < value or (dx == 0.0 and dy == 0.0):
                break
            dx *= 0.5
            dy *= 0.5
        if not after < value:
            break
        x += dx
        y += dy
        if after >= FAR * value:
            break
        most = largest(ring, n, x, y)
    return x, y


@kernel
def gather(points, i, start, around, guard, ring, floors):
    """Ring and floors of one star, x and y of each ring node and of each triangle before it; its largest coordinate."""
    n = start[i + 1] - start[i]
    reach = max(abs(points[i, 0]), abs(points[i, 1]))
    for j in range(n):
        k = around[start[i] + j]
        ring[2 * j], ring[2 * j + 1] = points[k, 0], points[k, 1]
        reach = max(reach, max(abs(points[k, 0]), abs(points[k, 1])))
        floors[j] = guard.floor
        if guard.level == STAR:
            before = around[start[i] + (n - 1 if j == 0 else j - 1)]
            floors[j] = max(guard.floors[i], max(guard.floors[before], guard.floors[k]))
    return n, reach


@kernel
def allowed(ring, n, x, y, tx, ty, delta, floors, was, now):
    """The rule of the guard for a star whose free node is to go from (x, y) to (tx, ty). was, now: (6,) to work in."""
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        px, py, qx, qy = ring[2 * i] - tx, ring[2 * i + 1] - ty, ring[2 * j] - tx, ring[2 * j + 1] - ty
        if floors[j] > 0.0:
            surplus = surplus_above(px, py, qx, qy, delta, floors[j])
        else:
            surplus = surplus_above_zero(px, py, qx, qy, delta)
        if surplus > 0.0:
            continue
        was[0], was[1], was[2], was[3] = ring[2 * i], ring[2 * i + 1], ring[2 * j], ring[2 * j + 1]
        now[:4] = was[:4]
        was[4], was[5], now[4], now[5] = x, y, tx, ty
        if not permitted(was, now, delta, floors[j]):
            return False
    return True


@kernel
def commit(points, i, ring, n, reach, tx, ty, guard, floors, corners, tally):
    """Moves node i to (tx, ty), or as far there as the guard allows, halving the way (kernels.stars.truncate)."""
    x, y = points[i, 0], points[i, 1]
    dx, dy = tx - x, ty - y
    for halving in range(HALVINGS):
        tx, ty = x + dx, y + dy
        if guard.single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        if tx == x and ty == y:
            break
        delta = guard.unit * max(reach, max(abs(tx), abs(ty))) + guard.grain
        if allowed(ring, n, x, y, tx, ty, delta, floors, corners[:6], corners[6:]):
            points[i, 0], points[i, 1] = tx, ty
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx *= 0.5
        dy *= 0.5
    tally[DROPPED] += 1


@kernel
def visit(points, nodes, start, around, guard, doublings, sweeps, tally):
    """Visits the nodes in their order, so many times, p = 2^doublings. tally: (3,), added to.

    start, around: the rings of all nodes, in CSR form.
    """
    most = 0
    for i in nodes:
        most = max(most, start[i + 1] - start[i])
    ring, floors, corners = np.empty(2 * most), np.empty(most), np.empty(12)
    for _ in range(sweeps):
        for i in nodes:
            n, reach = gather(points, i, start, around, guard, ring, floors)
            tx, ty = descend(ring, n, points[i, 0], points[i, 1], doublings)
            if tx != points[i, 0] or ty != points[i, 1]:
                commit(points, i, ring, n, reach, tx, ty, guard, floors, corners, tally)
