"""The closed balls of tetrahedra around nodes: their cells, the nodes around, and blocks of such stars."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.jit.vectors import WIDTH as LANES3
from gmsnet.kernels.topology.facets import OPPOSITE


@kernel
def count_stars(rows, first, last, marks, count):
    """Adds to count (N,) how many of the cells first…last are at each node without a mark."""
    for t in range(first, last):
        for k in range(4):
            v = np.uint64(rows[t, k])
            if not marks[v]:
                count[v] += 1


@kernel
def list_stars(rows, first, last, marks, place, corners):
    """Writes corners (M,), 4t + k of each of the cells first…last at a node without a mark that is its corner k.

    place: (N,) where those of each node are to begin; afterwards, where they end.
    """
    for t in range(first, last):
        for k in range(4):
            v = np.uint64(rows[t, k])
            if not marks[v]:
                at = place[v]
                place[v] = at + 1
                corners[np.uint64(at)] = 4 * t + k


@kernel
def rings(rows, orientation, start, corners, first, last, ring_start, ring, local, most):
    """The nodes around the nodes first…last, in the order in which cells name them, and the spokes by places there.

    Writes ring_start (N,), from 0 on, ring, with room for 3/2 of their corners and one a node more, and local (M, 3)
    uint8, in which nodes of the ring the spokes of each cell end, of positive volume from the node. A star with more
    than ``most`` nodes has an empty ring. Returns how many nodes these rings have.
    """
    seen = np.full(len(start) - 1, -1, dtype=np.int32)  # since ``base``: base + the place in the ring
    end, base, limit = 0, 0, (1 << 31) - 1 - most
    for v in range(first, last):
        ring_start[v] = end
        if base >= limit:
            seen[:] = -1
            base = 0
        count = 0
        for row in range(start[v], start[v + 1]):
            corner = corners[np.uint64(row)]
            t, k = np.uint64(corner >> 2), corner & 3
            second = 1 if orientation[t] > 0 else 2
            for i in range(3):
                spoke = second if i == 1 else 3 - second if i == 2 else 0
                other = np.uint64(rows[t, OPPOSITE[k, spoke]])
                known = seen[other] - base
                new = known < 0  # no branch on it: nothing tells which it will be
                room = min(count, most)
                place = room if new else known
                ring[np.uint64(end + room)] = other
                seen[other] = base + place
                local[np.uint64(row), i] = place
                count += 1 if new else 0
        base += min(count, most) + 1
        end += count if count <= most else 0
    return end


@kernel
def fill_blocks3(order, ring_start, ring, start, local, first, rings, spokes, low_block, high_block, blocks):
    """Writes the stars of the blocks low_block…high_block of LANES3.

    order: the free nodes by colour, of one colour by how many cells they have. first: (B + 1,) where the stars of each
    block begin in ``order``. rings, spokes: (B + 1,) where each block begins in ring and spoke. blocks: a SpaceBlocks
    (kernels.star.space), whose other arrays are written.
    """
    centre, to_ring, degree, to_spoke = blocks.centre, blocks.ring, blocks.degree, blocks.spoke
    simplices, number, filled = blocks.simplices, blocks.cells, blocks.filled
    low, around = np.empty(LANES3, dtype=np.uint64), np.empty(LANES3, dtype=np.int64)
    begin, own = np.empty(LANES3, dtype=np.uint64), np.empty(LANES3, dtype=np.int64)
    for b in range(low_block, high_block):
        stars = first[b + 1] - first[b]
        filled[b] = stars
        rows, cells = (rings[b + 1] - rings[b]) // LANES3, (spokes[b + 1] - spokes[b]) // (3 * LANES3)
        degree[b], simplices[b] = rows, cells
        for lane in range(LANES3):
            v = order[first[b] + min(lane, stars - 1)]
            at = np.uint64(b * LANES3 + lane)
            centre[at] = v
            low[lane], around[lane] = ring_start[v], ring_start[v + 1] - ring_start[v]
            begin[lane], own[lane] = start[v], start[v + 1] - start[v]
            number[at] = own[lane]
        to = np.uint64(rings[b])
        for j in range(rows):
            for lane in range(LANES3):
                to_ring[to + np.uint64(lane)] = ring[low[lane] + np.uint64(j if j < around[lane] else 0)]
            to += np.uint64(LANES3)
        to = np.uint64(spokes[b])
        for k in range(cells):
            for i in range(3):
                for lane in range(LANES3):
                    has = k < own[lane]
                    spoke = local[begin[lane] + np.uint64(k if has else 0), np.uint64(i)]
                    to_spoke[to + np.uint64(lane)] = spoke if has else np.uint8(0)
                to += np.uint64(LANES3)
