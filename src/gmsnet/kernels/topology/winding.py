"""Which faces share which edges, and how to read them so that all of a part are wound alike.

Faces are polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]]; ``first`` is None where all are
triangles. The half-edge h leaves corner[h] for the next corner of its face.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.topology.layout import span

ALONE = -1  # the half-edge has no partner: a boundary edge
NON_MANIFOLD = -2  # three or more faces meet at the edge


@inlined
def signed_area(points, first, corner, f):
    """Of a face as it is read."""
    low, count = span(first, f)
    a = corner[low]
    x, y = points[a, 0], points[a, 1]
    twice = 0.0
    for h in range(low + 1, low + count - 1):
        b, c = corner[h], corner[h + 1]
        twice += (points[b, 0] - x) * (points[c, 1] - y) - (points[b, 1] - y) * (points[c, 0] - x)
    return 0.5 * twice


@kernel
def count_signs(points, first, corner, faces):
    """How many faces have a positive area, and how many a negative one."""
    positive, negative = 0, 0
    for f in range(faces):
        area = signed_area(points, first, corner, f)
        positive += area > 0.0
        negative += area < 0.0
    return positive, negative


@kernel
def match(first, corner, faces, start, by_low, ends, twin):
    """Writes twin: the partner of each half-edge over its edge, ALONE, or NON_MANIFOLD. Linear in the half-edges.

    start: zeros, two more than nodes. by_low, ends, like twin as long as corner, to work with.
    """
    for f in range(faces):
        low, count = span(first, f)
        for h in range(low, low + count):
            start[min(corner[h], corner[h + 1 if h + 1 < low + count else low]) + 2] += 1
    for k in range(2, len(start)):
        start[k] += start[k - 1]
    for f in range(faces):
        low, count = span(first, f)
        for h in range(low, low + count):
            one, other = corner[h], corner[h + 1 if h + 1 < low + count else low]
            k = start[min(one, other) + 1]
            start[min(one, other) + 1] = k + 1
            by_low[k], ends[k] = h, max(one, other)
    nodes = len(start) - 2
    twin[:] = ALONE
    seen = np.full(nodes, -1, dtype=np.int64)  # other end → where its first half-edge stands in by_low
    for node in range(nodes):
        for k in range(start[node], start[node + 1]):
            known = seen[ends[k]]
            if known < start[node]:
                seen[ends[k]] = k
                continue
            h, other = by_low[k], by_low[known]
            if twin[other] == ALONE:
                twin[other] = h
                twin[h] = other
            else:  # a third face: all at this edge are crowded
                if twin[other] >= 0:
                    twin[twin[other]] = NON_MANIFOLD
                twin[other] = NON_MANIFOLD
                twin[h] = NON_MANIFOLD


@kernel
def wind(first, corner, face, twin, part, orientation):
    """Floods over the edges that join two faces; returns whether each part (bool) can be wound consistently.

    face: of each half-edge, or None where all are triangles. Writes the part of each face (part, −1 before) and its
    turn (int8, 1 before): faces of orientation −1 are to be read backwards for all of a part to be wound alike.
    """
    faces = len(part)
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
            low, count = span(first, f)
            for h in range(low, low + count):
                other = twin[h]
                if other < 0:
                    continue
                g = other // 3 if face is None else face[other]
                wanted = -orientation[f] if corner[h] == corner[other] else orientation[f]
                if part[g] < 0:
                    part[g] = parts
                    orientation[g] = wanted
                    queue[size] = g
                    size += 1
                elif orientation[g] != wanted:
                    consistent[parts] = False
        parts += 1
    return consistent[:parts]


@kernel
def part_areas(points, first, corner, part, orientation, parts):
    """Signed area of each part, its faces read with their orientations, and the sum of their absolute areas
    (float64)."""
    area = np.zeros(parts)
    extent = np.zeros(parts)
    for f in range(len(part)):
        own = signed_area(points, first, corner, f)
        area[part[f]] += own * orientation[f]
        extent[part[f]] += abs(own)
    return area, extent
