"""Rounds over the free nodes of the cells that miss a target, and of those alone: see methods/below.py."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.missing import ALL, missing
from gmsnet.kernels.methods.ranking import by_id
from gmsnet.kernels.methods.worst_first_cycles import visit
from gmsnet.kernels.simplex.mean_ratio2 import put_weights, weights_at_first, weights_in
from gmsnet.kernels.star.pattern import count_of, pair_of, pattern_at, weights_of


@kernel
def missed(points, simplices, quality, tangent):
    """The rows (int32) of the corner simplices that miss the target."""
    triangles, orientation = simplices.rows, simplices.orientation
    rows = np.empty(len(triangles) + LANES, dtype=np.int32)
    edges, short, weight = np.empty(4 * LANES), np.empty(LANES, dtype=np.int64), np.empty(3 * LANES)
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
            put_weights(weights_at_first(simplices.shapes, t, True), weight, lane)
        for lane in range(LANES):
            px, py, qx, qy = edges[lane], edges[LANES + lane], edges[2 * LANES + lane], edges[3 * LANES + lane]
            short[lane] = missing(px, py, qx, qy, quality, tangent, weights_in(simplices.shapes, weight, lane))
        for lane in range(count):
            rows[found] = start + lane
            found += short[lane]
    return rows[:found].copy()


@kernel
def rounds(points, nodes, stars, free, memory, guard, plan, most, scale, target, everywhere, tally):
    """Visits the nodes around which a cell misses the target, then those that still have one; returns the latter.

    nodes: (K,) int32, free ones in the order of their ids; everywhere: all of them are visited in the first round.
    stars: of all nodes (kernels.star.pattern). free: (N,) bool. memory: (N,) ids. plan: (R, 2) of log₂ of the power p
    and visits, for each round. most: visits; a round that would begin after so many is not made. scale: the 1/q from
    which powers are formed. target: what ``missing`` asks for. tally: (3,), added to.
    """
    mark, tried = np.zeros(len(points), dtype=np.bool_), np.zeros(len(points), dtype=np.bool_)
    visits, unit = 0, scale / math.sqrt(3.0)
    for r in range(len(plan)):
        if not len(nodes) or visits > most:
            break
        goal = ALL if everywhere and r == 0 else target
        power, sweeps = plan[r, 0], plan[r, 1]
        visit(points, nodes, stars, guard, power, sweeps, unit, goal, mark, tried, tally)
        visits += sweeps * len(nodes)
        nodes = still_missing(points, nodes, stars, free, target[0], target[1], tried, mark)
        by_id(nodes, memory)
    return nodes


@part
def still_missing(points, nodes, stars, free, quality, tangent, tried, seen):
    """The free nodes (int32) of the simplices around these nodes that miss the target, as they come.

    tried: (N,) bool, which of the nodes have been, for a cell around them missed it; only beside those can one miss it
    now. All False after it. seen: (N,) bool, all False before and after.
    """
    start, around = stars.start, stars.around
    most = 0
    for i in nodes:
        most += tried[i] * (start[i + 1] - start[i] + 1)
    found = np.empty(min(most, len(points)), dtype=np.int32)
    count = 0
    for i in nodes:
        if not tried[i]:
            continue
        tried[i] = False
        x, y, low, n = points[i, 0], points[i, 1], start[i], start[i + 1] - start[i]
        pattern = pattern_at(stars.patterns, stars.pattern, i)
        for k in range(count_of(pattern, n)):
            a, b = pair_of(pattern, n, k)
            before, after = around[low + a], around[low + b]
            px, py, qx, qy = points[before, 0] - x, points[before, 1] - y, points[after, 0] - x, points[after, 1] - y
            if missing(px, py, qx, qy, quality, tangent, weights_of(pattern, k, np.float64)):
                for corner in (i, before, after):
                    if free[corner] and not seen[corner]:
                        seen[corner] = True
                        found[count] = corner
                        count += 1
    for k in range(count):
        seen[found[k]] = False
    return found[:count].copy()
