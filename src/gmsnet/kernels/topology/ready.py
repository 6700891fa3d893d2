"""Greedy colours of the nodes of a part of a mesh: as far as they follow from those that are known."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel


@kernel
def colour_ready(places, start, ring, identity, free, colours):
    """Colours the nodes at some places whose free neighbours of lower ids all have a colour; returns how many it did.

    As ``connectivity.colour`` would: the first colour that no such neighbour has. places: by ascending ids. start,
    ring: CSR by places. identity: (N,) the id of each node, or any numbers in their order. free: (N,) bool. colours:
    (N,) int32, −1 where none is known yet.
    """
    most, done = 0, 0
    for v in places:
        most = max(most, start[v + 1] - start[v])
    taken = np.full(most + 1, -1, dtype=np.int64)
    for v in places:
        if colours[v] >= 0:
            continue
        ready = True
        for k in range(start[v], start[v + 1]):
            other = ring[k]
            if free[other] and identity[other] < identity[v]:
                ready &= colours[other] >= 0
                if colours[other] >= 0:
                    taken[min(colours[other], most)] = v
        if ready:
            c = 0
            while taken[c] == v:
                c += 1
            colours[v] = c
            done += 1
    return done
