"""Which cells are stretched on purpose: boundary layers, wakes, and meshes that are anisotropic as a whole.

A sliver is stretched, too. What tells a layer from slivers is that its cells are stretched in one direction over a
neighbourhood. So the vector v of kernels.stretch, no longer than log 4, so that one sliver cannot outvote its
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
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from gmsnet.kernels import stretch
from gmsnet.mesh import Mesh
from gmsnet.topology import Topology, planar_points

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

MOST = math.log(4.0)  # a larger stretch counts as this one where means are formed
SEED = math.log(2.8)  # the stretch of the mean over two rings from which cells are stretched on purpose
REACH = math.log(2.5)  # the mean stretch of a star to which a layer extends; right triangles with legs 1 and 2 have it
ALIKE = math.log(1.8)  # the same of the mean of v, if in little: the halves of squares have 1.73
FEW = 4  # cells: nodes of fewer weigh less
FEWEST = 6  # nodes above SEED that hang together
RINGS = 4  # how far a layer extends beyond those, in edges
EVEN = 0.2  # of the mean area of a star: the least of its areas where a layer goes around a corner
NEXT = 3.0  # how many times the area of a cell's neighbour in a layer its own may be, or the other way round
BROKEN = 0.05  # of the mean area around: a cell of less is damaged, and its nodes are not held


@dataclass(frozen=True, eq=False)
class Layers:
    """Cells that are stretched on purpose.

    nodes: (N,) bool by node id, the corners of those cells, but for damaged places. cells: (T,) bool by row of
    ``Topology.triangles``. median, largest: stretch of those cells, the ratio of the longer to the shorter axis of
    their Steiner ellipse (1 where there are none). damaged: how many of those cells are inverted, or have less than a
    twentieth of the area of those around; their nodes are left out of ``nodes``, so that they can be mended.
    """

    nodes: Flags
    cells: Flags
    median: float
    largest: float
    damaged: int

    def __bool__(self) -> bool:
        return bool(self.cells.any())

    @property
    def summary(self) -> str:
        """One sentence for a warning; "" where there are no layers."""
        if not self:
            return ""
        count, share = int(self.cells.sum()), self.cells.mean()
        where = "all cells" if share == 1.0 else f"{count:,} cells ({max(100.0 * share, 0.1):.2g} %)"
        damaged = f"; {self.damaged:,} of them are damaged" if self.damaged else ""
        return (
            f"the mesh looks anisotropic on purpose: {where} are stretched alike, "
            f"by {self.median:.3g} in the median and {self.largest:.3g} at most{damaged}"
        )


def stretched_layers(mesh: Mesh, topology: Topology) -> Layers:
    """The layers of a planar mesh, as it is now. topology: of this mesh; which nodes it holds has no influence.

    The result does not depend on the order of nodes and cells, nor on where the mesh lies and how large it is.
    """
    triangles, turn = topology.near, topology.near_turn
    points = planar_points(mesh)[topology.memory]
    count = len(points)
    nothing = Layers(np.zeros(count, dtype=bool), np.zeros(len(triangles), dtype=bool), 1.0, 1.0, 0)
    if not len(triangles) or topology.plane is None:
        return nothing
    cells, number = np.empty((len(triangles), stretch.COLUMNS)), np.empty(count, dtype=np.int32)
    stretch.per_cell(points, triangles, turn, MOST, cells)
    seeds = _coherent(triangles, cells, _rim(topology), number)
    if not seeds.any():
        return nothing
    means = np.empty((count, stretch.COLUMNS))
    stretch.to_nodes(triangles, np.zeros(count, dtype=bool), 1, cells, means, number)
    alike = np.hypot(means[:, stretch.ALONG], means[:, stretch.ACROSS]) >= ALIKE
    least = np.full(count, np.inf)
    np.minimum.at(least, triangles.ravel(), np.repeat(cells[:, stretch.AREA], 3))
    even = least >= EVEN * means[:, stretch.AREA]
    layer = _grown(triangles, seeds, alike | (even & (means[:, stretch.LENGTH] >= REACH)))
    if not layer.any():
        return nothing
    held = np.empty(count, dtype=bool)
    held[topology.memory] = layer
    return _layers(mesh, topology, held)


def _rim(topology: Topology) -> Flags:
    """(N,) by places in memory: nodes of the boundary and of interfaces."""
    ids = [topology.held.get(reason, ()) for reason in ("boundary", "interface between regions")]
    flags = np.zeros(len(topology.memory), dtype=bool)
    flags[np.concatenate(ids).astype(np.int64)] = True
    return flags[topology.memory]


def _coherent(triangles: NDArray[np.int32], cells: Floats, rim: Flags, number: NDArray[np.int32]) -> Flags:
    """(N,) where the mean of v over two rings is SEED or longer; cells with a node of the rim do not count."""
    nodes, around = np.empty((len(rim), 2)), np.empty((len(triangles), 2))
    stretch.to_nodes(triangles, rim, FEW, cells, nodes, number)
    # A corner of a cell that counts has a cell that counts, so no mean is formed with the zeros of nodes without one.
    stretch.to_cells(triangles, nodes, around)
    stretch.to_nodes(triangles, rim, FEW, around, nodes, number)
    return np.asarray((nodes**2).sum(axis=1) >= SEED**2)


def _grown(triangles: NDArray[np.int32], seeds: Flags, candidates: Flags) -> Flags:
    """(N,) pieces of FEWEST seeds or more, and the candidates up to RINGS edges away from them, over candidates."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    nodes = len(seeds)
    inside = edges[seeds[edges].all(axis=1)]
    graph = scipy.sparse.coo_matrix((np.ones(len(inside), dtype=bool), inside.T), shape=(nodes, nodes))
    pieces, piece = scipy.sparse.csgraph.connected_components(graph, directed=False)
    layer = np.asarray(seeds & (np.bincount(piece[seeds], minlength=pieces) >= FEWEST)[piece])
    for _ in range(RINGS if layer.any() else 0):
        touched = layer.copy()
        touched[edges[layer[edges].any(axis=1)]] = True
        layer |= touched & candidates
    return layer


