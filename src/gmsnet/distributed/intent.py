"""Whether anything in a mesh in a plane may be there on purpose: what ranks can tell of their own parts.

No is certain: no layer starts, and no wall is refined. Else both have to be looked for in the whole mesh.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.distributed.wall_cells import WallCells
from gmsnet.kernels.simplex import survey as kernels
from gmsnet.kernels.topology.connectivity import touching
from gmsnet.preserve.layers import coherent, fewest_in
from gmsnet.preserve.survey import FEW, MOST, SEED, SLACK, rim_of
from gmsnet.preserve.wall_edges import doubled
from gmsnet.preserve.walls import refined_walls
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Ids = NDArray[np.int64]

SURE = 1.0 + 1e-9  # sums over ranks have other roundings


class Look(NamedTuple):
    """What ranks have seen of their parts, alike on all of them.

    layers, walls: may there be stretched layers, and walls that the mesh is refined towards? beside: the cells at the
    walls of a mesh in a plane.
    """

    layers: bool
    walls: bool = False
    beside: WallCells | None = None

    @classmethod
    def at(cls, part: Part, points: Floats, *, walls: bool = True) -> Look:
        """points: as ``Part.points``. walls: are these looked at?"""
        topology = part.topology
        assert isinstance(topology, Topology)
        rim = part.halo.spread(rim_of(topology))
        ring = np.zeros((len(rim), 4), dtype=np.float32)
        rows, double = kernels.first_ring(points, topology.near, rim, MOST, ring)
        for column in range(3):
            ring[:, column] = part.halo.spread(ring[:, column])
        suspects = kernels.suspects(topology.near, rim, MOST, FEW, SEED - SLACK, ring) & part.moves
        layers = _layers(part, topology, points, rim, suspects)
        if not walls:
            return cls(layers)
        beside = WallCells.of(part, topology, rows, rim)
        others = np.ones(len(topology.near), dtype=bool)
        others[part.own_rows] = False
        double -= float(doubled(points, topology.near[others]).sum())
        return cls(layers, _walls(part, points, beside, double), beside)


def _layers(part: Part, topology: Topology, points: Floats, rim: NDArray[np.uint8], suspects: Flags) -> bool:
    """Do as many nodes hang together as a layer has from which it may extend?"""
    if not part.comm.allreduce(bool(suspects.any()), mpi().LOR):
        return False

    def shared(nodes: Ints, means: Floats) -> Floats:
        whole, found = np.zeros(len(rim)), means.copy()
        for column in range(means.shape[1]):
            whole[nodes] = means[:, column]
            part.halo.renew(whole)
            found[:, column] = whole[nodes]
        return found

    corners, nodes, strong = coherent(points, topology, rim, part.halo.spread(suspects), shared)
    seed = np.zeros(len(rim), dtype=bool)
    seed[nodes[strong]] = True
    seed = part.halo.spread(seed)
    cells = nodes[corners[touching(corners, (seed & part.moves)[nodes])]]
    pairs = cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    quads = bool(part.comm.allreduce(topology.near_shapes is not None, mpi().LOR))
    return _most_together(part, seed & part.moves, pairs[seed[pairs].all(axis=1)]) >= fewest_in(quads=quads)


def _most_together(part: Part, chosen: Flags, pairs: Ints) -> int:
    """The largest number of chosen nodes that hang together over pairs of nodes.

    chosen: (n,) by places in memory, of the nodes that this rank moves. pairs: (p, 2) places, all with a chosen node.
    """
    ids = part.around.nodes.ids[part.topology.memory]
    came, found = part.comm.gather((ids[chosen], np.unique(ids[pairs], axis=0))), None
    if came is not None:
        every, over = zip(*came, strict=True)
        found = _largest(np.concatenate(every), np.concatenate(over))
    return int(part.comm.bcast(found))


def _largest(chosen: Ids, pairs: Ids) -> int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components  # loads what few runs need

    if not len(chosen):
        return 0
    names, number = np.unique(np.concatenate([chosen, pairs.ravel()]), return_inverse=True)
    one, two = number[len(chosen) :].reshape(-1, 2).T
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, two)), shape=(len(names), len(names)))
    piece: NDArray[Any] = connected_components(graph, directed=False)[1]
    return int(np.bincount(piece[number[: len(chosen)]]).max())


def _walls(part: Part, points: Floats, beside: WallCells, double: float) -> bool:
    """Are most of the cells at one of the walls small? double: twice the area of the part's own simplices."""
    comm = part.comm
    mean = SURE * comm.allreduce(double) / max(comm.allreduce(len(part.own_rows)), 1)
    near = beside.at(points)
    found = False if near is None or beside.beside is None else refined_walls(near, beside.beside, mean)
    return bool(comm.bcast(found))
