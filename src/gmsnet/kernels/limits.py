"""Upper bounds of 1/q that held nodes and the connectivity set to groups of cells (proofs: gmsnet.limits)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.compile import inlined, kernel, part

# Kinds of groups, and no node. Their types keep a kernel from being compiled once for each of their values.
HELD, FREE_CORNER, CORNER, RING = map(np.int8, range(4))
NOWHERE = np.int64(-1)
ROOT3 = math.sqrt(3.0)
LEAST = 1e-4  # a smaller bound of the kind RING is given as this one
BISECTIONS = 40
SLACK, ABOVE = 1e-9, 1e-6  # of the sizes of discs; what is added to a bound for rounding


class Groups(NamedTuple):
    """Groups of cells that cannot all be better than ``bound``, as many rows as there is room; ``used`` are filled.

    kind, node (−1 where there is none), angle (of a corner, radians), bound; cells: rows of triangles, those of group g
    are cells[first[g] : first[g + 1]].
    """

    kind: NDArray[np.int8]
    node: NDArray[np.int32]
    angle: NDArray[np.float64]
    bound: NDArray[np.float64]
    first: NDArray[np.int64]
    cells: NDArray[np.int32]


@inlined
def best_with_corner(angle):
    """1/q of the best triangle that has a corner of this angle: √3 sin θ/(2 − cos θ), 0 from 180° on."""
    return ROOT3 * math.sin(angle) / (2.0 - math.cos(angle)) if angle < math.pi else 0.0


@kernel
def collect(points, triangles, turn, free, below, groups):
    """Fills in all groups with a bound less than ``below``; returns how many. free: (N,) bool."""
    nodes, used = len(points), np.int64(0)
    groups.first[0] = 0
    degree, edges = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    for v in range(nodes):
        degree[v] = edges[v] = 0
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        degree[i] += 1
        degree[j] += 1
        degree[k] += 1
        at_i, at_j, at_k = free[i], free[j], free[k]
        if at_i and at_j and at_k:
            continue
        if not (at_i or at_j or at_k):
            bound = shape_of(points, i, j, k) * turn[t]
            if bound < below:
                groups.cells[groups.first[used]] = t
                used = enter(groups, used, HELD, NOWHERE, 0.0, bound, np.int64(1))
            continue
        # At a free node, count the held edges around it; at a held one, note that there is a free node.
        edges[i] += not (at_i and (at_j or at_k))
        edges[j] += not (at_j and (at_k or at_i))
        edges[k] += not (at_k and (at_i or at_j))
    worth = np.empty(nodes, dtype=np.bool_)
    for v in range(nodes):
        bad = free[v] and best_with_corner(2.0 * math.pi / max(degree[v], 1)) < below
        worth[v] = bad or edges[v] >= (2 if free[v] else 1)
    start, rows = incident(triangles, degree, worth)
    most = 0
    for v in range(nodes):
        most = max(most, start[v + 1] - start[v])
    left, right, discs = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int32), np.empty((most, 5))
    for v in range(nodes):
        if not worth[v]:
            continue
        around = rows[start[v] : start[v + 1]]
        n = len(around)
        for m in range(n):
            left[m], right[m] = others(triangles, turn, around[m], v)
        if free[v]:
            bound = best_with_corner(2.0 * math.pi / n)
            if bound < below:
                for m in range(n):  # an assignment of slices would take seconds to compile
                    groups.cells[groups.first[used] + m] = around[m]
                used = enter(groups, used, FREE_CORNER, v, 2.0 * math.pi, bound, n)
            used = ring(points, free, below, v, around, left, right, discs, groups, used)
        else:
            used = corners(points, free, below, v, around, left, right, groups, used)
    return used


@part
def incident(triangles, degree, worth):
    """start (N + 1,) and rows: the triangles around each node that is worth it."""
    nodes = len(degree)
    start, end = np.empty(nodes + 1, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    start[0] = 0
    for i in range(nodes):
        end[i] = start[i]
        start[i + 1] = start[i] + (degree[i] if worth[i] else 0)
    rows = np.empty(start[nodes], dtype=np.int32)
    if len(rows):
        for t in range(len(triangles)):
            for k in range(3):
                i = triangles[t, k]
                if worth[i]:
                    rows[end[i]] = t
                    end[i] += 1
    return start, rows


@part
def enter(groups, used, kind, node, angle, bound, cells):
    """Closes the row of a group, whose cells are written already."""
    groups.kind[used], groups.node[used], groups.angle[used], groups.bound[used] = kind, node, angle, bound
    groups.first[used + 1] = groups.first[used] + cells
    return used + 1


@inlined
def others(triangles, turn, t, v):
    """The other two corners of a triangle, so that (v, first, second) is counter-clockwise where it is positive."""
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    if v == j:
        i, j, k = j, k, i
    elif v == k:
        i, j, k = k, i, j
    return (j, k) if turn[t] > 0 else (k, j)


@inlined
def shape_of(points, i, j, k):
    """1/q of a triangle, 0 of one without extent."""
    ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
    lengths = 2.0 * (ax * ax + ay * ay + bx * bx + by * by - ax * bx - ay * by)
    return 2.0 * ROOT3 * (ax * by - ay * bx) / lengths if lengths > 0.0 else 0.0


@part
def corners(points, free, below, v, around, left, right, groups, used):
    """The groups of cells between two neighbouring held edges at a held node, or all around it."""
    n = len(around)
    for m in range(n):  # each node may begin one triangle and end one, or there is more than one fan on a side
        for k in range(m):
            if left[k] == left[m] or right[k] == right[m]:
                return used
    whole = True  # no edge here is held
    for m in range(n):
        whole &= free[left[m]]
    for m in range(n):
        if free[left[m]] and not (whole and m == 0):
            continue
        count, at = 0, m
        while at >= 0:
            groups.cells[groups.first[used] + count] = around[at]
            count += 1
            end = right[at]
            if end == left[m] or not free[end]:
                break
            at = -1
            for k in range(n):
                if left[k] == end:
                    at = k
        if at < 0 or count < 2:  # an end that is not held is no end: nothing is known; one cell is of the kind HELD
            continue
        angle = 2.0 * math.pi
        if end != left[m]:
            ax, ay = points[left[m], 0] - points[v, 0], points[left[m], 1] - points[v, 1]
            bx, by = points[end, 0] - points[v, 0], points[end, 1] - points[v, 1]
            angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            if angle < 1e-9:  # next to 0 it cannot be told from a full turn, for which the bound is larger
                angle += 2.0 * math.pi
        bound = best_with_corner(angle / count) + ABOVE
        if bound < below:
            used = enter(groups, used, CORNER, v, angle, bound, count)
    return used


@part
def ring(points, free, below, v, around, left, right, discs, groups, used):
    """The group of a free node's cells whose opposite edges are held, if there are two or more."""
    n, count = len(around), 0
    for m in range(n):
        i, j = left[m], right[m]
        if not (free[i] or free[j]):
            dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            discs[count, 0], discs[count, 1] = (
                points[i, 0] - points[left[0], 0] + 0.5 * dx,
                points[i, 1] - points[left[0], 1] + 0.5 * dy,
            )
            discs[count, 2], discs[count, 3] = -dy, dx
            groups.cells[groups.first[used] + count] = around[m]
            count += 1
    if count < 2:
        return used
    bound = best_apex(discs[:count]) + ABOVE
    return enter(groups, used, RING, v, 0.0, bound, count) if bound < below else used


