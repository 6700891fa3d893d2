"""A few Adam steps on an objective of a star, for a block of stars in float64: the paper's OptimSmoothing.

    m ← β₁ m + (1 − β₁) g,   v ← β₂ v + (1 − β₂) g²,   p ← p − η_t (m/(1 − β₁ᵗ))/(√(v/(1 − β₂ᵗ)) + ε)

(Kingma & Ba 2014), component by component, at most 20 steps a visit as in the paper, in the star's own frame. So the
step sizes η_t are relative to the star's size; the paper does not state its own. 0.05/√t is what comes closest to the
optimum of each star: 99 % of what can be gained in one visit of raw meshes, and 76 to 91 % of the little that is left
after five sweeps, where a constant 0.05 gets 70 to 74 % (benchmarks/tune_adam.py).

The best place visited is proposed: where the objective is least, and, if the star was valid at the start, among the
places that keep it so. A step of a barrier objective that leads out of the star counts as one with no gradient: the
node goes back to its best place, and its steps are half as long from then on. A star that is tangled to begin with is
given to ``metric``, whichever objective was chosen: a barrier has no finite value there, and the angles, being
unsigned, take inverted triangles for good ones; it alone says which way is out.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.simplex import objectives
from gmsnet.kernels.simplex.lanes import any_positive
from gmsnet.kernels.simplex.objectives import GRADIENT, LEAST, METRIC, OUT
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.pattern import pattern_at

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8
STEPS = 20
STEP_SIZE = 0.05  # η_1
GAIN = 1.0 - 1e-12  # less of a gain than this is rounding
X, Y, BEST_X, BEST_Y, BEST, FACTOR, MX, MY, VX, VY, TANGLED = range(11)  # rows of a block's state
STATE = 11


@part
def descend(objective, local, n, pattern, sizes, state, out, shift):
    """Shifts (2·LANES, over the star's size) to the best places that len(sizes) steps of these sizes visit.

    Work: state (STATE rows of LANES; row TANGLED: 1 where the star was tangled at the start, else 0), out (OUT rows).
    """
    state[:] = 0.0
    for lane in range(LANES):
        state[BEST * LANES + lane] = np.inf
        state[FACTOR * LANES + lane] = 1.0
    first, second = 1.0, 1.0
    for step in range(len(sizes)):
        objectives.evaluate(objective, local, n, pattern, state, out, None)
        if step == 0:
            for lane in range(LANES):
                state[TANGLED * LANES + lane] = 0.0 if out[LEAST * LANES + lane] > 0.0 else 1.0
        keep_best(out, state)
        first *= BETA_1
        second *= BETA_2
        advance(sizes[step] / (1.0 - first), 1.0 / (1.0 - second), out, state)
    objectives.evaluate(objective, local, n, pattern, state, out, None)
    keep_best(out, state)
    shift[:] = state[BEST_X * LANES : (BEST_Y + 1) * LANES]


@part
def keep_best(out, state):
    """Notes where a lane stands, if that is better than all places before."""
    for lane in range(LANES):
        value, least = out[lane], out[LEAST * LANES + lane]
        best, tangled = state[BEST * LANES + lane], state[TANGLED * LANES + lane]
        better = (value if max(least, tangled) > 0.0 else np.inf) < GAIN * best
        state[BEST * LANES + lane] = value if better else best
        state[BEST_X * LANES + lane] = state[X * LANES + lane] if better else state[BEST_X * LANES + lane]
        state[BEST_Y * LANES + lane] = state[Y * LANES + lane] if better else state[BEST_Y * LANES + lane]


@part
def advance(size, correction, out, state):
    """One Adam step of a block. size: η_t/(1 − β₁ᵗ); correction: 1/(1 − β₂ᵗ)."""
    for lane in range(LANES):
        here = out[lane] < np.inf
        gx = out[GRADIENT * LANES + lane] if here else 0.0
        gy = out[(GRADIENT + 1) * LANES + lane] if here else 0.0
        mx = BETA_1 * state[MX * LANES + lane] + (1.0 - BETA_1) * gx
        my = BETA_1 * state[MY * LANES + lane] + (1.0 - BETA_1) * gy
        vx = BETA_2 * state[VX * LANES + lane] + (1.0 - BETA_2) * gx * gx
        vy = BETA_2 * state[VY * LANES + lane] + (1.0 - BETA_2) * gy * gy
        state[MX * LANES + lane] = mx
        state[MY * LANES + lane] = my
        state[VX * LANES + lane] = vx
        state[VY * LANES + lane] = vy
        factor = state[FACTOR * LANES + lane]
        factor = factor if here else 0.5 * factor
        state[FACTOR * LANES + lane] = factor
        x = state[X * LANES + lane] - size * factor * mx / (math.sqrt(vx * correction) + EPSILON)
        y = state[Y * LANES + lane] - size * factor * my / (math.sqrt(vy * correction) + EPSILON)
        state[X * LANES + lane] = x if here else state[BEST_X * LANES + lane]
        state[Y * LANES + lane] = y if here else state[BEST_Y * LANES + lane]


@part
def propose(objective, local, n, pattern, sizes, state, out, shift, other):
    """As ``descend``, tangled stars by ``metric``. Work: as there, and other (2·LANES)."""
    descend(objective, local, n, pattern, sizes, state, out, shift)
    if objective != METRIC and any_positive(state, TANGLED):
        descend(METRIC, local, n, pattern, sizes, state, out, other)
        objectives.choose(state[TANGLED * LANES :], other, shift)


@kernel
def sweep(points, blocks, first, last, guard, objective, sizes, tally):
    """Smooths the blocks first…last (of one colour) once. sizes: (steps,) η_t. tally: (3,), added to."""
    workspace = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES)
    shift, other = np.empty(2 * LANES), np.empty(2 * LANES)
    state, out = np.empty(STATE * LANES), np.empty(OUT * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        propose(objective, local, n, pattern, sizes, state, out, shift, other)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
