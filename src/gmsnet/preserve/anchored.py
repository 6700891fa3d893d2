"""Which stretched cells are layers of a wall: rows that start at a boundary or interface, lie along it, and grow.

Cells are stretched alike for other reasons, too: a mesh was sheared, swirled or stretched as a whole, or squeezed
between bodies that moved. Such cells are stretched away from the boundary, or as much inside as there, or across it.
A layer is thinnest where it starts. So of each piece of stretched cells that hang together, those count that have an
edge on a wall and are stretched along it, of all walls or, where a layer reaches from one to another, of one. They must
be many, thin, and

- much thinner than most of the piece, which has grown from row to row by much, or by less where most of the piece or
  of its edges on walls, and some of the piece, lie so, or
- thinner, and most of the piece lies along the wall that is nearest, with nodes over nodes as rows have them, or
- as even along the wall as rows of one height are made, where most of the piece lies along the wall, and the piece is
  not the mesh; or thinner by much, where only what lies along the wall is the layer.

Unless the piece has grown by much, most of those at the wall have one height, or one ratio of length and height. Of a
mesh that was sheared or squeezed they are thin by more here and by less there.

Where heights change little along a wall, nobody has disturbed them. Then there must be rows over it (courses.py), and
rows of which all have been made alike are layers whatever else is in their piece.

Growth is told by the stretch of cells and by their height: where rows of one height go around a bend, only their length
differs.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import stretch
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL
from gmsnet.kernels.topology.components import pieces
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.courses import FLAT, Courses, Walls, spread
from gmsnet.preserve.gaps import in_gaps
from gmsnet.preserve.layers import Layers
from gmsnet.preserve.survey import Survey
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

ALONG = math.cos(math.radians(40.0))  # twice the angle between the stretch and the wall may have this cosine
FEWEST = 6  # edges on walls
THIN = math.log(2.5)  # the length of such an edge over the height of its cell, in the median
GROWN = math.log(1.25)  # how many times as stretched those cells are as those of the piece, in the medians
CLEARLY_THIN, CLEARLY_GROWN, GROWN_BY_MUCH = math.log(4.0), math.log(1.7), math.log(6.0)
HIGHER = math.log(1.3)  # how many times as high as those cells the piece's are, in the medians
OF_PIECE, OF_EDGES = 0.66, 0.7  # of the cells, of the edges on walls: a share that lies along them where it is thin
SOME = 0.4  # of the cells, where it is the share of the edges that tells: around a flattened hole 0.2 to 0.3 lie so
MOSTLY = 0.72  # of the cells of a layer are stretched along the wall nearest to them
OVER = 0.35  # of an edge there, from its middle to where the third corner lies along it: in rows, over an end of it
PART, EVEN = 0.6, math.log(1.05)  # of a piece without growth: share of the mesh, change from cell to cell
# Between most cells along a wall, of heights, or of ratios of length and height: rows that were made keep one of them.
STEADY, ALL_EVEN = math.log(1.25), math.log(1.1)
ORDERED = 0.5  # of the edges of a wall along which heights change by EVEN or less: a share that has rows over it
UNEVEN = math.log(1.6)  # more from cell to cell is no row, but the slivers of a hull


def split(mesh: Mesh, topology: Topology, survey: Survey, layers: Layers) -> tuple[Layers, Layers]:
    """Of the stretched cells of a mesh, those that are layers of a wall, gaps closed, and the others."""
    triangles, orientation, of_cell = topology.triangles, topology.orientation, topology.near_cells
    chosen = layers.cells
    if of_cell is not None:
        triangles, orientation = topology.memory[topology.near], topology.near_orientation
        chosen = chosen[np.cumsum(np.append(0, np.diff(of_cell) != 0))]
    rim = np.zeros(len(topology.memory), dtype=bool)
    rim[topology.memory] = survey.rim > 0
    part = triangles[chosen]
    equal, points = np.ones(len(chosen), dtype=bool), planar_points(mesh)
    if of_cell is not None and topology.near_shapes is not None:
        equal = topology.near_shapes == EQUILATERAL
    courses = Courses.of(_edges(triangles, equal), points, _walls(topology, survey, points, rim))
    kept, wall = _at_walls(part, orientation[chosen], points, rim, len(chosen), equal[chosen], courses.ordered)
    whole = np.zeros(len(chosen), dtype=bool)
    whole[np.flatnonzero(chosen)[kept]] = True
    first = np.ones(len(chosen), dtype=bool) if of_cell is None else np.append(True, np.diff(of_cell) != 0)
    at_walls = whole[first]
    nodes = np.zeros(len(layers.nodes), dtype=bool)
    nodes[part[kept]] = True
    gaps = in_gaps(triangles, orientation, equal, points, rim, nodes, points[wall].mean(axis=1)) if len(wall) else False
    rows, as_high = courses.whole(nodes)
    if rows.any():
        damaged = np.zeros(len(nodes), dtype=bool)
        damaged[part] = True
        rows &= layers.nodes | ~damaged | as_high
        at_walls |= _all_of(np.asarray(rows[triangles].all(axis=1)), first)
        nodes |= rows
    return (
        replace(layers, nodes=layers.nodes & nodes | gaps | rows, cells=at_walls),
        replace(layers, nodes=layers.nodes & ~nodes, cells=layers.cells & ~at_walls, damaged=0),
    )


def _all_of(simplices: Flags, first: Flags) -> Flags:
    """The cells (C,) all of whose simplices (S,) are chosen. first: (S,) the first simplex of each cell."""
    return np.asarray(np.logical_and.reduceat(simplices, np.flatnonzero(first)))


def _edges(triangles: NDArray[np.int32], equal: Flags) -> NDArray[np.int32]:
    """(E, 2) of all cells; those between corners of quads that are no edge are left out."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [0, 2]], triangles[equal][:, [1, 2]]])