@part
def best_apex(edges):
    """The largest t for which one apex makes 1/q ≥ t with all edges (m, 5), from above.

    edges: the middle of each and the vector to its left that is as long as it; the last column is worked in.
    """
    scale = 0.0
    for m in range(len(edges)):
        scale = max(scale, math.sqrt(edges[m, 2] ** 2 + edges[m, 3] ** 2))
    low, high = LEAST, 1.0
    if meet(edges, high, scale):
        return high
    if not meet(edges, low, scale):
        return low
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if meet(edges, middle, scale):
            low = middle
        else:
            high = middle
    return high


@part
def meet(edges, t, scale):
    """Have the discs of all edges at this t a point in common? One that two circles share, or a centre."""
    count = len(edges)
    up = 0.5 * ROOT3 / t
    wide = 0.5 * ROOT3 * math.sqrt(max(1.0 / (t * t) - 1.0, 0.0))
    for m in range(count):
        edges[m, 4] = math.sqrt(edges[m, 2] ** 2 + edges[m, 3] ** 2)
    for m in range(count):
        if inside(edges, up, wide, scale, edges[m, 0] + up * edges[m, 2], edges[m, 1] + up * edges[m, 3]):
            return True
    for m in range(count):
        x, y, r = edges[m, 0] + up * edges[m, 2], edges[m, 1] + up * edges[m, 3], wide * edges[m, 4]
        for k in range(m):
            dx, dy = edges[k, 0] + up * edges[k, 2] - x, edges[k, 1] + up * edges[k, 3] - y
            s = wide * edges[k, 4]
            d = math.sqrt(dx * dx + dy * dy)
            if d > (r + s) * (1.0 + SLACK) + SLACK * scale:
                return False
            if d <= abs(r - s) or d == 0.0:
                continue  # one lies in the other
            along = 0.5 * (d + (r - s) * (r + s) / d)
            across = math.sqrt(max(r * r - along * along, 0.0))
            px, py, qx, qy = x + along * dx / d, y + along * dy / d, -across * dy / d, across * dx / d
            if inside(edges, up, wide, scale, px + qx, py + qy) or inside(edges, up, wide, scale, px - qx, py - qy):
                return True
    return False


@part
def inside(edges, up, wide, scale, x, y):
    """Does a point lie in all discs, but for rounding?"""
    for m in range(len(edges)):
        dx, dy = x - edges[m, 0] - up * edges[m, 2], y - edges[m, 1] - up * edges[m, 3]
        if math.sqrt(dx * dx + dy * dy) > wide * edges[m, 4] * (1.0 + SLACK) + SLACK * scale:
            return False
    return True
