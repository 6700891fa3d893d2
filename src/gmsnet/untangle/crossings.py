"""Where edges that cannot move cross each other: no mesh with these boundaries is without inverted cells there."""

from __future__ import annotations

import numpy as np
import scipy.spatial
from numpy.typing import NDArray

from gmsnet.measure import exact_signs
from gmsnet.topology import Topology
from gmsnet.untangle.patch import Flags, Floats, Ints

CHUNK, MANY = 1_000_000, 20  # pairs of boxes that are compared at a time; at most so many times


def near_crossings(points: Floats, edges: Ints, cells: Ints) -> Floats:
    """(k, 2) for each cell the next crossing of some edges (e, 2), at most its size off along either axis; else nan."""
    found = np.full((len(cells), 2), np.nan)
    low, high = points[cells].min(axis=1), points[cells].max(axis=1)
    middle, reach = (low + high) / 2, 1.5 * (high - low).max(axis=1)
    left, right = points[edges].min(axis=1), points[edges].max(axis=1)
    near = np.flatnonzero(near_any(middle, reach, left, right))
    pairs = near[meeting(left[near], right[near], left[near], right[near])]
    places = crossings(points, edges[pairs[pairs[:, 0] < pairs[:, 1]]])
    if len(places):
        distance, nearest = scipy.spatial.cKDTree(places).query(middle, p=np.inf)
        found[distance <= reach] = places[nearest[distance <= reach]]
    return found


def near_any(middle: Floats, reach: Floats, left: Floats, right: Floats) -> Flags:
    """Which of some boxes meet any square around (k, 2) of so much (k,) on all sides; or all, for many of both."""
    if len(left) * len(middle) > MANY * CHUNK:
        return np.ones(len(left), dtype=bool)
    out = np.zeros(len(left), dtype=bool)
    step = max(1, CHUNK // max(1, len(left)))
    for first in range(0, len(middle), step):
        low = middle[first : first + step] - reach[first : first + step, None]
        high = middle[first : first + step] + reach[first : first + step, None]
        apart = np.any((low[:, None] > right) | (high[:, None] < left), axis=2)
        out |= np.asarray(~apart).any(axis=0)
    return out


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
