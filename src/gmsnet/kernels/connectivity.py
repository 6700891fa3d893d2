"""Which faces meet at which edges, how to wind them alike, and the closed fan around a node.

Faces are polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]]. The half-edge h leaves
corner[h] for the next corner of its face. All arrays are int32 unless said otherwise.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import kernel

ALONE = -1  # the half-edge has no partner: a boundary edge
CROWDED = -2  # three or more faces meet at the edge

FREE, UNUSED, MIXED, OPEN, BROKEN = range(5)  # what the walk around a node finds


@kernel
def half_edges(first, corner):
    """Face and head (the corner it points to) of each half-edge."""
    face = np.empty(len(corner), dtype=np.int32)
    head = np.empty(len(corner), dtype=np.int32)
    for f in range(len(first) - 1):
        for h in range(first[f], first[f + 1]):
            face[h] = f
            head[h] = corner[h + 1] if h + 1 < first[f + 1] else corner[first[f]]
    return face, head


@kernel
def touching(triangles, chosen):
    """Rows (int32, ascending) of the triangles (T, 3) that have a chosen node. chosen: (N,) bool."""
    rows = np.empty(len(triangles), dtype=np.int32)
    count = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        rows[count] = t
        count += chosen[a] or chosen[b] or chosen[c]
    return rows[:count].copy()


@kernel
def counting_order(key, size):
    """The stable order that sorts ``key`` (values 0…size−1), and where each value starts (size + 1)."""
    start = np.zeros(size + 1, dtype=np.int32)
    for k in key:
        start[k + 1] += 1
    for k in range(size):
        start[k + 1] += start[k]
    order = np.empty(len(key), dtype=np.int32)
    at = start[:-1].copy()
    for i in range(len(key)):
        order[at[key[i]]] = i
        at[key[i]] += 1
    return order, start


@kernel
def match(corner, head, nodes):
    """twin: the partner of each half-edge over its edge, ALONE, or CROWDED. Linear in the half-edges."""
    low = np.minimum(corner, head)
    by_low, start = counting_order(low, nodes)
    ends = np.empty(len(corner), dtype=np.int32)  # the other end, in the order of by_low
    for k in range(len(by_low)):
        h = by_low[k]
        ends[k] = max(corner[h], head[h])
    twin = np.full(len(corner), ALONE, dtype=np.int32)
    seen = np.full(nodes, -1, dtype=np.int32)  # other end → where its first half-edge stands in by_low
    for node in range(nodes):
        for k in range(start[node], start[node + 1]):
            first = seen[ends[k]]
            if first < start[node]:
                seen[ends[k]] = k
                continue
            h, other = by_low[k], by_low[first]
            if twin[other] == ALONE:
                twin[other] = h
                twin[h] = other
            else:  # a third face: all at this edge are crowded
                if twin[other] >= 0:
                    twin[twin[other]] = CROWDED
                twin[other] = CROWDED
                twin[h] = CROWDED
    return twin


@kernel
def wind(first, corner, twin, face):
    """Flood over the edges that join two faces: part of each face, its turn (int8 ±1) and whether its part agrees.

    Faces whose turn is −1 are to be read backwards; consistent (bool per part) says whether that settles all edges.
    """
    faces = len(first) - 1
    part = np.full(faces, -1, dtype=np.int32)
    turn = np.ones(faces, dtype=np.int8)
    consistent = np.ones(faces, dtype=np.bool_)
    queue = np.empty(faces, dtype=np.int32)
    parts = 0
    for seed in range(faces):
        if part[seed] >= 0:
            continue
        part[seed] = parts
        queue[0] = seed
        size = 1
        while size:
            size -= 1
            f = queue[size]
            for h in range(first[f], first[f + 1]):
                other = twin[h]
                if other < 0:
                    continue
                g = face[other]
                wanted = -turn[f] if corner[h] == corner[other] else turn[f]
                if part[g] < 0:
                    part[g] = parts
                    turn[g] = wanted
                    queue[size] = g
                    size += 1
                elif turn[g] != wanted:
                    consistent[parts] = False
        parts += 1
    return part, turn, consistent[:parts]


@kernel
def part_areas(points, first, corner, part, turn, parts):
    """Signed area of each part, its faces read with their turns, and the sum of their absolute areas (float64)."""
    area = np.zeros(parts)
    extent = np.zeros(parts)
    for f in range(len(first) - 1):
        a = first[f]
        x, y = points[corner[a], 0], points[corner[a], 1]
        twice = 0.0
        for h in range(a + 1, first[f + 1] - 1):
            b, c = corner[h], corner[h + 1]
            twice += (points[b, 0] - x) * (points[c, 1] - y) - (points[b, 1] - y) * (points[c, 0] - x)
        area[part[f]] += 0.5 * twice * turn[f]
        extent[part[f]] += 0.5 * abs(twice)
    return area, extent


@kernel
def mark_edges(corner, head, twin, face, region, boundary, interface, crowded):
    """Sets the flags (bool per node) of the nodes of boundary edges, of edges between regions, of crowded edges."""
    for h in range(len(corner)):
        if twin[h] == ALONE:
            boundary[corner[h]] = boundary[head[h]] = True
        elif twin[h] == CROWDED:
            crowded[corner[h]] = crowded[head[h]] = True
        elif region[face[h]] != region[face[twin[h]]]:
            interface[corner[h]] = interface[head[h]] = True


@kernel
def walk_fans(first, corner, head, twin, face, turn, smoothable, candidate, nodes):
    """The ring of each candidate node, counter-clockwise once faces are read with their turns.

    smoothable: bool per face; candidate: bool per node. Returns (state per node, int8: FREE, UNUSED, MIXED: in a face
    that is not smoothable, OPEN: the fan has a gap, BROKEN: not one closed fan of three faces or more), (start, ring):
    the rings of the FREE nodes in CSR form.
    """
    by_node, at = counting_order(corner, nodes)
    state = np.full(nodes, UNUSED, dtype=np.int8)
    start = np.zeros(nodes + 1, dtype=np.int32)
    ring = np.empty(len(corner), dtype=np.int32)
    end = 0
    for node in range(nodes):
        start[node] = end
        degree = at[node + 1] - at[node]
        if degree == 0:
            continue
        state[node] = FREE
        for k in range(at[node], at[node + 1]):
            if not smoothable[face[by_node[k]]]:
                state[node] = MIXED
        if state[node] != FREE or not candidate[node]:
            continue
        outgoing = by_node[at[node]]
        steps = 0
        while True:
            # Of the triangle at hand: its half-edge from the node, the one towards it, and the corner first met.
            f = face[outgoing]
            incoming = outgoing - 1 if outgoing > first[f] else first[f + 1] - 1
            forward = turn[f] > 0
            ring[end + steps] = head[outgoing] if forward else corner[incoming]
            steps += 1
            across = twin[incoming] if forward else twin[outgoing]
            if across < 0:
                state[node] = OPEN
                break
            outgoing = across if corner[across] == node else next_half_edge(across, first, face)
            if outgoing == by_node[at[node]]:
                break
            if steps == degree:
                state[node] = BROKEN
                break
        if state[node] == FREE and (steps != degree or degree < 3):
            state[node] = BROKEN
        if state[node] == FREE:
            end += degree
    start[nodes] = end
    return state, start, ring[:end].copy()


@kernel
def next_half_edge(h, first, face):
    """The half-edge after h in its face."""
    f = face[h]
    return h + 1 if h + 1 < first[f + 1] else first[f]


@kernel
def turn_rings(start, ring, identity):
    """Turns each ring (CSR, in place) until it begins at its node of smallest identity."""
    most = 0
    for v in range(len(start) - 1):
        most = max(most, start[v + 1] - start[v])
    front = np.empty(most, dtype=ring.dtype)
    for v in range(len(start) - 1):
        first, end = start[v], start[v + 1]
        if first == end:
            continue
        at, least = first, identity[ring[first]]
        for k in range(first + 1, end):
            other = identity[ring[k]]
            if other < least:
                at, least = k, other
        turned = at - first
        for k in range(turned):
            front[k] = ring[first + k]
        for k in range(end - at):
            ring[first + k] = ring[at + k]
        for k in range(turned):
            ring[end - turned + k] = front[k]


@kernel
def colour(free, start, ring, is_free):
    """Greedy first-fit colours (int32 per node, −1 where held): no two free nodes of one ring share a colour.

    free: ids of the free nodes, in whose order colours are given; start, ring: CSR by node; is_free: bool per node.
    """
    nodes = len(is_free)
    most = 0
    for v in free:
        most = max(most, start[v + 1] - start[v])
    colours = np.full(nodes, -1, dtype=np.int32)
    taken = np.full(most + 2, -1, dtype=np.int64)
    for v in free:
        for k in range(start[v], start[v + 1]):
            other = ring[k]
            if is_free[other] and colours[other] >= 0:
                taken[colours[other]] = v
        c = 0
        while taken[c] == v:
            c += 1
        colours[v] = c
    return colours
