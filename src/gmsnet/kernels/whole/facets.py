"""The facets of a surface in space, one after the other: their normals, the edges between them, and how these turn.

Sums and lengths are taken as NumPy takes them, so that they round alike.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel

MANY = 24  # sides in one node's list: from there on they are not sorted one by one


@inlined
def length_of(x, y, z):
    """As constraints.features.lengths_of."""
    return math.hypot(math.hypot(x, y), z)


@kernel
def facet_normals(points, rows, normal, area, unit):
    """Writes the products (F, 3) of two edges of each facet, their lengths (F,), and unit normals, 0 where there is
    none."""
    for f in range(len(rows)):
        i, j, k = rows[f, 0], rows[f, 1], rows[f, 2]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        normal[f, 0], normal[f, 1], normal[f, 2] = x, y, z
        area[f] = length_of(x, y, z)
        for axis in range(3):
            unit[f, axis] = normal[f, axis] / area[f] if area[f] > 0.0 else 0.0


@kernel
def list_edges(rows, nodes, found, count, one, other):
    """Lists the edges of facets (F, 3) by their nodes, the lower one first; returns how many they are.

    All that is written has room for 3F. found: the edge as lower·nodes + higher. count: of how many sides it is. one,
    other: the first two of these as 3f + k, the same one twice where there is one alone.
    """
    sides = 3 * len(rows)
    start = np.zeros(nodes + 2, dtype=np.int64)
    high, side = np.empty(sides, dtype=np.int64), np.empty(sides, dtype=np.int64)
    for f in range(len(rows)):
        for k in range(3):
            start[min(rows[f, k], rows[f, (k + 1) % 3]) + 2] += 1
    for i in range(1, nodes + 2):
        start[i] += start[i - 1]
    for f in range(len(rows)):
        for k in range(3):
            a, b = rows[f, k], rows[f, (k + 1) % 3]
            at = start[min(a, b) + 1]
            high[at], side[at] = max(a, b), 3 * f + k
            start[min(a, b) + 1] = at + 1
    edges = 0
    for i in range(nodes):
        begin, end = start[i], start[i + 1]
        if end - begin > MANY:
            order = np.argsort(high[begin:end], kind="mergesort")
            high[begin:end], side[begin:end] = high[begin:end][order], side[begin:end][order]
        else:
            for at in range(begin + 1, end):
                h, s, back = high[at], side[at], at
                while back > begin and high[back - 1] > h:
                    high[back], side[back] = high[back - 1], side[back - 1]
                    back -= 1
                high[back], side[back] = h, s
        at = begin
        while at < end:
            after = at + 1
            while after < end and high[after] == high[at]:
                after += 1
            found[edges], count[edges], one[edges] = i * nodes + high[at], after - at, side[at]
            other[edges] = side[at + 1] if after - at == 2 else side[at]
            edges += 1
            at = after
    return edges


@kernel
def add_units(rows, unit, total, count):
    """Adds the unit normals of facets (F, 3) at their nodes to ``total`` (N, 3), and how many they are to ``count``."""
    for f in range(len(rows)):
        for k in range(3):
            i = rows[f, k]
            count[i] += 1
            for axis in range(3):
                total[i, axis] += unit[f, axis]


@kernel
def cosines(unit, one, other, out):
    """Writes the product of the unit normals (F, 3) on both sides of each edge (E,)."""
    for e in range(len(one)):
        f, g = one[e] // 3, other[e] // 3
        out[e] = (unit[f, 0] * unit[g, 0] + unit[f, 1] * unit[g, 1]) + unit[f, 2] * unit[g, 2]


@kernel
def find_level(points, rows, unit, one, other, smooth, cosine, share, rounding, beside, flat):
    """Writes the facets across smooth edges (E,) into ``beside`` (3F,), and into ``flat`` whether they are in one
    plane: the node beyond is off it by no more than so large a share of its distance, and rounding."""
    for e in range(len(one)):
        if not smooth[e]:
            continue
        f, g = one[e] // 3, other[e] // 3
        beside[one[e]], beside[other[e]] = g, f
        beyond, at = rows[g, (other[e] + 2) % 3], rows[f, 0]
        x, y, z = (
            points[beyond, 0] - points[at, 0],
            points[beyond, 1] - points[at, 1],
            points[beyond, 2] - points[at, 2],
        )
        away = abs((x * unit[f, 0] + y * unit[f, 1]) + z * unit[f, 2])
        if away > share * (abs(x) + abs(y) + abs(z)) * 2.0 + rounding:  # most edges
            continue
        if cosine[e] > 0.0 and away <= share * length_of(x, y, z) + rounding:
            flat[one[e]] = flat[other[e]] = True


@kernel
def link(beside, joins, queue, part):
    """Numbers the parts that facets joined across their edges make up, into ``part`` (F,), −1s, in their order.

    beside: (F, 3). joins: (F, 3) bool, which of these. Edges join both ways. queue: (F,) to work in.
    """
    parts = 0
    for f in range(len(part)):
        if part[f] >= 0:
            continue
        part[f], queue[0], at, end = parts, f, 0, 1
        while at < end:
            one = queue[at]
            at += 1
            for k in range(3):
                other = beside[one, k]
                if joins[one, k] and part[other] < 0:
                    part[other], queue[end] = parts, other
                    end += 1
        parts += 1


@kernel
def find_planes(own, part, low, high, plane):
    """Writes the plane part of each vertex that lies in one into ``plane`` (V,), −1s. own: (F, 3) vertices. part: (F,).

    That is, of vertices of a facet that has one all of whose facets are of one part. low, high: (V,) to work in.
    """
    for v in range(len(plane)):
        low[v], high[v] = len(part), -1
    for f in range(len(own)):
        for k in range(3):
            v = own[f, k]
            low[v], high[v] = min(low[v], part[f]), max(high[v], part[f])
    for f in range(len(own)):
        a, b, c = own[f, 0], own[f, 1], own[f, 2]
        if low[a] == high[a] or low[b] == high[b] or low[c] == high[c]:
            plane[a] = plane[b] = plane[c] = part[f]


@kernel
def own_sides(unit, own, table, out):
    """Writes the normal of each facet (F, 3), or where it has none the mean of those at its vertices, at length 1.

    unit: (F, 3), 0 where a facet has no area. own: (F, 3) vertices. table: (V, 6) points and normals.
    """
    for f in range(len(out)):
        x, y, z = unit[f, 0], unit[f, 1], unit[f, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            a, b, c = own[f, 0], own[f, 1], own[f, 2]
            x, y, z = (
                (table[a, 3] + table[b, 3]) + table[c, 3],
                (table[a, 4] + table[b, 4]) + table[c, 4],
                (table[a, 5] + table[b, 5]) + table[c, 5],
            )
            length = length_of(x, y, z)
            if length > 0.0:
                x, y, z = x / length, y / length, z / length
        out[f, 0], out[f, 1], out[f, 2] = x, y, z
