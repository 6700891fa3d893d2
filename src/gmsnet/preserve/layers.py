"""Which cells are stretched on purpose: boundary layers, wakes, and meshes that are anisotropic as a whole.

A sliver is stretched, too. What tells a layer from slivers is that its cells are stretched in one direction over a
neighbourhood. So the vector v of kernels.simplex.stretch, no longer than log 4, so that one sliver cannot outvote its
neighbours, is averaged over the two rings around each node: on random Delaunay meshes the mean is 1.25 (as a stretch
exp |v|), and hardly ever above 2.6; in layers it is the stretch itself, or 4. From where it is SEED or more, a layer
extends over the neighbours whose stars have a mean stretch of REACH or more, whatever its direction, or ALIKE or more
in one direction: so it goes around corners, where directions change, and up to where its cells are no longer stretched.

Cells at the boundary, or at an interface, do not count for a seed: where the nodes there are closer together, or
further apart, than those inside, one row of cells is stretched alike without anybody's intent. A layer has at least two
rows of cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import stretch
from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology.components import pieces, surroundings
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.display import plain
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.preserve.rows import followed
from gmsnet.preserve.survey import FEW, MOST, SEED, Survey
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Shared = Callable[[NDArray[np.int32], Floats], Floats]

REACH = math.log(2.5)  # the mean stretch of a star to which a layer extends; right triangles with legs 1 and 2 have it
ALIKE = math.log(1.8)  # the same of the mean of v, if in little: the halves of squares have 1.73
FEWEST = 6  # nodes above SEED that hang together
FEWEST_OF_QUADS = 16  # the same where there are quads: random ones have up to 9, for their corners are right triangles
RINGS = 4  # how far a layer extends beyond those, in edges
EVEN = 0.2  # of the mean area of a star: the minimum of its areas where a layer goes around a corner
NEXT = 3.0  # how many times the area of a cell's neighbour in a layer its own may be, or the other way round
BYTES_PER_NODE = 600  # that the layers of a mesh that has some take to be told, measured where all cells are in one
BROKEN = 0.05  # of the mean area around: a cell of less is damaged, and its nodes are not held,
THIN = math.log(4.0)  # if it is so stretched
CALM = (
    1.35  # times the mean area around, or the other way round: where half of the cells are so, the node is not at fault
)


@dataclass(frozen=True, eq=False)
class Layers:
    """Cells that are stretched on purpose.

    nodes: (N,) bool by node id, the corners of those cells, but for damaged places; of layers of walls those in gaps,
    too. cells: (T,) bool, which triangles and quads. median, largest: stretch of those cells, the ratio of the longer
    to the shorter axis of their Steiner ellipse (1 where there are none). damaged: how many of those cells are
    inverted, or thin and of less than a twentieth of the area of those around (in fans around corners cells are small,
    and as thick as long); their nodes are left out of ``nodes``, so that they can be untangled, but for those of which
    half the cells are as large as those around: they are not what damaged them. counts: how many cells are stretched,
    and how many there are, where these are those of a part of the mesh.
    """

    nodes: Flags
    cells: Flags
    median: float
    largest: float
    damaged: int
    counts: tuple[int, int] | None = None

    def __bool__(self) -> bool:
        return bool(self.cells.any() if self.counts is None else self.counts[0])

    @property
    def summary(self) -> str:
        """One sentence for a warning; "" where there are no layers."""
        if not self:
            return ""
        count, every = (int(self.cells.sum()), len(self.cells)) if self.counts is None else self.counts
        share = count / every
        where = "all cells" if share == 1.0 else f"{count:,} cells ({plain(max(100.0 * share, 0.1), 2)} %)"
        damaged = f"; {self.damaged:,} of them are damaged" if self.damaged else ""
        return (
            f"the mesh looks anisotropic on purpose: {where} are stretched alike, "
            f"by {plain(self.median)} in the median and {plain(self.largest)} at most{damaged}"
        )

    @property
    def away_from_walls(self) -> str:
        """One sentence of cells that are no layers of a wall."""
        count = int(self.cells.sum())
        are = "1 cell is" if count == 1 else f"{count:,} cells are"
        return f"{are} stretched alike, but not in layers of a wall, and smoothed as others"


def stretched_layers(mesh: Mesh, topology: Topology, survey: Survey | None = None) -> Layers:
    """The layers of a planar mesh, as it is now. topology: of this mesh; which nodes it holds has no influence.

    The result does not depend on the order of nodes and cells, nor on where the mesh lies and how large it is. survey:
    of this mesh, where it is known.
    """
    triangles, orientation = topology.near, topology.near_orientation
    count = len(topology.memory)
    nothing = Layers(np.zeros(count, dtype=bool), np.zeros(len(triangles), dtype=bool), 1.0, 1.0, 0)
    if not len(triangles) or topology.plane is None:
        return nothing
    survey = survey or Survey.of(mesh, topology)
    layer = _seeds(survey, topology)
    if not layer.any():
        return nothing
    refuse_unless_free(BYTES_PER_NODE * count, f"telling the layers among {count:,} nodes")
    cells, number = np.empty((len(triangles), stretch.COLUMNS)), np.empty(count, dtype=np.int32)
    stretch.per_cell(survey.points, triangles, orientation, MOST, cells)
    means = np.empty((count, stretch.COLUMNS))
    stretch.to_nodes(triangles, np.zeros(count, dtype=bool), 1, cells, means, number)
    alike = np.hypot(means[:, stretch.ALONG], means[:, stretch.ACROSS]) >= ALIKE
    least = np.full(count, np.inf)
    np.minimum.at(least, triangles.ravel(), np.repeat(cells[:, stretch.AREA], 3))
    even = least >= EVEN * means[:, stretch.AREA]
    candidates = alike | (even & (means[:, stretch.LENGTH] >= REACH))
    for _ in range(RINGS):
        touched = np.zeros(count, dtype=bool)
        touched[triangles[connectivity.touching(triangles, layer)]] = True
        layer |= touched & candidates
    held = np.empty(count, dtype=bool)
    held[topology.memory] = layer
    return _layers(mesh, topology, held) or nothing


def _seeds(survey: Survey, topology: Topology) -> Flags:
    """(N,) by places in memory: nodes that hang together, as many as a layer has, of which the mean over two rings is
    SEED or more.
    """
    seeds = np.zeros(len(survey.rim), dtype=bool)
    if not survey.suspects.any():
        return seeds
    corners, nodes, strong = coherent(survey.points, topology, survey.rim, survey.suspects)
    piece = pieces(corners, strong)
    fewest = fewest_in(quads=topology.near_shapes is not None)
    seeds[nodes[strong & (np.bincount(piece[strong], minlength=len(nodes)) >= fewest)[piece]]] = True
    return seeds


def fewest_in(*, quads: bool) -> int:
    """Nodes that hang together, of which the mean over two rings is SEED or more: fewer are no layer."""
    return FEWEST_OF_QUADS if quads else FEWEST


def coherent(
    points: Floats, topology: Topology, rim: NDArray[np.uint8], suspects: Flags, shared: Shared | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32], Flags]:
    """The suspects where the mean of v over two rings is SEED or longer; cells with a node of the rim do not count.

    points, rim, suspects: as of a survey. shared: takes the means over the first ring at these nodes, and gives those
    of the whole mesh where only a part of it is here. Returns the corners (T, 3) of the cells within two rings of the
    suspects in a numbering of their own, the places (n,) of these nodes, and (n,) which of them are such suspects.
    """
    rows, corners, nodes = surroundings(topology.near, suspects)
    cells = np.empty((len(rows), stretch.COLUMNS))
    stretch.per_cell(points[nodes], corners, topology.near_orientation[rows], MOST, cells)
    apart, number = rim[nodes] > 0, np.empty(len(nodes), dtype=np.int32)
    means, around = np.empty((len(nodes), 2)), np.empty((len(corners), 2))
    stretch.to_nodes(corners, apart, FEW, cells, means, number)
    if shared is not None:
        means = shared(nodes, means)
    # A corner of a cell that counts has a cell that counts, so no mean is formed with the zeros of nodes without one.
    stretch.to_cells(corners, means, around)
    stretch.to_nodes(corners, apart, FEW, around, means, number)
    return corners, nodes, ((means**2).sum(axis=1) >= SEED**2) & suspects[nodes]


def _layers(mesh: Mesh, topology: Topology, layer: Flags) -> Layers | None:
    """From the nodes of layers, by id, to their cells and what can be held of them; None where they make no cell.

    A quad is stretched where one of its corner simplices is; all its nodes are then held.
    """
    triangles, orientation, of_cell = topology.triangles, topology.orientation, topology.near_cells
    if of_cell is not None:
        triangles, orientation = topology.memory[topology.near], topology.near_orientation
    cells, number = np.empty((len(triangles), stretch.COLUMNS)), np.empty(len(layer), dtype=np.int32)
    points = planar_points(mesh)
    stretch.per_cell(points, triangles, orientation, math.inf, cells)
    corners = np.take(layer.astype(np.int8), triangles)
    count = corners[:, 0] + corners[:, 1] + corners[:, 2]  # of a cell's corners that are in a layer
    chosen: Flags = np.asarray(count == 3)
    chosen[_next_row(triangles, layer, count, cells)] = True
    if of_cell is not None:
        whole = np.zeros(int(of_cell.max(initial=-1)) + 1, dtype=bool)
        whole[of_cell[chosen]] = True
        if len(topology.quads):
            whole = _followed(topology, points, whole)
        chosen = whole[of_cell]
    if not chosen.any():
        return None
    area, around = cells[:, stretch.AREA], _area_around(triangles, cells, number)
    damaged = chosen & (area <= BROKEN * around) & ((area <= 0.0) | (cells[:, stretch.LENGTH] >= THIN))
    nodes = np.zeros(len(layer), dtype=bool)
    nodes[triangles[chosen]] = True
    if damaged.any():
        calm = chosen & (area <= CALM * around) & (around <= CALM * area)
        every, still = (np.bincount(triangles[some].ravel(), minlength=len(layer)) for some in (chosen, calm))
        nodes[triangles[damaged]] &= 2 * still[triangles[damaged]] >= every[triangles[damaged]]
    lengths = np.exp(cells[chosen, stretch.LENGTH])
    first = np.ones(len(chosen), dtype=bool) if of_cell is None else np.append(True, np.diff(of_cell) != 0)
    broken = damaged.sum() if of_cell is None else len(sorted_unique(of_cell[damaged]))
    return Layers(nodes, chosen[first], float(np.median(lengths)), float(lengths.max()), int(broken))


def _followed(topology: Topology, points: Floats, whole: Flags) -> Flags:
    """The faces (F,) of layers, in the order of ``near_cells``, with the quads that continue their rows."""
    of_file = np.zeros(len(topology.face_cell), dtype=bool)
    of_file[topology.near_origin[: len(whole)]] = whole
    number = np.searchsorted(topology.face_cell, topology.quad_cell)
    of_file[number] = followed(topology.quads, points, of_file[number])
    return of_file[topology.near_origin[: len(whole)]]


def _next_row(triangles: NDArray[np.int32], layer: Flags, count: NDArray[np.int8], cells: Floats) -> NDArray[np.int64]:
    """Rows of stretched cells that have an edge, and about the area, in common with a cell of a layer.

    count: (T,) how many corners of each cell are in a layer.
    """
    rim = np.flatnonzero((count == 2) & (cells[:, stretch.LENGTH] >= ALIKE))
    own = triangles[rim][layer[triangles[rim]]].reshape(-1, 2)
    beside = np.zeros(len(layer), dtype=bool)
    beside[own] = True
    inside = connectivity.touching(triangles, beside)
    inside = inside[count[inside] == 3]
    if not len(inside):
        return rim[:0]
    edges = triangles[inside][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    key, known = (e.min(axis=1).astype(np.int64) * len(layer) + e.max(axis=1) for e in (own, edges))
    order = np.argsort(known, kind="stable")
    place = np.minimum(np.searchsorted(known[order], key), len(known) - 1)
    across = np.repeat(np.abs(cells[inside, stretch.AREA]), 3)[order][place]
    size = np.abs(cells[rim, stretch.AREA])
    alike = (known[order][place] == key) & (size <= NEXT * across) & (across <= NEXT * size)
    return np.asarray(rim[alike])


def _area_around(triangles: NDArray[np.int32], cells: Floats, number: NDArray[np.int32]) -> Floats:
    """(T,) the mean of |D| over the stars of each cell's corners."""
    size = np.abs(cells[:, [stretch.AREA]])
    nodes = np.empty((len(number), 1))
    stretch.to_nodes(triangles, np.zeros(len(number), dtype=bool), 1, size, nodes, number)
    around = np.empty_like(size)
    stretch.to_cells(triangles, nodes, around)
    return around[:, 0]
