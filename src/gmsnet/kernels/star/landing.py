"""Where the nodes of a block come to lie on what they slide on, LANES at a time.

The vertices of the facets where nodes are stand as [vertex][point, normal][axis][lane] in float64.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.jit.prefetch import prefetch
from gmsnet.kernels.star.cubics import corners_of, foot_on, on_cubic, upright, walk
from gmsnet.kernels.star.surface import CURVED, land_on, on_curves

COORDINATES = 6  # of a vertex


class Landing(NamedTuple):
    """place: (LANES,) the facet of each lane. kind: (LANES,) its kind, NONE where it does not land here. corner, share:
    what the facets are, and second and third barycentric coordinates. limit: (LANES,) of each lane. target, normal:
    [axis][lane], where nodes come to lie and the reference's normal there."""

    place: NDArray[np.int64]
    kind: NDArray[np.int8]
    corner: NDArray[np.float64]
    share: NDArray[np.float64]
    limit: NDArray[np.float64]
    target: NDArray[np.float64]
    normal: NDArray[np.float32]


NONE = -1


@part
def landing_place():
    """Room for a block."""
    return Landing(
        np.zeros(LANES, dtype=np.int64), np.zeros(LANES, dtype=np.int8), np.empty(3 * COORDINATES * LANES),
        np.empty(2 * LANES), np.empty(LANES), np.empty(3 * LANES), np.empty(3 * LANES, dtype=np.float32),
    )  # fmt: skip


@part
def ask_for_facets(surface, blocks, block, last):
    """Has the facets fetched where the nodes of a block are, if there is one."""
    if block < last:
        rows, places, nodes, facet = surface.row, surface.place, blocks.centre, surface.facet
        for lane in range(LANES):
            row = np.int64(rows[nodes[block * LANES + lane]])
            if row >= 0:
                prefetch(facet, np.uint32(places[row]))


@inlined
def take_corner(vertex, v, corner, at):
    """A vertex to a place of a lane."""
    x, y, z, p, q, r = vertex[v, 0], vertex[v, 1], vertex[v, 2], vertex[v, 3], vertex[v, 4], vertex[v, 5]
    corner[at], corner[at + LANES], corner[at + 2 * LANES] = x, y, z
    corner[at + 3 * LANES], corner[at + 4 * LANES], corner[at + 5 * LANES] = p, q, r


@inlined
def take_corners(vertex, facet, f, corner, lane):
    """The vertices of facet f into a lane."""
    i, j, k = corners_of(facet, np.uint32(f))
    take_corner(vertex, i, corner, lane)
    take_corner(vertex, j, corner, lane + COORDINATES * LANES)
    take_corner(vertex, k, corner, lane + 2 * COORDINATES * LANES)


@part
def begin(surface, blocks, block, centre, inverse, done, step, landing):
    """Where nodes would go, and from which facets; returns how many of them are on curved patches."""
    rows, kinds, places, limits = surface.row, surface.kind, surface.place, surface.limit
    nodes, first, target, curved = blocks.centre, block * LANES, landing.target, 0
    for lane in range(LANES):
        row = np.int64(rows[nodes[first + lane]])
        landing.kind[lane], landing.place[lane], landing.limit[lane] = NONE, 0, 0.0
        if row >= 0 and not done[lane] and not on_curves(kinds[row]):
            landing.kind[lane], landing.limit[lane] = kinds[row], limits[row]
            if kinds[row] == CURVED:
                landing.place[lane] = places[row]
                curved += 1
    for lane in range(LANES):
        dx, dy, dz = np.float64(step[lane]), np.float64(step[LANES + lane]), np.float64(step[2 * LANES + lane])
        size = 1.0 / inverse[lane]
        there = abs(dx) + abs(dy) + abs(dz) < np.inf
        target[lane] = centre[lane] + (size * dx if there else 0.0)
        target[LANES + lane] = centre[LANES + lane] + (size * dy if there else 0.0)
        target[2 * LANES + lane] = centre[2 * LANES + lane] + (size * dz if there else 0.0)
    return curved


