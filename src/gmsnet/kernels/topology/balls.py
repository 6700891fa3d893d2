"""The closed balls of tetrahedra around nodes: their cells, the nodes around, and blocks of such stars."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.jit.vectors import WIDTH as LANES3
from gmsnet.kernels.topology.facets import OPPOSITE


@kernel
def count_stars(rows, marks, start):
    """Counts the cells at each node without a mark: start (N + 2,), zeros before, becomes CSR with one place ahead."""
    for t in range(len(rows)):
        for k in range(4):
            v = rows[t, k]
            if not marks[v]:
                start[v + 2] += 1
    for v in range(2, len(start)):
        start[v] += start[v - 1]


@kernel
def list_stars(rows, marks, start, corners):
    """Writes corners (M,), 4t + k of each cell t at a node without a mark that is its corner k.

    start: as ``count_stars`` leaves it; afterwards those of node v are start[v] … start[v + 1] − 1.
    """
    for t in range(len(rows)):
        for k in range(4):
            v = np.uint64(rows[t, k])
            if not marks[v]:
                at = start[v + np.uint64(1)]
                start[v + np.uint64(1)] = at + 1
                corners[np.uint64(at)] = 4 * t + k


@kernel
def rings(rows, orientation, start, corners, ring_start, ring, local, most):
    """The nodes around each node, in the order in which its cells name them, and the spokes by their places there.

    Writes ring_start (N + 1,), ring, with room for 3M/2 + N, and local (M, 3) uint8, in which nodes of the ring the
    spokes of each cell end, of positive volume from the node. A star with more than ``most`` nodes has an empty ring.
    Returns how many nodes all rings have.
    """
    nodes = len(start) - 2
    seen = np.full(nodes, -1, dtype=np.int64)  # 256·node | place in its ring
    end = 0
    for v in range(nodes):
        ring_start[v] = end
        count = 0
        for row in range(start[v], start[v + 1]):
            corner = corners[np.uint64(row)]
            t, k = np.uint64(corner >> 2), corner & 3
            second = 1 if orientation[t] > 0 else 2
            for i in range(3):
                spoke = second if i == 1 else 3 - second if i == 2 else 0
                other = np.uint64(rows[t, OPPOSITE[k, spoke]])
                known = seen[other]
                if known >> 8 != v or known < 0:
                    if count < most:
                        seen[other] = np.int64(v) << 8 | count
                        ring[end + count] = other
                        local[np.uint64(row), i] = count
                    count += 1
                else:
                    local[np.uint64(row), i] = known & 255
        end += count if count <= most else 0
    ring_start[nodes] = end
    return end


@kernel
def fill_blocks3(order, ring_start, ring, start, local, first, rings, spokes, blocks):
    """Writes stars in blocks of LANES3. order: the free nodes by colour, of one colour by how many cells they have.

    first: (B + 1,) where the stars of each block begin in ``order``. rings, spokes: (B + 1,) where each block begins in
    ring and spoke. blocks: a SpaceBlocks (kernels.star.space), whose other arrays are written.
    """
    centre, to_ring, degree, to_spoke = blocks.centre, blocks.ring, blocks.degree, blocks.spoke
    simplices, number, filled = blocks.simplices, blocks.cells, blocks.filled
    for b in range(len(filled)):
        stars = first[b + 1] - first[b]
        filled[b] = stars
        rows, cells = (rings[b + 1] - rings[b]) // LANES3, (spokes[b + 1] - spokes[b]) // (3 * LANES3)
        degree[b], simplices[b] = rows, cells
        for lane in range(LANES3):
            v = order[first[b] + min(lane, stars - 1)]
            at = np.uint64(b * LANES3 + lane)
            centre[at] = v
            low, around = np.uint64(ring_start[v]), ring_start[v + 1] - ring_start[v]
            to = np.uint64(rings[b] + lane)
            for j in range(around):
                to_ring[to] = ring[low + np.uint64(j)]
                to += np.uint64(LANES3)
            for _ in range(around, rows):
                to_ring[to] = ring[low]
                to += np.uint64(LANES3)
            own, begin = start[v + 1] - start[v], np.uint64(start[v])
            number[at] = own
            to = np.uint64(spokes[b] + lane)
            for k in range(own):
                row = begin + np.uint64(k)
                to_spoke[to] = local[row, 0]
                to_spoke[to + np.uint64(LANES3)] = local[row, 1]
                to_spoke[to + np.uint64(2 * LANES3)] = local[row, 2]
                to += np.uint64(3 * LANES3)
            for _ in range(own, cells):
                to_spoke[to] = to_spoke[to + np.uint64(LANES3)] = to_spoke[to + np.uint64(2 * LANES3)] = 0
                to += np.uint64(3 * LANES3)
