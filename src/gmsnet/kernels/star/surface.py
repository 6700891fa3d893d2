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
from gmsnet.kernels.star.pieces import LONGEST_WALK, NOWHERE, follow_curve, on_piece, piece_tangent

FLAT, CURVED, LINE, CURVE = range(4)  # kinds of rows; the last two have one way to go
# Where the control points of the edges stand: the one after corner k towards k + 1 is 2k, the other one 2k + 1.
CENTRE, CONTROLS = 6, 7


class Surface(NamedTuple):
    """What nodes slide on, and where they are; nodes by places in memory.

    row: (N,) int32, the row of each node that slides, else −1. By rows (R,): kind int8; of int32, its plane, line or
    curve, which is not read of curved patches; place int32, the facet or piece where it is, which changes as nodes
    move. Of planes, lines and curves (E,): origin (E, 3); direction (E, 3), the unit normal or direction, 0 of curves;
    same (E, 3) bool, which coordinates all its points have in common. Of facets (F,): corner (F, 3, 3) points, normal
    (F, 3, 3), beside (F, 3) int32, the facet across the edge from corner k to k + 1, NOWHERE at the rim, control
    (F, CONTROLS, 3). Of pieces (P,): piece (P, 4, 3) control points, before, after (P,) int32. single: new coordinates
    are rounded to float32. limit: (R,) how far from the facets, or edges, themselves each row may go. Of facets of a
    volume's boundary around each row (M,), in CSR form by start (R + 1,): ring (M, 2) int32, the other two nodes, seen
    counter-clockwise from outside; own (M, 3) its unit normal at first. bound: how far places on facets may lie from
    the reference's (kernels.star.chords).
    """

    row: NDArray[np.int32]
    kind: NDArray[np.int8]
    of: NDArray[np.int32]
    place: NDArray[np.int32]
    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    same: NDArray[np.bool_]
    corner: NDArray[np.float64]
    normal: NDArray[np.float64]
    beside: NDArray[np.int32]
    control: NDArray[np.float64]
    piece: NDArray[np.float64]
    before: NDArray[np.int32]
    after: NDArray[np.int32]
    single: bool
    limit: NDArray[np.float64]
    start: NDArray[np.int32]
    ring: NDArray[np.int32]
    own: NDArray[np.float64]
    bound: float | None = None


@inlined
def barycentric(corner, f, x, y, z):
    """The second and third barycentric coordinates of the foot of a point on the plane of facet f."""
    ax, ay, az = corner[f, 0, 0], corner[f, 0, 1], corner[f, 0, 2]
    ux, uy, uz = corner[f, 1, 0] - ax, corner[f, 1, 1] - ay, corner[f, 1, 2] - az
    vx, vy, vz = corner[f, 2, 0] - ax, corner[f, 2, 1] - ay, corner[f, 2, 2] - az
    px, py, pz = x - ax, y - ay, z - az
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    pu, pv = px * ux + py * uy + pz * uz, px * vx + py * vy + pz * vz
    double = uu * vv - uv * uv
    if not double > 0.0:
        return 0.0, 0.0
    return (vv * pu - uv * pv) / double, (uu * pv - uv * pu) / double


@inlined
def along_edge(corner, f, k, x, y, z):
    """How far along the edge from corner k to the next one the foot of a point is, from 0 to 1."""
    j = (k + 1) % 3
    ux = corner[f, j, 0] - corner[f, k, 0]
    uy = corner[f, j, 1] - corner[f, k, 1]
    uz = corner[f, j, 2] - corner[f, k, 2]
    square = ux * ux + uy * uy + uz * uz
    if not square > 0.0:
        return 0.0
    t = (x - corner[f, k, 0]) * ux + (y - corner[f, k, 1]) * uy + (z - corner[f, k, 2]) * uz
    return min(max(t / square, 0.0), 1.0)


@part
def walk(corner, beside, f, x, y, z):
    """The facet nearest to a point, from facet f on, and the three barycentric coordinates there, none below 0.

    Told no more of the surface than it needs: all that is passed to a part is copied.
    """
    last = NOWHERE
    for _ in range(LONGEST_WALK):
        b, c = barycentric(corner, f, x, y, z)
        a = 1.0 - b - c
        if a >= 0.0 and b >= 0.0 and c >= 0.0:
            return f, a, b, c
        # Across the edge that it lies behind most; the edge opposite to a is from corner 1 to 2.
        k = 1 if a <= b and a <= c else 2 if b <= c else 0
        onward = beside[f, k]
        if onward in (NOWHERE, last):  # the rim, or the ridge between two facets
            t = along_edge(corner, f, k, x, y, z)
            if k == 0:
                return f, 1.0 - t, t, 0.0
            if k == 1:
                return f, 0.0, 1.0 - t, t
            return f, t, 0.0, 1.0 - t
        last, f = f, onward
    b, c = barycentric(corner, f, x, y, z)  # around a peak
    a, b, c = max(1.0 - b - c, 0.0), max(b, 0.0), max(c, 0.0)
    whole = a + b + c
    return f, a / whole, b / whole, c / whole