@part
def find_facets(vertex, facet, landing):
    """The nearest facets and the places on them."""
    corner, share, target, place, kind = landing.corner, landing.share, landing.target, landing.place, landing.kind
    for lane in range(LANES):
        take_corners(vertex, facet, place[lane], corner, lane)
    q, r = COORDINATES * LANES, 2 * COORDINATES * LANES
    for lane in range(LANES):
        px, py, pz = corner[lane], corner[LANES + lane], corner[2 * LANES + lane]
        share[lane], share[LANES + lane] = foot_on(
            corner[q + lane] - px, corner[q + LANES + lane] - py, corner[q + 2 * LANES + lane] - pz,
            corner[r + lane] - px, corner[r + LANES + lane] - py, corner[r + 2 * LANES + lane] - pz,
            target[lane] - px, target[LANES + lane] - py, target[2 * LANES + lane] - pz,
        )  # fmt: skip
    for lane in range(LANES):
        b, c = share[lane], share[LANES + lane]
        if kind[lane] == CURVED and not (b >= 0.0 and c >= 0.0 and 1.0 - b - c >= 0.0):
            x, y, z = target[lane], target[LANES + lane], target[2 * LANES + lane]
            place[lane], _, share[lane], share[LANES + lane] = walk(vertex, facet, place[lane], x, y, z)
            take_corners(vertex, facet, place[lane], corner, lane)


@part
def evaluate(landing):
    """The places on cubics, and the normals there, of all lanes."""
    corner, share, target, normal, limit = landing.corner, landing.share, landing.target, landing.normal, landing.limit
    q, r = COORDINATES * LANES, 2 * COORDINATES * LANES
    for lane in range(LANES):
        b, c = share[lane], share[LANES + lane]
        a = 1.0 - b - c
        nx, ny, nz = corner[3 * LANES + lane], corner[4 * LANES + lane], corner[5 * LANES + lane]
        ux, uy, uz = corner[q + 3 * LANES + lane], corner[q + 4 * LANES + lane], corner[q + 5 * LANES + lane]
        vx, vy, vz = corner[r + 3 * LANES + lane], corner[r + 4 * LANES + lane], corner[r + 5 * LANES + lane]
        target[lane], target[LANES + lane], target[2 * LANES + lane] = on_cubic(
            a, b, c, limit[lane],
            corner[lane], corner[LANES + lane], corner[2 * LANES + lane], nx, ny, nz,
            corner[q + lane], corner[q + LANES + lane], corner[q + 2 * LANES + lane], ux, uy, uz,
            corner[r + lane], corner[r + LANES + lane], corner[r + 2 * LANES + lane], vx, vy, vz,
        )  # fmt: skip
        normal[lane], normal[LANES + lane], normal[2 * LANES + lane] = upright(
            a * nx + b * ux + c * vx, a * ny + b * uy + c * vy, a * nz + b * uz + c * vz
        )


@part
def land(surface, blocks, block, centre, inverse, done, step, landing):
    """Where the nodes that are not done come to lie, and the steps that lead there."""
    target, normal = landing.target, landing.normal
    if begin(surface, blocks, block, centre, inverse, done, step, landing):
        find_facets(surface.vertex, surface.facet, landing)
        evaluate(landing)
    for lane in range(LANES):
        if landing.kind[lane] not in (NONE, CURVED):
            x, y, z = np.float64(step[lane]), np.float64(step[LANES + lane]), np.float64(step[2 * LANES + lane])
            size = 1.0 / inverse[lane] if abs(x) + abs(y) + abs(z) < np.inf else 0.0
            x, y, z = (x, y, z) if size > 0.0 else (0.0, 0.0, 0.0)
            row = np.int64(surface.row[blocks.centre[block * LANES + lane]])
            x, y, z, landing.place[lane], u, v, w = land_on(
                surface,
                row,
                centre[lane] + size * x,
                centre[LANES + lane] + size * y,
                centre[2 * LANES + lane] + size * z,
            )
            target[lane], target[LANES + lane], target[2 * LANES + lane] = x, y, z
            normal[lane], normal[LANES + lane], normal[2 * LANES + lane] = u, v, w
    if surface.single:
        for k in range(3 * LANES):
            target[k] = np.float64(np.float32(target[k]))
    for axis in range(3):
        for lane in range(LANES):
            k = axis * LANES + lane
            step[k] = (target[k] - centre[k]) * inverse[lane]
