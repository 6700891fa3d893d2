"""How good some cells are, and which free nodes they have.

Selection is exact, and does not depend on the order of the cells: all those up to a limit are taken, equal ones too.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import put_weights, shape_of, weights_at_first, weights_in

PLACE = 8  # bits of an id by which it is sorted at a time
DIGITS = 1 << PLACE


@kernel
def shapes(points, simplices, first, last, shape):
    """1/q of the simplices in the blocks first…last of LANES, with the sign of their area, into shape (S,)."""
    triangles, orientation = simplices.rows, simplices.orientation
    edges, row, weight = np.empty(4 * LANES), np.empty(LANES), np.empty(3 * LANES)
    for block in range(first, last):
        start = block * LANES
        count = min(LANES, len(triangles) - start)
        for lane in range(count):
            t = start + lane
            # Unsigned, so that nothing is compared with zero.
            a, b, c = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
            x, y = points[a, 0], points[a, 1]
            edges[lane] = points[b, 0] - x
            edges[LANES + lane] = points[b, 1] - y
            edges[2 * LANES + lane] = points[c, 0] - x
            edges[3 * LANES + lane] = points[c, 1] - y
            put_weights(weights_at_first(simplices.shapes, t, True), weight, lane)
        for lane in range(count, LANES):
            edges[lane] = edges[LANES + lane] = edges[2 * LANES + lane] = edges[3 * LANES + lane] = 0.0
        for lane in range(LANES):
            px, py, qx, qy = edges[lane], edges[LANES + lane], edges[2 * LANES + lane], edges[3 * LANES + lane]
            row[lane] = shape_of(px, py, qx, qy, weights_in(simplices.shapes, weight, lane))
        for lane in range(count):
            shape[start + lane] = orientation[start + lane] * row[lane]


@kernel
def shapes_of(points, simplices, cells, shape):
    """1/q of some of the simplices, into shape (len(cells),)."""
    triangles, orientation = simplices.rows, simplices.orientation
    for k in range(len(cells)):
        t = cells[k]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x, y = points[a, 0], points[a, 1]
        px, py, qx, qy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
        shape[k] = orientation[t] * shape_of(px, py, qx, qy, weights_at_first(simplices.shapes, t, True))


@kernel
def free_nodes(rows, cells, shape, limit, free, memory, seen):
    """The free nodes (int32) of those of the cells whose shape is at most the limit, in the order of their ids.

    shape: (len(cells),). free: (N,) bool. memory: (N,) the id of each node. seen: (N,) bool, all False before and
    after.
    """
    found = np.empty(3 * len(cells), dtype=np.int32)
    count = 0
    for k in range(len(cells)):
        if shape[k] <= limit:
            for m in range(3):
                i = rows[cells[k], m]
                if free[i] and not seen[i]:
                    seen[i] = True
                    found[count] = i
                    count += 1
    for k in range(count):
        seen[found[k]] = False
    nodes = found[:count].copy()
    by_id(nodes, memory)
    return nodes


@part
def by_id(nodes, memory):
    """Puts nodes, each there once, into the order of their ids: whatever is made of them does not depend on places.

    By the digits of the ids, the last one first; the node goes with its id, below it.
    """
    keys, other = np.empty(len(nodes), dtype=np.int64), np.empty(len(nodes), dtype=np.int64)
    at = np.empty(DIGITS, dtype=np.int64)  # by digit, where the next key goes
    largest = 0
    for k in range(len(nodes)):
        largest = max(largest, memory[nodes[k]])
        keys[k] = np.int64(memory[nodes[k]]) << 32 | nodes[k]
    shift = 32
    while largest > 0:
        for digit in range(DIGITS):
            at[digit] = 0
        for k in range(len(nodes)):
            at[keys[k] >> shift & DIGITS - 1] += 1
        end = 0
        for digit in range(DIGITS):
            end, at[digit] = end + at[digit], end
        for k in range(len(nodes)):
            digit = keys[k] >> shift & DIGITS - 1
            other[at[digit]] = keys[k]
            at[digit] += 1
        keys, other = other, keys
        shift += PLACE
        largest >>= PLACE
    for k in range(len(nodes)):
        nodes[k] = keys[k] & 0xFFFFFFFF
