"""Where a mesh on the way stands in the comparison of meshes: quick sums over its triangles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.measure.report import ASPECT
from gmsnet.measure.totals import Totals
from gmsnet.metric.conformity import cell_qualities
from gmsnet.metric.field import Metric

Floats = NDArray[np.float64]

ROUNDING = 1e-12  # a smaller gain in q̂ is no gain


class Missing(NamedTuple):
    """What misses a target. corners: (K, 3 or 4) of the simplices that do. cells: how many cells these belong to."""

    corners: NDArray[np.int32]
    cells: int

    @classmethod
    def of(cls, corners: NDArray[np.int32], cells: NDArray[np.int32] | None = None) -> Missing:
        """cells: (K,) the cell of each, those of one cell one after the other; None where each is a cell."""
        if cells is None:
            return cls(corners, len(corners))
        return cls(corners, int(np.count_nonzero(np.diff(cells))) + (len(cells) > 0))


NONE = Missing.of(np.empty((0, 3), dtype=np.int32))


def in_metric(totals: Totals, points: Floats, simplices: Simplices, metric: Metric) -> Totals:
    """The same counts, and the least and the mean quality of the cells in a metric: no angles, and so no q̂."""
    values = cell_qualities(points, simplices, metric.at(points))
    nan = math.nan
    return replace(
        totals, low_mean=nan, low_min=nan, high_mean=nan, high_max=nan, aspect_mean=nan, aspect_min=nan,
        shape_mean=float(values.mean()), shape_min=float(values.min()),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Score:
    """Where a mesh stands in the comparison of meshes on the way.

    measure: the sums over all triangles, None where there are none; asked for when they first matter. missing: what
    misses the target, if there is one. positive: all triangles are known to be.
    """

    measure: Callable[[], Totals | None]
    best_by: str
    missing: Missing = NONE
    positive: bool = False

    @classmethod
    def of(cls, totals: Totals | None, best_by: str, missing: Missing = NONE) -> Score:
        """From the sums over all triangles; None where there are none."""
        return cls(lambda: totals, best_by, missing)

    @cached_property
    def totals(self) -> Totals | None:
        """What the rest is taken from."""
        return self.measure()

    @property
    def missed(self) -> int:
        """How many cells miss the target."""
        return self.missing.cells

    @property
    def inverted(self) -> int:
        """How many are."""
        return 0 if self.positive or self.totals is None else self.totals.inverted

    @property
    def qhat(self) -> float:
        """q̂ with 1/q or 1/q_V, as asked for; nan where meshes are not compared by it (see ``better_than``)."""
        if self.totals is None or not self.totals.in_plane:
            return math.nan
        return self.totals.qhat_aspect if self.best_by == ASPECT else self.totals.qhat

    @property
    def min_shape(self) -> float:
        """The minimum 1/q."""
        return math.inf if self.totals is None else self.totals.shape_min

    @property
    def mean_shape(self) -> float:
        """The mean 1/q."""
        return math.nan if self.totals is None else self.totals.shape_mean

    def closer_to_target(self, other: Score) -> bool:
        """Nearer to the target: fewer inverted cells, then fewer that miss it, then a better worst cell, not q̂."""
        if self.counts != other.counts:
            return self.counts < other.counts
        return self.min_shape > other.min_shape

    def better_than(self, other: Score) -> bool:
        """Fewer inverted cells first, then fewer that miss the target, then a larger q̂, by more than rounding.

        Where not all cells are triangles, on surfaces and in a metric: then the larger minimum 1/q of the cells that
        are compared, then their mean.
        """
        if self.counts != other.counts:
            return self.counts < other.counts
        if math.isnan(self.qhat):
            if abs(self.min_shape - other.min_shape) > ROUNDING:
                return self.min_shape > other.min_shape
            return self.mean_shape > other.mean_shape + ROUNDING
        return self.qhat > other.qhat + ROUNDING

    @property
    def counts(self) -> tuple[int, int]:
        """Inverted cells, and those that miss the target."""
        return self.inverted, self.missed
