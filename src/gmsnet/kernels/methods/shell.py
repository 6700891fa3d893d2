"""Newton's method on powers of q at single stars of a surface, in the tangent plane of each.

With the spokes a and b of a simplex, c = a × b, D = |c| and its unit normal m = c/D, let N = L/2 and Q = N/D = √3·q in
space. A step t of the node makes c that of a − t and b − t: c + t × (a − b), so that ∇D = w = (a − b) × m, and
∇N = −(w_a a + w_b b), as in the plane (kernels.simplex.mean_ratio2). With u = −∇Q/Q = (w_a a + w_b b)/N + w/D,
T = (Q/M)^p, and all of them along two directions of the star's tangent plane,

    g = −∇F/p = Σ T u,    H = ∇²F/p = Σ T ((p − 1) u uᵀ + (w_a + w_b)I/N + (w uᵀ + u wᵀ)/D).

What is left out of H is how m and the tangent plane turn, which a step of this size does not feel. A step is lengthened
as in the plane (kernels.methods.worst_first). Where it leads is put onto the reference before it is judged: a step is
halved until F falls there, and the guard allows it.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.methods.barrier_star import newton_step
from gmsnet.kernels.methods.worst_first import power
from gmsnet.kernels.simplex.mean_ratio2 import pull, roundness
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.chords import near
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of
from gmsnet.kernels.star.shell import allowed, crossed, gather, half_lengths3, square
from gmsnet.kernels.star.surface import directions_at, land_on, on_curves

MOST = 50.0  # times a Newton step: the longest one
HALVINGS = 10
FAR = 0.8  # on while a step brings F below FAR of what it was
STILL = 1e-8  # of a spoke's square: a move of less leaves a star be
SMALLEST = 1e-200  # F, with margin: below it powers underflow
FLAT = 1e-6  # of F: what promises less is no gain

VALUE, GX, GY, XX, XY, YY, SX, SY, SZ = range(9)  # of sums; the last three: of c


@inlined
def value_at(star, n, pattern, x, y, z, inverse, doublings):
    """F with the free node at (x, y, z), 1/M given, and the largest Q; infinite where a simplex has no area."""
    value, most = 0.0, 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, az = star[3 * i] - x, star[3 * i + 1] - y, star[3 * i + 2] - z
        bx, by, bz = star[3 * j] - x, star[3 * j + 1] - y, star[3 * j + 2] - z
        cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
        double = math.sqrt(square(cx, cy, cz))
        if not double > 0.0:
            return np.inf, np.inf
        q = half_lengths3(ax, ay, az, bx, by, bz, weights_of(pattern, k, np.float64)) / double
        value += power(q * inverse, doublings)
        most = max(most, q)
    return value, most


@inlined
def tangents(star, n, pattern, x, y, z, frame):
    """Two directions of the tangent plane of a star, into ``frame`` (6,), from the sum of its c."""
    sx, sy, sz = 0.0, 0.0, 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, az = star[3 * i] - x, star[3 * i + 1] - y, star[3 * i + 2] - z
        bx, by, bz = star[3 * j] - x, star[3 * j + 1] - y, star[3 * j + 2] - z
        cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
        sx, sy, sz = sx + cx, sy + cy, sz + cz
    across(sx, sy, sz, frame)


@inlined
def across(sx, sy, sz, frame):
    """Two unit vectors across a vector of any length, into ``frame``."""
    length = math.sqrt(square(sx, sy, sz))
    if not length > 0.0:
        sx, sy, sz, length = 0.0, 0.0, 1.0, 1.0
    sx, sy, sz = sx / length, sy / length, sz / length
    # Duff et al.: Building an orthonormal basis, revisited (2017).
    sign = 1.0 if sz >= 0.0 else -1.0
    p = -1.0 / (sign + sz)
    q = sx * sy * p
    frame[0], frame[1], frame[2] = 1.0 + sign * sx * sx * p, sign * q, -sign * sx
    frame[3], frame[4], frame[5] = q, sign + sy * sy * p, -sy


@inlined
def newton(star, n, pattern, x, y, z, inverse, doublings, frame, sums):
    """F, −∇F/p and its Hessian over p along the two directions of ``frame``; False where a simplex has no area."""
    p = 2.0**doublings
    for k in range(YY + 1):
        sums[k] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        ax, ay, az = star[3 * i] - x, star[3 * i + 1] - y, star[3 * i + 2] - z
        bx, by, bz = star[3 * j] - x, star[3 * j + 1] - y, star[3 * j + 2] - z
        cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
        double = math.sqrt(square(cx, cy, cz))
        if not double > 0.0:
            return False
        lengths = half_lengths3(ax, ay, az, bx, by, bz, weights)
        both = 1.0 / (lengths * double)
        per_length, per_double = double * both, lengths * both
        t = power(lengths * per_double * inverse, doublings)
        share = per_double * per_double
        wx, wy, wz = crossed(ax - bx, ay - by, az - bz, cx * share, cy * share, cz * share)
        px, py, pz = pull(ax, bx, weights), pull(ay, by, weights), pull(az, bz, weights)
        v1 = (wx * frame[0] + wy * frame[1]) + wz * frame[2]
        v2 = (wx * frame[3] + wy * frame[4]) + wz * frame[5]
        u1 = ((px * frame[0] + py * frame[1]) + pz * frame[2]) * per_length + v1
        u2 = ((px * frame[3] + py * frame[4]) + pz * frame[5]) * per_length + v2
        even = roundness(2.0 * per_length, weights)
        sums[VALUE] += t
        sums[GX] += t * u1
        sums[GY] += t * u2
        sums[XX] += t * (u1 * ((p - 1.0) * u1 + 2.0 * v1) + even)
        sums[XY] += t * ((p - 1.0) * (u1 * u2) + (v1 * u2 + u1 * v2))
        sums[YY] += t * (u2 * ((p - 1.0) * u2 + 2.0 * v2) + even)
    return True


@inlined
def mean_of(star, n, pattern):
    """The mean of the neighbours."""
    x, y, z, share = 0.0, 0.0, 0.0, 1.0 / neighbours(pattern, n)
    for j in range(n):
        weight = neighbour_weight(pattern, j) * share
        x, y, z = x + weight * star[3 * j], y + weight * star[3 * j + 1], z + weight * star[3 * j + 2]
    return x, y, z


@inlined
def landed(surface, row, x, y, z, normal):
    """Where a node comes to lie that would go to (x, y, z), its place there; and the normal of the reference."""
    x, y, z, place, normal[0], normal[1], normal[2] = land_on(surface, row, x, y, z)
    return x, y, z, place


@inlined
def go(points, i, stars, guard, star, n, pattern, floors, reach, dx, dy, dz, value, inverse, doublings, was, normal,
       tally):  # fmt: skip
    """Moves node i by (dx, dy, dz), halved until F falls below ``value`` and the guard allows it; returns F.

    value: infinite where F does not matter.
    """
    surface = guard.constraint
    row = surface.row[i]
    was[0], was[1], was[2] = points[i, 0], points[i, 1], points[i, 2]
    if not (math.isfinite(dx) and math.isfinite(dy) and math.isfinite(dz)):
        tally[DROPPED] += 1
        return value
    for halving in range(HALVINGS):
        x, y, z, place = landed(surface, row, was[0] + dx, was[1] + dy, was[2] + dz, normal)
        if x == was[0] and y == was[1] and z == was[2]:
            break
        after, _ = value_at(star, n, pattern, x, y, z, inverse, doublings)
        falls = after < value
        falls = falls and allowed(star, n, pattern, stars, stars.first[i], floors, guard, reach, x, y, z, was, normal)
        if falls and near(surface, row, star, n, pattern, place, x, y, z, was):
            points[i, 0], points[i, 1], points[i, 2] = x, y, z
            surface.place[row] = place
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return after
        dx, dy, dz = 0.5 * dx, 0.5 * dy, 0.5 * dz
    tally[DROPPED] += 1
    return value


@inlined
def improve(points, i, stars, guard, inverse, doublings, relaxation, stretch, steps, star, floors, work, tally):
    """Newton steps of node i, as many as pay up to ``steps``; a tangled star tries the mean of its ring.

    inverse: 1/M, by the star's own if powers of that are lost to rounding. stretch: that many times the way to the mean
    is tried first. work: (24,) to work in.
    """
    surface = guard.constraint
    row = surface.row[i]
    if row < 0:
        return
    n, reach = gather(points, stars, i, guard, star, floors)
    pattern = pattern_at(stars.patterns, stars.pattern, i)
    frame, sums, was, normal = work[:6], work[6:15], work[15:18], work[18:21]
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    value, most = value_at(star, n, pattern, x, y, z, inverse, doublings)
    if not value < np.inf or tangled(star, n, pattern, stars, stars.first[i], x, y, z):
        mx, my, mz = mean_of(star, n, pattern)
        go(points, i, stars, guard, star, n, pattern, floors, reach, mx - x, my - y, mz - z, np.inf, inverse,
           doublings, was, normal, tally)  # fmt: skip
        return
    if not (SMALLEST < value < 1.0 / SMALLEST):
        inverse = 1.0 / most
        value, _ = value_at(star, n, pattern, x, y, z, inverse, doublings)
    if stretch > 0.0:
        mx, my, mz = mean_of(star, n, pattern)
        dx, dy, dz = stretch * (mx - x), stretch * (my - y), stretch * (mz - z)
        before, value = value, go_once(points, i, stars, guard, star, n, pattern, floors, reach, dx, dy, dz, value,
                                       inverse, doublings, was, normal, tally)  # fmt: skip
        if value < before:
            return
    p = 2.0**doublings
    for _ in range(steps):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        tangents(star, n, pattern, x, y, z, frame)
        along = on_curves(surface.kind[row])
        if along:
            frame[0], frame[1], frame[2] = directions_at(surface, row, x, y, z)
        if not newton(star, n, pattern, x, y, z, inverse, doublings, frame, sums):
            return
        if along:
            dx, dy = sums[GX] / sums[XX], 0.0
        else:
            dx, dy = newton_step(sums[GX], sums[GY], sums[XX], sums[XY], sums[YY])
        fall = (sums[GX] * dx + sums[GY] * dy) / sums[VALUE]
        if not fall > FLAT / p:
            return
        longer = max(1.0 / max(1.0 - (p + 1.0) * fall, 1.0 / MOST), relaxation)
        dx, dy = longer * dx, longer * dy
        after = go(
            points, i, stars, guard, star, n, pattern, floors, reach, dx * frame[0] + dy * frame[3],
            dx * frame[1] + dy * frame[4], dx * frame[2] + dy * frame[5], value, inverse, doublings, was, normal, tally,
        )  # fmt: skip
        if not after < FAR * value:
            return
        value = after


@inlined
def go_once(points, i, stars, guard, star, n, pattern, floors, reach, dx, dy, dz, value, inverse, doublings, was,
            normal, tally):  # fmt: skip
    """As ``go``, but by the whole step or not at all, and uncounted if not at all."""
    surface = guard.constraint
    row = surface.row[i]
    was[0], was[1], was[2] = points[i, 0], points[i, 1], points[i, 2]
    x, y, z, place = landed(surface, row, was[0] + dx, was[1] + dy, was[2] + dz, normal)
    after, _ = value_at(star, n, pattern, x, y, z, inverse, doublings)
    falls = after < value
    falls = falls and allowed(star, n, pattern, stars, stars.first[i], floors, guard, reach, x, y, z, was, normal)
    if falls and near(surface, row, star, n, pattern, place, x, y, z, was):
        points[i, 0], points[i, 1], points[i, 2] = x, y, z
        surface.place[row] = place
        tally[MOVED] += 1
        return after
    return value


@inlined
def tangled(star, n, pattern, stars, at, x, y, z):
    """Is a simplex of the star not upright?"""
    side = stars.side
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, az = star[3 * i] - x, star[3 * i + 1] - y, star[3 * i + 2] - z
        bx, by, bz = star[3 * j] - x, star[3 * j + 1] - y, star[3 * j + 2] - z
        cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
        if not (cx * side[at + k, 0] + cy * side[at + k, 1]) + cz * side[at + k, 2] > 0.0:
            return True
    return False


@kernel
def sweep(points, stars, first, last, guard, doublings, relaxation, stretch, tally):
    """Visits the stars first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    star, floors, work = np.empty(3 * stars.most), np.empty(stars.most + 1), np.empty(24)
    for k in range(first, last):
        i = stars.node[k]
        improve(points, i, stars, guard, 1.0, doublings, relaxation, stretch, 1, star, floors, work, tally)


@kernel
def visit(points, stars, nodes, guard, doublings, sweeps, scale, awake, tally):
    """Visits these nodes in their order, so many times, p = 2^doublings: see kernels.methods.worst_first_cycles."""
    start, around = stars.start, stars.around
    star, floors, work = np.empty(3 * stars.most), np.empty(stars.most + 1), np.empty(24)
    for i in nodes:
        awake[i] = True
    for _ in range(sweeps):
        for i in nodes:
            if not awake[i]:
                continue
            awake[i] = False
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            improve(points, i, stars, guard, scale, doublings, 1.0, 0.0, 8, star, floors, work, tally)
            far = square(points[i, 0] - x, points[i, 1] - y, points[i, 2] - z)
            if far > STILL * square(star[0] - x, star[1] - y, star[2] - z):
                awake[i] = True
                for k in range(start[i], start[i + 1]):
                    awake[around[k]] = True
    for i in nodes:
        awake[i] = False
        for k in range(start[i], start[i + 1]):
            awake[around[k]] = False
