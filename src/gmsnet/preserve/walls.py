"""Near which walls the sizes of cells are meant to be what they are.

A mesh that is refined towards a body is so on purpose: what happens there, in about a boundary layer's thickness, must
be resolved as its maker wanted. In isotropic regions the connectivity carries the grading, so they are smoothed freely;
but converged smoothing changes single areas by a factor of up to two. So cells near such a wall keep their areas
within a band, and those on it their heights within a narrower one. Their shapes are improved as far as the bands let
them.

Where a mesh has been disturbed, areas are noise, and nobody's intent. There bands reach to the mean of the areas around
each cell, and where the noise is larger still, further. This goes by degrees, with the median noise near a wall, and
with that around single cells that are damaged. So a mesh that is a little worse is kept nearly as much.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import measures as quality
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.signs import exact_signs
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.banded import Kept
from gmsnet.preserve.survey import Survey
from gmsnet.preserve.wall_edges import Beside, doubled, edge_of
from gmsnet.topology.stars import Ints
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

NEAR = 0.02  # of a wall's diameter: how far from it a cell's middle may lie
REFINED = 0.25  # cells there have edges of at most this share of those that cells of the mesh's mean area would have
COARSE = 0.1  # of a wall's diameter: the edges on a body that is resolved at all are shorter
MOST = 0.5  # at least this share of the cells near a wall is refined, or it is not refined towards that wall
# How far a cell's area lies from the mean of its neighbours', in logarithms, averaged over the stars of its corners:
# the noise. Meshes of triangles as they are made have a median of 0.02 to 0.08 near a wall, random ones 0.4 to 0.5; of
# quads, recombined of triangles, 0.03 to 0.2 and 0.3 to 0.35. From the first to the second of these bands of heights
# give way to those of areas; from there to the third these reach to the mean around; and from there to the fourth they
# grow by the factor WIDEST.
SURE, CALM, NOISY, RANDOM = range(4)
NOISE = np.array([[0.08, 0.1, 0.2, 0.4], [0.12, 0.145, 0.17, 0.25]])  # of triangles, of quads
WIDEST = 4.0
ROUGH, BROKEN = 0.4, 0.5  # the same for single cells, whose band reaches to the mean from the second on
SOUND, POOR = 0.5, 0.3  # the same by their 1/q
CANDIDATES = 8  # edges of the wall, by their middles, among which the nearest is looked for


class NearWalls(NamedTuple):
    """Which cells keep their areas.

    kept: their corners, by node id, and how exactly. coarse: how many walls there are that the mesh is refined towards,
    but of which no cell is kept, for those on them are larger than NEAR.
    """

    kept: Kept
    coarse: int


def near_walls(mesh: Mesh, topology: Topology, survey: Survey | None = None) -> NearWalls:
    """The cells of a planar mesh that keep their areas.

    topology: of this mesh, with what is stretched on purpose held. The cells are those whose middle lies within NEAR of
    a wall's diameter from it (a wall is a piece of the boundary that hangs together), provided that the mesh is refined
    towards that wall and is not all noise there; but for inverted cells. Most cells near a refined wall are at most
    REFINED of the mesh's mean size, and so small that at least one row of them is near. survey: of this mesh, where it
    is known.
    """
    triangles, count = topology.near, len(topology.memory)
    kept, coarse = Kept.nothing(count), 0
    if topology.plane is None or not len(triangles):
        return NearWalls(kept, 0)
    survey = survey or Survey.of(mesh, topology)
    points = survey.points
    largest = REFINED * float(edge_of(survey.double))
    beside = Beside.of(topology.simplices, survey.beside, survey.rim)
    if not _some_small(points, beside, largest):
        return NearWalls(kept, 0)  # so it is with most meshes
    rough: Floats | None = None
    for wall, cells in beside.walls():
        size = edge_of(doubled(points, beside.simplices.rows[cells]))
        if not _mostly_small(size, largest):
            continue
        diameter = _diameter(points[sorted_unique(wall)])
        close = NEAR * diameter
        most = min(largest, close)
        rows = _rows_near(points, triangles, points[wall], close)
        inside = edge_of(doubled(points, triangles[rows]))
        if not (most > 0.0 and all(len(some) and (some <= most).mean() >= MOST for some in (size, inside))):
            coarse += bool(close < np.median(size) <= COARSE * diameter)
            continue
        rough = _roughness(topology, points) if rough is None else rough
        levels = _levels(topology, rows)
        if np.median(rough[rows]) < levels[RANDOM]:
            _keep(kept, topology, points, rows, rough[rows], levels, wall)
    if kept.nodes.any():
        _leave_out_inverted(kept, topology, points)
    return NearWalls(kept, coarse)


def refined_walls(points: Floats, beside: Beside, double: float) -> bool:
    """Are most of the cells beside one of the walls small? Else no cell is kept.

    double: the mean of twice the area over the mesh.
    """
    largest, rows = REFINED * float(edge_of(double)), beside.simplices.rows
    if not _some_small(points, beside, largest):
        return False
    return any(_mostly_small(edge_of(doubled(points, rows[cells])), largest) for _, cells in beside.walls())


def _some_small(points: Floats, beside: Beside, largest: float) -> bool:
    return bool((edge_of(doubled(points, beside.simplices.rows)) <= largest).any())


def _mostly_small(size: Floats, largest: float) -> bool:
    return bool((size <= largest).mean() >= MOST)


def _levels(topology: Topology, rows: NDArray[np.int64]) -> Floats:
    """The levels of noise of some rows of ``near``, by how many of them are of quads."""
    quads = 0.0 if topology.near_shapes is None else float((topology.near_shapes[rows] != EQUILATERAL).mean())
    return np.asarray((1.0 - quads) * NOISE[0] + quads * NOISE[1])


def _keep(
    kept: Kept, topology: Topology, points: Floats, rows: NDArray[np.int64], rough: Floats, levels: Floats, wall: Ints
) -> None:
    """Marks the corners of the simplices near one wall.

    rows: of ``topology.near``; rough: (len(rows),) their noise, levels: of it. wall: (k, 2) its edges.
    """
    corners, columns = topology.near[rows], np.empty((4, len(rows)))
    quality.per_cell(points, corners, topology.near_orientation[rows], columns)
    shape, noise = columns[quality.SHAPE], float(np.median(rough))
    blend = np.maximum(_ramp(rough, ROUGH, BROKEN), _ramp(-shape, -SOUND, -POOR))
    blend = np.maximum(blend, _ramp(np.array(noise), levels[CALM], levels[NOISY]))
    nodes = topology.memory[corners]
    kept.nodes[nodes] = True
    np.maximum.at(kept.blend, nodes, blend[:, None])
    wider = WIDEST ** float(_ramp(np.array(noise), levels[NOISY], levels[RANDOM]))
    kept.room[nodes] = np.maximum(kept.room[nodes], wider)
    kept.heights[topology.memory[wall]] = 1.0 - _ramp(np.array(noise), levels[SURE], levels[CALM])


def _leave_out_inverted(kept: Kept, topology: Topology, points: Floats) -> None:
    """Takes the corners of inverted cells from those that are kept; but for cells that cannot move."""
    inside = kept.nodes[topology.memory]
    rows = np.flatnonzero(inside[topology.near].any(axis=1) & topology.near_free[topology.near].any(axis=1))
    corners = topology.near[rows]
    inverted = exact_signs(points, corners, topology.near_orientation[rows]) <= 0
    kept.nodes[topology.memory[corners[inverted]]] = False


def _ramp(value: Floats, low: float, high: float) -> Floats:
    """0 up to low, 1 from high on, linear between."""
    return np.asarray(np.clip((value - low) / (high - low), 0.0, 1.0))


def _roughness(topology: Topology, points: Floats) -> Floats:
    """(T,) of each row of ``near``, how far areas lie from the mean of their neighbours' (in logarithms), around the
    corners of its cell. A steady growth from row to row cancels in it.
    """
    rows, shapes = topology.near, topology.near_shapes
    cells = np.arange(len(rows)) if topology.near_cells is None else topology.near_cells
    double, number = np.bincount(cells, doubled(points, rows)), np.bincount(cells)
    size = np.log(np.maximum(double / np.maximum(number, 1), np.finfo(float).tiny))
    # Of a corner of a quad the corner itself, and the edge to the next one: so each of a cell counts once.
    once = np.ones(rows.size, dtype=bool)
    if shapes is not None:
        once = np.repeat(shapes == EQUILATERAL, 3) | (np.arange(rows.size) % 3 == 0)
    owner = np.repeat(cells, 3)[once]
    edges = np.sort(rows[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)[once], axis=1).astype(np.int64)
    key = edges[:, 0] * len(points) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    one, other = owner[order[same]], owner[order[same + 1]]
    both, across = np.concatenate([one, other]), np.concatenate([other, one])
    count = np.bincount(both, minlength=len(size))
    mean = np.bincount(both, size[across], minlength=len(size)) / np.maximum(count, 1)
    off = np.where(count > 0, np.abs(size - mean), 0.0)
    corners = rows.ravel()[once]
    each = np.maximum(np.bincount(corners, minlength=len(points)), 1)
    around = np.bincount(corners, off[owner], minlength=len(points)) / each
    return np.asarray((np.bincount(owner, around[corners]) / np.maximum(np.bincount(owner), 1))[cells])


def _rows_near(points: Floats, triangles: Ints, wall: Floats, near: float) -> NDArray[np.int64]:
    """The triangles whose middles lie within ``near`` of a wall with the edges (k, 2, 2)."""
    middle = np.column_stack([points[:, axis][triangles].mean(axis=1) for axis in range(2)])
    low, high = wall.min(axis=(0, 1)) - near, wall.max(axis=(0, 1)) + near
    rows = np.flatnonzero(((middle >= low) & (middle <= high)).all(axis=1))
    return rows[_distance(middle[rows], wall, near) <= near]


def _diameter(points: Floats) -> float:
    """The largest distance between two of the points."""
    from scipy.spatial import ConvexHull, QhullError
    from scipy.spatial.distance import pdist

    try:
        points = points[ConvexHull(points).vertices]
    except QhullError:  # all in one line
        along = points[:, int(np.argmax(np.ptp(points, axis=0)))]
        points = points[[int(along.argmin()), int(along.argmax())]]
    return float(pdist(points).max(initial=0.0))


def _distance(points: Floats, ends: Floats, near: float) -> Floats:
    """(n,) distance from a wall with the edges (k, 2, 2); ∞ where it is certainly larger than ``near``."""
    from scipy.spatial import cKDTree

    out = np.full(len(points), np.inf)
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    reach = near + 0.5 * float(np.linalg.norm(along, axis=1).max())
    count = min(CANDIDATES, len(ends))
    far, nearest = cKDTree(ends.mean(axis=1)).query(points, k=count, distance_upper_bound=reach)
    far, nearest = far.reshape(len(points), count), nearest.reshape(len(points), count)
    for k in range(count):
        some = np.flatnonzero(far[:, k] < np.inf)
        edge = nearest[some, k]
        away, step = points[some] - start[edge], along[edge]
        share = np.clip((away * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-300), 0.0, 1.0)
        out[some] = np.minimum(out[some], np.linalg.norm(away - share[:, None] * step, axis=1))
    return out
