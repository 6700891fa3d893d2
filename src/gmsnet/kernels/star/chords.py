"""Whether facets stay near the surface that they stand for, where a node of theirs goes.

A node may lie on a surface while the facets at it cut off a bend. So distances are taken at places on these, too: in
the middle, on the edges that move, and between. Each is from the facet of the reference to which a walk leads, or, if
that is too far off, from the nearest one; and places on that one and on those beside it count, too, where they lie over
the facet.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.star.cubics import corners_of, on_facet, walk
from gmsnet.kernels.star.pattern import count_of, pair_of
from gmsnet.kernels.star.pieces import NOWHERE
from gmsnet.kernels.star.surface import CURVED
from gmsnet.kernels.whole.nearest import nearest_one

# Barycentric coordinates on a facet: of the node that moves, and of the two others.
PLACES = np.array([
    [6, 0, 6], [6, 6, 0], [4, 4, 4], [8, 2, 2], [2, 8, 2], [2, 2, 8], [9, 3, 0], [9, 0, 3], [3, 9, 0], [3, 0, 9],
]) / 12.0  # fmt: skip
# The same on a facet of the reference; the first few also on those beside it.
BACK = np.array([
    [12, 0, 0], [0, 12, 0], [0, 0, 12], [4, 4, 4], [6, 6, 0], [0, 6, 6], [6, 0, 6],
    [9, 3, 0], [3, 9, 0], [0, 9, 3], [0, 3, 9], [9, 0, 3], [3, 0, 9],
]) / 12.0  # fmt: skip
FEW = 4
BESIDE = 0.15  # in barycentric coordinates: so far beside a facet what lies over its edge counts, too
CLOSER = 0.8  # times what is asked for, since there are places between


@inlined
def off_plane(px, py, pz, ux, uy, uz, vx, vy, vz, beside):
    """The squared distance of the point p from the plane of the triangle 0, u, v if it lies over that, else 0."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    if not square > 0.0:
        return 0.0
    s = (py * vz - pz * vy) * nx + (pz * vx - px * vz) * ny + (px * vy - py * vx) * nz
    t = (uy * pz - uz * py) * nx + (uz * px - ux * pz) * ny + (ux * py - uy * px) * nz
    height = px * nx + py * ny + pz * nz
    least = -beside * square
    return height * height / square if s >= least and t >= least and s + t <= square - least else 0.0


@inlined
def alike(vertex, facet, f, ux, uy, uz, vx, vy, vz):
    """Is a facet of the reference at most 60° off the triangle 0, u, v? Others are beyond a sharp edge, or folded."""
    i, j, k = corners_of(facet, f)
    x, y, z = vertex[i, 0], vertex[i, 1], vertex[i, 2]
    ax, ay, az = vertex[j, 0] - x, vertex[j, 1] - y, vertex[j, 2] - z
    bx, by, bz = vertex[k, 0] - x, vertex[k, 1] - y, vertex[k, 2] - z
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    across = cx * nx + cy * ny + cz * nz
    square = (cx * cx + cy * cy + cz * cz) * (nx * nx + ny * ny + nz * nz)
    return across > 0.0 and 4.0 * across * across >= square


@part
def back_from(vertex, facet, f, x, y, z, ax, ay, az, bx, by, bz):
    """The largest squared distance of places on facet f of the reference, and on those beside it, from a facet."""
    most = 0.0
    ux, uy, uz, vx, vy, vz = ax - x, ay - y, az - z, bx - x, by - y, bz - z
    for side in range(4):
        other = f if side == 3 else np.int64(facet[f, 3 + side])
        for j in range(0 if other == NOWHERE else len(BACK) if side == 3 else FEW):
            p, q, r = BACK[j, 0], BACK[j, 1], BACK[j, 2]
            px, py, pz = on_facet(vertex, facet, other, p, q, r)
            beside = BESIDE if side == 3 else 0.0
            most = max(most, off_plane(px - x, py - y, pz - z, ux, uy, uz, vx, vy, vz, beside))
    return most


@part
def off_reference(vertex, facet, boxes, f, bound, x, y, z, ax, ay, az, bx, by, bz):
    """The largest squared distance of places on a facet from the reference, by walks from its facet f on, and back.

    bound: squared. A walk may end at a ridge that is not the nearest: where it is further off than that, and where f is
    NOWHERE, the nearest facet is looked for, and taken instead if it faces the same way.
    """
    most, last = 0.0, np.int64(NOWHERE)
    for k in range(len(PLACES)):
        p, q, r = PLACES[k, 0], PLACES[k, 1], PLACES[k, 2]
        sx, sy, sz = p * x + q * ax + r * bx, p * y + q * ay + r * by, p * z + q * az + r * bz
        here, square, counts = np.int64(NOWHERE), np.inf, True
        if f != NOWHERE:
            here, a, b, c = walk(vertex, facet, f, sx, sy, sz)
            dx, dy, dz = on_facet(vertex, facet, here, a, b, c)
            dx, dy, dz = dx - sx, dy - sy, dz - sz
            square = dx * dx + dy * dy + dz * dz
        if square > bound:
            least, there = nearest_one(boxes, sx, sy, sz)
            same = alike(vertex, facet, there, ax - x, ay - y, az - z, bx - x, by - y, bz - z)
            if same or f == NOWHERE:
                square, here, counts = least, there, same
        else:
            f = here
        most = max(most, square)
        if here != last and counts:
            most = max(most, back_from(vertex, facet, here, x, y, z, ax, ay, az, bx, by, bz))
        last = here
    return most


@inlined
def span_of(surface, row, place):
    """How long the square of an edge may be before facets are looked at, with the node of a row at this place."""
    if surface.kind[row] != CURVED:
        return surface.row_span[row]
    return min(surface.span[place], surface.span[surface.place[row]])


@inlined
def goes_off(surface, row, place, x, y, z, was, ax, ay, az, bx, by, bz):
    """Would the facet of the node of a row and two others lie further off than it may with the node at (x, y, z)?

    place: the reference's facet there. was: (3 or more) where the node is. One that is too far off may come nearer.
    """
    ux, uy, uz, vx, vy, vz = ax - x, ay - y, az - z, bx - x, by - y, bz - z
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    if longest <= surface.shortest or longest <= span_of(surface, row, place):
        return False
    vertex, facet, boxes, most = surface.vertex, surface.facet, surface.boxes, surface.bound * surface.bound
    on = place if surface.kind[row] == CURVED else NOWHERE
    off = off_reference(vertex, facet, boxes, on, most, x, y, z, ax, ay, az, bx, by, bz)
    if off <= most:
        return False
    then = off_reference(vertex, facet, boxes, NOWHERE, most, was[0], was[1], was[2], ax, ay, az, bx, by, bz)
    return off >= then or then <= most


@inlined
def near(surface, row, star, n, pattern, place, x, y, z, was):
    """Do all facets of a star stay near the reference with its node at (x, y, z)? place: as of ``goes_off``."""
    if surface.shortest < np.inf:
        for k in range(count_of(pattern, n)):
            i, j = pair_of(pattern, n, k)
            ax, ay, az = star[3 * i], star[3 * i + 1], star[3 * i + 2]
            bx, by, bz = star[3 * j], star[3 * j + 1], star[3 * j + 2]
            if goes_off(surface, row, place, x, y, z, was, ax, ay, az, bx, by, bz):
                return False
    return True
