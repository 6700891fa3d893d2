"""Which cells are the worst, and which free nodes they have.

Selection is exact, and does not depend on the order of the cells: all those up to a limit are taken, equal ones too.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import LANES, inlined, kernel
from gmsnet.kernels.quality import TINY, TWO_SQRT3

BINS = 4096  # of the histogram of 1/q between −1 and 1


@kernel
def shapes(points, triangles, turn, first, last, shape):
    """1/q of the triangles in the blocks first…last of LANES, with the sign of their area, into shape (T,)."""
    ends, row = np.empty(6 * LANES), np.empty(LANES)
    for block in range(first, last):
        start = block * LANES
        count = min(LANES, len(triangles) - start)
        for lane in range(LANES):
            t = min(start + lane, len(triangles) - 1)
            for k in range(3):
                i = triangles[t, k]
                ends[2 * k * LANES + lane] = points[i, 0]
                ends[(2 * k + 1) * LANES + lane] = points[i, 1]
        for lane in range(LANES):
            ax, ay = ends[lane], ends[LANES + lane]
            bx, by = ends[2 * LANES + lane], ends[3 * LANES + lane]
            row[lane] = shape_of(bx - ax, by - ay, ends[4 * LANES + lane] - ax, ends[5 * LANES + lane] - ay)
        for lane in range(count):
            shape[start + lane] = turn[start + lane] * row[lane]


@inlined
def shape_of(px, py, qx, qy):
    """1/q of the triangle (0, p, q)."""
    rx, ry = qx - px, qy - py
    lengths = (px * px + py * py) + (qx * qx + qy * qy) + (rx * rx + ry * ry)
    return TWO_SQRT3 * (px * qy - py * qx) / max(lengths, TINY)


@kernel
def shapes_of(points, triangles, turn, cells, shape):
    """1/q of some of the triangles, into shape (len(cells),)."""
    for k in range(len(cells)):
        t = cells[k]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x, y = points[a, 0], points[a, 1]
        shape[k] = turn[t] * shape_of(points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y)


@kernel
def bin_of(shape):
    """Where a value stands in the histogram."""
    return max(0, min(BINS - 1, int((shape + 1.0) * (0.5 * BINS))))


@kernel
def worst(shape, wanted):
    """Indices (int32) of the worst cells: all in the lowest bins that hold as many as are wanted."""
    counts = np.zeros(BINS, dtype=np.int64)
    for t in range(len(shape)):
        counts[bin_of(shape[t])] += 1
    total, end = 0, 0
    while total < wanted and end < BINS:
        total += counts[end]
        end += 1
    cells = np.empty(total, dtype=np.int32)
    found = 0
    for t in range(len(shape)):
        if bin_of(shape[t]) < end:
            cells[found] = t
            found += 1
    return cells


@kernel
def free_nodes(triangles, cells, shape, limit, colours, colours_most, seen):
    """The free nodes (int32) of those of the cells whose shape is at most the limit, colour after colour.

    shape: (len(cells),). colours: (N,), −1 where held. seen: (N,) bool, all False before and after.
    """
    found = np.empty(3 * len(cells), dtype=np.int32)
    start = np.zeros(colours_most + 1, dtype=np.int32)
    count = 0
    for k in range(len(cells)):
        if shape[k] <= limit:
            for m in range(3):
                i = triangles[cells[k], m]
                if colours[i] >= 0 and not seen[i]:
                    seen[i] = True
                    found[count] = i
                    count += 1
                    start[colours[i] + 1] += 1
    for c in range(colours_most):
        start[c + 1] += start[c]
    nodes = np.empty(count, dtype=np.int32)
    for k in range(count):
        i = found[k]
        seen[i] = False
        nodes[start[colours[i]]] = i
        start[colours[i]] += 1
    return nodes
