"""What every smoother shares: gather a block of stars, judge the proposed shifts, commit those that break nothing.

A block is LANES stars of one colour and degree n. Its free nodes stand in ``x`` as [axis][lane], its rings in ``ring``
as [ring node][axis][lane], flat. Stars of one colour share no cell, so a block may be committed at once.

The guard. A triangle is *certified* if its determinant exceeds the error bound of kernels.predicates with the
coordinates known up to ±δ, δ the file's unit of rounding times the star's largest coordinate: it is then positive in
exact arithmetic, in float64, and as written. A move is allowed if each triangle of the star is certified after it, or
was certainly inverted before and is certainly less so after it. So no valid cell becomes invalid, and invalid ones
only get better. A shift that is not allowed is halved, as the paper's Algorithm 1 does, and dropped after HALVINGS.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import LANES, fast_kernel, kernel
from gmsnet.kernels.predicates import SHEWCHUK, UNDERFLOW, determinant_and_bound

HALVINGS = 20
MOVED, TRUNCATED, DROPPED = range(3)  # what a sweep counts


@kernel
def gather(points, centre, rings, block, offset, n, x, ring):
    """Coordinates of the stars of a block, as they stand now."""
    for lane in range(LANES):
        i = centre[block * LANES + lane]
        x[lane] = points[i, 0]
        x[LANES + lane] = points[i, 1]
    for j in range(n):
        for lane in range(LANES):
            i = rings[offset + j * LANES + lane]
            ring[2 * j * LANES + lane] = points[i, 0]
            ring[(2 * j + 1) * LANES + lane] = points[i, 1]


@fast_kernel
def localise(x, ring, n, size, local):
    """Ring minus centre over the size of the star, in float32; size: the larger side of its bounding box (float64).

    This is the paper's normalisation: one factor d = max(Δx, Δy) over the n + 1 nodes, the free node at the origin.
    """
    left, right, bottom, top = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for lane in range(LANES):
        left[lane] = right[lane] = x[lane]
        bottom[lane] = top[lane] = x[LANES + lane]
    for j in range(n):
        for lane in range(LANES):
            a, b = ring[2 * j * LANES + lane], ring[(2 * j + 1) * LANES + lane]
            left[lane], right[lane] = min(left[lane], a), max(right[lane], a)
            bottom[lane], top[lane] = min(bottom[lane], b), max(top[lane], b)
    for lane in range(LANES):
        size[lane] = max(right[lane] - left[lane], top[lane] - bottom[lane])
        left[lane] = 1.0 / size[lane] if size[lane] > 0.0 else 0.0
    for j in range(n):
        for lane in range(LANES):
            local[2 * j * LANES + lane] = (ring[2 * j * LANES + lane] - x[lane]) * left[lane]
            local[(2 * j + 1) * LANES + lane] = (ring[(2 * j + 1) * LANES + lane] - x[LANES + lane]) * left[lane]


@kernel
def margins(target, x, ring, n, unit, delta, margin):
    """For each lane the least certified surplus of a triangle with the free node at ``target``: allowed if positive.

    delta: (LANES,) receives the uncertainty of the star's coordinates.
    """
    for lane in range(LANES):
        margin[lane] = np.inf
        delta[lane] = max(
            max(abs(x[lane]), abs(x[LANES + lane])), max(abs(target[lane]), abs(target[LANES + lane]))
        )
    for j in range(2 * n):
        for lane in range(LANES):
            delta[lane] = max(delta[lane], abs(ring[j * LANES + lane]))
    for lane in range(LANES):
        delta[lane] *= unit
    for j in range(n):
        a = 2 * (n - 1 if j == 0 else j - 1) * LANES
        b = 2 * j * LANES
        for lane in range(LANES):
            px = ring[a + lane] - target[lane]
            py = ring[a + LANES + lane] - target[LANES + lane]
            qx = ring[b + lane] - target[lane]
            qy = ring[b + LANES + lane] - target[LANES + lane]
            left = px * qy
            right = py * qx
            around = abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta[lane]
            bound = SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW + 4.0 * delta[lane] * around
            surplus = (left - right) - bound
            margin[lane] = min(margin[lane], surplus)


@kernel
def allowed(tx, ty, x, ring, n, lane, delta):
    """May the free node of one lane move to (tx, ty)? The scalar form of the rule, which also knows inverted cells."""
    for j in range(n):
        a = 2 * (n - 1 if j == 0 else j - 1) * LANES + lane
        b = 2 * j * LANES + lane
        after, doubt = determinant_and_bound(ring[a], ring[a + LANES], ring[b], ring[b + LANES], tx, ty, delta)
        if after > doubt:
            continue
        before, doubt_before = determinant_and_bound(
            ring[a], ring[a + LANES], ring[b], ring[b + LANES], x[lane], x[LANES + lane], delta
        )
        if not (before < -doubt_before and after - doubt > before + doubt_before):
            return False
    return True


@kernel
def commit(points, centre, block, count, x, ring, n, size, shift, unit, single, target, delta, margin, tally):
    """Moves the free nodes of a block by size·shift, truncated by the guard; counts what happened in ``tally``."""
    for lane in range(LANES):
        target[lane] = x[lane] + size[lane] * shift[lane]
        target[LANES + lane] = x[LANES + lane] + size[lane] * shift[LANES + lane]
    if single:
        for lane in range(2 * LANES):
            target[lane] = np.float64(np.float32(target[lane]))
    margins(target, x, ring, n, unit, delta, margin)
    for lane in range(count):
        i = centre[block * LANES + lane]
        if margin[lane] > 0.0:
            tally[MOVED] += target[lane] != x[lane] or target[LANES + lane] != x[LANES + lane]
            points[i, 0] = target[lane]
            points[i, 1] = target[LANES + lane]
        else:
            truncate(points, i, x, ring, n, lane, size[lane], shift, delta[lane], single, tally)


@kernel
def truncate(points, i, x, ring, n, lane, size, shift, delta, single, tally):
    """Halves the shift of one lane until it is allowed (Algorithm 1), or drops it."""
    dx = size * shift[lane]
    dy = size * shift[LANES + lane]
    if not (np.isfinite(dx) and np.isfinite(dy)):
        tally[DROPPED] += 1
        return
    for halving in range(HALVINGS):
        tx = x[lane] + dx
        ty = x[LANES + lane] + dy
        if single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        if tx == x[lane] and ty == x[LANES + lane]:
            break
        if allowed(tx, ty, x, ring, n, lane, delta):
            points[i, 0] = tx
            points[i, 1] = ty
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx *= 0.5
        dy *= 0.5
    tally[DROPPED] += 1