def _layers(mesh: Mesh, topology: Topology, layer: Flags) -> Layers:
    """From the nodes of layers, by id, to their cells and what can be held of them."""
    triangles = topology.triangles
    cells, number = np.empty((len(triangles), stretch.COLUMNS)), np.empty(len(layer), dtype=np.int32)
    points = planar_points(mesh)
    stretch.per_cell(points, triangles, topology.turn, math.inf, cells)
    chosen: Flags = np.asarray(layer[triangles].all(axis=1))
    chosen |= _next_row(triangles, layer, chosen, cells)
    damaged = chosen & (cells[:, stretch.AREA] <= BROKEN * _area_around(triangles, cells, number))
    nodes = np.zeros(len(layer), dtype=bool)
    nodes[triangles[chosen]] = True
    nodes[triangles[damaged]] = False
    lengths = np.exp(cells[chosen, stretch.LENGTH])
    return Layers(nodes, chosen, float(np.median(lengths)), float(lengths.max()), int(damaged.sum()))


def _next_row(triangles: NDArray[np.int32], layer: Flags, inside: Flags, cells: Floats) -> Flags:
    """(T,) stretched cells that have an edge, and about the area, in common with a cell of a layer."""
    rim = np.flatnonzero((layer[triangles].sum(axis=1) == 2) & (cells[:, stretch.LENGTH] >= ALIKE))
    own = triangles[rim][layer[triangles[rim]]].reshape(-1, 2)
    edges = triangles[inside][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    key, known = (e.min(axis=1).astype(np.int64) * len(layer) + e.max(axis=1) for e in (own, edges))
    order = np.argsort(known, kind="stable")
    place = np.minimum(np.searchsorted(known[order], key), max(len(known) - 1, 0))
    next_row = np.zeros(len(triangles), dtype=bool)
    if len(known):
        across = np.repeat(np.abs(cells[inside, stretch.AREA]), 3)[order][place]
        size = np.abs(cells[rim, stretch.AREA])
        next_row[rim] = (known[order][place] == key) & (size <= NEXT * across) & (across <= NEXT * size)
    return next_row


def _area_around(triangles: NDArray[np.int32], cells: Floats, number: NDArray[np.int32]) -> Floats:
    """(T,) the mean of |D| over the stars of each cell's corners."""
    size = np.abs(cells[:, [stretch.AREA]])
    nodes = np.empty((len(number), 1))
    stretch.to_nodes(triangles, np.zeros(len(number), dtype=bool), 1, size, nodes, number)
    around = np.empty_like(size)
    stretch.to_cells(triangles, nodes, around)
    return around[:, 0]
