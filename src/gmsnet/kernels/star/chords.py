"""Whether facets stay near the surface that they stand for, where a node of theirs goes.

A node may lie on a surface while the facets at it cut off a bend. So distances are taken at places on these, too: in
the middle, on the edges that move, and between. Each is from the facet of the reference to which a walk leads; and
places on that one and on those beside it count, too, where they lie over the facet.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.star.cubics import on_facet, walk
from gmsnet.kernels.star.pattern import count_of, pair_of
from gmsnet.kernels.star.pieces import NOWHERE
from gmsnet.kernels.star.surface import CURVED, FLAT

# Barycentric coordinates on a facet: of the node that moves, and of the two others.
PLACES = np.array([[3, 0, 3], [3, 3, 0], [2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0
# The same on a facet of the reference; the first few also on those beside it.
BACK = np.array([[6, 0, 0], [0, 6, 0], [0, 0, 6], [2, 2, 2], [3, 3, 0], [0, 3, 3], [3, 0, 3]]) / 6.0
FEW = 4
BESIDE = 0.15  # in barycentric coordinates: so far beside a facet what lies over its edge counts, too
CLOSER = 0.85  # times what is asked for, since there are places between


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


@part
def off_reference(vertex, facet, f, x, y, z, ax, ay, az, bx, by, bz):
    """The largest squared distance of these places on a facet from the reference, by walks from its facet f on; and of
    places on the facets there, and beside these, from this one."""
    most, last = 0.0, np.int64(NOWHERE)
    ux, uy, uz, vx, vy, vz = ax - x, ay - y, az - z, bx - x, by - y, bz - z
    for k in range(len(PLACES)):
        p, q, r = PLACES[k, 0], PLACES[k, 1], PLACES[k, 2]
        sx, sy, sz = p * x + q * ax + r * bx, p * y + q * ay + r * by, p * z + q * az + r * bz
        f, a, b, c = walk(vertex, facet, f, sx, sy, sz)
        dx, dy, dz = on_facet(vertex, facet, f, a, b, c)
        dx, dy, dz = dx - sx, dy - sy, dz - sz
        most = max(most, dx * dx + dy * dy + dz * dz)
        for side in range(4 if f != last else 0):
            other = f if side == 3 else np.int64(facet[f, 3 + side])
            for j in range(0 if other == NOWHERE else len(BACK) if side == 3 else FEW):
                p, q, r = BACK[j, 0], BACK[j, 1], BACK[j, 2]
                px, py, pz = on_facet(vertex, facet, other, p, q, r)
                most = max(
                    most, off_plane(px - x, py - y, pz - z, ux, uy, uz, vx, vy, vz, BESIDE if side == 3 else 0.0)
                )
        last = f
    return most


@inlined
def off_nearest(surface, row, place, x, y, z, ax, ay, az, bx, by, bz):
    """The same from the facet of the node of a row; of one on a line or curve from a facet of either patch beside."""
    vertex, facet = surface.vertex, surface.facet
    if surface.kind[row] == CURVED:
        return off_reference(vertex, facet, place, x, y, z, ax, ay, az, bx, by, bz)
    least = np.inf
    for k in range(2):
        seed = np.int64(surface.bound.seeds[row, k])
        if seed != NOWHERE:
            least = min(least, off_reference(vertex, facet, seed, x, y, z, ax, ay, az, bx, by, bz))
    return least if least < np.inf else 0.0


@inlined
def near(bound, surface, row, star, n, pattern, place, x, y, z):
    """Do all facets of a star stay within the bound with its node at (x, y, z)?

    bound: None where there is none. place: the reference's facet there.
    """
    if bound is None:
        return True
    if surface.kind[row] == FLAT:
        return True
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        ax, ay, az = star[3 * i], star[3 * i + 1], star[3 * i + 2]
        bx, by, bz = star[3 * j], star[3 * j + 1], star[3 * j + 2]
        if off_nearest(surface, row, place, x, y, z, ax, ay, az, bx, by, bz) > bound.most * bound.most:
            return False
    return True
