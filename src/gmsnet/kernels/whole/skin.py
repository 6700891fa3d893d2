"""What a surface in space is like at the corners of its facets, all at once: numbers, normals, handles and extents.

Sums are taken corner after corner: first over the corners 0 of all facets, then over the corners 1, and so on.
"""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, kernel

EDGE_CONTROLS = 6  # of a cubic over a facet; the one in its middle follows


@kernel
def number_corners(rows, patch, nodes, of_number, following, own):
    """Writes one number for each of the nodes in each of its patches into ``own``; returns how many numbers there are.

    rows, own: (F, 3). patch: (F,). of_number, following: (3F + nodes,) of −1: the patch of each number, and the next
    number of the same node. The first one of a node is its own.
    """
    count = nodes
    for f in range(len(rows)):
        for k in range(3):
            at = rows[f, k]
            if of_number[at] < 0:
                of_number[at] = patch[f]
            while of_number[at] != patch[f]:
                if following[at] < 0:
                    following[at], of_number[count] = count, patch[f]
                    count += 1
                at = following[at]
            own[f, k] = at
    return count


@inlined
def dot3(ax, ay, az, bx, by, bz):
    """As constraints.smooth_patches.dot."""
    return (ax * bx + ay * by) + az * bz


@kernel
def add_normals(corner, unit, area, own, total):
    """Adds each facet's normal at its corners, times area/(a²b²) of the edges a and b there, to ``total`` (numbers, 3).

    corner: (F, 3, 3). unit: (F, 3). area: (F,). own: (F, 3) numbers.
    """
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        for f in range(len(corner)):
            x, y, z = corner[f, k, 0], corner[f, k, 1], corner[f, k, 2]
            ax, ay, az = corner[f, i, 0] - x, corner[f, i, 1] - y, corner[f, i, 2] - z
            bx, by, bz = corner[f, j, 0] - x, corner[f, j, 1] - y, corner[f, j, 2] - z
            weight = dot3(ax, ay, az, ax, ay, az) * dot3(bx, by, bz, bx, by, bz)
            share = area[f] / weight if weight > 0.0 else 0.0
            for axis in range(3):
                total[own[f, k], axis] += unit[f, axis] * share


@inlined
def handle(ex, ey, ez, nx, ny, nz):
    """The handle of a cubic over an edge at its end with the unit normal n: that of an arc."""
    across = dot3(ex, ey, ez, nx, ny, nz)
    tx, ty, tz = ex - across * nx, ey - across * ny, ez - across * nz
    length, size = math.sqrt(dot3(ex, ey, ez, ex, ey, ez)), math.sqrt(dot3(tx, ty, tz, tx, ty, tz))
    if size > 0.0:
        tx, ty, tz = tx / size, ty / size, tz / size
    else:
        tx = ty = tz = 0.0
    cosine = dot3(tx, ty, tz, ex, ey, ez) / length if length > 0.0 else 1.0
    reach = 2.0 * length / (3.0 * (1.0 + max(cosine, 0.0)))
    return tx * reach, ty * reach, tz * reach


@kernel
def write_controls(corner, normal, made):
    """Writes the inner control points (F, 7, 3) of cubics over facets: corner, normal (F, 3, 3)."""
    for f in range(len(corner)):
        for k in range(3):
            j = (k + 1) % 3
            ex, ey, ez = (
                corner[f, j, 0] - corner[f, k, 0], corner[f, j, 1] - corner[f, k, 1], corner[f, j, 2] - corner[f, k, 2]
            )  # fmt: skip
            hx, hy, hz = handle(ex, ey, ez, normal[f, k, 0], normal[f, k, 1], normal[f, k, 2])
            gx, gy, gz = handle(ex, ey, ez, normal[f, j, 0], normal[f, j, 1], normal[f, j, 2])
            made[f, 2 * k, 0], made[f, 2 * k + 1, 0] = corner[f, k, 0] + hx, corner[f, j, 0] - gx
            made[f, 2 * k, 1], made[f, 2 * k + 1, 1] = corner[f, k, 1] + hy, corner[f, j, 1] - gy
            made[f, 2 * k, 2], made[f, 2 * k + 1, 2] = corner[f, k, 2] + hz, corner[f, j, 2] - gz
        for axis in range(3):
            edges = made[f, 0, axis]
            for k in range(1, EDGE_CONTROLS):
                edges += made[f, k, axis]
            edges /= EDGE_CONTROLS
            middle = ((corner[f, 0, axis] + corner[f, 1, axis]) + corner[f, 2, axis]) / 3.0
            made[f, EDGE_CONTROLS, axis] = edges + 0.5 * (edges - middle)


@kernel
def bound_patches(rows, patch, points, low, high, origin):
    """Writes the extents (P, 3) of patches, and a node of each. rows: (F, 3). patch: (F,). low, high: ±infinity."""
    for f in range(len(rows)):
        p = patch[f]
        for k in range(3):
            for axis in range(3):
                value = points[rows[f, k], axis]
                low[p, axis], high[p, axis] = min(low[p, axis], value), max(high[p, axis], value)
                origin[p, axis] = value


@kernel
def leave_planes(rows, patch, points, origin, normal, away):
    """Writes how far nodes of patches are at most from planes: origin, normal (P, 3). away: (P,) zeros."""
    for f in range(len(rows)):
        p = patch[f]
        nx, ny, nz = normal[p, 0], normal[p, 1], normal[p, 2]
        for k in range(3):
            i = rows[f, k]
            x, y, z = points[i, 0] - origin[p, 0], points[i, 1] - origin[p, 1], points[i, 2] - origin[p, 2]
            away[p] = max(away[p], abs(dot3(x, y, z, nx, ny, nz)))
