"""Rounds over the free nodes of the cells that miss a target, and of those alone: see methods/below.py."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.missing import ALL, missing
from gmsnet.kernels.methods.ranking import by_id
from gmsnet.kernels.methods.worst_first_cycles import visit


@kernel
def missed(points, triangles, orientation, quality, tangent):
    """The rows (int32) of the triangles that miss the target."""
    rows = np.empty(len(triangles) + LANES, dtype=np.int32)
    edges, short = np.empty(4 * LANES), np.empty(LANES, dtype=np.int64)
    found = 0
    for start in range(0, len(triangles), LANES):
        count = min(LANES, len(triangles) - start)
        for lane in range(count):
            t = start + lane
            # Unsigned, so that nothing is compared with zero.
            a, b, c = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
            x, y, sign = points[a, 0], points[a, 1], np.float64(orientation[t])
            edges[lane] = sign * (points[b, 0] - x)  # a triangle to be read backwards: its mirror image
            edges[LANES + lane] = points[b, 1] - y
            edges[2 * LANES + lane] = sign * (points[c, 0] - x)
            edges[3 * LANES + lane] = points[c, 1] - y
        for lane in range(LANES):
            px, py, qx, qy = edges[lane], edges[LANES + lane], edges[2 * LANES + lane], edges[3 * LANES + lane]
            short[lane] = missing(px, py, qx, qy, quality, tangent)
        for lane in range(count):
            rows[found] = start + lane
            found += short[lane]
    return rows[:found].copy()


@kernel
def rounds(points, nodes, start, around, free, memory, guard, plan, most, scale, target, everywhere, tally):
    """Visits the nodes around which a cell misses the target, then those that still have one; returns the latter.

    nodes: (K,) int32, free ones in the order of their ids; everywhere: all of them are visited in the first round.
    start, around: the rings of all nodes, in CSR form. free: (N,) bool. memory: (N,) ids. plan: (R, 2) of log₂ of the
    power p and visits, for each round. maximum: visits; a round that would begin after so many is not made. scale: the
    1/q from which powers are formed. target: what ``missing`` asks for. tally: (3,), added to.
    """
    mark, tried = np.zeros(len(points), dtype=np.bool_), np.zeros(len(points), dtype=np.bool_)
    visits, unit = 0, scale / math.sqrt(3.0)
    for r in range(len(plan)):
        if not len(nodes) or visits > most:
            break
        goal = ALL if everywhere and r == 0 else target
        power, sweeps = plan[r, 0], plan[r, 1]
        visit(points, nodes, start, around, guard, power, sweeps, unit, goal, mark, tried, tally)
        visits += sweeps * len(nodes)
        nodes = still_missing(points, nodes, start, around, free, target[0], target[1], tried, mark)
        by_id(nodes, memory)
    return nodes


@part
def still_missing(points, nodes, start, around, free, quality, tangent, tried, seen):
    """The free nodes (int32) of the cells around these nodes that miss the target, as they come.

    tried: (N,) bool, which of the nodes have been, for a cell around them missed it; only beside those can one miss it
    now. All False after it. seen: (N,) bool, all False before and after.
    """
    most = 0
    for i in nodes:
        most += tried[i] * (start[i + 1] - start[i] + 1)
    found = np.empty(min(most, len(points)), dtype=np.int32)
    count = 0
    for i in nodes:
        if not tried[i]:
            continue
        tried[i] = False
        x, y = points[i, 0], points[i, 1]
        before = around[start[i + 1] - 1]
        px, py = points[before, 0] - x, points[before, 1] - y
        for k in range(start[i], start[i + 1]):
            after = around[k]
            qx, qy = points[after, 0] - x, points[after, 1] - y
            if missing(px, py, qx, qy, quality, tangent):
                for corner in (i, before, after):
                    if free[corner] and not seen[corner]:
                        seen[corner] = True
                        found[count] = corner
                        count += 1
            before, px, py = after, qx, qy
    for k in range(count):
        seen[found[k]] = False
    return found[:count].copy()
