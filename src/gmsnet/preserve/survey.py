"""One look at all triangles of a mesh, which on most meshes is all that the search for layers and walls costs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import survey as kernels
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.held import ON_BOUNDARY, ON_INTERFACE
from gmsnet.topology.ordering import near_points
from gmsnet.topology.stars import Ints
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

MOST = math.log(4.0)  # a larger stretch counts as this one where means are formed
SEED = math.log(2.8)  # the stretch of the mean over two rings from which cells are stretched on purpose
FEW = 4  # cells: nodes of fewer weigh less
SLACK = 1e-4  # of SEED: the look errs by less


@dataclass(frozen=True, eq=False)
class Survey:
    """What ``layers`` and ``walls`` want to know of a planar mesh; by places in memory.

    points: (N, 2). rim: (N,) uint8, BOUNDARY and INTERFACE of kernels.simplex.survey where a node is one of those.
    suspects: (N,) bool, all nodes where the mean of v over two rings may be SEED or longer. beside: the rows of
    ``Topology.near`` with two nodes of the boundary or more. double: the mean of twice the area of a triangle.
    """

    points: Floats
    rim: NDArray[np.uint8]
    suspects: Flags
    beside: Ints
    double: float

    @classmethod
    def of(cls, mesh: Mesh, topology: Topology, near: Floats | None = None) -> Survey:
        """Of a mesh with triangles. near: ``near_points(mesh, topology)``, where they are known."""
        near, rim = near_points(mesh, topology) if near is None else near, rim_of(topology)
        ring = np.zeros((len(rim), 4), dtype=np.float32)
        beside, total = kernels.first_ring(near, topology.near, rim, MOST, ring)
        suspects = kernels.suspects(topology.near, rim, MOST, FEW, SEED - SLACK, ring)
        return cls(near, rim, suspects, beside, total / len(topology.near))


def rim_of(topology: Topology | Volume) -> NDArray[np.uint8]:
    """(N,) by places in memory: BOUNDARY and INTERFACE of kernels.simplex.survey where a node is one of those."""
    nodes = np.zeros(len(topology.memory), dtype=np.uint8)
    for reason, bit in ((ON_BOUNDARY, kernels.BOUNDARY), (ON_INTERFACE, kernels.INTERFACE)):
        for found in (topology.held, topology.sliding):
            nodes[found.get(reason, np.empty(0, dtype=np.int64))] = bit
    return np.take(nodes, topology.memory)
