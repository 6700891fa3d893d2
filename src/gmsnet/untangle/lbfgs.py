"""The barrier over a whole patch at once: L-BFGS (SciPy's L-BFGS-B without bounds)."""

from __future__ import annotations

import math

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from gmsnet.kernels.untangle import barrier
from gmsnet.untangle.newton import AVERAGING, closing
from gmsnet.untangle.patch import Patch
from gmsnet.untangle.state import UntanglingState

Floats = NDArray[np.float64]

ROUNDS, ITERATIONS = 30, 60  # so many values of ε, so many iterations for each
BUDGET = 50_000_000  # iterations times nodes, all in all: many seconds, and then no more
MEMORY = 10  # pairs of steps that L-BFGS remembers


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

    result = scipy.optimize.minimize(
        evaluate, np.zeros(2 * count), jac=True, method="L-BFGS-B",
        options={"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": MEMORY, "ftol": 1e-9, "gtol": 1e-9},
    )  # fmt: skip
    points[:count] = start + size * result.x.reshape(-1, 2)
    return int(result.nit)
