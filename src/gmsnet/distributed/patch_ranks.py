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


def patch_ranks(part: Part, topology: Any, active: Flags) -> Ids:
    """(n,) by places in memory: one rank for all active nodes that hang together over cells, which moves one of them.

    −1 of others. active: (n,), of the nodes that this rank moves. All ranks call it.
    """
    counts = np.array(part.comm.allgather(int(np.count_nonzero(active))))
    end = np.cumsum(counts)  # of the numbers of each rank's active nodes
    lowest = np.full(len(active), -1, dtype=np.int64)
    lowest[active] = end[part.comm.rank] - counts[part.comm.rank] + np.arange(counts[part.comm.rank])
    lowest = part.halo.spread(lowest)
    chosen = lowest >= 0
    piece = pieces(topology.near[touching(topology.near, chosen)], chosen)[chosen]
    least = np.empty(len(active), dtype=np.int64)
    while True:
        least[piece] = np.iinfo(np.int64).max
        np.minimum.at(least, piece, lowest[chosen])
        lower = lowest.copy()
        lower[chosen] = least[piece]
        lower = part.halo.spread(lower)
        if not part.comm.allreduce(bool((lower != lowest).any()), mpi().LOR):
            break
        lowest = lower
    return np.where(active, np.searchsorted(end, lowest, side="right"), -1)
