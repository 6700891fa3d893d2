"""The barrier over a whole patch at once: L-BFGS (Nocedal, Wright: Numerical Optimization, 2006, algorithm 7.4).

SciPy's leaves its sums to BLAS. Their bits depend on the processor and on the number of threads, and these wait for
each other where the machine is busy: ten times as long as all the rest takes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.untangle import barrier
from gmsnet.untangle.newton import AVERAGING, closing
from gmsnet.untangle.patch import Patch
from gmsnet.untangle.state import UntanglingState

Floats = NDArray[np.float64]

ROUNDS, ITERATIONS = 30, 60  # so many values of ε, so many iterations for each
BUDGET = 50_000_000  # iterations times nodes, all in all: many seconds, and then no more
MEMORY = 10  # pairs of steps that L-BFGS remembers
FALL, HALVINGS = 1e-4, 20  # of the slope, that a step has to bring at least; how often it is halved for that
ENOUGH = 1e-9  # falls of the value, relative to it, and slopes: there it ends
Pair = tuple[Floats, Floats, float]


def whole(tangle: UntanglingState, patch: Patch, patience: int) -> int:
    """L-BFGS on a piece until all its cells are certified; takes over where it has come to; returns iterations.

    patience: after so many values of ε that have not made the worst cell any better, it is given up.
    """
    precision = tangle.precision
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    worst = np.empty(patch.parts)
    iterations, best, since = 0, -math.inf, 0
    for _ in range(ROUNDS):
        if tangle.work > BUDGET:
            break
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, worst)
        if worst[0] > 0.0 and tangle.certified(points, patch):
            break
        since = 0 if worst[0] > best + 0.01 * abs(best) else since + 1
        best = max(best, float(worst[0]))
        if since > patience:
            break
        made = minimise(points, patch, scale, float(closing(worst)[0]), ITERATIONS)
        iterations += made
        tangle.work += made * patch.count
    tangle.put(points, patch)
    return iterations


def minimise(points: Floats, patch: Patch, scale: Floats, epsilon: float, iterations: int) -> int:
    """At most so many iterations from the points (m, 2) of a patch, which are changed; returns how many there were.

    scale: (m,) areas; the unknowns are the shifts over their roots, so that graded meshes are as easy as even ones.
    """
    count, start = patch.count, points[: patch.count].copy()
    size = np.sqrt(scale[:count])[:, None]
    gradient = np.empty_like(points)

    def evaluate(unknowns: Floats) -> tuple[float, Floats]:
        points[:count] = start + size * unknowns.reshape(-1, 2)
        value = barrier.energy(points, patch.cells, patch.weights, scale, epsilon, gradient)
        return value, (gradient[:count] * size).ravel()

    found, made = descended(evaluate, np.zeros(2 * count), iterations)
    points[:count] = start + size * found.reshape(-1, 2)
    return made


def descended(
    evaluate: Callable[[Floats], tuple[float, Floats]], place: Floats, iterations: int
) -> tuple[Floats, int]:  # fmt: skip
    """The place (n,) after at most so many iterations, and how many there were. evaluate: value and gradient there."""
    pairs = deque[Pair](maxlen=MEMORY)
    value, gradient = evaluate(place)
    for made in range(iterations):
        if not np.abs(gradient).max(initial=0.0) > ENOUGH:
            return place, made
        way = -_by_pairs(gradient, pairs)
        slope, step = _sum(way, gradient), 1.0 if pairs else 1.0 / math.sqrt(_sum(gradient, gradient))
        for _ in range(HALVINGS):
            new, after = evaluate(place + step * way)
            if new <= value + FALL * step * slope:
                break
            step *= 0.5
        else:
            return place, made
        place, before = place + step * way, value
        moved, turned = step * way, after - gradient
        value, gradient = new, after
        curved = _sum(moved, turned)
        if curved > 1e-10 * _sum(turned, turned):
            pairs.append((moved, turned, 1.0 / curved))
        if before - value <= ENOUGH * max(abs(before), abs(value), 1.0):
            return place, made + 1
    return place, iterations


def _by_pairs(gradient: Floats, pairs: deque[Pair]) -> Floats:
    """About the inverse Hessian times the gradient."""
    found, shares = gradient.copy(), []
    for moved, turned, inverse in reversed(pairs):
        shares.append(inverse * _sum(moved, found))
        found -= shares[-1] * turned
    if pairs:
        moved, turned, inverse = pairs[-1]
        found *= 1.0 / (inverse * _sum(turned, turned))
    for (moved, turned, inverse), share in zip(pairs, reversed(shares), strict=True):
        found += (share - inverse * _sum(turned, found)) * moved
    return found


def _sum(a: Floats, b: Floats) -> float:
    """Of products, not by BLAS."""
    return float(np.add.reduce(a * b))
