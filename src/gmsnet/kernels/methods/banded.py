"""Newton steps on shape within bands of the areas, by an interior point method, for a block of stars in float64.

Each corner simplex of a star costs, with q its shape, M that of the worst cell, and D twice its area,

    (q/M)^p − μ log(4(H − D)(D − L)/(H − L)²),

the second term if D has a band [L, H]. Both are convex in the free node's place where D > 0: D is linear, of the
gradient w, and q a quadratic form over it. With A = H − D and B = D − L the second has

    ∇ = μ(1/A − 1/B) w,   ∇² = μ(1/A² + 1/B²) w wᵀ.

The objective is infinite where a cell has no area, or a band ends. So what starts inside stays inside. With p a power
of two that grows, and μ that falls from sweep to sweep, nodes come to where the worst cells are as good as the bands
let them be (Nocedal, Wright: Numerical Optimization, section 19.6). Bands with ends that single nodes would run into
leave none of them stuck: the barrier keeps all away from them until late.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.bands import ends_of, rest_in, shorten
from gmsnet.kernels.methods.worst_first import power
from gmsnet.kernels.simplex.objectives import aspect
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import SIZE
from gmsnet.kernels.star.constraint import along_curve
from gmsnet.kernels.star.pattern import count_of, pair_of, pattern_at, weights_of

LONGER = 1.3  # times Newton's is the step that is tried first
HALVINGS = 12

# Rows of a block's state: the step (two), how much of it is on trial; the value there and on trial, the gradient (two),
# the Hessian (three); whether all simplices are inside; 1 where the halvings go on.
DX, DY, SHARE, VALUE, AFTER, GX, GY, XX, XY, YY, INSIDE, OPEN = range(12)
STATE = 12


@part
def derive(local, n, pattern, low, high, inverse, doublings, weight, state):
    """The objective with its derivatives, where the nodes are. low, high: of D over the size squared; inverse: 1/M."""
    state[:] = 0.0
    state[INSIDE * LANES : (INSIDE + 1) * LANES] = 1.0
    p = 2.0**doublings
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            ax, ay, bx, by = r[lane], r[LANES + lane], s[lane], s[LANES + lane]
            q, gx, gy, xx, xy, yy = aspect(ax, ay, bx, by, weights)
            t = power(q * inverse, doublings)
            slope = p * t / q
            bend = (p - 1.0) * slope / q
            d, wx, wy = ax * by - ay * bx, ay - by, bx - ax
            above, below = high[k * LANES + lane] - d, d - low[k * LANES + lane]  # both ∞ without a band
            push = weight * (1.0 / above - 1.0 / below)
            stiff = weight * (1.0 / (above * above) + 1.0 / (below * below))
            state[VALUE * LANES + lane] += t
            state[GX * LANES + lane] += slope * gx + push * wx
            state[GY * LANES + lane] += slope * gy + push * wy
            state[XX * LANES + lane] += slope * xx + bend * gx * gx + stiff * wx * wx
            state[XY * LANES + lane] += slope * xy + bend * gx * gy + stiff * wx * wy
            state[YY * LANES + lane] += slope * yy + bend * gy * gy + stiff * wy * wy
            state[INSIDE * LANES + lane] *= 1.0 if d > 0.0 and above > 0.0 and below > 0.0 else 0.0


@part
def judge(local, n, pattern, low, high, inverse, doublings, weight, state):
    """By how much the objective rises with the share SHARE of the step: row AFTER; +∞ where it is infinite.

    The logarithms are taken of the products over a star: of what is left of the ways to the ends of bands.
    """
    state[AFTER * LANES : (AFTER + 1) * LANES] = 0.0
    left = np.ones(LANES)
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            share = state[SHARE * LANES + lane]
            x, y = share * state[DX * LANES + lane], share * state[DY * LANES + lane]
            before = r[lane] * s[LANES + lane] - r[LANES + lane] * s[lane]
            ax, ay, bx, by = r[lane] - x, r[LANES + lane] - y, s[lane] - x, s[LANES + lane] - y
            q, _, _, _, _, _ = aspect(ax, ay, bx, by, weights)
            d, most, least = ax * by - ay * bx, high[k * LANES + lane], low[k * LANES + lane]
            ends = most < np.inf
            rest = (most - d) / (most - before) * ((d - least) / (before - least)) if ends else 1.0
            inside = d > 0.0 and (not ends or (most > d and d > least))
            left[lane] *= rest
            state[AFTER * LANES + lane] += power(q * inverse, doublings) if inside else np.inf
    for lane in range(LANES):
        if state[AFTER * LANES + lane] < np.inf:
            state[AFTER * LANES + lane] -= weight * math.log(left[lane]) + state[VALUE * LANES + lane]


@part
def descend(local, n, pattern, low, high, inverse, doublings, weight, centre, constraint, state, shift):
    """The shifts (2·LANES): a Newton step, halved until the objective falls; none where it is infinite."""
    derive(local, n, pattern, low, high, inverse, doublings, weight, state)
    for lane in range(LANES):
        gx, gy = state[GX * LANES + lane], state[GY * LANES + lane]
        xx, xy, yy = state[XX * LANES + lane], state[XY * LANES + lane], state[YY * LANES + lane]
        gx, gy, xx, xy, yy = along_curve(constraint, centre[lane], gx, gy, xx, xy, yy)
        over = -LONGER / (xx * yy - xy * xy)
        dx, dy = over * (yy * gx - xy * gy), over * (xx * gy - xy * gx)
        going = state[INSIDE * LANES + lane] > 0.0 and abs(dx) + abs(dy) < np.inf
        state[DX * LANES + lane] = dx if going else 0.0
        state[DY * LANES + lane] = dy if going else 0.0
        state[SHARE * LANES + lane] = 1.0
        state[OPEN * LANES + lane] = 1.0 if going else 0.0
    for _ in range(HALVINGS):
        judge(local, n, pattern, low, high, inverse, doublings, weight, state)
        open_still = False
        for lane in range(LANES):
            if state[OPEN * LANES + lane] > 0.0:
                falls = state[AFTER * LANES + lane] < 0.0
                state[OPEN * LANES + lane] = 0.0 if falls else 1.0
                state[SHARE * LANES + lane] *= 1.0 if falls else 0.5
                open_still |= not falls
        if not open_still:
            break
    for lane in range(LANES):
        share = 0.0 if state[OPEN * LANES + lane] > 0.0 else state[SHARE * LANES + lane]
        shift[lane], shift[LANES + lane] = share * state[DX * LANES + lane], share * state[DY * LANES + lane]


@kernel
def sweep(points, blocks, bands, inverse, doublings, weight, first, last, guard, tally):
    """Visits the blocks first…last (of one colour) once. tally: (3,), added to.

    bands: bands.Bands. inverse: 1/M; doublings: p = 2^doublings; weight: μ.
    """
    workspace = stars.workspace_for(blocks.most)
    local, state, shift = np.empty(2 * blocks.most * LANES), np.empty(STATE * LANES), np.empty(2 * LANES)
    low, high = np.empty(blocks.most * LANES), np.empty(blocks.most * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        start, sizes = bands.first[block], workspace.work[SIZE * LANES : (SIZE + 1) * LANES]
        for k in range(count_of(pattern, n)):
            i, j = pair_of(pattern, n, k)
            for lane in range(LANES):
                p, q, over = 2 * i * LANES + lane, 2 * j * LANES + lane, 1.0 / (sizes[lane] * sizes[lane])
                length = sizes[lane] * math.hypot(local[p] - local[q], local[LANES + p] - local[LANES + q])
                rest = rest_in(pattern, k, i, j, local, lane, LANES) / over
                least, most = ends_of(bands, start + k * LANES + lane, rest, length)
                low[k * LANES + lane], high[k * LANES + lane] = over * least, over * most
        centre = stars.centre_of(blocks, block)
        descend(local, n, pattern, low, high, inverse, doublings, weight, centre, guard.constraint, state, shift)
        shorten(bands, guard.constraint, blocks, block, workspace.star, sizes, shift)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
