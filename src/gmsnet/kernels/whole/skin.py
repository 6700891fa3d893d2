"""What a surface in space is like at the corners of its facets, all at once: numbers, normals and extents.

Sums are taken corner after corner: first over the corners 0 of all facets, then over the corners 1, and so on.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel


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
def add_normals(points, rows, unit, area, own, total):
    """Adds each facet's normal at its corners, times area/(a²b²) of the edges a and b there, to ``total`` (numbers, 3).

    rows: (F, 3) nodes. unit: (F, 3). area: (F,). own: (F, 3) numbers.
    """
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        for f in range(len(rows)):
            p, q, r = rows[f, k], rows[f, i], rows[f, j]
            x, y, z = points[p, 0], points[p, 1], points[p, 2]
            ax, ay, az = points[q, 0] - x, points[q, 1] - y, points[q, 2] - z
            bx, by, bz = points[r, 0] - x, points[r, 1] - y, points[r, 2] - z
            weight = dot3(ax, ay, az, ax, ay, az) * dot3(bx, by, bz, bx, by, bz)
            share = area[f] / weight if weight > 0.0 else 0.0
            for axis in range(3):
                total[own[f, k], axis] += unit[f, axis] * share


@kernel
def add_curvatures(points, rows, unit, area, beside, at):
    """Raises ``at`` (N,) to how much a surface bends near each node, at most: the inverse of a radius.

    At an edge that is the sine of the angle between its facets over the distance of their middles. rows, unit: (F, 3).
    area: (F,) twice the areas. beside: (F, 3) the facet across each edge, or −1.
    """
    for f in range(len(rows)):
        for k in range(3):
            g = beside[f, k]
            if g < f:
                continue
            i, j, square = rows[f, k], rows[f, (k + 1) % 3], 0.0
            for axis in range(3):
                square += (points[j, axis] - points[i, axis]) ** 2
            cosine = dot3(unit[f, 0], unit[f, 1], unit[f, 2], unit[g, 0], unit[g, 1], unit[g, 2])
            sine = math.sqrt(max(1.0 - cosine * cosine, 0.0)) if cosine > 0.0 else 1.0
            apart = (area[f] + area[g]) / 3.0
            bend = sine * math.sqrt(square) / apart if apart > 0.0 else 0.0
            for corner in range(3):
                at[rows[f, corner]] = max(at[rows[f, corner]], bend)
                at[rows[g, corner]] = max(at[rows[g, corner]], bend)


@kernel
def spread(rows, at, most):
    """Writes the largest of ``at`` (N,) at the corners of facets (F, 3) into ``most`` (F,), and raises ``at`` to it."""
    for f in range(len(rows)):
        most[f] = max(at[rows[f, 0]], max(at[rows[f, 1]], at[rows[f, 2]]))
    for f in range(len(rows)):
        for k in range(3):
            at[rows[f, k]] = max(at[rows[f, k]], most[f])


@kernel
def least_growth(points, rows, span):
    """The least of the spans (F,) of facets (F, 3) over the squares of their longest edges."""
    least = np.inf
    for f in range(len(rows)):
        longest = 0.0
        for k in range(3):
            i, j, square = rows[f, k], rows[f, (k + 1) % 3], 0.0
            for axis in range(3):
                square += (points[j, axis] - points[i, axis]) ** 2
            longest = max(longest, square)
        if span[f] < least * longest:
            least = span[f] / longest
    return least


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
