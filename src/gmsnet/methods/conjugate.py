"""Nonlinear conjugate gradients over the places of all moving nodes at once, preconditioned by multigrid.

Polak and Ribière's (Nocedal, Wright: Numerical Optimization, section 5.2). No step goes as far as where a first simplex
has no area left, and each lowers the sum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.whole import multigrid
from gmsnet.kernels.whole.steps import largest_step
from gmsnet.methods.sliders import Sliders

Floats = NDArray[np.float64]

ITERATIONS = 120
REFRESH = 10  # iterations after which the preconditioner is formed anew
PATIENCE = 2  # iterations one after the other that gain little are the end
ARMIJO, HALVINGS, INSIDE = 1e-4, 25, 0.9


class Sum(Protocol):
    """A sum over simplices as a function of the places of some nodes.

    moved: (n,) the nodes that move. sliders: those of them that slide. cells: (S, 3) the simplices, None in space.
    """

    @property
    def moved(self) -> NDArray[np.intp]: ...  # noqa: D102

    @property
    def sliders(self) -> Sliders | None: ...  # noqa: D102

    @property
    def cells(self) -> NDArray[np.int32] | None: ...  # noqa: D102

    def value(self, points: Floats, gradient: Floats) -> float:
        """The sum at points (N, D), and its gradient (N, D); more than any mesh has where a cell is inverted."""

    def inverse(self, points: Floats) -> Callable[[Floats], Floats]:
        """About the inverse of its second derivative there, (n, D) to (n, D)."""


def minimise(problem: Sum, points: Floats, settled: float) -> Floats:
    """Where conjugate gradients lead from points (N, D) without an inverted cell.

    settled: a smaller share of the sum, gained in an iteration, is little.
    """
    gradient, sliders = np.empty_like(points), problem.sliders
    value = problem.value(points, gradient)
    slopes = gradient[problem.moved]
    inverse, age, small, length = problem.inverse(points), 0, 0, 1.0
    z = inverse(slopes)
    fall = multigrid.product(slopes, z)
    along = -z
    for _ in range(ITERATIONS):
        slope = multigrid.product(slopes, along)
        if not slope < 0.0:
            along, slope = -z, -fall
        if not slope < 0.0:  # nothing to gain
            break
        shifts = np.zeros_like(points)
        shifts[problem.moved] = along
        if problem.cells is not None:  # short of where a first simplex has no area left
            length = min(length, INSIDE * float(largest_step(points, problem.cells, shifts)))
        for _ in range(HALVINGS):
            there, promised = points + length * shifts, ARMIJO * length * slope
            if sliders is not None:
                there = sliders.placed(there)  # which may cut the shifts of some short
                promised = ARMIJO * multigrid.product(slopes, there[problem.moved] - points[problem.moved])
            after = problem.value(there, gradient)
            if after <= value + min(promised, 0.0):
                break
            length *= 0.5
        else:
            break
        small = small + 1 if value - after < settled * value else 0
        points, value = there, after
        if sliders is not None:
            sliders.taken()
        if small == PATIENCE:
            break
        before, slopes = slopes, gradient[problem.moved]
        age += 1
        if age == REFRESH:
            inverse, age = problem.inverse(points), 0
            z = inverse(slopes)
            fall, along, length = multigrid.product(slopes, z), -z, 1.0
            continue
        z = inverse(slopes)
        share = max(0.0, multigrid.product(slopes - before, z) / fall)
        fall = multigrid.product(slopes, z)
        along = share * along - z
        length *= 2.0
    return points
