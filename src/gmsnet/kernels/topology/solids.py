"""Cells of several kinds in space: which share a facet, how to read all of a part alike, and the stars of their nodes.

Cells are listed as (T, 8) nodes, behind the corners the first one again, and a kind (T,), a row of the tables below.
Facet k of cell t has the number 6t + k.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.topology.facets import ALONE, NON_MANIFOLD, OPPOSITE

FACETS = 6
NONE = -1


class Tables(NamedTuple):
    """By the kind of a cell, NONE where there is nothing.

    facets: (K, 6, 4) corners, counter-clockwise as seen from outside. around: (3, K, 8, 4) the corners that an edge
    joins to each; the others of its corner simplices; those of none. simplices: (K, 8, 4). inexact: (K,) whether
    positive corner simplices do not tell that a cell is valid. facets_at: (K, 8) how many at each corner.
    """

    facets: NDArray[np.int32]
    around: NDArray[np.int32]
    simplices: NDArray[np.int32]
    inexact: NDArray[np.bool_]
    facets_at: NDArray[np.int32]


@inlined
def sorted_nodes(nodes, kind, tables, t, k):
    """The nodes of a facet in rising order, NONE last of three; all NONE where a cell has no such facet."""
    f = tables.facets[kind[t], k]
    if f[0] == NONE:
        return np.int64(NONE), np.int64(NONE), np.int64(NONE), np.int64(NONE)
    a, b, c = np.int64(nodes[t, f[0]]), np.int64(nodes[t, f[1]]), np.int64(nodes[t, f[2]])
    a, b = min(a, b), max(a, b)
    b, c = min(b, c), max(b, c)
    a, b = min(a, b), max(a, b)
    if f[3] == NONE:
        return a, b, c, np.int64(NONE)
    d = np.int64(nodes[t, f[3]])
    c, d = min(c, d), max(c, d)
    b, c = min(b, c), max(b, c)
    a, b = min(a, b), max(a, b)
    return a, b, c, d


@kernel
def match_solids(nodes, kind, tables, count, twin):
    """Writes twin (6T,): the facet on the other side of each facet, ALONE, or NON_MANIFOLD. count: of all nodes."""
    cells = len(nodes)
    start = np.zeros(count + 2, dtype=np.int64)
    for t in range(cells):
        for k in range(FACETS):
            a, _, _, _ = sorted_nodes(nodes, kind, tables, t, k)
            if a != NONE:
                start[a + 2] += 1
    for v in range(2, len(start)):
        start[v] += start[v - 1]
    total = start[-1]
    low, high = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    facet = np.empty(total, dtype=np.int64)
    for t in range(cells):
        for k in range(FACETS):
            twin[FACETS * t + k] = ALONE
            a, b, c, d = sorted_nodes(nodes, kind, tables, t, k)
            if a != NONE:
                at = start[a + 1]
                start[a + 1] = at + 1
                low[at], high[at], facet[at] = b << 32 | c, d, FACETS * t + k
    for v in range(count):
        first, last = start[v], start[v + 1]
        if last - first > 48:
            order = np.argsort(low[first:last], kind="mergesort")
            own_low, own_high, own_facet = low[first:last][order], high[first:last][order], facet[first:last][order]
            for i in range(last - first):
                low[first + i], high[first + i], facet[first + i] = own_low[i], own_high[i], own_facet[i]
        join_equal(low, high, facet, first, last, twin)


@part
def join_equal(low, high, facet, first, last, twin):
    """Joins the facets first…last of equal keys; many of them are sorted by the first key."""
    many = last - first > 48
    for i in range(first, last):
        if facet[i] < 0:
            continue
        one, found = facet[i], 0
        for j in range(i + 1, last):
            if many and low[j] != low[i]:
                break
            if facet[j] >= 0 and low[j] == low[i] and high[j] == high[i]:
                found += 1
                if found == 1:
                    twin[one], twin[facet[j]] = facet[j], one
                else:
                    if found == 2:
                        twin[twin[one]] = NON_MANIFOLD
                    twin[one] = twin[facet[j]] = NON_MANIFOLD
                facet[j] = NONE


@inlined
def seen_alike(nodes, kind, tables, one, other):
    """Do two cells see their common facet turn the same way? Then one of the two is inside out."""
    t, k, u, j = one // FACETS, one % FACETS, other // FACETS, other % FACETS
    f, g = tables.facets[kind[t], k], tables.facets[kind[u], j]
    corners = 3 if f[3] == NONE else 4
    a, b = nodes[t, f[0]], nodes[t, f[1]]
    for i in range(corners):
        if nodes[u, g[i]] == a:
            return nodes[u, g[(i + 1) % corners]] == b
    return False


@kernel
def wind_solids(nodes, kind, tables, twin, piece, orientation):
    """Floods over the facets that join two cells; returns whether each part (bool) can be read consistently.

    Writes the part of each cell (piece, −1 before) and its orientation (int8, 1 before).
    """
    cells = len(nodes)
    consistent, queue, parts = np.ones(cells, dtype=np.bool_), np.empty(cells, dtype=np.int32), 0
    for seed in range(cells):
        if piece[seed] >= 0:
            continue
        piece[seed] = parts
        queue[0] = seed
        size = 1
        while size:
            size -= 1
            t = np.int64(queue[size])
            for facet in range(FACETS * t, FACETS * t + FACETS):
                other = np.int64(twin[facet])
                if other < 0:
                    continue
                u = other // FACETS
                wanted = -orientation[t] if seen_alike(nodes, kind, tables, facet, other) else orientation[t]
                if piece[u] < 0:
                    piece[u] = parts
                    orientation[u] = wanted
                    queue[size] = u
                    size += 1
                elif orientation[u] != wanted:
                    consistent[parts] = False
        parts += 1
    return consistent[:parts]


@kernel
def mark_solids(nodes, kind, tables, twin, region, halved, boundary, interface, non_manifold, mismatched, marks):
    """Marks the nodes of facets on the boundary, between two regions, of more than two cells, and of ``halved`` ones.

    halved: (6T,) bool, the facets that lie against others of other nodes. region: (T,), or none (0,) where all are the
    same. The four are the bits to be set in marks (N,).
    """
    for t in range(len(nodes)):
        for k in range(FACETS):
            f = tables.facets[kind[t], k]
            if f[0] == NONE:
                continue
            other, mark = np.int64(twin[FACETS * t + k]), 0
            if halved[FACETS * t + k]:
                mark = mismatched
            elif other == ALONE:
                mark = boundary
            elif other == NON_MANIFOLD:
                mark = non_manifold
            elif len(region) and region[t] != region[other // FACETS]:
                mark = interface
            if mark:
                for i in range(4):
                    if f[i] != NONE:
                        marks[nodes[t, f[i]]] |= np.uint16(mark)


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
    place = np.zeros(len(core), dtype=np.int64)
    end = 0
    for v in range(len(core)):
        own[v] = end
        if core[v] == 0:
            continue
        for j in range(core[v]):
            place[ring[ring_start[v] + j]] = j
        for at in range(start[v], start[v + 1]):
            t = cell[at]
            for s in range(8):
                simplex = tables.simplices[kind[t], s]
                if simplex[0] == NONE:
                    break
                for k in range(4):
                    if simplex[k] == corner[at]:
                        put_simplex(nodes, t, simplex, k, roles[kind[t], k], place, own[v], end, local, role, owner)
                        end += 1
    own[len(core)] = end
    return end


@inlined
def put_simplex(nodes, t, simplex, k, number, place, first, end, local, role, owner):
    """Puts a simplex behind those from first to end of its role or a lesser one."""
    i = end
    while i > first and role[i - 1] > number:
        role[i], owner[i] = role[i - 1], owner[i - 1]
        local[i, 0], local[i, 1], local[i, 2] = local[i - 1, 0], local[i - 1, 1], local[i - 1, 2]
        i -= 1
    role[i], owner[i] = number, t
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
def fill_mixed_blocks(order, ring_start, ring, core, edges, own, local, role, owner, roles, lanes, first, blocks):
    """Writes stars in blocks (kernels.star.space), SpaceBlocks whose rows are counted and the rest is empty."""
    mixture = blocks.mixture
    next_row = np.empty(roles, dtype=np.int64)
    for b in range(len(blocks.filled)):
        stars = first[b + 1] - first[b]
        blocks.filled[b] = stars
        rows, around = np.int64(blocks.simplices[b]), np.int64(blocks.degree[b])
        at, offset, begin = blocks.at[b], blocks.offset[b], blocks.at[b] // (3 * lanes)
        for r in range(rows):
            mixture.present[begin + r] = 0
        for lane in range(lanes):  # the roles of the rows
            v = order[first[b] + min(lane, stars - 1)]
            if lane == 0:
                next_row[:] = 0
            i = own[v]
            while i < own[v + 1]:
                j = i
                while j < own[v + 1] and role[j] == role[i]:
                    j += 1
                next_row[role[i]] = max(next_row[role[i]], j - i)
                i = j
        row = 0
        for r in range(roles):
            count = next_row[r]
            next_row[r] = row
            for k in range(count):
                mixture.role[begin + row + k] = r
            row += count
        for k in range(3 * lanes * rows):
            blocks.spoke[at + k] = 0
        for k in range(lanes * rows):
            mixture.owner[at // 3 + k] = 0
        for lane in range(lanes):
            v = order[first[b] + min(lane, stars - 1)]
            blocks.centre[b * lanes + lane] = v
            mixture.edges[b * lanes + lane] = edges[v]
            for j in range(around):
                blocks.ring[offset + j * lanes + lane] = ring[ring_start[v] + (j if j < core[v] else 0)]
            blocks.cells[b * lanes + lane] = own[v + 1] - own[v]
            same, before = 0, -1
            for i in range(own[v], own[v + 1]):
                same = same + 1 if role[i] == before else 0
                before = np.int64(role[i])
                k = next_row[role[i]] + same
                mixture.present[begin + k] |= np.uint16(1 << lane)
                mixture.owner[at // 3 + k * lanes + lane] = owner[i]
                for j in range(3):
                    blocks.spoke[at + (3 * k + j) * lanes + lane] = local[i, j]
