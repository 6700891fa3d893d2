"""What all nodes of a volume have gained at once is judged when sweeps have brought back what they can of the mean."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.measure.totals import totals_of
from gmsnet.methods.base import Field
from gmsnet.methods.whole_mesh import LEAST_GAIN, TRADE
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume


class Trial:
    """What a volume was before all nodes moved at once; until the sweeps after that have ended, nobody looks at it."""

    def __init__(self, points: NDArray[np.float64], least: float, mean: float) -> None:
        self.points, self.least, self.mean = points, least, mean

    @classmethod
    def of(cls, field: Field, executor: Executor) -> Trial:
        """As it is now."""
        return cls(field.points.copy(), *_figures(field, executor))

    def ends(self, field: Field, executor: Executor) -> bool:
        """Has the least η gained enough for what it has cost in the mean? If not, all nodes go back."""
        least, mean = _figures(field, executor)
        gain = least - self.least
        good = gain >= LEAST_GAIN and gain >= TRADE * (self.mean - mean)
        if not good:
            field.points[:] = self.points
            field.floor.forget()
            assert isinstance(field.topology, MixedVolume)
            field.topology.forget_slack()
            if isinstance(field.constraint, Surface):  # it has followed the nodes
                locate3(field.constraint, field.points)
        return good


def _figures(field: Field, executor: Executor) -> tuple[float, float]:
    """The least and the mean η over the cells with a free node."""
    totals = totals_of(field.points, field.topology.scored, executor)
    return (-math.inf, -math.inf) if totals is None else (totals.shape_min, totals.shape_mean)
