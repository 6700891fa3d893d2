"""Plane parts of a surface whose cells lie over one another, as in a plane mesh that is tangled and turned in space.

Where such cells meet, their normals are opposite. So every fold looks like a sharp edge, whose nodes would be held.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.outline import Flags, Longs, edge_keys
from gmsnet.constraints.patches import NOTHING, linked
from gmsnet.kernels.whole import facets as kernels

Floats = NDArray[np.float64]
LEVEL = 1e-6  # of the length of edges, and of the extent of the part: what is so near to a plane is in it

FEWEST = 3  # facets around a node that is inside of its part
OPPOSITE = -0.99  # the cosine between normals from which on they may be so in one plane


class FoldedPlane(NamedTuple):
    """facets: (F,) bool, which are its. origin: (3,), a point of it. axes: (2, 3) of length 1; seen against their
    product the boundary is wound counter-clockwise. Along the axes of the space they are whole numbers."""

    facets: Flags
    origin: Floats
    axes: Floats


def folded_planes(facets: Facets, points: Floats, sharp: Flags) -> list[FoldedPlane]:
    """The parts with a boundary of their own that lie in a plane and are folded in it. points: (N, 3).

    A part hangs together across edges of two facets of one label, where there is no line cell. sharp: (F,) bool, the
    facets with an edge that is no smooth one: where these are not folded, no others are looked at.
    """
    rows = facets.rows
    if not (_crossed(facets, points).any() or _turned_over(points, rows[sharp])):
        return []
    normal, unit, area = _normals(points, rows)
    found, count, one, other = _edges(points, rows)
    f, g = one // 3, other // 3
    joined = (count == 2) & (facets.label[f] == facets.label[g])
    joined &= ~np.isin(found, edge_keys(facets.lines[:, 0], facets.lines[:, 1], len(points)))
    joined &= _level(points, rows, unit, area, one, other)
    beside = np.full(rows.size, NOTHING, dtype=np.int64)
    beside[one[joined]], beside[other[joined]] = g[joined], f[joined]
    part = linked(beside.reshape(-1, 3))
    planes = (_plane(part == number, points, rows, normal) for number in _with_folds(facets, points, part, unit))
    return [plane for plane in planes if plane is not None]


def _normals(points: Floats, rows: Longs) -> tuple[Floats, Floats, Floats]:
    """Of facets, see kernels.whole.facets: the products of two edges, unit normals, and the lengths of the products."""
    normal, unit, area = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(len(rows))
    kernels.facet_normals(points, rows, normal, area, unit)
    return normal, unit, area


def _edges(points: Floats, rows: Longs) -> Longs:
    """(4, E) the edges of facets, see kernels.whole.facets: their nodes, of how many sides, the first two of these."""
    table = np.empty((4, rows.size), dtype=np.int64)
    return table[:, : kernels.list_edges(rows, len(points), *table)]


def _crossed(facets: Facets, points: Floats) -> Flags:
    """(Q,) the quads with a corner that is turned against the product of the diagonals: bow-ties and concave ones."""
    places = points[quads_of(facets)].transpose(1, 0, 2)
    product = np.cross(places[2] - places[0], places[3] - places[1])
    crossed = np.zeros(len(product), dtype=bool)
    for k in range(4):
        here, ahead, behind = places[k], places[(k + 1) % 4], places[k - 1]
        crossed |= dot(np.cross(ahead - here, behind - here), product) <= 0.0
    return crossed


def _turned_over(points: Floats, rows: Longs) -> bool:
    """Do two of some facets (F, 3) with a common edge have normals that are opposite?"""
    _, count, one, other = _edges(points, rows)
    _, unit, _ = _normals(points, rows)
    return bool(((count == 2) & (dot(unit[one // 3], unit[other // 3]) < OPPOSITE)).any())


def _level(points: Floats, rows: Longs, unit: Floats, area: Floats, one: Longs, other: Longs) -> Flags:
    """(E,) which edges join facets of one plane: that of the larger one, whose normal is known better."""
    swapped = area[other // 3] > area[one // 3]
    large, small = np.where(swapped, other, one), np.where(swapped, one, other)
    beyond = points[rows[small // 3, (small + 2) % 3]]
    begin, end = points[rows[large // 3, large % 3]], points[rows[large // 3, (large + 1) % 3]]
    size = np.maximum(lengths_of(beyond - begin), lengths_of(end - begin))
    level: Flags = (area[large // 3] > 0.0) & (abs(dot(beyond - begin, unit[large // 3])) <= LEVEL * size)
    return level


def _with_folds(facets: Facets, points: Floats, part: Longs, unit: Floats) -> list[int]:
    """The parts with facets on both sides, or with a quad that has corners on both, and with nodes inside."""
    count = int(part.max(initial=-1)) + 1
    first = np.full(count, len(part), dtype=np.int64)
    np.minimum.at(first, part, np.arange(len(part)))
    folded = np.zeros(count, dtype=bool)
    folded[part[dot(unit, unit[first[part]]) < 0.0]] = True
    begin, half = len(part) - facets.halves, facets.halves // 2
    folded[part[begin : begin + half][_crossed(facets, points)]] = True
    return np.flatnonzero(folded & _with_inner_nodes(facets.rows, part, count)).tolist()


def _with_inner_nodes(rows: Longs, part: Longs, count: int) -> Flags:
    """(count,) which parts have nodes that none but their facets have, which alone may move: FEWEST facets at least."""
    size = int(rows.max(initial=-1)) + 1
    low, high = np.full(size, count, dtype=np.int64), np.full(size, -1, dtype=np.int64)
    for column in rows.T:
        np.minimum.at(low, column, part)
        np.maximum.at(high, column, part)
    found = np.zeros(count, dtype=bool)
    found[low[(low == high) & (np.bincount(rows.ravel(), minlength=size) >= FEWEST)]] = True
    return found


def quads_of(facets: Facets) -> Longs:
    """(Q, 4) the corners of the quads whose halves are the last facets."""
    begin, half = len(facets.rows) - facets.halves, facets.halves // 2
    return np.column_stack([facets.rows[begin : begin + half], facets.rows[begin + half :, 2]])


def _plane(chosen: Flags, points: Floats, rows: Longs, normal: Floats) -> FoldedPlane | None:
    """The plane of a part; None where it is none, or has no boundary, and so no side that is up."""
    nodes = np.unique(rows[chosen])
    at = points[nodes]
    upward, size = normal[chosen].sum(axis=0), np.ptp(at, axis=0)
    extent = float(size.max())
    if not np.linalg.norm(upward) > LEVEL * extent**2:
        return None
    upward = upward / np.linalg.norm(upward)
    flat = int(np.argmax(abs(upward)))
    if size[flat] == 0.0:
        axes = np.eye(3)[[(flat + 1) % 3, (flat + 2) % 3]]
        axes = axes if upward[flat] > 0.0 else axes[::-1]
    else:
        side = np.cross(np.eye(3)[int(np.argmin(abs(upward)))], upward)
        side /= np.linalg.norm(side)
        axes = np.stack([side, np.cross(upward, side)])
    off = (at - at[0]) @ np.cross(axes[0], axes[1])
    return FoldedPlane(chosen, at[0], axes) if abs(off).max() <= LEVEL * extent else None
