"""Where edges that cannot move cross each other: no mesh with these boundaries is without inverted cells there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure import exact_signs
from gmsnet.topology import Topology
from gmsnet.untangle.patch import Floats, Ints

CHUNK = 1_000_000  # pairs of boxes that are compared at a time


def near_crossings(points: Floats, edges: Ints, cells: Ints) -> Floats:
    """(k, 2) for each cell the next crossing of some edges (e, 2), in its box or at most its size from it; else nan."""
    found = np.full((len(cells), 2), np.nan)
    low, high = points[cells].min(axis=1), points[cells].max(axis=1)
    reach = (high - low).max(axis=1)[:, None]
    low, high = low - reach, high + reach
    left, right = points[edges].min(axis=1), points[edges].max(axis=1)
    near = np.unique(meeting(low, high, left, right)[:, 1])
    pairs = near[meeting(left[near], right[near], left[near], right[near])]
    places = crossings(points, edges[pairs[pairs[:, 0] < pairs[:, 1]]])
    for k, cell in enumerate(cells):
        inside = places[((places >= low[k]) & (places <= high[k])).all(axis=1)]
        if len(inside):
            found[k] = inside[np.argmin(((inside - points[cell].mean(axis=0)) ** 2).sum(axis=1))]
    return found


def held_edges(topology: Topology) -> tuple[Ints, Ints]:
    """The edges of triangles whose two nodes are held (e, 2), by places in memory: those of one triangle, and all."""
    near = topology.near
    edges = np.concatenate([near[:, [0, 1]], near[:, [1, 2]], near[:, [2, 0]]])
    edges = np.sort(edges[(topology.near_colours[edges] < 0).all(axis=1)], axis=1)
    every, triangles = np.unique(edges, axis=0, return_counts=True)
    return every[triangles == 1], every


def meeting(low: Floats, high: Floats, left: Floats, right: Floats) -> NDArray[np.intp]:
    """(p, 2) which of some boxes (lower and upper corners, (k, 2)) meet which of others."""
    pairs: list[NDArray[np.intp]] = [np.empty((0, 2), dtype=np.intp)]
    step = max(1, CHUNK // max(1, len(left)))
    for first in range(0, len(low), step):
        end = first + step
        apart = np.any((low[first:end, None] > right) | (high[first:end, None] < left), axis=2)
        one, other = np.nonzero(~apart)
        pairs.append(np.column_stack([first + one, other]))
    return np.concatenate(pairs)


def crossings(points: Floats, pairs: Ints) -> Floats:
    """(k, 2) where pairs of edges (p, 2, 2) cross in the inside of both, by exact signs."""
    (a, b), (c, d) = pairs[:, 0].T, pairs[:, 1].T
    turn = np.ones(len(pairs), dtype=np.int8)

    def sign(*corners: Ints) -> NDArray[np.int8]:
        return exact_signs(points, np.column_stack(corners), turn)

    crossed = (sign(a, b, c) * sign(a, b, d) < 0) & (sign(c, d, a) * sign(c, d, b) < 0)
    p, r = points[a[crossed]], points[b[crossed]] - points[a[crossed]]
    q, s = points[c[crossed]], points[d[crossed]] - points[c[crossed]]
    way = times(q - p, s) / times(r, s)
    return np.asarray(p + way[:, None] * r)


def times(u: Floats, v: Floats) -> Floats:
    """(n,) u × v of vectors (n, 2)."""
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
