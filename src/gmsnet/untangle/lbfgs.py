"""The barrier over a whole patch at once: L-BFGS (SciPy's L-BFGS-B without bounds)."""

from __future__ import annotations

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from gmsnet.kernels import untangle_barrier as barrier
from gmsnet.untangle.patch import Patch

Floats = NDArray[np.float64]

MEMORY = 10  # pairs of steps that L-BFGS remembers


def minimise(points: Floats, patch: Patch, scale: Floats, epsilon: float, iterations: int) -> int:
    """At most so many iterations from the points (m, 2) of a patch, which are changed; returns how many there were.

    scale: (m,) areas; the unknowns are the shifts over their roots, so that graded meshes are as easy as even ones.
    """
    count, start = patch.count, points[: patch.count].copy()
    size = np.sqrt(scale[:count])[:, None]
    gradient = np.empty_like(points)

    def evaluate(unknowns: Floats) -> tuple[float, Floats]:
        points[:count] = start + size * unknowns.reshape(-1, 2)
        value = barrier.energy(points, patch.cells, scale, epsilon, gradient)
        return value, (gradient[:count] * size).ravel()

    result = scipy.optimize.minimize(
        evaluate, np.zeros(2 * count), jac=True, method="L-BFGS-B",
        options={"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": MEMORY, "ftol": 1e-9, "gtol": 1e-9},
    )  # fmt: skip
    points[:count] = start + size * result.x.reshape(-1, 2)
    return int(result.nit)
