"""Which rank smooths which nodes, where those that hang together are to be on one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.kernels.topology.components import pieces
from gmsnet.kernels.topology.connectivity import touching

Flags = NDArray[np.bool_]
Ids = NDArray[np.int64]


def homes(part: Part, topology: Any, active: Flags) -> Ids:
    """(n,) by places in memory: of the active nodes that hang together over cells the rank of that of the lowest id.

    −1 of others. active: (n,), of the nodes that this rank moves. All ranks call it.
    """
    ids, owner = part.around.nodes.ids[topology.memory], part.around.nodes.owner[topology.memory]
    chosen = part.halo.spread(active)
    piece = pieces(topology.near[touching(topology.near, chosen)], chosen)[chosen]
    lowest = np.full(len(ids), -1, dtype=np.int64)
    lowest[chosen] = ids[chosen] * part.comm.size + owner[chosen]  # of the node of the lowest id, its rank
    least = np.empty(len(ids), dtype=np.int64)
    while True:
        least[piece] = np.iinfo(np.int64).max
        np.minimum.at(least, piece, lowest[chosen])
        lower = lowest.copy()
        lower[chosen] = least[piece]
        lower = part.halo.spread(lower)
        if not part.comm.allreduce(bool((lower != lowest).any()), mpi().LOR):
            break
        lowest = lower
    return np.where(active, lowest % part.comm.size, -1)
