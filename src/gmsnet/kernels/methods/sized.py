"""Newton steps on shape and size together, for a block of stars in float64.

Each corner simplex of a star costs, with D twice its area and D₀ what that is to be,

    q² + (γ/2)(D/D₀ + D₀/D),

which is convex in the free node's place where D > 0, and infinite at the rim of that region: q is a quadratic form over
a linear function (kernels.simplex.objectives), D is linear, of the gradient w, and D/D₀ + D₀/D is convex in D:

    ∇ = (γ/2)(1/D₀ − D₀/D²) w,   ∇² = γ (D₀/D³) w wᵀ.

Near a sliver q² rules, and the step is Newton's of F^(−1/2), as in kernels.methods.barrier. It is halved until F
falls. A star that is tangled goes to the mean of its ring.

What a simplex's area is to be: its own as the run begins, but not further than a factor of exp(REACH) from the mean of
the areas around it; and where those lie far apart, so that they are nobody's intent, it is that mean. So a graded mesh
keeps its areas, and slivers get those of their neighbours. Of a quad the simplices at its four corners count, each with
its own D₀: those at two opposite corners make up its area, so that it keeps that with them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.lanes import any_positive
from gmsnet.kernels.simplex.objectives import aspect_squared, squares
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import SIZE
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of

REACH = 0.25
CALM, ROUGH = 0.25, 0.5  # how far areas around a node lie from their mean, in logarithms
TINY = 1e-300
STEPS, FAR, HALVINGS = 4, 0.7, 12  # Newton steps of a visit: on while the objective falls below FAR of what it was
MOST = 50.0  # times a Newton step: the longest one
SHORTEST = 1e-9  # of the star's size: a shorter step is rounding

# Rows of a block's state: where the node is (two), the step (two), how much of it is on trial; the value there and on
# trial, the gradient (two) and the Hessian (three), the minimum D; 1 where the halvings go on.
X, Y, DX, DY, SHARE, VALUE, AFTER, GX, GY, XX, XY, YY, LEAST, OPEN = range(14)
STATE = 14


class Wanted(NamedTuple):
    """D₀ of each simplex of the stars in blocks, [simplex][lane], those of a block from double[first[block]] on."""

    first: NDArray[np.int64]
    double: NDArray[np.float64]


@kernel
def targets(points, triangles, blocks, wanted):
    """Writes the D₀ of all stars. triangles: (T, 3) the nodes of all corner simplices."""
    nodes = len(points)
    mean, rough, number = np.zeros(nodes), np.zeros(nodes), np.zeros(nodes)
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        d = abs(double(points, i, j, k))
        for c in range(3):
            mean[triangles[t, c]] += d
            number[triangles[t, c]] += 1.0
    for i in range(nodes):
        mean[i] = math.log(max(mean[i] / max(number[i], 1.0), TINY))
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        size = math.log(max(abs(double(points, i, j, k)), TINY))
        for c in range(3):
            i = triangles[t, c]
            rough[i] += min(abs(size - mean[i]), ROUGH) / number[i]
    for block in range(len(blocks.degree)):
        n, offset, low = blocks.degree[block], blocks.offset[block], wanted.first[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        for k in range(count_of(pattern, n)):
            i, j = pair_of(pattern, n, k)
            for lane in range(LANES):
                c = blocks.centre[block * LANES + lane]
                a, b = blocks.rings[offset + i * LANES + lane], blocks.rings[offset + j * LANES + lane]
                around = (mean[a] + mean[b] + mean[c]) / 3.0
                uneven = (rough[a] + rough[b] + rough[c]) / 3.0
                reach = REACH * min(max((ROUGH - uneven) / (ROUGH - CALM), 0.0), 1.0)
                own = math.log(max(double(points, c, a, b), TINY))
                wanted.double[low + k * LANES + lane] = math.exp(min(max(own, around - reach), around + reach))


@inlined
def double(points, i, j, k):
    """Twice the signed area."""
    ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
    return ax * by - ay * bx


@part
def derive(local, n, pattern, wanted, weight, state):
    """The objective with its derivatives, and the minimum D, where the nodes are. wanted: D₀ over the size squared."""
    state[VALUE * LANES : (VALUE + 1) * LANES] = 0.0
    state[GX * LANES : LEAST * LANES] = 0.0
    state[LEAST * LANES : (LEAST + 1) * LANES] = np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            x, y = state[X * LANES + lane], state[Y * LANES + lane]
            ax, ay, bx, by = r[lane] - x, r[LANES + lane] - y, s[lane] - x, s[LANES + lane] - y
            value, gx, gy, xx, xy, yy = aspect_squared(ax, ay, bx, by, weights)
            d, goal = ax * by - ay * bx, wanted[k * LANES + lane]
            wx, wy = ay - by, bx - ax
            inverse = 1.0 / d if d > 0.0 else 0.0
            part = goal * inverse
            slope = 0.5 * weight * (1.0 / goal - part * inverse)
            bend = weight * part * inverse * inverse
            state[VALUE * LANES + lane] += value + 0.5 * weight * (d / goal + part)
            state[GX * LANES + lane] += gx + slope * wx
            state[GY * LANES + lane] += gy + slope * wy
            state[XX * LANES + lane] += xx + bend * wx * wx
            state[XY * LANES + lane] += xy + bend * wx * wy
            state[YY * LANES + lane] += yy + bend * wy * wy
            state[LEAST * LANES + lane] = min(state[LEAST * LANES + lane], d)


@part
def judge(local, n, pattern, wanted, weight, state):
    """The objective with the share SHARE of the step taken: row AFTER, infinite where a D is not positive."""
    state[AFTER * LANES : (AFTER + 1) * LANES] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            share = state[SHARE * LANES + lane]
            x = state[X * LANES + lane] + share * state[DX * LANES + lane]
            y = state[Y * LANES + lane] + share * state[DY * LANES + lane]
            ax, ay, bx, by = r[lane] - x, r[LANES + lane] - y, s[lane] - x, s[LANES + lane] - y
            d, goal = ax * by - ay * bx, wanted[k * LANES + lane]
            q = squares(ax, ay, bx, by, weights) / d
            value = q * q / 3.0 + 0.5 * weight * (d / goal + goal / d)
            state[AFTER * LANES + lane] += value if d > 0.0 else np.inf


@part
def steps(state):
    """The step that the derivatives call for; none where the star is tangled or there is nothing to gain."""
    for lane in range(LANES):
        gx, gy, value = -state[GX * LANES + lane], -state[GY * LANES + lane], state[VALUE * LANES + lane]
        xx, xy, yy = state[XX * LANES + lane], state[XY * LANES + lane], state[YY * LANES + lane]
        inverse = 1.0 / (xx * yy - xy * xy)
        dx, dy = (yy * gx - xy * gy) * inverse, (xx * gy - xy * gx) * inverse
        longer = 1.0 / max(1.0 - 1.5 * (gx * dx + gy * dy) / value, 1.0 / MOST)
        far = abs(dx) + abs(dy)
        going = 1.0 if state[LEAST * LANES + lane] > 0.0 and far > SHORTEST and far < np.inf else 0.0
        state[DX * LANES + lane] = longer * dx if going > 0.0 else 0.0
        state[DY * LANES + lane] = longer * dy if going > 0.0 else 0.0
        state[SHARE * LANES + lane] = 1.0
        state[OPEN * LANES + lane] = going


@part
def descend(local, n, pattern, wanted, weight, state):
    """Takes up to STEPS steps from the origin; rows X and Y say where they lead."""
    state[:] = 0.0
    for _ in range(STEPS):
        derive(local, n, pattern, wanted, weight, state)
        steps(state)
        for _ in range(HALVINGS):
            judge(local, n, pattern, wanted, weight, state)
            for lane in range(LANES):
                falls = state[AFTER * LANES + lane] < state[VALUE * LANES + lane]
                state[OPEN * LANES + lane] = 0.0 if falls else state[OPEN * LANES + lane]
                state[SHARE * LANES + lane] *= 0.5 if state[OPEN * LANES + lane] > 0.0 else 1.0
            if not any_positive(state, OPEN):
                break
        fell = False
        for lane in range(LANES):
            share = 0.0 if state[OPEN * LANES + lane] > 0.0 else state[SHARE * LANES + lane]
            state[X * LANES + lane] += share * state[DX * LANES + lane]
            state[Y * LANES + lane] += share * state[DY * LANES + lane]
            fell |= state[AFTER * LANES + lane] < FAR * state[VALUE * LANES + lane]
        if not fell:
            break


@part
def take(local, n, pattern, state, shift):
    """The shifts (2·LANES): to where the steps have led, or, in tangled stars, to the mean of the neighbours."""
    for lane in range(LANES):
        tangled = not state[LEAST * LANES + lane] > 0.0
        shift[lane] = 0.0 if tangled else state[X * LANES + lane]
        shift[LANES + lane] = 0.0 if tangled else state[Y * LANES + lane]
        if tangled:
            for j in range(n):
                share, of_all = neighbour_weight(pattern, j), neighbours(pattern, n)
                shift[lane] += share * local[2 * j * LANES + lane] / of_all
                shift[LANES + lane] += share * local[(2 * j + 1) * LANES + lane] / of_all


@kernel
def sweep(points, blocks, wanted, weight, first, last, guard, tally):
    """Visits the blocks first…last (of one colour) once. tally: (3,), added to.

    wanted: as ``targets`` leaves it.
    """
    workspace = stars.workspace_for(blocks.most)
    local, goals = np.empty(2 * blocks.most * LANES), np.empty(blocks.most * LANES)
    state, shift = np.empty(STATE * LANES), np.empty(2 * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        low, sizes = wanted.first[block], workspace.work[SIZE * LANES : (SIZE + 1) * LANES]
        for k in range(count_of(pattern, n)):
            for lane in range(LANES):
                size = sizes[lane]
                goals[k * LANES + lane] = wanted.double[low + k * LANES + lane] / (size * size)
        descend(local, n, pattern, goals, weight, state)
        take(local, n, pattern, state, shift)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
