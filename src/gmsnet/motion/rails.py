"""What nodes slide on while others move: curves in a plane, and the boundaries of volumes."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.constraint import Constraint, land_all, locate
from gmsnet.kernels.star.surface import LINE, Surface, land_all3, locate3

Floats = NDArray[np.float64]


class Rails(Protocol):
    """nodes: (K,) by places in memory, ascending, that slide and are not held."""

    nodes: NDArray[np.intp]

    def ways(self, points: Floats) -> Floats:
        """(K, D, D) the projections to the directions in which the nodes of points (N, D) may go."""

    def land(self, points: Floats) -> None:
        """Puts the nodes onto what they slide on; points (N, D) are written to."""

    def locate(self, points: Floats) -> None:
        """Takes note of where the nodes are, which are there."""


def rails_of(constraint: Constraint | Surface | None, free: NDArray[np.bool_]) -> Rails | None:
    """Those of the free nodes (N,) that slide; None where there are none."""
    if constraint is None:
        return None
    nodes = np.flatnonzero(free & (constraint.row >= 0))
    if not len(nodes):
        return None
    return OnSurface(constraint, nodes) if isinstance(constraint, Surface) else OnCurves(constraint, nodes)


class OnCurves:
    """See Rails. Straight curves go on behind their ends."""

    def __init__(self, constraint: Constraint, nodes: NDArray[np.intp]) -> None:
        self.constraint, self.nodes = constraint, nodes

    def ways(self, points: Floats) -> Floats:
        """See Rails."""
        tangents = np.empty((len(self.nodes), 2))
        land_all(self.constraint, self.nodes, points.copy(), tangents)
        return _along(tangents)

    def land(self, points: Floats) -> None:
        """See Rails."""
        land_all(self.constraint, self.nodes, points, np.empty((len(self.nodes), 2)))

    def locate(self, points: Floats) -> None:
        """See Rails."""
        locate(self.constraint, points)


class OnSurface:
    """See Rails."""

    def __init__(self, surface: Surface, nodes: NDArray[np.intp]) -> None:
        self.surface, self.nodes = surface, nodes

    def ways(self, points: Floats) -> Floats:
        """See Rails."""
        directions = np.empty((len(self.nodes), 3))
        land_all3(self.surface, self.nodes, points.copy(), directions)
        found, one_way = _along(directions), self.surface.kind[self.surface.row[self.nodes]] >= LINE
        return np.where(one_way[:, None, None], found, np.eye(3) - found)

    def land(self, points: Floats) -> None:
        """See Rails."""
        land_all3(self.surface, self.nodes, points, np.empty((len(self.nodes), 3)))

    def locate(self, points: Floats) -> None:
        """See Rails."""
        locate3(self.surface, points)


def _along(directions: Floats) -> Floats:
    return np.asarray(directions[:, :, None] * directions[:, None, :])
