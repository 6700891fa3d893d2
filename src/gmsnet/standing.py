"""Where a mesh on the way stands in the comparison of meshes: quick sums over its triangles."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gmsnet.arguments import ASPECT
from gmsnet.measure import Totals

ROUNDING = 1e-12  # a smaller gain in q̂ is no gain


@dataclass(frozen=True)
class Standing:
    """Where a mesh stands in the comparison of meshes on the way.

    missed: how many cells miss the target. totals: what the rest was taken from.
    """

    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float
    missed: int = 0
    totals: Totals | None = None

    @classmethod
    def of(cls, totals: Totals | None, best_by: str, missed: int = 0) -> Standing:
        """From the sums over all triangles; None where there are none."""
        if totals is None:
            return cls(0, math.nan, math.inf, math.nan, missed)
        qhat = totals.qhat_aspect if best_by == ASPECT else totals.qhat
        return cls(totals.inverted, qhat, totals.shape_min, totals.shape_mean, missed, totals)

    @property
    def rank(self) -> tuple[int, int, float]:
        """Of two meshes that of the lesser rank is nearer to the target; the worst cell decides, not q̂."""
        return self.inverted, self.missed, -self.min_shape

    def beats(self, other: Standing) -> bool:
        """Fewer inverted cells first, then fewer that miss the target, then a larger q̂, by more than rounding."""
        if (self.inverted, self.missed) != (other.inverted, other.missed):
            return (self.inverted, self.missed) < (other.inverted, other.missed)
        return self.qhat > other.qhat + ROUNDING
