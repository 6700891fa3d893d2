"""The stars of cells of several kinds in space: the cells at each node, the nodes around it, its simplices in blocks.

Cells are listed as in ``kernels.topology.solids``.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.topology.facets import OPPOSITE
from gmsnet.kernels.topology.solids import NONE


@kernel
def list_solids(nodes, corners, marks, start, cell, corner):
    """The cells at each node without a mark, in CSR form: cell (M,) and which of its corners the node is.

    corners: (T,) how many. start: (N + 2,) zeros before; those of node v are then start[v] … start[v + 1] − 1. cell and
    corner have room for all corners. Returns how many there are.
    """
    for t in range(len(nodes)):
        for k in range(corners[t]):
            if not marks[nodes[t, k]]:
                start[nodes[t, k] + 2] += 1
    for v in range(2, len(start)):
        start[v] += start[v - 1]
    for t in range(len(nodes)):
        for k in range(corners[t]):
            v = nodes[t, k]
            if not marks[v]:
                at = start[v + 1]
                start[v + 1] = at + 1
                cell[at], corner[at] = t, k
    return start[-1]


@kernel
def rings_of_solids(nodes, kind, tables, start, cell, corner, ring_start, ring, edges, core, most):
    """The nodes around each node: first those that an edge joins, then the others of its simplices, then of its cells.

    start, cell, corner: as ``list_solids`` leaves them. Writes ring_start (N + 1,), ring, with room for seven a corner,
    edges and core (N,): how many are joined by edges, and how many are in simplices. A node with more than ``most`` in
    simplices has none. Returns how many nodes all rings have.
    """
    seen = np.full(len(edges), -1, dtype=np.int64)
    end = 0
    for v in range(len(edges)):
        ring_start[v] = end
        count, first, second = 0, 0, 0
        seen[v] = v
        for turn in range(3):
            for at in range(start[v], start[v + 1]):
                t = cell[at]
                for j in range(4):
                    place = tables.around[turn, kind[t], corner[at], j]
                    if place != NONE:
                        other = nodes[t, place]
                        if seen[other] != v:
                            seen[other] = v
                            ring[end + count] = other
                            count += 1
            first, second = count if turn == 0 else first, count if turn < 2 else second
        if second > most:
            count, first, second = 0, 0, 0
        edges[v], core[v] = first, second
        end += count
    ring_start[len(edges)] = end
    return end


@kernel
def stars_of_solids(nodes, kind, tables, roles, start, cell, corner, ring_start, ring, core, own, local, role, owner):
    """The corner simplices at each node, by their roles: own (N + 1,) where those of each begin, local (M, 3) uint8,
    the places in its ring where their spokes end, role (M,) and owner (M,), the cell.

    roles: (K, 4) by the kind and by which vertex of the simplex the node is. local, role, owner have room for eight a
    corner. Returns how many there are.
    """
    place, after = np.zeros(len(core), dtype=np.int64), np.empty(roles.max() + 2, dtype=np.int64)
    end = 0
    for v in range(len(core)):
        own[v] = end
        if core[v] == 0:
            continue
        for j in range(core[v]):
            place[ring[ring_start[v] + j]] = j
        after[:] = 0
        for at in range(start[v], start[v + 1]):
            t = kind[cell[at]]
            for vertex in tables.at_corner[t, corner[at]]:
                if vertex == NONE:
                    break
                after[roles[t, vertex & 3] + 1] += 1
        after[0] = end
        for number in range(1, len(after)):
            after[number] += after[number - 1]
        end = after[-1]
        for at in range(start[v], start[v + 1]):
            t = cell[at]
            for vertex in tables.at_corner[kind[t], corner[at]]:
                if vertex == NONE:
                    break
                put_simplex(nodes, t, kind[t], tables, vertex, roles, place, after, local, role, owner)
    own[len(core)] = end
    return end


@inlined
def put_simplex(nodes, t, kind, tables, vertex, roles, place, after, local, role, owner):
    """Puts a simplex of cell t behind those of its role. after: where the next one of each goes."""
    simplex, k = tables.simplices[kind, vertex >> 2], vertex & 3
    number = roles[kind, k]
    i = after[number]
    role[i], owner[i], after[number] = number, t, i + 1
    for j in range(3):
        local[i, j] = place[nodes[t, simplex[OPPOSITE[k, j]]]]


@kernel
def count_rows(order, first, own, role, roles, core, rows, ring_rows):
    """How many rows the simplices of each block of stars take, and the nodes around.

    order: the free nodes; first: (B + 1,) where the stars of each block begin there. rows, ring_rows: (B,).
    """
    most = np.empty(roles, dtype=np.int64)
    for b in range(len(rows)):
        most[:] = 0
        around = 0
        for at in range(first[b], first[b + 1]):
            v = order[at]
            around = max(around, core[v])
            i = own[v]
            while i < own[v + 1]:
                j = i
                while j < own[v + 1] and role[j] == role[i]:
                    j += 1
                most[role[i]] = max(most[role[i]], j - i)
                i = j
        rows[b], ring_rows[b] = most.sum(), around


@kernel
def fill_mixed_blocks(
    order, ring_start, ring, core, edges, own, local, role, owner, roles, lanes, first, low_block, high_block, blocks
):
    """Writes the stars of the blocks low_block…high_block of SpaceBlocks whose rows are counted and the rest is empty.

    See kernels.star.space_blocks.
    """
    mixture = blocks.mixture
    begin, count = np.empty((roles, lanes), dtype=np.uint64), np.empty((roles, lanes), dtype=np.int64)
    low, inner = np.empty(lanes, dtype=np.uint64), np.empty(lanes, dtype=np.int64)
    for b in range(low_block, high_block):
        stars = first[b + 1] - first[b]
        blocks.filled[b] = stars
        count[:] = 0
        for lane in range(lanes):
            v = order[first[b] + min(lane, stars - 1)]
            blocks.centre[b * lanes + lane] = v
            mixture.edges[b * lanes + lane] = edges[v]
            blocks.cells[b * lanes + lane] = own[v + 1] - own[v]
            low[lane], inner[lane] = ring_start[v], core[v]
            before = -1
            for i in range(own[v], own[v + 1]):  # those of one role stand together
                r = np.int64(role[i])
                if r != before:
                    begin[r, lane] = i
                before = r
                count[r, lane] += 1
        to = np.uint64(blocks.offset[b])
        for j in range(blocks.degree[b]):
            for lane in range(lanes):
                blocks.ring[to + np.uint64(lane)] = ring[low[lane] + np.uint64(j if j < inner[lane] else 0)]
            to += np.uint64(lanes)
        to = np.uint64(blocks.at[b])
        row = to // np.uint64(3 * lanes)
        for r in range(roles):
            for k in range(count[r].max()):
                bits = 0
                for lane in range(lanes):
                    has = k < count[r, lane]
                    i = begin[r, lane] + np.uint64(k) if has else np.uint64(0)
                    bits |= 1 << lane if has else 0
                    mixture.owner[row * np.uint64(lanes) + np.uint64(lane)] = owner[i] if has else 0
                    for j in range(3):
                        blocks.spoke[to + np.uint64(j * lanes + lane)] = local[i, j] if has else 0
                mixture.role[row], mixture.present[row] = r, bits
                row += np.uint64(1)
                to += np.uint64(3 * lanes)
