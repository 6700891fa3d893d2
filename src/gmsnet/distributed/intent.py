"""Whether anything in a mesh may be there on purpose: what a rank can tell of its own part.

No is certain. Where it may be, layers and refined walls have to be looked for in the whole mesh.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.kernels.simplex import survey as kernels
from gmsnet.preserve.columns import FEWEST, feet
from gmsnet.preserve.survey import FEW, MOST, SEED, SLACK, rim_of
from gmsnet.preserve.walls import refined
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]

SURE = 1.0 + 1e-9  # sums over ranks have other roundings


def may_be_meant(part: Part, points: Floats) -> bool:
    """May there be stretched layers, or cells near a wall that the mesh is refined towards? The same on all ranks.

    points: as ``Part.points``.
    """
    topology = part.topology
    if isinstance(topology, Volume):
        rim = part.halo.spread(rim_of(topology))
        found = feet(points, topology, rim > 0)
        return int(part.comm.allreduce(int(np.count_nonzero(part.moves[found])))) >= FEWEST
    rim = part.halo.spread(rim_of(topology))
    ring = np.zeros((len(rim), 4), dtype=np.float32)
    beside, _ = kernels.first_ring(points, topology.near, rim, MOST, ring)
    for column in range(3):
        ring[:, column] = part.halo.spread(ring[:, column])
    suspects = kernels.suspects(topology.near, rim, MOST, FEW, SEED - SLACK, ring) & part.moves
    total = part.comm.allreduce(_doubled_area(part, topology, points))
    cells = part.comm.allreduce(len(part.own_rows))
    walls = refined(points, topology.near.take(beside, axis=0), SURE * total / max(cells, 1))
    return bool(part.comm.allreduce(bool(suspects.any()) or walls, mpi().LOR))


def _doubled_area(part: Part, topology: Topology, points: Floats) -> float:
    """Twice the area of all simplices of the rank's own cells."""
    a, b, c = (points[topology.near[part.own_rows, k]] for k in range(3))
    (px, py), (qx, qy) = (b - a).T, (c - a).T
    return math.fsum(np.abs(px * qy - py * qx))