@inlined
def on_cubic(corner, control, f, k, a, b, c):
    """Coordinate k of the place on the cubic over facet f."""
    edges = a * b * (a * control[f, 0, k] + b * control[f, 1, k]) + b * c * (
        b * control[f, 2, k] + c * control[f, 3, k]
    )
    edges += c * a * (c * control[f, 4, k] + a * control[f, 5, k])
    corners = a * a * a * corner[f, 0, k] + b * b * b * corner[f, 1, k] + c * c * c * corner[f, 2, k]
    return corners + 3.0 * edges + 6.0 * a * b * c * control[f, CENTRE, k]


@inlined
def normal_on(normal, f, a, b, c):
    """The unit normal at a place of facet f, between those of its corners."""
    x = a * normal[f, 0, 0] + b * normal[f, 1, 0] + c * normal[f, 2, 0]
    y = a * normal[f, 0, 1] + b * normal[f, 1, 1] + c * normal[f, 2, 1]
    z = a * normal[f, 0, 2] + b * normal[f, 1, 2] + c * normal[f, 2, 2]
    length = np.sqrt(x * x + y * y + z * z)
    if not length > 0.0:
        return 0.0, 0.0, 1.0
    return x / length, y / length, z / length


@inlined
def within(limit, px, py, pz, x, y, z):
    """(x, y, z), or the place on the way there from (px, py, pz) at this distance from it."""
    if limit == np.inf:
        return x, y, z
    dx, dy, dz = x - px, y - py, z - pz
    far = np.sqrt(dx * dx + dy * dy + dz * dz)
    if far <= limit:
        return x, y, z
    share = limit / far
    return px + share * dx, py + share * dy, pz + share * dz


@inlined
def over_facet(corner, control, limit, f, a, b, c):
    """The place of a row over facet f."""
    return within(
        limit,
        a * corner[f, 0, 0] + b * corner[f, 1, 0] + c * corner[f, 2, 0],
        a * corner[f, 0, 1] + b * corner[f, 1, 1] + c * corner[f, 2, 1],
        a * corner[f, 0, 2] + b * corner[f, 1, 2] + c * corner[f, 2, 2],
        on_cubic(corner, control, f, 0, a, b, c),
        on_cubic(corner, control, f, 1, a, b, c),
        on_cubic(corner, control, f, 2, a, b, c),
    )


@part
def snap3(surface, row, x, y, z):
    """Where the node of a row goes that would go to (x, y, z): x, y, z, and its facet or piece there.

    Coordinates that all points of a plane, line or curve have in common keep their bits; on a plane or line along an
    axis the others are as they were asked for. Nothing is stored.
    """
    kind, place = surface.kind[row], np.int64(surface.place[row])
    if kind == CURVED:
        place, a, b, c = walk(surface.corner, surface.beside, place, x, y, z)
        x, y, z = over_facet(surface.corner, surface.control, surface.limit[row], place, a, b, c)
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
def land_curved(corner, beside, control, normal, limit, single, place, x, y, z):
    """As ``land_on``, on a curved patch, from the facet ``place`` on. In loops arrays are told: counted once."""
    place, a, b, c = walk(corner, beside, place, x, y, z)
    u, v, w = normal_on(normal, place, a, b, c)
    x, y, z = over_facet(corner, control, limit, place, a, b, c)
    if single:
        x, y, z = np.float64(np.float32(x)), np.float64(np.float32(y)), np.float64(np.float32(z))
    return x, y, z, place, u, v, w


@inlined
def land_on(surface, row, x, y, z):
    """As ``snap3``, and the unit normal there, which is zero on curves."""
    kind = surface.kind[row]
    if kind == CURVED:
        return land_curved(
            surface.corner, surface.beside, surface.control, surface.normal, surface.limit[row], surface.single,
            np.int64(surface.place[row]), x, y, z,
        )  # fmt: skip
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
        place, a, b, c = walk(surface.corner, surface.beside, place, x, y, z)
        return normal_on(surface.normal, place, a, b, c)
    if kind == CURVE:
        place, t = follow_curve(surface.piece, surface.before, surface.after, place, x, y, z)
        return piece_tangent(surface.piece, place, t)
    e = surface.of[row]
    return surface.direction[e, 0], surface.direction[e, 1], surface.direction[e, 2]


@kernel
def locate3(surface, points):
    """Writes anew where each node that slides is, of coordinates (N, 3 or 4) that were kept without that."""
    rows, kind, kept, corner, beside = surface.row, surface.kind, surface.place, surface.corner, surface.beside
    for node in range(len(rows)):
        row = rows[node]
        if row < 0:
            continue
        x, y, z = points[node, 0], points[node, 1], points[node, 2]
        if kind[row] == CURVED:
            place, _, _, _ = walk(corner, beside, np.int64(kept[row]), x, y, z)
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
