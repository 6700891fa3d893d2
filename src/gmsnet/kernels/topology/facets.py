"""Which tetrahedra share which facets, how to read all of a part alike, and the closed ball of cells at a node.

Facet k of cell t has the number 4t + k and is opposite to the cell's node k. Its nodes in the order of OPPOSITE are
seen counter-clockwise from outside in a cell of positive volume, and are spokes of positive volume from node k.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part

ALONE = -1  # the facet has no partner: it is on the boundary
NON_MANIFOLD = -2  # three or more cells meet at the facet
OPPOSITE = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]], dtype=np.int32)
FEW = 24  # facets of a node: more are sorted


@kernel
def place_cells(cells, first, last, position, place, used, count):
    """Writes place (T, 4), the corners of the cells first…last of (T, 4) by their places in memory, by node ids before.

    position: (N,). used: (N,) bool, becomes True of the places that they have. Adds to count (N,) how many cells have
    each place as their lowest.
    """
    for t in range(first, last):
        a, b = position[np.uint64(cells[t, 0])], position[np.uint64(cells[t, 1])]
        c, d = position[np.uint64(cells[t, 2])], position[np.uint64(cells[t, 3])]
        place[t, 0], place[t, 1], place[t, 2], place[t, 3] = a, b, c, d
        used[np.uint64(a)] = used[np.uint64(b)] = used[np.uint64(c)] = used[np.uint64(d)] = True
        count[np.uint64(min(min(a, b), min(c, d)))] += 1


@kernel
def order_cells(place, first, last, begin, order, rows):
    """Writes the cells first…last of ``place`` to where those of their lowest corner begin (N,), one after the other.

    order: (T,) their numbers; rows: (T, 4) their corners. Raises begin by how many are written.
    """
    for t in range(first, last):
        a, b, c, d = place[t, 0], place[t, 1], place[t, 2], place[t, 3]
        low = np.uint64(min(min(a, b), min(c, d)))
        to = np.uint64(begin[low])
        begin[low] += 1
        order[to] = t
        rows[to, 0], rows[to, 1], rows[to, 2], rows[to, 3] = a, b, c, d


@inlined
def mixed(value):
    """A number that looks random (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014)."""
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@kernel
def scatter(places):
    """Fills places (N, 2) uint64, a place of each node in a plane that looks random."""
    step = np.uint64(0x9E3779B97F4A7C15)
    for v in range(len(places)):
        places[v, 0] = mixed(np.uint64(2 * v + 1) * step)
        places[v, 1] = mixed(np.uint64(2 * v + 2) * step)


@inlined
def signed_area(places, a, b, c):
    """Twice the area of a triangle in that plane, modulo 2⁶⁴."""
    ux, uy = places[b, 0] - places[a, 0], places[b, 1] - places[a, 1]
    return ux * (places[c, 1] - places[a, 1]) - uy * (places[c, 0] - places[a, 0])


@kernel
def enclose(rows, region, places, area, own, marks, interface):
    """Adds to area (N,) uint64, zeros before, so that it is 0 where the facets opposite to a node close around it.

    They close where each of their edges is gone along in both directions. The signed areas of the triangles of a closed
    surface in any plane add up to 0, and of another one whose nodes are scattered (``scatter``) by a chance of 2⁻⁶⁰.
    All cells have the same orientation. region: (T,), or none (0,); own (N,): the region of a cell of each node, to be
    written. Marks (N,) get the bit ``interface`` where cells of two regions meet.
    """
    for t in range(len(rows)):
        a, b, c, d = np.uint64(rows[t, 0]), np.uint64(rows[t, 1]), np.uint64(rows[t, 2]), np.uint64(rows[t, 3])
        at_b, at_c = signed_area(places, a, d, c), signed_area(places, a, b, d)
        at_d = signed_area(places, a, c, b)
        area[a] -= at_b + at_c + at_d  # a cell is closed
        area[b] += at_b
        area[c] += at_c
        area[d] += at_d
    if len(region):
        for t in range(len(rows)):
            for k in range(4):
                own[rows[t, k]] = region[t]
        for t in range(len(rows)):
            for k in range(4):
                if own[rows[t, k]] != region[t]:
                    marks[rows[t, k]] |= np.uint16(interface)


@inlined
def sorted_facet(rows, t, k):
    """The nodes of a facet in rising order."""
    a, b, c = rows[t, OPPOSITE[k, 0]], rows[t, OPPOSITE[k, 1]], rows[t, OPPOSITE[k, 2]]
    low, high = min(min(a, b), c), max(max(a, b), c)
    return np.int64(low), np.int64(a) + b + c - low - high, np.int64(high)


@kernel
def match(rows, start, keys, facets, twin):
    """Writes twin (4T,): the facet on the other side of each facet, ALONE, or NON_MANIFOLD.

    rows: (T, 4). start: zeros, two more than nodes. keys (int64) and facets, like twin as long, to work with. Facets
    are listed at their lowest node, whose lists are searched one by one, or sorted where they are long.
    """
    for t in range(len(rows)):
        for k in range(4):
            low, _, _ = sorted_facet(rows, t, k)
            start[low + 2] += 1
    for k in range(2, len(start)):
        start[k] += start[k - 1]
    for t in range(len(rows)):
        for k in range(4):
            low, middle, high = sorted_facet(rows, t, k)
            at = start[low + 1]
            start[low + 1] = at + 1
            keys[at], facets[at] = middle << 32 | high, 4 * t + k
    for node in range(len(start) - 2):
        first, last = np.int64(start[node]), np.int64(start[node + 1])
        if last - first > FEW:
            order = np.argsort(keys[first:last], kind="mergesort")
            own_keys, own_facets = keys[first:last][order], facets[first:last][order]
            for i in range(last - first):
                keys[first + i], facets[first + i] = own_keys[i], own_facets[i]
            join_sorted(keys, facets, first, last, twin)
        else:
            join_few(keys, facets, first, last, twin)


@part
def join_sorted(keys, facets, first, last, twin):
    """Joins the facets of equal keys, which stand one after the other."""
    at = first
    while at < last:
        end = at + 1
        while end < last and keys[end] == keys[at]:
            end += 1
        join(facets, at, end, twin)
        at = end


@part
def join_few(keys, facets, first, last, twin):
    """Joins the facets of equal keys among a few; those that are joined change places with the first of the rest."""
    at = first
    while at < last:
        key, end = keys[at], at + 1
        for i in range(at + 1, last):
            if keys[i] == key:
                keys[i], keys[end] = keys[end], key
                facets[i], facets[end] = facets[end], facets[i]
                end += 1
        join(facets, at, end, twin)
        at = end


@part
def join(facets, at, end, twin):
    """The facets at…end have the same nodes."""
    if end - at == 1:
        twin[facets[at]] = ALONE
    elif end - at == 2:
        twin[facets[at]], twin[facets[at + 1]] = facets[at + 1], facets[at]
    else:
        for i in range(at, end):
            twin[facets[i]] = NON_MANIFOLD


@inlined
def same_way(rows, one, other):
    """Do two cells see their common facet turn the same way? Then one of the two is to be read with the other sign."""
    t, k, u, j = one >> 2, one & 3, other >> 2, other & 3
    a, b = rows[t, OPPOSITE[k, 0]], rows[t, OPPOSITE[k, 1]]
    for i in range(3):
        if rows[u, OPPOSITE[j, i]] == a:
            return rows[u, OPPOSITE[j, (i + 1) % 3]] == b
    return False


@kernel
def wind(rows, twin, piece, orientation):
    """Floods over the facets that join two cells; returns whether each part (bool) can be read consistently.

    Writes the part of each cell (piece, −1 before) and its orientation (int8, 1 before).
    """
    cells = len(rows)
    consistent = np.ones(cells, dtype=np.bool_)
    queue = np.empty(cells, dtype=np.int32)
    parts = 0
    for seed in range(cells):
        if piece[seed] >= 0:
            continue
        piece[seed] = parts
        queue[0] = seed
        size = 1
        while size:
            size -= 1
            t = np.int64(queue[size])
            for facet in range(4 * t, 4 * t + 4):
                other = np.int64(twin[facet])
                if other < 0:
                    continue
                u = other >> 2
                wanted = -orientation[t] if same_way(rows, facet, other) else orientation[t]
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
def mark_facets(rows, twin, region, orientation, area, boundary, interface, non_manifold, marks):
    """Marks the nodes of facets on the boundary, between two regions, and of more than two cells.

    region: (T,), or none (0,) where all are the same. orientation: (T,) ±1. area: as ``enclose`` leaves it, if only the
    cells are given at which it is not 0; a facet may then have its other cell elsewhere. None (0,): all cells are. The
    three are the bits to be set in marks (N,). Returns whether all pairs of cells see their common facet from two
    sides.
    """
    agrees = True
    for t in range(len(rows)):
        for k in range(4):
            facet = 4 * t + k
            other, mark = np.int64(twin[facet]), 0
            if other == ALONE:
                mark = boundary
                if len(area):
                    for i in range(3):
                        if area[rows[t, OPPOSITE[k, i]]] == 0:
                            mark = 0
            elif other == NON_MANIFOLD:
                mark = non_manifold
            elif other > facet:
                u = other >> 2
                if len(region) and region[t] != region[u]:
                    mark = interface
                turned = orientation[t] != orientation[u]
                agrees &= same_way(rows, facet, other) == turned
            if mark:
                for i in range(3):
                    marks[rows[t, OPPOSITE[k, i]]] |= np.uint16(mark)
    return agrees
