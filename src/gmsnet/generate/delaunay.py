"""Delaunay triangles inside a boundary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, QhullError

from gmsnet.errors import InputError
from gmsnet.generate.marked import marked
from gmsnet.generate.outline import inside
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_ROUNDS = 40  # of splitting boundary segments that the triangulation lacks; each round halves them


@dataclass(frozen=True)
class Triangulation:
    """points: (N × 2). triangles: (T × 3), counter-clockwise. segments: (B × 2), all of the boundary; side: (B,)."""

    points: Floats
    triangles: Ints
    segments: Ints
    side: Ints


def triangulate(outline: Floats, segments: Ints, side: Ints, inner: Floats) -> Triangulation:
    """Delaunay triangles of the outline's nodes (B × 2) and inner points, inside the segments.

    Where a segment (B × 2) is not an edge of the triangulation, it is split in the middle. side: (B,) the straight side
    that each segment is part of. Raises InputError if the points allow no such triangulation.
    """
    for _ in range(MOST_ROUNDS):
        points = np.concatenate([outline, inner])
        try:
            triangles = np.asarray(Delaunay(points).simplices, dtype=np.int64)
        except QhullError as error:
            raise InputError(f"these points cannot be triangulated: {str(error).strip().splitlines()[0]}") from error
        missing = np.flatnonzero(~np.isin(_keys(segments, len(points)), _keys(_edges(triangles), len(points))))
        if not missing.size:
            triangles = _between(points, segments, side, triangles)
            _check(points, segments, triangles)
            return Triangulation(points, triangles, segments, side)
        middle = len(outline) + np.arange(len(missing))
        outline = np.concatenate([outline, outline[segments[missing]].mean(axis=1)])
        second = np.column_stack([middle, segments[missing, 1]])
        segments = segments.copy()
        segments[missing, 1] = middle
        segments = np.concatenate([segments, second])
        side = np.concatenate([side, side[missing]])
    raise InputError("no division of the boundary fits these nodes; take more nodes or another seed")


def labelled(mesh: Triangulation, markers: Sequence[str], *, scale: float = 1.0) -> Mesh:
    """The mesh of a triangulation: triangles of the region "domain", and lines by the marker of their side.

    markers: of each side. scale: factor for the coordinates.
    """
    return marked(mesh.points, {"triangle": mesh.triangles}, mesh.segments, mesh.side, markers, scale=scale)


def unique_edges(triangles: Ints) -> Ints:
    """(E × 2) each edge once, the smaller number first, in the order of the numbers."""
    nodes = int(triangles.max(initial=0)) + 1
    return np.column_stack(np.divmod(sorted_unique(_keys(_edges(triangles), nodes)), nodes))


def _edges(triangles: Ints) -> Ints:
    """(3T × 2) the edges, those of one triangle after those of another."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def _keys(edges: Ints, nodes: int) -> Ints:
    """One number for each edge, whatever its direction."""
    return np.asarray(edges.min(axis=1) * nodes + edges.max(axis=1))


def _between(points: Floats, segments: Ints, side: Ints, triangles: Ints) -> Ints:
    """The triangles inside the segments, counter-clockwise."""
    triangles = triangles[~_on_one_side(segments, side, triangles, len(points))]
    # Pieces of triangles that are joined over edges other than segments lie inside or outside as a whole.
    keys = _keys(_edges(triangles), len(points))
    order = np.argsort(keys, kind="stable")
    keys, owner = keys[order], order // 3
    joined = np.flatnonzero((keys[1:] == keys[:-1]) & ~np.isin(keys[1:], _keys(segments, len(points))))
    pairs = coo_array((np.ones(len(joined)), (owner[joined], owner[joined + 1])), shape=(len(triangles),) * 2)
    count, piece = connected_components(pairs, directed=False)
    size = np.abs(_doubled_area(points, triangles))
    largest = np.lexsort((-size, piece))[np.searchsorted(np.sort(piece), np.arange(count))]
    centre = points[triangles[largest]].mean(axis=1)
    triangles = triangles[inside(centre, points[segments[:, 0]], points[segments[:, 1]])[piece]]
    clockwise = _doubled_area(points, triangles) < 0
    triangles[clockwise] = triangles[clockwise][:, ::-1]
    return triangles


def _on_one_side(segments: Ints, side: Ints, triangles: Ints, nodes: int) -> NDArray[np.bool_]:
    """Slivers of no area along the hull: all three nodes lie on one straight side (a corner lies on two)."""
    sides = np.full((nodes, 2), -1, dtype=np.int64)
    sides[segments[:, 0], 0] = side
    sides[segments[:, 1], 1] = side
    a, b, c = (sides[triangles[:, k]] for k in range(3))
    common = [(a[:, k] >= 0) & (a[:, k, None] == b).any(axis=1) & (a[:, k, None] == c).any(axis=1) for k in range(2)]
    return np.asarray(common[0] | common[1])


def _doubled_area(points: Floats, triangles: Ints) -> Floats:
    (ax, ay), (bx, by), (cx, cy) = (points[triangles[:, k]].T for k in range(3))
    return np.asarray((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def _check(points: Floats, segments: Ints, triangles: Ints) -> None:
    """Raises InputError unless the triangles fill the domain: same boundary, same area, every node used."""
    keys, count = np.unique(_keys(_edges(triangles), len(points)), return_counts=True)
    boundary = np.array_equal(keys[count == 1], np.sort(_keys(segments, len(points)))) and count.max(initial=0) <= 2
    area = _doubled_area(points, triangles)
    (x0, y0), (x1, y1) = ((points[segments[:, k]] - points[0]).T for k in range(2))
    enclosed = float(np.sum(x0 * y1 - x1 * y0))
    filled = abs(float(area.sum()) - enclosed) <= 1e-9 * enclosed and bool((area > 0).all())
    if not (boundary and filled and len(sorted_unique(triangles)) == len(points)):
        raise InputError("rounding spoils the triangulation of these nodes; take another seed or rings less flat")
