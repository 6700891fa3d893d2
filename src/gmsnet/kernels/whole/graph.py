"""The Laplacian of a mesh: what couples nodes that move together.

With the spokes a and b of a corner simplex, D = a × b and L = w_a |a|² + w_b |b|² + w_o |b − a|², q = κ L/(2D) is a
quadratic form of each coordinate alone, over D. Where D is taken as given, the Hessian of Σq is one Laplacian for x
and for y, with the weight κ w/D of each edge, the same for all three of a triangle. Near the minimum on a mesh of good
cells it is the Hessian but for what depends on the boundary alone.

Rows are the nodes that move; what leads to others counts on the diagonal. In CSR form, without the diagonal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel


class Matrix(NamedTuple):
    """A symmetric matrix with the given diagonal (n,) and −off where a row (start, column) has an entry."""

    start: NDArray[np.int64]
    column: NDArray[np.int32]
    off: NDArray[np.float64]
    diagonal: NDArray[np.float64]


@inlined
def edge(cells, table, t, e):
    """The nodes of edge e of simplex t, and its weight: between the corners 0 and 1, 0 and 2, 1 and 2."""
    weight = 1.0
    if table is not None:
        weight = table[t, e]
    return cells[t, 1 if e == 2 else 0], cells[t, 1 if e == 0 else 2], weight


@kernel
def neighbours(cells, table, number, count):
    """start (count + 1,) and column of the graph of the nodes that move, which edges of some weight join.

    cells: (S, 3). table: (S, 3) weights, None where all are 1. number: (N,) the row of each node, −1 if it stays.
    """
    room = np.zeros(count + 1, dtype=np.int64)
    for t in range(len(cells)):
        for e in range(3):
            a, b, weight = edge(cells, table, t, e)
            if weight > 0.0 and number[a] >= 0 and number[b] >= 0:
                room[number[a] + 1] += 1
                room[number[b] + 1] += 1
    for i in range(count):
        room[i + 1] += room[i]
    end, column = room[:-1].copy(), np.empty(room[count], dtype=np.int32)
    for t in range(len(cells)):
        for e in range(3):
            a, b, weight = edge(cells, table, t, e)
            i, j = number[a], number[b]
            if weight > 0.0 and i >= 0 and j >= 0:
                enter(room, end, column, i, j)
                enter(room, end, column, j, i)
    start, filled = np.zeros(count + 1, dtype=np.int64), 0
    for i in range(count):
        for k in range(room[i], end[i]):
            column[filled] = column[k]
            filled += 1
        start[i + 1] = filled
    return start, column[:filled].copy()


@inlined
def enter(room, end, column, i, j):
    """Adds j to row i, if it is not there yet."""
    k = room[i]
    while k < end[i] and column[k] != j:
        k += 1
    if k == end[i]:
        column[k] = j
        end[i] += 1


@kernel
def assemble(points, cells, table, number, even, matrix):
    """Fills in the Laplacian for the points (N, 2) as they are. even: all D are taken as 1, which no cell need be."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    off[:] = 0.0
    diagonal[:] = 0.0
    for t in range(len(cells)):
        share = 1.0
        if not even:
            i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
            ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
            share = 1.0 / (ax * by - ay * bx)
        for e in range(3):
            a, b, weight = edge(cells, table, t, e)
            if not weight > 0.0:
                continue
            row, other = number[a], number[b]
            if row >= 0:
                diagonal[row] += share * weight
            if other >= 0:
                diagonal[other] += share * weight
            if row >= 0 and other >= 0:
                add(start, column, off, row, other, share * weight)
                add(start, column, off, other, row, share * weight)


@inlined
def add(start, column, off, row, other, weight):
    """Adds to an entry that exists."""
    k = start[row]
    while column[k] != other:
        k += 1
    off[k] += weight


@kernel
def pull_of_neighbours(points, cells, table, number, out):
    """(n, 2) the sum over the edges of each moving node of weight times the way to the other end."""
    out[:] = 0.0
    for t in range(len(cells)):
        for e in range(3):
            a, b, weight = edge(cells, table, t, e)
            dx, dy = weight * (points[b, 0] - points[a, 0]), weight * (points[b, 1] - points[a, 1])
            row, other = number[a], number[b]
            if row >= 0:
                out[row, 0] += dx
                out[row, 1] += dy
            if other >= 0:
                out[other, 0] -= dx
                out[other, 1] -= dy
