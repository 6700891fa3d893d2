"""Chains of edges, and whether the faces around a node make one fan, open or closed.

Faces are polygons in CSR form, half-edges and their twins are as in kernels.topology.winding.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.topology.layout import span


@part
def other_edge(first, corner, f, g, v):
    """Of the two half-edges of face f that touch node v, the one that is not g; −1 where v is no end of g."""
    low, count = span(first, f)
    for k in range(count):
        if corner[low + k] == v:
            leaving, coming = low + k, low + (k - 1 if k > 0 else count - 1)
            if g == leaving:
                return coming
            if g == coming:
                return leaving
    return -1


@kernel
def fan_sizes(first, corner, face, twin, half_edges, at, sizes):
    """Writes, for both ends of some half-edges, how many faces a walk around the node meets, from edge to edge.

    face: (H,) of each half-edge, or None where all are triangles. at: (N,) how many corners each node has. sizes: (N,)
    int32, −1 before. The faces of a node make one fan, open or closed, where its size equals ``at``. Walks end at
    boundary and non-manifold edges.
    """
    for h in half_edges:
        f = h // 3 if face is None else face[h]
        low, count = span(first, f)
        for v in (corner[h], corner[h + 1 if h + 1 < low + count else low]):
            if sizes[v] >= 0:
                continue
            met, closed = 1, False
            other = other_edge(first, corner, f, h, v)
            for begin in (h, other):
                g = begin
                while not closed and g >= 0 and twin[g] >= 0 and met <= at[v]:
                    g = np.int64(twin[g])
                    here = g // 3 if face is None else face[g]
                    if here == f:
                        closed = True
                    else:
                        met += 1
                        g = np.int64(other_edge(first, corner, here, g, v))
            sizes[v] = met


@kernel
def repeated_corners(first, corner, faces, marks):
    """Marks (N,) bool the nodes that a face of three or four corners names twice."""
    for f in range(faces):
        low, count = span(first, f)
        if count > 4:
            continue
        for j in range(low, low + count):
            for k in range(j + 1, low + count):
                if corner[j] == corner[k]:
                    marks[corner[j]] = True


@kernel
def join(ends, start, at, through, nodes, begin, closed):
    """Joins edges to chains; returns how many there are.

    ends: (E, 2) nodes. start, at: CSR by nodes, the edges at each. through: (K,) bool, the nodes that a chain goes
    through: each has two edges. Chains with ends come first, in the order of the nodes at which they begin, and then
    those without. nodes: (2E,); chain c gets nodes[begin[c] : begin[c + 1]]. One without ends names its first node
    again at the end. begin: (E + 1,). closed: (E,) bool.
    """
    left = np.ones(len(ends), dtype=np.bool_)
    chains, size = 0, 0
    begin[0] = 0
    for inner in (False, True):
        for v in range(len(start) - 1):
            if through[v] != inner:
                continue
            for k in range(start[v], start[v + 1]):
                edge, node = at[k], v
                if not left[edge]:
                    continue
                nodes[size] = v
                size += 1
                while left[edge]:
                    left[edge] = False
                    node = ends[edge, 0] + ends[edge, 1] - node
                    nodes[size] = node
                    size += 1
                    if through[node]:
                        low = start[node]
                        edge = at[low] + at[low + 1] - edge
                closed[chains] = inner
                chains += 1
                begin[chains] = size
    return chains
