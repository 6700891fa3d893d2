"""Greedy colours of the nodes of a part of a mesh: as far as they follow from those that are known."""

from __future__ import annotations

from gmsnet.kernels.jit.compile import kernel, part


@part
def first_colour(v, start, ring, identity, free, colours, taken):
    """The first colour that no free neighbour of lower id has; −1 where one has none yet. taken: room for marks."""
    most = len(taken) - 1
    for k in range(start[v], start[v + 1]):
        other = ring[k]
        if free[other] and identity[other] < identity[v]:
            if colours[other] < 0:
                return -1
            taken[min(colours[other], most)] = v
    c = 0
    while taken[c] == v:
        c += 1
    return c


@kernel
def colour_ready(waiting, own, start, ring, identity, free, colours, taken, found):
    """Colours the nodes whose free neighbours of lower ids all have a colour; returns how many it did.

    As ``connectivity.colour`` would: the first colour that no such neighbour has. waiting: nodes of which others may
    have got their last such neighbour since, by ascending ids; what follows from them is found along the rings. own:
    (N,) bool, the nodes to colour. start, ring: CSR by places. identity: (N,) the id of each node, or any numbers in
    their order. free: (N,) bool. colours: (N,) int32, −1 where none is known yet. taken: one more than the longest
    ring, −1 at first; found: as many as there are nodes to colour.
    """
    end = 0
    for v in waiting:
        if colours[v] < 0:
            colours[v] = first_colour(v, start, ring, identity, free, colours, taken)
            if colours[v] >= 0:
                found[end] = v
                end += 1
    k = 0
    while k < end:
        v = found[k]
        k += 1
        for j in range(start[v], start[v + 1]):
            other = ring[j]
            if own[other] and colours[other] < 0 and identity[other] > identity[v]:
                colours[other] = first_colour(other, start, ring, identity, free, colours, taken)
                if colours[other] >= 0:
                    found[end] = other
                    end += 1
    return end


@kernel
def waits_for_others(places, own, start, ring, identity, free, waits):
    """Writes which nodes at some places have a free neighbour of a lower id that is not their own."""
    for i in range(len(places)):
        v, waits[i] = places[i], False
        for k in range(start[v], start[v + 1]):
            other = ring[k]
            waits[i] |= free[other] and not own[other] and identity[other] < identity[v]
