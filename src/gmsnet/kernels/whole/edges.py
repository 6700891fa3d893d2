"""What the edges of a mesh are like at its nodes, each edge once however many cells it has."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel


@kernel
def mean_edges(pairs, points, mean):
    """Writes the mean length of the edges at each node into ``mean`` (N,), zeros. pairs: (P, 2) the ends of edges."""
    nodes = len(mean)
    start, other = np.zeros(nodes + 2, dtype=np.int64), np.empty(len(pairs), dtype=np.int32)
    for e in range(len(pairs)):
        start[min(pairs[e, 0], pairs[e, 1]) + 2] += 1
    for i in range(1, nodes + 2):
        start[i] += start[i - 1]
    for e in range(len(pairs)):
        low = min(pairs[e, 0], pairs[e, 1])
        other[start[low + 1]] = max(pairs[e, 0], pairs[e, 1])
        start[low + 1] += 1
    count, mark = np.zeros(nodes, dtype=np.int32), np.full(nodes, -1, dtype=np.int32)
    for i in range(nodes):
        for at in range(start[i], start[i + 1]):
            j = np.uint32(other[at])
            if mark[j] == i:
                continue
            mark[j], square = i, 0.0
            for axis in range(3):
                step = points[j, axis] - points[i, axis]
                square += step * step
            length = math.sqrt(square)
            mean[i] += length
            mean[j] += length
            count[i] += 1
            count[j] += 1
    for i in range(nodes):
        mean[i] /= max(count[i], 1)