def _walls(topology: Topology, survey: Survey, points: Floats, rim: Flags) -> Walls:
    """All edges of cells on walls."""
    on_rim = np.take((survey.rim > 0).astype(np.int8), topology.near)
    beside = np.flatnonzero(on_rim[:, 0] + on_rim[:, 1] + on_rim[:, 2] >= 2)
    corners, shapes = topology.memory[topology.near[beside]], topology.near_shapes
    equal = np.ones(len(corners), dtype=bool) if shapes is None else shapes[beside] == EQUILATERAL
    cells = np.empty((len(corners), stretch.COLUMNS))
    stretch.per_cell(points, corners, topology.near_orientation[beside], math.inf, cells)
    _, length, height, aligned, one, two, _ = _on_walls(corners, points, rim, cells, equal)
    return Walls(np.column_stack([one, two]), height, aligned & (np.log(length) - height >= FLAT))


def _at_walls(
    triangles: NDArray[np.int32], orientation: NDArray[np.int8], points: Floats, rim: Flags, of_all: int, equal: Flags,
    ordered: Flags,
) -> tuple[Flags, NDArray[np.int32]]:  # fmt: skip
    """Which simplices (S, 3), all of them stretched alike with their neighbours, belong to layers of a wall; its edges.

    points: (N, 2). rim: (N,) which nodes are on boundaries or interfaces. of_all: how many the mesh has. equal: (S,)
    which are triangles, the others are corners of quads, 0 the corner itself. ordered: (N,) nodes of walls with rows
    over them.
    """
    cells = np.empty((len(triangles), stretch.COLUMNS))
    stretch.per_cell(points, triangles, orientation, math.inf, cells)
    inside = np.zeros(len(points), dtype=bool)
    inside[triangles] = True
    piece = pieces(triangles, inside)[triangles[:, 0]]
    row, length, height, aligned, one, two, off = _on_walls(triangles, points, rim, cells, equal)
    across = 0.5 * (np.log(np.maximum(np.abs(cells[:, stretch.AREA]), stretch.TINY)) - cells[:, stretch.LENGTH])
    kept, wall = np.zeros(len(triangles), dtype=bool), np.zeros(len(row), dtype=bool)
    loop = pieces(np.column_stack([one, two]), rim)[one]

    def starts_at(some: Flags, own: NDArray[np.intp]) -> NDArray[np.intp]:
        """Which cells of a piece are a layer of the wall with some of the edges: all, none, or those along the wall."""
        along = some & aligned
        if np.count_nonzero(along) < FEWEST:
            return own[:0]
        thin = float(np.median((np.log(length) - height)[along]))
        change = _change(height[along], one[along], two[along])
        if thin < THIN or change > UNEVEN:
            return own[:0]
        varies = min(spread(height[along]), spread((np.log(length) - height)[along]))
        regular = change <= EVEN and varies <= ALL_EVEN
        even = regular and len(own) <= PART * of_all
        grown = float(np.median(cells[row[along], stretch.LENGTH]) - np.median(cells[own, stretch.LENGTH]))
        if (varies > STEADY and grown < GROWN_BY_MUCH) or not (grown >= GROWN or even):
            return own[:0]
        higher = np.median(across[own]) - np.median(across[row[along]]) >= HIGHER
        if not (even or higher):
            return own[:0]
        if change <= EVEN and ordered[one[along]].mean() < ORDERED:
            return own[:0]
        lies = _along_nearest(triangles[own], points, cells[own], one[along], two[along])  # takes most of the time
        lie = float(lies.mean())
        most = lie >= OF_PIECE or (lie >= SOME and np.count_nonzero(along) >= OF_EDGES * np.count_nonzero(some))
        if thin >= CLEARLY_THIN and higher and grown >= (CLEARLY_GROWN if most else GROWN_BY_MUCH):
            return own
        if lie >= MOSTLY and (even or np.median(off[along]) >= OVER):
            return own
        return own[lies] if regular and thin >= CLEARLY_THIN and higher and grown >= CLEARLY_GROWN else own[:0]

    for name in np.unique(piece[row]):
        own, here = np.flatnonzero(piece == name), piece[row] == name
        loops = np.unique(loop[here])
        walls = [here, *(here & (loop == each) for each in loops)] if len(loops) > 1 else [here]
        for some in walls:
            layer = starts_at(some, own)
            if len(layer):
                kept[layer], wall = True, wall | (some & aligned)
                break
    return kept, np.column_stack([one, two])[wall]


