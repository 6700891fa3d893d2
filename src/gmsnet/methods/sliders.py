"""Nodes that slide, where all nodes move at once: each step is put onto their curves, slopes are those along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.constraint import Constraint, locate, slide_all
from gmsnet.methods.base import Field

Floats = NDArray[np.float64]


@dataclass(eq=False)
class Sliders:
    """The nodes (K,) that slide and may move, by places in memory. parameters, tangents: where they were put last.

    No node comes nearer to a neighbour on its curve than a tenth of the way in one step. The parameters of the
    constraint are those of the points that were taken last.
    """

    constraint: Constraint
    nodes: NDArray[np.intp]
    parameters: Floats
    tangents: Floats

    @classmethod
    def of(cls, field: Field, free: NDArray[np.bool_]) -> Sliders | None:
        """Of those among the nodes (N,) that are free; None where there are none."""
        constraint = field.constraint
        if not isinstance(constraint, Constraint):
            return None
        nodes = np.flatnonzero(free & (constraint.row >= 0))
        if not len(nodes):
            return None
        locate(constraint, field.points)
        sliders = cls(constraint, nodes, np.empty(len(nodes)), np.empty((len(nodes), 2)))
        sliders.placed(field.points.copy())
        return sliders

    def placed(self, points: Floats) -> Floats:
        """The points (N, 2) with these nodes on their curves; they are written to."""
        slide_all(self.constraint, self.nodes, points, self.parameters, self.tangents)
        return points

    def taken(self) -> None:
        """The next step begins where nodes were put last."""
        self.constraint.parameter[self.constraint.row[self.nodes]] = self.parameters

    def back(self, points: Floats) -> None:
        """The next step begins at these points (N, 2), whatever was taken."""
        locate(self.constraint, points)

    def along(self, vectors: Floats, rows: NDArray[np.integer]) -> Floats:
        """Vectors (n, 2) with those of these nodes, in ``rows`` (K,), along the curves alone; they are written to."""
        vectors[rows] = (vectors[rows] * self.tangents).sum(axis=1, keepdims=True) * self.tangents
        return vectors
