"""What hangs together, and what is near."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel


@kernel
def pieces(cells, chosen):
    """(N,) int32: the minimum of the nodes that each one hangs together with, over edges between chosen nodes.

    cells: (k, m), polygons of m nodes, or edges (m = 2). chosen: (N,) bool.
    """
    least = np.empty(
        len(chosen), dtype=np.int32
    )  # of the same piece and not larger; the node itself at a piece's least
    for i in range(len(chosen)):
        least[i] = i
    corners = cells.shape[1]
    for cell in range(len(cells)):
        for corner in range(corners):
            a, b = cells[cell, corner - 1], cells[cell, corner]
            if not (chosen[a] and chosen[b]):
                continue
            while least[a] != a:
                least[a] = least[least[a]]
                a = least[a]
            while least[b] != b:
                least[b] = least[least[b]]
                b = least[b]
            if a < b:
                least[b] = a
            else:
                least[a] = b
    for i in range(len(chosen)):
        least[i] = least[least[i]]
    return least


@kernel
def surroundings(triangles, chosen):
    """The triangles within two rings of the chosen nodes (N,) bool, as a mesh of its own.

    Returns their rows (int32, ascending), their corners (rows, 3) in a numbering of their nodes alone, and the nodes
    (int32, ascending) by these numbers. All triangles around a chosen node and its neighbours are there.
    """
    nodes = len(chosen)
    number = np.zeros(nodes, dtype=np.int32)  # 1: in the first ring; later 1 + the number of a node
    rows = np.empty(len(triangles), dtype=np.int32)
    for t in range(len(triangles)):
        i, j, k = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
        if chosen[i] | chosen[j] | chosen[k]:
            number[i] = number[j] = number[k] = 1
    count = 0
    for t in range(len(triangles)):
        i, j, k = np.uint32(triangles[t, 0]), np.uint32(triangles[t, 1]), np.uint32(triangles[t, 2])
        rows[count] = t
        count += (number[i] | number[j] | number[k]) != 0
    rows = rows[:count].copy()
    for n in range(count):
        for corner in range(3):
            number[triangles[rows[n], corner]] = 1
    own = np.empty(min(nodes, 3 * count), dtype=np.int32)
    used = 0
    for i in range(nodes):
        if number[i]:
            own[used] = i
            used += 1
            number[i] = used
    corners = np.empty((count, 3), dtype=np.int32)
    for n in range(count):
        for corner in range(3):
            corners[n, corner] = number[triangles[rows[n], corner]] - 1
    return rows, corners, own[:used].copy()
