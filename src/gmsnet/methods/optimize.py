"""Optimisation-based smoothing: each node goes to where an objective of its star is least, found by descent.

- adam: at most 20 Adam steps from where the node is, of MetricLoss by default: the paper's OptimSmoothing, with a step
  size tuned in its favour. kernels/methods/adam.py
- newton: safeguarded Newton steps, to the end; bounded objectives may not make a simplex smaller than a tenth of its
  star's mean. kernels/methods/newton.py

In space both descend star by star (kernels/methods/descent3.py), and all but the two objectives of angles are there.

The objectives stand in kernels/simplex/objectives.py, in space in objectives3.py. ``q`` and ``q2`` are barriers, and
good for the worst cell; the other three are bounded, so that their minimisers give up single cells for the mean of the
rest: on random squares of 1,000 nodes the minimum angle ends at 20° and 21° with the barriers and at about 1° with the
others, the mean of 1/q at 0.896, 0.895 and, with MetricLoss, 0.897.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import adam, descent3, newton
from gmsnet.kernels.simplex import objectives
from gmsnet.kernels.simplex.objectives3 import Aim3
from gmsnet.kernels.star.block import Blocks, Visit
from gmsnet.kernels.star.guard import LARGEST, Guard
from gmsnet.methods.base import ALL_CELLS, TRIANGLES, Method, MethodOptions, StarSmoother, Tally


class Adam(StarSmoother):
    """Adam steps on one objective. sizes: of each step, relative to the star's size."""

    objective: int
    sizes: NDArray[np.float64]

    def __init__(self, objective: str, sizes: NDArray[np.float64] | None = None) -> None:
        self.objective = objectives.NAMES.index(objective)
        self.sizes = step_sizes() if sizes is None else sizes

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(adam.sweep, (self.objective, self.sizes), None)

    def in_space(self, guard: Guard) -> Visit:
        """See StarSmoother."""
        return Visit(descent3.sweep3, (Aim3(self.objective), 0, self.sizes), None)


class Newton(StarSmoother):
    """Newton steps on one objective.

    floor: of 1/q. If the guard has a floor, no cell may come below this one, nor below MARGIN times the guard's. For
    bounded objectives, which make many cells as bad as they may become for the mean of the others.
    """

    objective: int
    floor: float | None

    MARGIN = 1.05

    def __init__(self, objective: str, floor: float | None = None) -> None:
        self.objective, self.floor = objectives.NAMES.index(objective), floor

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        if self.floor is not None and guard.floor > 0.0:
            guard = guard._replace(floor=max(self.MARGIN * guard.floor, self.floor * LARGEST))
        newton.sweep(points, blocks, first, last, guard, self.objective, tally)

    def in_space(self, guard: Guard) -> Visit:
        """See StarSmoother."""
        return Visit(descent3.sweep3, (Aim3(self.objective), newton.STEPS, np.empty(0)), None)


def step_sizes() -> NDArray[np.float64]:
    """(20,) the tuned step sizes of Adam, relative to the star's size."""
    return adam.STEP_SIZE / np.sqrt(np.arange(1, adam.STEPS + 1))


def create(options: MethodOptions) -> StarSmoother:
    """The variant with the objective."""
    return Newton(options.objective) if options.variant == "newton" else Adam(options.objective)


METHOD = Method(
    name="optimize",
    summary="to where an objective of the star is least, by Adam steps (as the paper does) or Newton's",
    source="Kingma, Ba: Adam (2014), as in the paper of GMSNet; Nocedal, Wright: Numerical Optimization, chapter 3",
    create=create,
    variants=("adam", "newton"),
    objectives=objectives.NAMES,
    slides=True,
    cells=ALL_CELLS,
    limits=dict.fromkeys(objectives.OF_ANGLES, TRIANGLES),
)
