"""Parts of a surface that can be laid flat, and what is known of facets and of the edges between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.outline import Flags, Longs, edge_keys
from gmsnet.constraints.patches import NOTHING
from gmsnet.kernels.whole import facets as kernels

Floats = NDArray[np.float64]


class Chart(NamedTuple):
    """facets: (n,) which are its, ascending. origin: (3,), a point of it. axes: (2, 3) of length 1; seen against their
    product the surface is wound counter-clockwise. Along the axes of the space they are whole numbers."""

    facets: Longs
    origin: Floats
    axes: Floats

    @property
    def normal(self) -> Floats:
        """(3,) of length 1."""
        return np.cross(self.axes[0], self.axes[1])


def normals_of(points: Floats, rows: Longs) -> tuple[Floats, Floats, Floats]:
    """Of facets, see kernels.whole.facets: the products of two edges, unit normals, and the lengths of the products."""
    normal, unit, area = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(len(rows))
    kernels.facet_normals(points, rows, normal, area, unit)
    return normal, unit, area


def edges_of(nodes: int, rows: Longs) -> Longs:
    """(4, E) the edges of facets, see kernels.whole.facets: their nodes, of how many sides, the first two of these."""
    table = np.empty((4, rows.size), dtype=np.int64)
    return table[:, : kernels.list_edges(rows, nodes, *table)]


def crossed(facets: Facets, points: Floats) -> Flags:
    """(Q,) the quads with a corner that is turned against the product of the diagonals: bow-ties and concave ones."""
    places = points[quads_of(facets)]
    return turned_corners(places, np.cross(places[:, 2] - places[:, 0], places[:, 3] - places[:, 1]))


def turned_corners(places: Floats, side: Floats) -> Flags:
    """(C,) the cells (C, k, 3) with a corner that is turned against a direction (C, 3), or upright to it."""
    found = np.zeros(len(places), dtype=bool)
    count = places.shape[1]
    for k in range(1 if count == 3 else count):
        here, ahead, behind = places[:, k], places[:, (k + 1) % count], places[:, k - 1]
        found |= dot(np.cross(ahead - here, behind - here), side) <= 0.0
    return found


def folded(facets: Facets, points: Floats, sharp: Flags, cosine: float) -> bool:
    """Is there a crossed quad, or do normals of neighbours among some facets (F,) have less than this cosine?"""
    if crossed(facets, points).any():
        return True
    rows = facets.rows[sharp]
    _, count, one, other = edges_of(len(points), rows)
    _, unit, _ = normals_of(points, rows)
    return bool(((count == 2) & (dot(unit[one // 3], unit[other // 3]) < cosine)).any())


def level(facets: Facets, points: Floats, unit: Floats, area: Floats, edges: Longs, share: float) -> Flags:
    """(E,) which edges join two facets of one label, without a line cell, whose planes are the same.

    That is, the node beyond is off the plane of the larger one, whose normal is known better, by at most so large a
    share of its distance. edges: as ``edges_of`` gives them.
    """
    rows = facets.rows
    found, count, one, other = edges
    swapped = area[other // 3] > area[one // 3]
    large, small = np.where(swapped, other, one), np.where(swapped, one, other)
    beyond = points[rows[small // 3, (small + 2) % 3]]
    begin, end = points[rows[large // 3, large % 3]], points[rows[large // 3, (large + 1) % 3]]
    size = np.maximum(lengths_of(beyond - begin), lengths_of(end - begin))
    flat: Flags = (area[large // 3] > 0.0) & (abs(dot(beyond - begin, unit[large // 3])) <= share * size)
    flat &= (count == 2) & (facets.label[one // 3] == facets.label[other // 3])
    return flat & ~np.isin(found, edge_keys(facets.lines[:, 0], facets.lines[:, 1], len(points)))


def across_edges(count: int, one: Longs, other: Longs) -> Longs:
    """(count, 3) the facet across each edge of facets, where an edge of these joins two; else NOTHING."""
    beside = np.full(3 * count, NOTHING, dtype=np.int64)
    beside[one], beside[other] = other // 3, one // 3
    return beside.reshape(-1, 3)


def quads_of(facets: Facets) -> Longs:
    """(Q, 4) the corners of the quads whose halves are the last facets."""
    begin, half = len(facets.rows) - facets.halves, facets.halves // 2
    return np.column_stack([facets.rows[begin : begin + half], facets.rows[begin + half :, 2]])


def axes_across(upward: Floats) -> Floats:
    """(2, 3) of length 1, whose product is a direction (3,) of length 1."""
    side = np.cross(np.eye(3)[int(np.argmin(abs(upward)))], upward)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(upward, side)])
