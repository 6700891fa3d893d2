"""Nodes that slide in space: on planes and lines exactly, on curved patches and curves by the cubics over their facets.

A place on a curved patch is that of a facet of the input with barycentric coordinates: the cubic Bézier triangle over
the facet has the input's nodes as corners and the patch's normals there (Vlachos, Peters, Boyd, Mitchell: Curved PN
triangles, 2001). Where a node would go is first brought to the nearest facet, walking from the one where it is; the
place on the cubic with the same barycentric coordinates is where it goes. So places follow without any iteration, and
neighbouring facets agree along their edge. Curves are cubics over their edges in the same way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.star.cubics import normal_on, over_facet, walk, within
from gmsnet.kernels.star.pieces import follow_curve, on_piece, piece_tangent
from gmsnet.kernels.whole.nearest import Boxes

MOST_WALKS = 8  # around a peak, until the first one is come to again
FLAT, CURVED, LINE, CURVE = range(4)  # kinds of rows; the last two have one way to go


class Surface(NamedTuple):
    """What nodes slide on, and where they are; nodes by places in memory.

    row: (N,) int32, the row of each node that slides, else −1. By rows (R,): kind int8; of int32, its plane, line or
    curve, which is not read of curved patches; place int32, the facet or piece where it is, which changes as nodes
    move. Of planes, lines and curves (E,): origin (E, 3); direction (E, 3), the unit normal or direction, 0 of curves;
    same (E, 3) bool, which coordinates all its points have in common. Of curved patches: vertex (V, 6), a point and its
    unit normal; facet (F, 6) int32, its vertices and then the facet across the edge from vertex k to k + 1, NOWHERE at
    the rim. Of pieces (P,): piece (P, 4, 3) control points, before, after (P,) int32. single: new coordinates are
    rounded to float32. limit: (R,) how far from the facets, or edges, themselves each row may go. Of facets of a
    volume's boundary around each row (M,), in CSR form by start (R + 1,): ring (M, 2) int32, the other two nodes, seen
    counter-clockwise from outside; own (M, 3) its unit normal at first. bound: how far places on facets may lie from
    those of the reference, which is looked at where squares of edges are longer than span (F,) where a node is on a
    curved patch, or row_span (R,) of one on a line or curve (kernels.star.chords); shortest: of these. boxes: with all
    facets of curved patches, and of patches beside curves.
    """

    row: NDArray[np.int32]
    kind: NDArray[np.int8]
    of: NDArray[np.int32]
    place: NDArray[np.int32]
    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    same: NDArray[np.bool_]
    vertex: NDArray[np.float64]
    facet: NDArray[np.int32]
    piece: NDArray[np.float64]
    before: NDArray[np.int32]
    after: NDArray[np.int32]
    single: bool
    limit: NDArray[np.float64]
    start: NDArray[np.int32]
    ring: NDArray[np.int32]
    own: NDArray[np.float64]
    bound: float
    span: NDArray[np.float64]
    row_span: NDArray[np.float64]
    shortest: float
    boxes: Boxes


@part
def snap3(surface, row, x, y, z):
    """Where the node of a row goes that would go to (x, y, z): x, y, z, and its facet or piece there.

    Coordinates that all points of a plane, line or curve have in common keep their bits; on a plane or line along an
    axis the others are as they were asked for. Nothing is stored.
    """
    kind, place = surface.kind[row], np.int64(surface.place[row])
    if kind == CURVED:
        place, a, b, c = walk(surface.vertex, surface.facet, place, x, y, z)
        x, y, z = over_facet(surface.vertex, surface.facet, surface.limit[row], place, a, b, c)
    elif kind == CURVE:
        place, t = follow_curve(surface.piece, surface.before, surface.after, place, x, y, z)
        piece = surface.piece
        x, y, z = within(
            surface.limit[row],
            piece[place, 0, 0] + t * (piece[place, 3, 0] - piece[place, 0, 0]),
            piece[place, 0, 1] + t * (piece[place, 3, 1] - piece[place, 0, 1]),
            piece[place, 0, 2] + t * (piece[place, 3, 2] - piece[place, 0, 2]),
            on_piece(piece, place, 0, t), on_piece(piece, place, 1, t), on_piece(piece, place, 2, t),
        )  # fmt: skip
    if kind != CURVED:
        e = surface.of[row]
        ox, oy, oz = surface.origin[e, 0], surface.origin[e, 1], surface.origin[e, 2]
        ux, uy, uz = surface.direction[e, 0], surface.direction[e, 1], surface.direction[e, 2]
        along = (x - ox) * ux + (y - oy) * uy + (z - oz) * uz
        one, two, three = surface.same[e, 0], surface.same[e, 1], surface.same[e, 2]
        if kind == FLAT:
            if one or two or three:
                along = 0.0  # a plane along two axes
            x, y, z = x - along * ux, y - along * uy, z - along * uz
        elif kind == LINE and np.int64(one) + np.int64(two) + np.int64(three) < 2:
            x, y, z = ox + along * ux, oy + along * uy, oz + along * uz
        x, y, z = ox if one else x, oy if two else y, oz if three else z
    if surface.single:
        x, y, z = np.float64(np.float32(x)), np.float64(np.float32(y)), np.float64(np.float32(z))
    return x, y, z, place


@inlined
def on_curves(kind):
    """Does a row of this kind have one way to go, and not two?"""
    return kind >= LINE


@inlined
def land_on(surface, row, x, y, z):
    """As ``snap3``, and the unit normal there, which is zero on curves."""
    kind = surface.kind[row]
    if kind == CURVED:
        vertex, facet = surface.vertex, surface.facet
        place, a, b, c = walk(vertex, facet, np.int64(surface.place[row]), x, y, z)
        u, v, w = normal_on(vertex, facet, place, a, b, c)
        x, y, z = over_facet(vertex, facet, surface.limit[row], place, a, b, c)
        if surface.single:
            x, y, z = np.float64(np.float32(x)), np.float64(np.float32(y)), np.float64(np.float32(z))
        return x, y, z, place, u, v, w
    x, y, z, place = snap3(surface, row, x, y, z)
    if on_curves(kind):
        return x, y, z, place, 0.0, 0.0, 0.0
    e = surface.of[row]
    return x, y, z, place, surface.direction[e, 0], surface.direction[e, 1], surface.direction[e, 2]


@part
def directions_at(surface, row, x, y, z):
    """The unit normal of the patch, or the unit tangent of the curve, of a row at (x, y, z)."""
    kind, place = surface.kind[row], np.int64(surface.place[row])
    if kind == CURVED:
        place, a, b, c = walk(surface.vertex, surface.facet, place, x, y, z)
        return normal_on(surface.vertex, surface.facet, place, a, b, c)
    if kind == CURVE:
        place, t = follow_curve(surface.piece, surface.before, surface.after, place, x, y, z)
        return piece_tangent(surface.piece, place, t)
    e = surface.of[row]
    return surface.direction[e, 0], surface.direction[e, 1], surface.direction[e, 2]


@part
def located(vertex, facet, f, x, y, z):
    """The facet nearest to a point, from facet f on; from where it leads to, the same one again.

    Walks to a ridge or a peak end on one of its facets, and those from there on another one: of these the first.
    """
    place, a, b, c = walk(vertex, facet, f, x, y, z)
    if a > 0.0 and b > 0.0 and c > 0.0:
        return place
    least = onward = place
    for _ in range(MOST_WALKS):
        onward, _, _, _ = walk(vertex, facet, onward, x, y, z)
        if onward == place:
            break
        least = min(least, onward)
    return least


@kernel
def locate3(surface, points):
    """Writes anew where each node that slides is, of coordinates (N, 3 or 4) that were kept without that.

    Once it has, it changes nothing: so it does not matter how often nodes that stay are located.
    """
    rows, kind, kept, vertex, facet = surface.row, surface.kind, surface.place, surface.vertex, surface.facet
    for node in range(len(rows)):
        row = rows[node]
        if row < 0:
            continue
        x, y, z = points[node, 0], points[node, 1], points[node, 2]
        if kind[row] == CURVED:
            place = located(vertex, facet, np.int64(kept[row]), x, y, z)
        else:
            _, _, _, place = snap3(surface, row, x, y, z)
        kept[row] = place


@kernel
def land_all3(surface, nodes, points, directions):
    """Puts these nodes (K,) of points (N, 3 or 4) where ``snap3`` says, and writes ``directions_at`` there (K, 3)."""
    for i in range(len(nodes)):
        node = nodes[i]
        row = surface.row[node]
        x, y, z, place = snap3(surface, row, points[node, 0], points[node, 1], points[node, 2])
        surface.place[row] = place
        points[node, 0], points[node, 1], points[node, 2] = x, y, z
        directions[i, 0], directions[i, 1], directions[i, 2] = directions_at(surface, row, x, y, z)
