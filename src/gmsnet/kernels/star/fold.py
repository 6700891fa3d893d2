"""Whether facets of the boundary of a volume keep their side of the surface that their nodes slide on, and near it."""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.star.chords import goes_off
from gmsnet.kernels.star.cubics import normal_on, walk
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.surface import CURVED

LEAST_COSINE = 0.1  # between a facet's normal and that of the surface at its middle: 84°


@inlined
def cosine_of(points, i, j, x, y, z, nx, ny, nz):
    """Between the normal of the facet of (x, y, z) and nodes i and j and a unit normal; 1 for one without an area."""
    ax, ay, az = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
    bx, by, bz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    square = cx * cx + cy * cy + cz * cz
    if not square > 0.0:
        return 1.0
    return (cx * nx + cy * ny + cz * nz) / math.sqrt(square)


@inlined
def side_of_facet(surface, row, place, e, points, x, y, z):
    """The cosine of facet e around the node of a row, with the node at (x, y, z).

    The surface's normal is that of a curved patch where the facet's middle is, else that of the facet at first.
    """
    i, j = surface.ring[e, 0], surface.ring[e, 1]
    nx, ny, nz = surface.own[e, 0], surface.own[e, 1], surface.own[e, 2]
    if surface.kind[row] == CURVED:
        mx, my, mz = points[i, 0] + points[j, 0], points[i, 1] + points[j, 1], points[i, 2] + points[j, 2]
        f, a, b, c = walk(surface.vertex, surface.facet, place, (x + mx) / 3.0, (y + my) / 3.0, (z + mz) / 3.0)
        nx, ny, nz = normal_on(surface.vertex, surface.facet, f, a, b, c)
    return cosine_of(points, i, j, x, y, z, nx, ny, nz)


@part
def folds(surface, node, points, place, x, y, z):
    """Would a facet turn over if a node went to (x, y, z)? place: its facet or piece there.

    A facet that is turned already may not turn further.
    """
    if surface is not None:
        row = surface.row[node]
        if row >= 0:
            for e in range(surface.start[row], surface.start[row + 1]):
                cosine = side_of_facet(surface, row, place, e, points, x, y, z)
                if cosine < LEAST_COSINE:
                    px, py, pz = points[node, 0], points[node, 1], points[node, 2]
                    if cosine < side_of_facet(surface, row, surface.place[row], e, points, px, py, pz):
                        return True
    return False


@part
def strays(surface, node, points, place, x, y, z):
    """Would a facet lie further off the surface than it may if a node went to (x, y, z)? place: as of ``folds``."""
    if surface is not None and surface.shortest < math.inf:
        row = surface.row[node]
        if row >= 0:
            for e in range(surface.start[row], surface.start[row + 1]):
                i, j = surface.ring[e, 0], surface.ring[e, 1]
                if goes_off(
                    surface, row, place, x, y, z, points[node], points[i, 0], points[i, 1], points[i, 2],
                    points[j, 0], points[j, 1], points[j, 2],
                ):  # fmt: skip
                    return True
    return False


@inlined
def spoils(surface, node, points, place, x, y, z):
    """Either of these."""
    return folds(surface, node, points, place, x, y, z) or strays(surface, node, points, place, x, y, z)


@part
def refuse_spoiling(points, blocks, block, surface, workspace):
    """Takes back what is allowed of the lanes whose target would spoil the boundary."""
    if surface is not None:
        for lane in range(LANES3):
            if workspace.row[lane] >= 0 and workspace.allowed[lane]:
                node, target = blocks.centre[block * LANES3 + lane], workspace.target
                x, y, z = target[4 * lane], target[4 * lane + 1], target[4 * lane + 2]
                workspace.allowed[lane] = not spoils(surface, node, points, workspace.place[lane], x, y, z)