def _on_walls(
    triangles: NDArray[np.int32], points: Floats, rim: Flags, cells: Floats, equal: Flags
) -> tuple[NDArray[np.intp], Floats, Floats, Flags, NDArray[np.int32], NDArray[np.int32], Floats]:
    """Of the edges of some simplices with both ends on the rim: the row, the length, the logarithm of the height over
    it, whether the cell is stretched along, the ends; and how far from the middle the third corner lies along the edge,
    in lengths: 0.5 over an end.

    equal: (S,) which are triangles; of the corner of a quad, only its own edges count.
    """
    every, found = np.ones(len(triangles), dtype=bool), []
    for a, b, some in ((0, 1, every), (0, 2, every), (1, 2, equal)):
        row = np.flatnonzero(rim[triangles[:, a]] & rim[triangles[:, b]] & some)
        found.append((row, triangles[row, a], triangles[row, b], triangles[row, 3 - a - b]))
    row, one, two, third = (np.concatenate(each) for each in zip(*found, strict=True))
    way = points[two] - points[one]
    length = np.hypot(way[:, 0], way[:, 1])
    aligned, length = _aligned(cells[row], way), np.maximum(length, stretch.TINY)
    height = np.log(np.maximum(np.abs(cells[row, stretch.AREA]), stretch.TINY) / length)
    share = ((points[third] - points[one]) * way).sum(axis=1) / length**2
    return row, length, height, aligned, one, two, np.abs(share - 0.5)


def _change(height: Floats, one: NDArray[np.int32], two: NDArray[np.int32]) -> float:
    """The mean change of log height between neighbours along a wall, which share an end; +∞ where none do."""
    node, value = np.concatenate([one, two]), np.concatenate([height, height])
    order = np.argsort(node, kind="stable")
    node, value = node[order], value[order]
    start = np.flatnonzero(np.append(True, node[1:] != node[:-1]))
    several = np.diff(np.append(start, len(node))) > 1
    change = np.maximum.reduceat(value, start) - np.minimum.reduceat(value, start)
    return float(np.mean(change[several])) if several.any() else math.inf


def _along_nearest(
    triangles: NDArray[np.int32], points: Floats, cells: Floats, one: NDArray[np.int32], two: NDArray[np.int32]
) -> Flags:
    """Which of some cells are stretched along the nearest edge of the wall, from ``one`` to ``two``."""
    from scipy.spatial import cKDTree  # it takes a tenth of a second to import

    _, nearest = cKDTree((points[one] + points[two]) / 2.0).query(points[triangles].mean(axis=1))
    return _aligned(cells, points[two[nearest]] - points[one[nearest]])


def _aligned(cells: Floats, way: Floats) -> Flags:
    """Which cells are stretched along a way (n, 2)."""
    square = np.maximum((way * way).sum(axis=1), stretch.TINY)
    cosine, sine = (way[:, 0] ** 2 - way[:, 1] ** 2) / square, 2.0 * way[:, 0] * way[:, 1] / square
    share = cells[:, stretch.ALONG] * cosine + cells[:, stretch.ACROSS] * sine
    return np.asarray(share >= ALONG * np.maximum(cells[:, stretch.LENGTH], stretch.TINY))
