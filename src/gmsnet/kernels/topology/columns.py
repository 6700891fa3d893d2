"""How tetrahedra are stretched around nodes, and columns of nodes that start at a wall.

The sum of e eᵀ over the six edges of a tetrahedron, over its trace, is a third of the identity where it is regular; of
a flat cell its smallest eigenvalue belongs to the direction in which it is thin. Each cell has the trace 1, so that one
sliver weighs no more than any other cell where these moments are averaged over the cells around a node.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], dtype=np.int32)
MOMENTS = 6  # xx, yy, zz, xy, xz, yz


@inlined
def add_edge(moment, x, y, z, weight):
    """weight·e eᵀ."""
    moment[0] += weight * x * x
    moment[1] += weight * y * y
    moment[2] += weight * z * z
    moment[3] += weight * x * y
    moment[4] += weight * x * z
    moment[5] += weight * y * z


@inlined
def determinant(m):
    """Of the matrix of a moment."""
    return m[0] * (m[1] * m[2] - m[5] * m[5]) - m[3] * (m[3] * m[2] - m[5] * m[4]) + m[4] * (m[3] * m[5] - m[1] * m[4])


@kernel
def around_nodes(points, rows, chosen, bound, moments, along, count, thin):
    """Adds up, at chosen nodes (N,) bool, the moments of their cells, of trace 1, into moments (N, 6).

    along: (N, 6), the same of their edges to other chosen nodes alone, each of trace 1 and once for each cell. count:
    (N,) cells; thin: (N,) those of a determinant below the bound. All are zeros before.
    """
    own = np.empty(MOMENTS)
    for t in range(len(rows)):
        if not (chosen[rows[t, 0]] or chosen[rows[t, 1]] or chosen[rows[t, 2]] or chosen[rows[t, 3]]):
            continue
        own[:] = 0.0
        for k in range(6):
            i, j = rows[t, EDGES[k, 0]], rows[t, EDGES[k, 1]]
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            add_edge(own, x, y, z, 1.0)
            square = x * x + y * y + z * z
            if chosen[i] and chosen[j] and square > 0.0:
                add_edge(along[i], x, y, z, 1.0 / square)
                add_edge(along[j], x, y, z, 1.0 / square)
        trace = own[0] + own[1] + own[2]
        if trace > 0.0:
            is_thin = determinant(own) < bound * trace * trace * trace
            for k in range(4):
                i = rows[t, k]
                if chosen[i]:
                    count[i] += 1
                    thin[i] += is_thin
                    for m in range(MOMENTS):
                        moments[i, m] += own[m] / trace


@kernel
def of_stars(points, nodes, start, local, ring_start, ring, moments):
    """The moments of the cells around free nodes, which have a star each, of trace 1, into moments (M, 6), star by
    star."""
    own, corner, number = np.empty(MOMENTS), np.empty((4, 3)), 0
    for v in nodes:
        for row in range(start[v], start[v + 1]):
            own[:] = 0.0
            for k in range(3):
                corner[3, k] = points[v, k]
                for m in range(3):
                    corner[m, k] = points[ring[ring_start[v] + local[row, m]], k]
            for k in range(6):
                a, b = EDGES[k, 0], EDGES[k, 1]
                add_edge(
                    own, corner[b, 0] - corner[a, 0], corner[b, 1] - corner[a, 1], corner[b, 2] - corner[a, 2], 1.0
                )
            trace = own[0] + own[1] + own[2]
            for m in range(MOMENTS):
                moments[number, m] = own[m] / trace if trace > 0.0 else 0.0
            number += 1


@kernel
def next_in_columns(points, rows, front, normal, inner, taken, to, height):
    """The next node of each column: at the end of the edge from its last node that is nearest to its direction.

    front: (N,) int32, the column whose last node a node is, else −1. normal: (C, 3) unit directions, of which either
    sense will do. inner: (N,) bool, which nodes columns may go on to; taken: (N,) bool, which are in one already.
    Writes to (C,) int32, −1 where there is none, and height (C,), the length of that edge; to has −1 before, height
    the cosine that an edge must exceed.
    """
    best = height.copy()
    for t in range(len(rows)):
        for k in range(12):
            edge, back = k >> 1, k & 1
            i, j = rows[t, EDGES[edge, back]], rows[t, EDGES[edge, 1 - back]]
            c = front[i]
            if c < 0 or not inner[j] or taken[j]:
                continue
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            length = np.sqrt(x * x + y * y + z * z)
            cosine = abs(x * normal[c, 0] + y * normal[c, 1] + z * normal[c, 2])
            if cosine > best[c] * length:
                best[c], to[c], height[c] = cosine / length, j, length
