"""One look at all triangles, for those who search for stretched layers and for refined walls.

The search for layers wants the nodes around which the mean of v (kernels.simplex.stretch) over two rings of cells is
long, as ``to_nodes``, ``to_cells`` and ``to_nodes`` form it. With m the means over the first ring,

    |mean over two rings| ≤ Σ (|m_i| + |m_j| + |m_k|)/3 / n            over the n cells (i, j, k) around the node,

to which only cells with |m| ≥ limit at a corner can bring more than their share of the limit. On a mesh without layers
there are few of these, and next to no node that has enough of them.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel
from gmsnet.kernels.simplex.elementary import logarithm
from gmsnet.kernels.simplex.stretch import ACROSS, ALONG, TINY, stretch

BOUNDARY, INTERFACE = 1, 2  # bits of what is said of a node
NUMBER, EXCESS = 2, 3  # columns of what is kept of a node, beside the sums of v
MANY = 1000  # cells around a node, the sum of which single precision may spoil
ZERO, ONE, THIRD = np.float32(0.0), np.float32(1.0), np.float32(1.0 / 3.0)


@kernel
def first_ring(points, triangles, rim, most, ring):
    """Sums over the cells around each node of planar points, and what else there is to know of all triangles (T, 3).

    rim: (N,) uint8, bits of each node. ring: (N, 4) float32 zeros, to which are added the sums of v, no longer than
    ``most``, over the cells without a node of the rim, and their number. Returns the rows (int32, ascending) of the
    triangles with two nodes of the boundary or more, and the sum of |D|, D twice the area.
    """
    beside = np.empty(len(triangles), dtype=np.int32)
    count, total = 0, 0.0
    work = np.empty(7 * LANES)
    for start in range(0, len(triangles), LANES):
        filled = min(LANES, len(triangles) - start)
        for lane in range(filled):
            t = start + lane
            i, j, k = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
            work[lane] = points[j, 0] - points[i, 0]
            work[LANES + lane] = points[j, 1] - points[i, 1]
            work[2 * LANES + lane] = points[k, 0] - points[i, 0]
            work[3 * LANES + lane] = points[k, 1] - points[i, 1]
        for lane in range(filled):
            along, across, part, square, double = stretch(
                work[lane], work[LANES + lane], work[2 * LANES + lane], work[3 * LANES + lane]
            )
            length = max(min(0.5 * logarithm(np.float32(min(square, 1e30))), most), 0.0)
            share = length / max(part, TINY)
            work[4 * LANES + lane] = share * along
            work[5 * LANES + lane] = share * across
            work[6 * LANES + lane] = abs(double)
        sizes = 0.0  # a sum of few numbers loses less
        for lane in range(filled):
            t = start + lane
            i, j, k = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
            sizes += work[6 * LANES + lane]
            if rim[i] | rim[j] | rim[k]:
                beside[count] = t
                count += (rim[i] & BOUNDARY) + (rim[j] & BOUNDARY) + (rim[k] & BOUNDARY) >= 2
                continue
            along, across = np.float32(work[4 * LANES + lane]), np.float32(work[5 * LANES + lane])
            for node in (i, j, k):
                ring[node, ALONG] += along
                ring[node, ACROSS] += across
                ring[node, NUMBER] += ONE
        total += sizes
    return beside[:count].copy(), total


@kernel
def suspects(triangles, rim, most, fewest, limit, ring):
    """(N,) bool: every node around which the mean over two rings may be longer than ``limit``.

    ring: from ``first_ring``, with which it shares rim and most; it is changed. fewest: where fewer cells count, the
    mean is as if there were so many. This is done in single precision, which errs by less than a hundred-thousandth
    here: the limit should be lower by more than that.
    """
    most, fewest, limit = np.float32(most), np.float32(fewest), np.float32(limit)
    hot = np.empty(len(rim), dtype=np.bool_)
    for i in range(len(rim)):
        if ring[i, NUMBER] > MANY:
            ring[i, ALONG], ring[i, ACROSS], ring[i, EXCESS] = most * ring[i, NUMBER], ZERO, np.inf
        x, y, least = ring[i, ALONG], ring[i, ACROSS], limit * max(ring[i, NUMBER], fewest)
        hot[i] = x * x + y * y >= least * least
    warm = np.empty(len(triangles), dtype=np.int32)
    count = 0
    for t in range(len(triangles)):
        i, j, k = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
        if (hot[i] | hot[j] | hot[k]) and not (rim[i] | rim[j] | rim[k]):
            more = -limit
            for node in (i, j, k):
                x, y = ring[node, ALONG], ring[node, ACROSS]
                more += THIRD * math.sqrt(x * x + y * y) / max(ring[node, NUMBER], fewest)
            for node in (i, j, k):
                ring[node, EXCESS] += more
            warm[count] = t
            count += 1
    found = np.empty(len(rim), dtype=np.bool_)
    for i in range(len(rim)):
        found[i] = False
    for n in range(count):
        for corner in range(3):
            i = triangles[warm[n], corner]
            found[i] = ring[i, EXCESS] >= ZERO
    return found
