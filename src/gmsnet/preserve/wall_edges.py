"""The edges of walls, and the cells beside them. A wall is a piece of the boundary that hangs together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL, Simplices
from gmsnet.kernels.simplex.survey import BOUNDARY
from gmsnet.kernels.topology.components import pieces
from gmsnet.topology.stars import Ints

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]


class Beside(NamedTuple):
    """The simplices with two nodes of the boundary or more, in memory order. boundary: (N,) bool, its nodes."""

    simplices: Simplices
    boundary: Flags

    @classmethod
    def of(cls, simplices: Simplices, rows: Ints, rim: NDArray[np.uint8]) -> Beside:
        """Of all simplices these rows. rim: as of a survey."""
        return cls(simplices.take(rows), np.asarray((rim & BOUNDARY) > 0))

    def walls(self) -> list[tuple[Ints, NDArray[np.intp]]]:
        """The edges (k, 2) of each wall, and for each of them which of the simplices is there."""
        rows, shapes = self.simplices.rows, self.simplices.shapes
        edges = rows[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        at_rim = self.boundary[edges].all(axis=1)
        if shapes is not None:  # of a corner of a quad, the edge to the next one: so each edge of a cell counts once
            at_rim &= np.repeat(shapes == EQUILATERAL, 3) | (np.arange(len(edges)) % 3 == 0)
        outer = np.flatnonzero(at_rim)
        ends = np.sort(edges[outer], axis=1)
        key = ends[:, 0].astype(np.int64) * len(self.boundary) + ends[:, 1]
        # An edge between two of these nodes that is not on the boundary has both of its cells among these rows.
        _, place, count = np.unique(key, return_index=True, return_counts=True)
        once = place[count == 1]
        ends, cells = ends[once], outer[once] // 3
        piece = pieces(ends, self.boundary)[ends[:, 0]]
        order = np.argsort(piece, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(piece[order])) + 1)
        return [(ends[part], cells[part]) for part in parts if len(part)]


def doubled(points: Floats, triangles: Ints) -> Floats:
    """(T,) twice the area."""
    (ax, bx, cx), (ay, by, cy) = (points[:, axis][triangles].T for axis in range(2))
    return np.asarray(np.abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)))


def edge_of(double: Floats | float) -> Floats:
    """The edges of equilateral triangles of such areas, doubled."""
    return np.asarray(np.sqrt(double * (2.0 / np.sqrt(3.0))))
