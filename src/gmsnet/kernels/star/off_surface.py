"""How far nodes that have slid in space lie from the facets and edges of the input."""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.star.pieces import follow_curve
from gmsnet.kernels.star.surface import CURVE, CURVED, walk


@inlined
def distance(ax, ay, az, bx, by, bz):
    """From one point to another."""
    return math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2)


@inlined
def edge_length(corner, f, k):
    """Of the edge of facet f from corner k to the next one."""
    j = (k + 1) % 3
    return distance(
        corner[f, k, 0], corner[f, k, 1], corner[f, k, 2], corner[f, j, 0], corner[f, j, 1], corner[f, j, 2]
    )


@part
def off_facet(corner, beside, place, x, y, z):
    """The distance of a point from the facet nearest to it, from ``place`` on, over the mean length of its edges."""
    f, a, b, c = walk(corner, beside, place, x, y, z)
    px = a * corner[f, 0, 0] + b * corner[f, 1, 0] + c * corner[f, 2, 0]
    py = a * corner[f, 0, 1] + b * corner[f, 1, 1] + c * corner[f, 2, 1]
    pz = a * corner[f, 0, 2] + b * corner[f, 1, 2] + c * corner[f, 2, 2]
    whole = (edge_length(corner, f, 0) + edge_length(corner, f, 1)) + edge_length(corner, f, 2)
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
    corner, beside = surface.corner, surface.beside
    piece, before, after = surface.piece, surface.before, surface.after
    for node in range(len(rows)):
        row = rows[node]
        if row < 0 or not moved[node]:
            continue
        x, y, z = points[node, 0], points[node, 1], points[node, 2]
        if kinds[row] == CURVED:
            most = max(most, off_facet(corner, beside, places[row], x, y, z))
        elif kinds[row] == CURVE:
            most = max(most, off_edge(piece, before, after, places[row], x, y, z))
    return most
