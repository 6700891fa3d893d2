"""Where edges that cannot move cross each other: no mesh with these boundaries is without inverted cells there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.spatial
from numpy.typing import NDArray

from gmsnet.measure.signs import exact_signs
from gmsnet.untangle.patch import Floats, Ints

MOST = 3_000_000  # pairs of boxes
BACK = 1e-9  # the sine of an angle: two edges with less between them lie on each other
FLAT = 1e-9  # of the largest box: smaller ones count as that large where boxes are sorted by size


def near_crossings(points: Floats, edges: Ints, cells: Ints) -> Floats:
    """(k, 2) for each cell the next crossing of some edges (e, 2), at most its size off along either axis; else nan."""
    found = np.full((len(cells), 2), np.nan)
    edges = edges[(points[edges[:, 0]] != points[edges[:, 1]]).any(axis=1)]
    if not len(edges) or not len(cells):
        return found
    low, high = points[cells].min(axis=1), points[cells].max(axis=1)
    middle, reach = (low + high) / 2, 1.5 * (high - low).max(axis=1)
    left, right = points[edges].min(axis=1), points[edges].max(axis=1)
    pairs = meeting(middle - reach[:, None], middle + reach[:, None], left, right)
    if pairs is not None:
        near = np.unique(pairs[:, 1])
        pairs = meeting(left[near], right[near], left[near], right[near])
    if pairs is None:  # so much lies over each other that one crossing more or less says nothing
        return found
    places = crossings(points, apart(edges, near[pairs]))
    if len(places):
        distance, nearest = scipy.spatial.cKDTree(places).query(middle, p=np.inf)
        found[distance <= reach] = places[nearest[distance <= reach]]
    return found


def crossings_of(points: Floats, edges: Ints) -> Floats:
    """(k, 2) where some edges (e, 2) cross each other; nothing is said where too many lie over each other."""
    edges = edges[(points[edges[:, 0]] != points[edges[:, 1]]).any(axis=1)]
    if not len(edges):
        return np.empty((0, 2))
    low, high = points[edges].min(axis=1), points[edges].max(axis=1)
    pairs = meeting(low, high, low, high)
    return np.empty((0, 2)) if pairs is None else crossings(points, apart(edges, pairs))


def doubled_back(points: Floats, edges: Ints) -> NDArray[np.intp]:
    """(k,) the nodes of exactly two of some edges (e, 2) that lie on each other, ascending."""
    at, other = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.argsort(at, kind="stable")
    nodes = np.flatnonzero(np.bincount(at) == 2)
    first = np.searchsorted(at[order], nodes)
    u, v = (points[other[order][first + k]] - points[nodes] for k in (0, 1))
    along, across = np.einsum("ij,ij->i", u, v), times(u, v)
    return np.asarray(nodes[(along > 0.0) & (np.abs(across) <= BACK * along)])


def angle_sums(points: Floats, at: Ints, ahead: Ints, behind: Ints) -> Floats:
    """(N,) the sum of the angles of cells at their corners, from the next corner to the one before."""
    one, other = points[ahead] - points[at], points[behind] - points[at]
    angle = np.arctan2(times(one, other), np.einsum("ij,ij->i", one, other))
    found: Floats = np.bincount(at, angle, minlength=len(points)).astype(np.float64)
    return found


def apart(edges: Ints, pairs: NDArray[np.intp]) -> Ints:
    """(p, 2, 2) the pairs of edges, each once, that share no node: those that do, do not cross."""
    both = edges[pairs[pairs[:, 0] < pairs[:, 1]]]
    chosen: Ints = both[~(both[:, 0, :, None] == both[:, 1, None, :]).any(axis=(1, 2))]
    return chosen


def meeting(low: Floats, high: Floats, left: Floats, right: Floats) -> NDArray[np.intp] | None:
    """(p, 2) which of some boxes (lower and upper corners, (k, 2)) meet which of others; None for more than MOST pairs.

    By their middles, those of one size (to a factor of two) with those of one size at a time.
    """
    pairs: list[NDArray[np.intp]] = [np.empty((0, 2), dtype=np.intp)]
    pairs_left = MOST
    for one, middle, half in by_size(low, high):
        for other, other_middle, other_half in by_size(left, right):
            tree = scipy.spatial.cKDTree(other_middle)
            if len(one) * len(other) > MOST:  # only then is it worth counting before they are listed
                pairs_left -= int(tree.query_ball_point(middle, half + other_half, p=np.inf, return_length=True).sum())
                if pairs_left < 0:
                    return None
            close = tree.query_ball_point(middle, half + other_half, p=np.inf, return_sorted=True)
            count = np.fromiter(map(len, close), dtype=np.intp, count=len(close))
            if count.any():
                some = np.column_stack([np.repeat(one, count), other[np.concatenate(close).astype(np.intp)]])
                apart = (low[some[:, 0]] > right[some[:, 1]]) | (high[some[:, 0]] < left[some[:, 1]])
                pairs.append(some[~apart.any(axis=1)])
    return np.concatenate(pairs)


def by_size(low: Floats, high: Floats) -> Iterator[tuple[NDArray[np.intp], Floats, float]]:
    """Boxes of about one size: which they are, their middles, and the largest half of a side."""
    if not len(low):
        return
    half = (high - low).max(axis=1) / 2
    least = max(FLAT * float(half.max()), float(np.finfo(float).tiny))
    size = np.floor(np.log2(np.maximum(half, least)))
    for each in np.unique(size):
        rows = np.flatnonzero(size == each)
        yield rows, (low[rows] + high[rows]) / 2, float(half[rows].max())


def crossings(points: Floats, pairs: Ints) -> Floats:
    """(k, 2) where pairs of edges (p, 2, 2) cross in the inside of both, by exact signs."""
    (a, b), (c, d) = pairs[:, 0].T, pairs[:, 1].T
    orientation = np.ones(len(pairs), dtype=np.int8)

    def sign(*corners: Ints) -> NDArray[np.int8]:
        return exact_signs(points, np.column_stack(corners), orientation)

    crossed = (sign(a, b, c) * sign(a, b, d) < 0) & (sign(c, d, a) * sign(c, d, b) < 0)
    p, r = points[a[crossed]], points[b[crossed]] - points[a[crossed]]
    q, s = points[c[crossed]], points[d[crossed]] - points[c[crossed]]
    way = times(q - p, s) / times(r, s)
    return np.asarray(p + way[:, None] * r)


def times(u: Floats, v: Floats) -> Floats:
    """(n,) u × v of vectors (n, 2)."""
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
