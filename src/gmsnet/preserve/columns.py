"""Layers of tetrahedra at walls: flat cells in columns of nodes that start at a boundary or an interface.

The halves and thirds of prisms that were grown from a wall have their nodes in columns. A column starts at a node of a
wall around which all cells are flat, as one, and along the wall. It goes on, from row to row, to the next node along
its own direction, as long as the cells there are flat alike. Slivers are flat in directions of their own, which cancel
out around a node, and a mesh that was squeezed has no rows. So columns count that have ROWS rows or more, FEWEST or
more beside one another, whose cells are thinner at the wall than at their ends, or whose first rows have one height,
and higher ones follow. What lies around edges of the wall, between columns, belongs to them (see column_gaps.py).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import columns as kernels
from gmsnet.kernels.topology import connectivity
from gmsnet.preserve.column_gaps import neighbours, with_gaps
from gmsnet.preserve.layers import Layers
from gmsnet.topology.held import ON_BOUNDARY, ON_INTERFACE
from gmsnet.topology.polygons import Ints
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

WALLS = (ON_BOUNDARY, ON_INTERFACE)  # why the nodes of walls are held
FLAT, STILL_FLAT = 2.5, 1.7  # how many times longer than thick cells are, in the mean around a node: at a wall, inside
# How many times longer than thick flat cells are in the shorter of the two directions: else they are long one way
# alone, as where a section was swept. The thirds of prisms lie askew, which evens that out.
BROAD, BROAD_THIRDS = 1.5, 1.2
ALONG_WALL = 0.1  # of the squared length of the edges on a wall: what may lie across it
TURN = math.cos(math.radians(30.0))  # of a column from row to row
HIGHER = 2.5  # times as high as the row before it: no row of the same layer
LAST = 1.6  # the same for the last row
AT_ONCE = 1.1  # times as high as the lowest next row are rows that grow together
ROWS = 2  # nodes of a column above its wall
FEWEST, SHARE = 12, 0.66  # columns beside one another; of the feet there
GROWN = 1.25  # times as flat at the wall as at the end of the column, or as high there, in the median
EVEN = 0.03  # of its height: by how much that of a row differs from column to column, in the median
# In columns of rows of one height: up to these shares of the free nodes, the last row must be so many times as high as
# the first. Rows that do not grow and are most of a mesh are a grid.
SHARES, GROWN_BY = (0.35, 0.75), (0.0, 1.1, GROWN)
DETERMINANT = 1.0 / 45.0  # of a moment of trace 1: less is flat by 2 or more


def layers_of_volume(topology: Volume, points: Floats) -> Layers:
    """The layers of a mesh of volumes as it is now; their cells in memory order. points: (N, 4) in memory order."""
    nodes, rows = len(points), topology.near
    none = Layers(np.zeros(nodes, dtype=bool), np.zeros(len(rows), dtype=bool), 1.0, 1.0, 0)
    wall = _wall_nodes(topology)
    broad = BROAD_THIRDS if topology.simplices.shapes is None else BROAD
    foot, normal, flatness = _feet(points, rows, wall, broad)
    if len(foot) < FEWEST:
        return none
    width = _widths(points, rows, wall, foot)
    columns, heights, last, top, above = _grown(topology, points, foot, normal, width, broad)
    long: Flags = np.asarray((columns[:, ROWS : ROWS + 1] >= 0).any(axis=1))
    if long.sum() < FEWEST:
        return none
    whole, heights = _ended(columns, heights, top, above)
    chosen = long & _accepted(rows, columns, heights, flatness, last, long, wall, len(topology.free))
    if not chosen.any():
        return none
    solids = topology.simplices.solids
    nodes_of = rows if solids is None else solids.nodes
    inside = np.zeros(nodes, dtype=bool)
    members = columns[chosen]
    inside[members[members >= 0]] = True
    if not inside[nodes_of].all(axis=1).any():  # columns without a cell between them are none
        return none
    inside = with_gaps(topology, points, whole[chosen], heights[chosen], wall)
    cells: Flags = np.asarray(inside[nodes_of].all(axis=1))
    held = np.zeros(nodes, dtype=bool)
    held[topology.memory] = inside & topology.near_free
    found = flatness[chosen]
    return Layers(held, cells, float(np.median(found)), float(found.max()), 0)


def feet(points: Floats, topology: Volume, wall: Flags) -> Ints:
    """At which of these nodes of walls (N,) layers may start, by places; of fewer than FEWEST there are none."""
    broad = BROAD_THIRDS if topology.simplices.shapes is None else BROAD
    return _feet(points, topology.near, wall, broad)[0]


def _wall_nodes(topology: Volume) -> Flags:
    """(N,) by places in memory: nodes of boundaries and interfaces, whether they slide or not."""
    wall = np.zeros(len(topology.memory), dtype=bool)
    for reasons in (topology.held, topology.sliding):
        for reason in WALLS:
            wall[topology.places[reasons.get(reason, np.empty(0, dtype=np.int64))]] = True
    return wall


def _feet(points: Floats, rows: Ints, wall: Flags, broad: float) -> tuple[Ints, Floats, Floats]:
    """The nodes of walls where all cells are flat along the wall: places, unit normals (K, 3), flatness (K,)."""
    moments, along = np.zeros((2, len(wall), kernels.MOMENTS))
    count = np.zeros(len(wall), dtype=np.int32)
    kernels.around_nodes(points, rows, wall, moments, along, count)
    some = np.flatnonzero(wall & (count > 0))
    mean = moments[some] / count[some, None]
    few = _determinant(mean) < DETERMINANT
    some, mean = some[few].astype(np.int32), mean[few]
    flatness, normal = _flat(mean, broad)
    across = np.einsum("ki,kij,kj->k", normal, _tensors(along[some]), normal)
    good = (flatness >= FLAT) & (across <= ALONG_WALL * along[some, :3].sum(axis=1))
    return some[good], normal[good], flatness[good]


def _widths(points: Floats, rows: Ints, wall: Flags, foot: Ints) -> Floats:
    """(C,) the mean lengths of the edges of these nodes that lie on their wall."""
    chosen = np.zeros(len(wall), dtype=bool)
    chosen[foot] = True
    one, two = neighbours(rows, chosen)
    on_wall = chosen[one] & wall[two]
    one, length = one[on_wall], np.linalg.norm(points[one[on_wall]] - points[two[on_wall]], axis=1)
    total, number = (np.bincount(one, weight, len(wall)) for weight in (length, None))
    found: Floats = total[foot] / np.maximum(number[foot], 1)
    return found


def _grown(
    topology: Volume, points: Floats, foot: Ints, normal: Floats, width: Floats, broad: float
) -> tuple[Ints, Floats, Floats, Ints, Floats]:
    """The columns: (C, R) places from the foot on, −1 behind their ends; heights (C, R − 1); flatness of the last.

    And (C,) the node at the top of the last row, −1 where there is none, with the height of that row: cells above are
    not flat any more, and so not all of those around that node. width: (C,) of cells at the feet. The lowest rows come
    first: so a layer that reaches from a wall to another one grows from where it is thin.
    """
    nodes, inner = len(points), topology.near_free & (np.diff(topology.start) > 0)
    at, normal, last = foot.copy(), normal.copy(), np.full(len(foot), np.nan)
    top, above = np.full(len(foot), -1, dtype=np.int32), np.zeros(len(foot))
    taken = np.zeros(nodes, dtype=bool)
    taken[foot] = True
    rows, row = list[tuple[Ints, Ints, Ints, Floats]](), np.zeros(len(foot), dtype=np.int64)
    before, stale = np.full(len(foot), np.inf), np.ones(len(foot), dtype=bool)
    to, height = np.full(len(foot), -1, dtype=np.int32), np.zeros(len(foot))
    while stale.any() or (to >= 0).any():
        if stale.any():
            front = np.full(nodes, -1, dtype=np.int32)
            front[at[stale]] = np.flatnonzero(stale)
            near = topology.near[connectivity.touching(topology.near, front >= 0)]
            found, length = np.full(len(foot), -1, dtype=np.int32), np.full(len(foot), TURN)
            kernels.next_in_columns(points, near, front, normal, inner, taken, found, length)
            found[length > HIGHER * before] = -1
            to[stale], height[stale] = found[stale], length[stale]
        lowest = np.min(height, where=to >= 0, initial=np.inf)
        step = np.flatnonzero((to >= 0) & (height <= AT_ONCE * lowest))
        step = step[np.argsort(height[step], kind="stable")]
        _, first = np.unique(to[step], return_index=True)  # two columns may not go on to one node
        ahead, there = np.sort(step[first]), to.copy()
        mean = np.empty((len(ahead), kernels.MOMENTS))
        kernels.of_stars(points, to[ahead], topology.start, topology.local, topology.ring_start, topology.ring, mean)
        flatness, direction = _flat(mean, broad)
        alike = (flatness >= STILL_FLAT) & (abs((direction * normal[ahead]).sum(axis=1)) >= TURN)
        going, ending = ahead[alike], ahead[~alike]
        low = (height <= LAST * before) & (height * STILL_FLAT <= width)
        top[ending] = np.where(low[ending], to[ending], -1)
        above[ahead] = before[ahead] = height[ahead]
        to[step] = -1
        last[going], normal[going] = flatness[alike], direction[alike]
        at[going], taken[there[going]] = there[going], True
        row[going] += 1
        rows.append((going, row[going], there[going], height[going]))
        stale = (to >= 0) & taken[to]
        stale[going] = True
    columns = np.full((len(foot), 1 + int(row.max(initial=0))), -1, dtype=np.int32)
    heights = np.full((len(foot), columns.shape[1] - 1), np.nan)
    columns[:, 0] = foot
    for of, number, node, high in rows:
        columns[of, number], heights[of, number - 1] = node, high
    return columns, heights, last, top, above


def _ended(columns: Ints, heights: Floats, top: Ints, above: Floats) -> tuple[Ints, Floats]:
    """Columns and heights with the tops of their last rows, which no column goes through."""
    free = (top >= 0) & ~np.isin(top, columns)
    columns = np.column_stack([columns, np.full(len(columns), -1, dtype=np.int32)])
    heights = np.column_stack([heights, np.full(len(columns), np.nan)])
    end = (columns >= 0).sum(axis=1)
    columns[free, end[free]], heights[free, end[free] - 1] = top[free], above[free]
    return columns, heights


def _accepted(
    rows: Ints, columns: Ints, heights: Floats, flatness: Floats, last: Floats, long: Flags, wall: Flags, free: int
) -> Flags:
    """(C,) which columns stand beside enough others and have grown, or are of rows of one height that are not the mesh.

    free: how many nodes may move.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components  # loads what few runs need

    number = np.full(len(wall), -1, dtype=np.int64)
    number[columns[long, 0]] = np.flatnonzero(long)
    others = np.flatnonzero(wall & (number < 0))  # they link columns as well, those of a face with those around an edge
    number[others] = len(columns) + np.arange(len(others))
    pairs = number[linked(rows, (number >= 0) & (number < len(columns)), wall)]
    count = len(columns) + len(others)
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    piece = connected_components(graph, directed=False)[1]
    feet = np.bincount(piece[number[columns[:, 0]]], minlength=count)  # of each piece
    piece = piece[: len(columns)]
    pairs = pairs[(pairs < len(columns)).all(axis=1)]
    accepted = np.zeros(len(columns), dtype=bool)
    first = heights[:, 0]
    higher = np.nan_to_num(heights).max(axis=1) / np.where(first > 0.0, first, np.inf)
    differ = abs(first[pairs[:, 0]] - first[pairs[:, 1]]) / np.maximum(first[pairs[:, 0]], first[pairs[:, 1]])
    least = GROWN_BY[int(np.searchsorted(SHARES, np.count_nonzero(columns[long, 1:] >= 0) / max(free, 1)))]
    for name in np.unique(piece[long]).tolist():
        own = long & (piece == name)
        if own.sum() < max(FEWEST, SHARE * feet[name]):
            continue
        grown = np.median(flatness[own]) >= GROWN * np.median(last[own])
        even = np.median(differ[piece[pairs[:, 0]] == name], axis=None) <= EVEN
        accepted[own] = grown or (even and np.median(higher[own]) >= least)
    return accepted


