"""Patches of a mesh: the free nodes around some triangles, and the triangles around these."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.jit.prefetch import prefetch


@kernel
def around(cells, rings, free, start, ring):
    """(N,) bool: the free corners of the cells (T, 3 or 4), and ``rings − 1`` rings of free nodes around.

    free: (N,) bool. start, ring: the rings of all nodes, in CSR form.
    """
    active = np.zeros(len(free), dtype=np.bool_)
    nodes = np.empty(len(free), dtype=np.int32)
    count = 0
    for t in range(len(cells)):
        for corner in range(cells.shape[1]):
            i = cells[t, corner]
            if free[i] and not active[i]:
                active[i] = True
                nodes[count] = i
                count += 1
    first = 0
    for _ in range(rings - 1):
        last = count
        for k in range(first, last):
            i = nodes[k]
            for place in range(start[i], start[i + 1]):
                j = ring[place]
                if free[j] and not active[j]:
                    active[j] = True
                    nodes[count] = j
                    count += 1
        first = last
    return active


@kernel
def triangles_around(nodes, active, start, ring):
    """(T, 3) the triangles that have one of the nodes, each once, wound as the rings: with the minimum such node first.

    nodes: (K,) ascending. active: (N,) bool, whether a node is one of them. start, ring: their rings, in CSR form.
    """
    most = 0
    for i in nodes:
        prefetch(ring, np.uint64(start[i]))
        most += start[i + 1] - start[i]
    triangles = np.empty((most + 1, 3), dtype=np.int32)  # what is written last may not count
    count = 0
    for i in nodes:
        before = ring[start[i + 1] - 1]
        earlier = active[before] & (before < i)  # its own turn has come
        for place in range(start[i], start[i + 1]):
            after = ring[place]
            also = active[after] & (after < i)
            triangles[count, 0], triangles[count, 1], triangles[count, 2] = i, before, after
            count += not (earlier | also)
            before, earlier = after, also
    return triangles[:count].copy()
