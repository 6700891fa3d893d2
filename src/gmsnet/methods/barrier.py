"""Newton's method on a barrier, one step a visit. The formulas stand in kernels/methods/barrier.py.

The objective is the sum of q^p over the star, p = 1, 2 or 4, q the inverse of the shape metric: infinite where a
triangle of the star degenerates, so that no cell is given up for the mean of the others. ``q`` gives the best mean of
1/q and ``q4`` the best least one; ``q2`` stands between them.

On random squares (10,000 nodes, from the input, means over four meshes) q̂ after 2, 4, 8 and 12 sweeps is

    q   0.045  0.108  0.119  0.120        q2  0.053  0.127  0.139  0.139        q4  0.068  0.133  0.150  0.151

In space q stands for q^(3/2) in these names, whose star has the steps of kernels/methods/barrier3.py.

What the single parts bring on the way to the best mesh is measured by ``benchmarks/roads.py``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import barrier as kernels
from gmsnet.kernels.methods import shell
from gmsnet.kernels.methods.barrier3 import Power3, sweep3
from gmsnet.kernels.methods.barrier_star import Power
from gmsnet.kernels.methods.shell_lanes import sweep_lanes
from gmsnet.kernels.star.block import Visit
from gmsnet.kernels.star.guard import Guard
from gmsnet.kernels.star.shell import ShellBlocks, ShellStars
from gmsnet.methods.base import ALL_CELLS, Field, Method, StarSmoother, Tally
from gmsnet.parallel.executor import Executor

POWERS = {"q2": 2, "q": 1, "q4": 4}
IN_SPACE = {"q2": 0, "q": -1, "q4": 1}  # k of q^p: q there stands for the mean ratio to the power of 3/2
IN_SPACE_MOST, IN_SPACE_LONG = 1.3, 1.8  # ω; more gains nothing, but for long waves
RELAXATION, RELAXED = 1.6, 8  # ω, and for how many sweeps
STRETCH, MEANS = 1.1, 1  # how far to the mean, and in how many sweeps


class Barrier(StarSmoother):
    """One objective.

    relaxation: ω, by which a Newton step is lengthened in the first ``relaxed`` sweeps. In the first ``means`` sweeps
    a node goes STRETCH times the way to the mean of its ring instead, where its objective falls by that.
    """

    power: Power
    power3: Power3
    doublings: int
    relaxation: float
    relaxed: int
    means: int
    sweeps: int

    def __init__(
        self, objective: str, relaxation: float = RELAXATION, relaxed: int = RELAXED, means: int = MEANS
    ) -> None:
        self.power, self.power3 = Power.of(POWERS[objective]), Power3.of(IN_SPACE[objective])
        self.doublings = POWERS[objective].bit_length() - 1
        self.relaxation, self.relaxed, self.means = relaxation, relaxed, means
        self.sweeps, self.most_in_space = 0, IN_SPACE_MOST

    def hasten(self) -> None:
        """Steps in space are longer from now on: so many cells grow or shrink together in fewer sweeps."""
        self.relaxation = self.most_in_space = IN_SPACE_LONG

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (self.power, *self._pace))

    def in_space(self, guard: Guard) -> Visit:
        """See StarSmoother."""
        relaxation = min(self.relaxation, self.most_in_space) if self.sweeps < self.relaxed else 1.0
        return Visit(sweep3, (self.power3, relaxation))

    def visit_on_surface(
        self, points: NDArray[np.float64], stars: ShellStars, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        shell.sweep(points, stars, first, last, guard, self.doublings, *self._pace, tally)

    def visit_in_lanes(
        self, points: NDArray[np.float64], lanes: ShellBlocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        sweep_lanes(points, *lanes, first, last, guard, *self._pace, tally)

    @property
    def in_lanes(self) -> bool:
        """See StarSmoother."""
        return self.doublings == 0

    @property
    def _pace(self) -> tuple[float, float]:
        """ω, and how far to the mean, of this sweep."""
        relaxation = self.relaxation if self.sweeps < self.relaxed else 1.0
        return relaxation, STRETCH if self.sweeps < self.means else 0.0

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        tally = super().sweep(field, executor, test)
        self.sweeps += 1
        return tally


METHOD = Method(
    name="barrier",
    summary="one Newton step a sweep on the sum of q^p over the star, which is infinite where a cell degenerates",
    source="Knupp: Algebraic mesh quality metrics (2001), for q; Nocedal, Wright: Numerical Optimization, chapter 3",
    create=lambda options: Barrier(options.objective),
    objectives=tuple(POWERS),
    slides=True,
    surfaces=True,
    cells=ALL_CELLS,
)