def linked(rows: Ints, foot: Flags, wall: Flags) -> Ints:
    """The edges (E, 2) of cells between nodes of walls (N,), one of them or both a foot; once for each simplex."""
    corners = rows[connectivity.touching(rows, foot)]
    pairs = np.concatenate([corners[:, [a, b]] for a, b in kernels.EDGES])
    return np.asarray(pairs[wall[pairs].all(axis=1) & foot[pairs].any(axis=1)])


def _tensors(moments: Floats) -> Floats:
    """(K, 3, 3)."""
    tensors: Floats = moments[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    return tensors


def _determinant(moments: Floats) -> Floats:
    xx, yy, zz, xy, xz, yz = moments.T
    found: Floats = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return found


def _flat(moments: Floats, broad: float) -> tuple[Floats, Floats]:
    """How many times longer than thick cells of these moments are (K,), and the direction in which they are thin.

    1.0 of cells that are long one way alone. broad: BROAD, or BROAD_THIRDS of tetrahedra.
    """
    values, vectors = np.linalg.eigh(_tensors(moments))
    values = np.maximum(values, 1e-30)
    flatness: Floats = np.sqrt(np.sqrt(values[:, 1] * values[:, 2]) / values[:, 0])
    flatness[values[:, 1] < broad**2 * values[:, 0]] = 1.0
    return flatness, vectors[:, :, 0]
