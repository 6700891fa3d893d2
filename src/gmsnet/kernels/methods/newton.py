"""Safeguarded Newton steps on an objective of a star, for a block of stars in float64.

With the gradient g and the eigenvalues λ and eigenvectors u of the Hessian,

    d = −Σ u (u·g)/max(|λ|, ε·max|λ|, δ),

at most half the star's radius (the root mean square of its edges) long, halved until the objective falls by at least
1e-4 of what the slope promises (Armijo) and the star, if it was valid at the start, still is. So the objective never
rises. A bounded objective would flatten a triangle for the good of the others; it may not make any smaller than a tenth
of the star's mean. A lane has come to its end after 20 steps, when a step is below 1e-9 of the radius, or when ten
halvings are not enough: at a stationary point, at the edge of where it may go, or, where the objective has a kink
(min-max-angle), where nothing is gained along d. Closer to an edge or a kink, rounding would decide what the next visit
does. All that depends on lengths and eigenvalues alone, so that turning the star turns the shift.

A star that is tangled to begin with is given to ``metric``, for the reasons in kernels.methods.adam.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex import objectives
from gmsnet.kernels.simplex.lanes import any_positive
from gmsnet.kernels.simplex.objectives import GRADIENT, LEAST, METRIC, OUT, Q2, VALUE, Q
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at

STEPS, TRIALS = 20, 100  # at most so many steps and, halvings included, evaluations
ARMIJO = 1e-4
REACH, END = 0.5, 1e-9  # the longest and the shortest step, in radii
LEAST_SHARE = 2.0**-10  # the shortest step as a share of d
FLOOR, FLAT = 1e-8, 1e-6  # ε, and δ for stars of size 1: less is taken for rounding
MARGIN = 0.1  # of the mean D of a star: the minimum that a bounded objective may make of a triangle's
TINY = 1e-150
# Rows of a block's state: the place on trial (first), the last one taken and its value, the step d from there with its
# slope and length, the share of d on trial, how many steps were taken, whether to go on, and what holds for the star.
TRIAL_X, TRIAL_Y, X, Y, BEST, DX, DY, SLOPE, LENGTH, SHARE, TAKEN, ALIVE, RADIUS, LOWEST, TANGLED = range(15)
STATE = 15


@inlined
def newton_step(gx, gy, xx, xy, yy):
    """d for a gradient and a Hessian."""
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    spread = math.sqrt(half * half + xy * xy)
    first, second = abs(mean + spread), abs(mean - spread)
    floor = max(FLOOR * max(first, second), FLAT)
    first, second = 1.0 / max(first, floor), 1.0 / max(second, floor)
    turn = 0.5 * (first - second) / max(spread, TINY)
    equal = 0.5 * (first + second)
    return -(equal + turn * half) * gx - turn * xy * gy, -turn * xy * gx - (equal - turn * half) * gy


@part
def descend(objective, local, n, pattern, state, out, hessian, shift):
    """Shifts (2·LANES, over the star's size) to where the steps end.

    Work: state (STATE rows of LANES; row TANGLED: 1 where the star was tangled at the start, else 0), out (OUT rows),
    hessian (3 rows).
    """
    begin(local, n, pattern, 0.0 if objective in (Q, Q2) else MARGIN, state)
    for trial in range(TRIALS):
        objectives.evaluate(objective, local, n, pattern, state, out, hessian)
        if trial == 0:
            for lane in range(LANES):
                least = out[LEAST * LANES + lane]
                state[TANGLED * LANES + lane] = 0.0 if least > 0.0 else 1.0
                state[LOWEST * LANES + lane] = min(state[LOWEST * LANES + lane], 0.999 * least)
        judge(out, hessian, state)
        if not any_positive(state, ALIVE):
            break
    for k in range(2 * LANES):  # Y is the row after X
        shift[k] = state[X * LANES + k]


@part
def begin(local, n, pattern, margin, state):
    """All lanes at the origin, their radii, and the minimum D that they may come to."""
    state[:] = 0.0
    for j in range(n):
        weight = neighbour_weight(pattern, j)
        for lane in range(LANES):
            qx, qy = local[2 * j * LANES + lane], local[(2 * j + 1) * LANES + lane]
            state[RADIUS * LANES + lane] += weight * (qx * qx + qy * qy)
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        for lane in range(LANES):
            px, py = local[2 * i * LANES + lane], local[(2 * i + 1) * LANES + lane]
            qx, qy = local[2 * j * LANES + lane], local[(2 * j + 1) * LANES + lane]
            state[LOWEST * LANES + lane] += px * qy - py * qx
    for lane in range(LANES):
        state[RADIUS * LANES + lane] = math.sqrt(state[RADIUS * LANES + lane] / neighbours(pattern, n))
        state[LOWEST * LANES + lane] *= margin / count_of(pattern, n)
        state[BEST * LANES + lane] = np.inf
        state[ALIVE * LANES + lane] = 1.0


@part
def judge(out, hessian, state):
    """Takes the places on trial that are good enough, with new steps from there; halves the steps to the others."""
    for lane in range(LANES):
        value, best, share = out[VALUE * LANES + lane], state[BEST * LANES + lane], state[SHARE * LANES + lane]
        alive, radius = state[ALIVE * LANES + lane], state[RADIUS * LANES + lane]
        above = out[LEAST * LANES + lane] - state[LOWEST * LANES + lane]
        inside = max(above, state[TANGLED * LANES + lane]) * alive
        enough = best + ARMIJO * share * state[SLOPE * LANES + lane]
        taken = (value if inside > 0.0 and value < np.inf else np.nan) <= enough
        gx, gy = out[GRADIENT * LANES + lane], out[(GRADIENT + 1) * LANES + lane]
        dx, dy = newton_step(gx, gy, hessian[lane], hessian[LANES + lane], hessian[2 * LANES + lane])
        length = math.sqrt(dx * dx + dy * dy)
        scale = min(1.0, REACH * radius / max(length, TINY))
        state[BEST * LANES + lane] = value if taken else best
        state[X * LANES + lane] = state[TRIAL_X * LANES + lane] if taken else state[X * LANES + lane]
        state[Y * LANES + lane] = state[TRIAL_Y * LANES + lane] if taken else state[Y * LANES + lane]
        dx = scale * dx if taken else state[DX * LANES + lane]
        dy = scale * dy if taken else state[DY * LANES + lane]
        length = scale * length if taken else state[LENGTH * LANES + lane]
        share = 1.0 if taken else 0.5 * share
        steps = state[TAKEN * LANES + lane] + (1.0 if taken else 0.0)
        # The start counts as a step.
        ends = share < LEAST_SHARE or share * length <= END * radius or steps > STEPS
        alive = 0.0 if ends else alive
        state[SLOPE * LANES + lane] = gx * dx + gy * dy if taken else state[SLOPE * LANES + lane]
        state[DX * LANES + lane] = dx
        state[DY * LANES + lane] = dy
        state[LENGTH * LANES + lane] = length
        state[SHARE * LANES + lane] = share
        state[TAKEN * LANES + lane] = steps
        state[ALIVE * LANES + lane] = alive
        state[TRIAL_X * LANES + lane] = state[X * LANES + lane] + alive * share * dx
        state[TRIAL_Y * LANES + lane] = state[Y * LANES + lane] + alive * share * dy


@part
def propose(objective, local, n, pattern, state, out, hessian, shift, other):
    """As ``descend``, tangled stars by ``metric``. Work: as there, and other (2·LANES)."""
    descend(objective, local, n, pattern, state, out, hessian, shift)
    tangled = state[TANGLED * LANES : (TANGLED + 1) * LANES]
    if objective != METRIC and any_positive(state, TANGLED):
        descend(METRIC, local, n, pattern, state, out, hessian, other)
        objectives.choose(tangled, other, shift)


@kernel
def sweep(points, blocks, first, last, guard, objective, tally):
    """Smooths the blocks first…last (of one colour) once. tally: (3,), added to."""
    workspace = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES)
    shift, other = np.empty(2 * LANES), np.empty(2 * LANES)
    state, out, hessian = np.empty(STATE * LANES), np.empty(OUT * LANES), np.empty(3 * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        propose(objective, local, n, pattern, state, out, hessian, shift, other)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
