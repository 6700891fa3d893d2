"""How flat the cells around nodes are, and in which direction: in the mean, or one by one.

The mean of the moments around a node is flat where its cells are flat alike. Where a wall bends much, as that of a
coarse round body, whose facets meet at up to 70°, the mean is that of thick cells. There each cell is flat by itself,
in a direction not far from one in common. Slivers are flat in all directions, and layers around an edge of 90° in two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import columns as kernels
from gmsnet.kernels.topology import connectivity
from gmsnet.topology.polygons import Ints
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

# How many times longer than thick cells are around a node at a wall: in the mean, and one by one.
FLAT, FLAT_EACH = 2.5, 8.0
# How many times longer than thick flat cells are in the shorter of the two directions: else they are long one way
# alone, as where a section was swept. The thirds of prisms lie askew, which evens that out.
BROAD, BROAD_THIRDS = 1.5, 1.2
ALONG_WALL = 0.1  # of the squared length of the edges on a wall: what may lie across it
DETERMINANT = 1.0 / 45.0  # of a moment of trace 1: less is flat by 2 or more
COHERENT = 0.6  # the mean square of the cosine between the directions of cells and that in common; 0.5 around an edge
STEEP = 0.4  # the same of one edge on a wall: of more, it goes up a side of the layer


def feet(points: Floats, rows: Ints, wall: Flags, broad: float) -> tuple[Ints, Floats, Floats]:
    """The nodes of walls where all cells are flat along the wall: places, unit normals (K, 3), flatness (K,)."""
    moments, along = np.zeros((2, len(wall), kernels.MOMENTS))
    count, thin = np.zeros((2, len(wall)), dtype=np.int32)
    kernels.around_nodes(points, rows, wall, DETERMINANT, moments, along, count, thin)
    some = np.flatnonzero(wall & (count > 0))
    mean = moments[some] / count[some, None]
    few = _determinant(mean) < DETERMINANT
    some, mean = some[few].astype(np.int32), mean[few]
    flatness, normal = _flat(mean, broad)
    across = np.einsum("ki,kij,kj->k", normal, _tensors(along[some]), normal)
    good = (flatness >= FLAT) & (across <= ALONG_WALL * along[some, :3].sum(axis=1))
    bent = wall & (count > 0) & (thin == count)
    bent[some[good]] = False
    more, ways, flat = _bent_feet(points, rows, wall, np.flatnonzero(bent).astype(np.int32), broad)
    places = np.concatenate([some[good], more])
    order = np.argsort(places)
    return places[order], np.concatenate([normal[good], ways])[order], np.concatenate([flatness[good], flat])[order]


def _bent_feet(points: Floats, rows: Ints, wall: Flags, nodes: Ints, broad: float) -> tuple[Ints, Floats, Floats]:
    """The same of nodes with cells that are flat one by one."""
    number = np.full(len(wall), -1, dtype=np.int32)
    number[nodes] = np.arange(len(nodes), dtype=np.int32)
    around = rows[connectivity.touching(rows, number >= 0)]
    i, j = around[:, kernels.EDGES[:, 0]], around[:, kernels.EDGES[:, 1]]  # (R, 6)
    edges = points[j, :3] - points[i, :3]
    moments = np.einsum("rea,reb->rab", edges, edges)[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    at, own = number[around], np.repeat(np.arange(len(around)), 4).reshape(-1, 4)
    flatness, way = _one_by_one(moments[own[at >= 0]], at[at >= 0], len(nodes), broad)
    steep = np.zeros(len(nodes))
    on_wall, square = wall[i] & wall[j], np.maximum((edges * edges).sum(axis=2), 1e-300)
    for end in (number[i], number[j]):
        chosen = on_wall & (end >= 0)
        cosine = (edges[chosen] * way[end[chosen]]).sum(axis=1)
        np.maximum.at(steep, end[chosen], cosine * cosine / square[chosen])
    good = (flatness >= FLAT_EACH) & (steep <= STEEP)
    return nodes[good], way[good], flatness[good]


def in_stars(topology: Volume, points: Floats, nodes: Ints, broad: float, enough: float) -> tuple[Floats, Floats]:
    """How flat the cells of free nodes are (K,), and in which direction (K, 3); one by one where they are less than
    enough in the mean."""
    stars = topology.start, topology.local, topology.ring_start, topology.ring
    first = np.concatenate([[0], np.cumsum(topology.start[nodes + 1] - topology.start[nodes])])
    each = np.empty((int(first[-1]), kernels.MOMENTS))
    kernels.of_stars(points, nodes, *stars, each)
    mean = np.add.reduceat(each, first[:-1]) / np.diff(first)[:, None] if len(nodes) else each
    flatness, way = _flat(mean, broad)
    bent = np.flatnonzero(flatness < enough)
    at = np.full(len(nodes), -1)
    at[bent] = np.arange(len(bent))
    at = np.repeat(at, np.diff(first))
    flatness[bent], way[bent] = _one_by_one(each[at >= 0], at[at >= 0], len(bent), broad)
    return flatness, way


def _one_by_one(moments: Floats, at: NDArray[np.integer], count: int, broad: float) -> tuple[Floats, Floats]:
    """How flat cells are one by one, in the geometric mean at each of K = count nodes, and in which direction (K, 3).

    moments: (M, 6) of cells; at: (M,) at which node. 1.0 where these directions differ much.
    """
    each, way = _flat(moments, broad)
    number = np.bincount(at, minlength=count)
    mean: Floats = np.exp(np.bincount(at, np.log(each), count) / np.maximum(number, 1))
    products = way[:, [0, 1, 2, 0, 0, 1]] * way[:, [0, 1, 2, 1, 2, 2]]
    together = np.empty((count, kernels.MOMENTS))
    for column, product in enumerate(products.T):
        together[:, column] = np.bincount(at, product, count)
    values, vectors = np.linalg.eigh(_tensors(together))
    mean[values[:, 2] < COHERENT * number] = 1.0
    return mean, vectors[:, :, 2]


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
