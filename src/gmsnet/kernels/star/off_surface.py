"""How far nodes that have slid in space lie from the facets and edges of the input."""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.star.cubics import corners_of, on_facet, walk
from gmsnet.kernels.star.pieces import follow_curve
from gmsnet.kernels.star.surface import CURVE, CURVED


@inlined
def distance(ax, ay, az, bx, by, bz):
    """From one point to another."""
    return math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2)


@inlined
def edge_length(vertex, i, j):
    """Of the edge from vertex i to j."""
    return distance(vertex[i, 0], vertex[i, 1], vertex[i, 2], vertex[j, 0], vertex[j, 1], vertex[j, 2])


@part
def off_facet(vertex, facet, place, x, y, z):
    """The distance of a point from the facet nearest to it, from ``place`` on, over the mean length of its edges."""
    f, a, b, c = walk(vertex, facet, place, x, y, z)
    px, py, pz = on_facet(vertex, facet, f, a, b, c)
    i, j, k = corners_of(facet, f)
    whole = (edge_length(vertex, i, j) + edge_length(vertex, j, k)) + edge_length(vertex, k, i)
    return 3.0 * distance(px, py, pz, x, y, z) / whole


@part
def off_edge(piece, before, after, place, x, y, z):
    """The same of the edge of a curve."""
    p, t = follow_curve(piece, before, after, place, x, y, z)
    ax, ay, az = piece[p, 0, 0], piece[p, 0, 1], piece[p, 0, 2]
    bx, by, bz = piece[p, 3, 0], piece[p, 3, 1], piece[p, 3, 2]
    away = distance(ax + t * (bx - ax), ay + t * (by - ay), az + t * (bz - az), x, y, z)
    return away / distance(ax, ay, az, bx, by, bz)


@kernel
def farthest(surface, points, moved):
    """The largest of these distances of the nodes that have moved (N,) bool, over the length of the edges there.

    points: (N, 3 or 4). Nodes on planes and lines are on them. No place that is kept changes.
    """
    most, rows, kinds, places = 0.0, surface.row, surface.kind, surface.place
    vertex, facet = surface.vertex, surface.facet
    piece, before, after = surface.piece, surface.before, surface.after
    for node in range(len(rows)):
        row = rows[node]
        if row < 0 or not moved[node]:
            continue
        x, y, z = points[node, 0], points[node, 1], points[node, 2]
        if kinds[row] == CURVED:
            most = max(most, off_facet(vertex, facet, places[row], x, y, z))
        elif kinds[row] == CURVE:
            most = max(most, off_edge(piece, before, after, places[row], x, y, z))
    return most
