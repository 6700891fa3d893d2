"""Where a mesh on the way stands in the comparison of meshes: quick sums over its triangles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.arguments import ASPECT
from gmsnet.kernels import quality as kernels
from gmsnet.measure import weighted_metric

Floats = NDArray[np.float64]

ROUNDING = 1e-12  # a smaller gain in q̂ is no gain


@dataclass(frozen=True)
class Standing:
    """Where a mesh stands in the comparison of meshes on the way."""

    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float

    @classmethod
    def of(cls, sums: Floats, triangles: int, best_by: str) -> Standing:
        """From the rows of sums that kernels.quality.summarise leaves."""
        if triangles == 0:
            return cls(0, math.nan, math.inf, math.nan)
        low, high, shape = (float(sums[:, k].sum()) / triangles for k in range(3))
        worst_low, worst_high = float(sums[:, kernels.MIN_LOW].min()), float(sums[:, kernels.MAX_HIGH].max())
        worst_shape = float(sums[:, kernels.MIN_SHAPE].min())
        low, worst_low, worst_high, high = map(math.degrees, (low, worst_low, worst_high, high))
        mean, worst = shape, worst_shape
        if best_by == ASPECT:
            mean = float(sums[:, kernels.SUM_ASPECT].sum()) / triangles
            worst = float(sums[:, kernels.MIN_ASPECT].min())
        qhat = weighted_metric(low, worst_low, worst_high, high, mean, worst)
        return cls(int(sums[:, kernels.INVERTED].sum()), qhat, worst_shape, shape)

    def beats(self, other: Standing) -> bool:
        """Fewer inverted cells first, then a larger q̂, by more than rounding."""
        if self.inverted != other.inverted:
            return self.inverted < other.inverted
        return self.qhat > other.qhat + ROUNDING
