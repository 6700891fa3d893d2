"""Cells of several kinds in space: which share a facet, how to read all of a part alike, and the stars of their nodes.

Cells are listed as (T, 8) nodes, behind the corners the first one again, and a kind (T,), a row of the tables below.
Facet k of cell t has the number 6t + k.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio3 import determinant
from gmsnet.kernels.topology.facets import ALONE, NON_MANIFOLD

FACETS = 6
NONE = -1


class Tables(NamedTuple):
    """By the kind of a cell, NONE where there is nothing.

    facets: (K, 6, 4) corners, counter-clockwise as seen from outside. around: (3, K, 8, 4) the corners that an edge
    joins to each; the others of its corner simplices; those of none. simplices: (K, 8, 4). at_corner:
    (K, 8, 8) 4s + k for each simplex s that has the corner as its vertex k. inexact: (K,) whether positive corner
    simplices do not tell that a cell is valid. facets_at: (K, 8) how many at each corner.
    """

    facets: NDArray[np.int32]
    around: NDArray[np.int32]
    simplices: NDArray[np.int32]
    at_corner: NDArray[np.int32]
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
def list_simplices(nodes, kind, tables, rows, owner):
    """Writes the corner simplices of all cells, cell by cell: rows (S, 4) and owner (S,), the cell."""
    end = 0
    for t in range(len(kind)):
        for simplex in tables.simplices[kind[t]]:
            if simplex[0] == NONE:
                break
            for k in range(4):
                rows[end, k] = nodes[t, simplex[k]]
            owner[end] = t
            end += 1


@kernel
def volumes(points, nodes, kind, tables, volume, size):
    """Writes six times the volume of each cell (T,), and the sum of the magnitudes of what that is made of.

    A facet of four nodes is the bilinear patch between them, what is swept by which is the mean of both its halvings.
    So of two cells that share it one has what the other lacks: the sum over a part of the mesh hangs on its boundary
    alone.
    """
    for t in range(len(kind)):
        total, magnitude = 0.0, 0.0
        for f in tables.facets[kind[t]]:
            if f[0] == NONE:
                break
            one = _swept(points, nodes[t], f[0], f[1], f[2])
            if f[3] != NONE:
                one += _swept(points, nodes[t], f[0], f[2], f[3])
                one += _swept(points, nodes[t], f[0], f[1], f[3]) + _swept(points, nodes[t], f[1], f[2], f[3])
                one *= 0.5
            total, magnitude = total + one, magnitude + abs(one)
        volume[t], size[t] = total, magnitude


@inlined
def _swept(points, cell, i, j, k):
    """The determinant of three corners of a cell, from its first one."""
    d, a, b, c = cell[0], cell[i], cell[j], cell[k]
    x, y, z = points[d, 0], points[d, 1], points[d, 2]
    return determinant(
        points[a, 0] - x, points[a, 1] - y, points[a, 2] - z, points[b, 0] - x, points[b, 1] - y, points[b, 2] - z,
        points[c, 0] - x, points[c, 1] - y, points[c, 2] - z,
    )  # fmt: skip


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
