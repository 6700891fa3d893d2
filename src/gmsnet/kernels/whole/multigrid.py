"""Multigrid by aggregates for a Laplacian with positive weights (Notay: An aggregation-based algebraic multigrid
method, Electronic Transactions on Numerical Analysis 37, 2010).

Aggregates are pairs of pairs along the heaviest edges. Each level is smoothed by a Gauss–Seidel sweep forth before, and
one back after the correction. Right-hand sides are (n, 2). Sums are formed in one order, so that the same bits come out
everywhere.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.whole.graph import Matrix

STRONG = 0.25  # of the heaviest edge of a row: a pair is joined by at least that


@part
def pairs(matrix, aggregate):
    """Joins rows in pairs by their heaviest edges: the number of the pair of each (n,); returns how many there are.

    A row whose heavy neighbours all have partners joins the heaviest one's pair.
    """
    start, column, off = matrix.start, matrix.column, matrix.off
    for i in range(len(aggregate)):
        aggregate[i] = -1
    count = 0
    for i in range(len(aggregate)):
        if aggregate[i] >= 0:
            continue
        most, of_free, heaviest, partner = 0.0, 0.0, -1, -1
        for k in range(start[i], start[i + 1]):
            j, weight = column[k], off[k]
            if weight > most:
                most, heaviest = weight, j
            if aggregate[j] < 0 and weight > of_free:
                of_free, partner = weight, j
        if partner >= 0 and of_free >= STRONG * most:
            aggregate[i] = aggregate[partner] = count
            count += 1
        elif heaviest >= 0 and aggregate[heaviest] >= 0:
            aggregate[i] = aggregate[heaviest]
        else:
            aggregate[i] = count
            count += 1
    return count


@part
def summed(matrix, aggregate, count):
    """The matrix of the aggregates, each entry the sum of those between their members."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    n = len(aggregate)
    first, place = np.zeros(count + 1, dtype=np.int64), np.empty(n, dtype=np.int64)
    for i in range(n):
        first[aggregate[i] + 1] += 1
    for a in range(count):
        first[a + 1] += first[a]
    end = first[:-1].copy()
    for i in range(n):
        place[end[aggregate[i]]] = i
        end[aggregate[i]] += 1
    rows, to, sums = np.zeros(count + 1, dtype=np.int64), np.empty(len(column), dtype=np.int32), np.empty(len(column))
    own, where, filled = np.zeros(count), np.full(count, -1), 0
    for a in range(count):
        low = filled
        for p in range(first[a], first[a + 1]):
            i = place[p]
            own[a] += diagonal[i]
            for k in range(start[i], start[i + 1]):
                b, weight = aggregate[column[k]], off[k]
                if b == a:
                    own[a] -= weight
                elif where[b] < low:
                    where[b] = filled
                    to[filled], sums[filled] = b, weight
                    filled += 1
                else:
                    sums[where[b]] += weight
        rows[a + 1] = filled
    return Matrix(rows, to[:filled].copy(), sums[:filled].copy(), own)


@kernel
def coarser(matrix):
    """The aggregate of each row (n,), and the matrix of the aggregates."""
    aggregate = np.empty(len(matrix.diagonal), dtype=np.int32)
    count = pairs(matrix, aggregate)
    half = summed(matrix, aggregate, count)
    of_pairs = np.empty(count, dtype=np.int32)
    count = pairs(half, of_pairs)
    for i in range(len(aggregate)):
        aggregate[i] = of_pairs[aggregate[i]]
    return aggregate, summed(half, of_pairs, count)


@inlined
def row_sum(start, column, off, x, i, sx, sy):
    """Adds what the neighbours of a row contribute."""
    for k in range(start[i], start[i + 1]):
        j, weight = column[k], off[k]
        sx += weight * x[j, 0]
        sy += weight * x[j, 1]
    return sx, sy


@kernel
def forth(matrix, b, x):
    """A Gauss–Seidel sweep from x = 0, which is written."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    x[:] = 0.0
    for i in range(len(b)):
        sx, sy = row_sum(start, column, off, x, i, b[i, 0], b[i, 1])
        x[i, 0], x[i, 1] = sx / diagonal[i], sy / diagonal[i]


@kernel
def back(matrix, aggregate, correction, b, x):
    """Adds the correction of each row's aggregate, and makes a Gauss–Seidel sweep from the last row to the first."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    for i in range(len(aggregate)):
        x[i, 0] += correction[aggregate[i], 0]
        x[i, 1] += correction[aggregate[i], 1]
    for i in range(len(b) - 1, -1, -1):
        sx, sy = row_sum(start, column, off, x, i, b[i, 0], b[i, 1])
        x[i, 0], x[i, 1] = sx / diagonal[i], sy / diagonal[i]


@kernel
def remainder(matrix, aggregate, b, x, out):
    """The residual b − Ax, summed over each aggregate."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    out[:] = 0.0
    for i in range(len(b)):
        d = diagonal[i]
        sx, sy = row_sum(start, column, off, x, i, b[i, 0] - d * x[i, 0], b[i, 1] - d * x[i, 1])
        out[aggregate[i], 0] += sx
        out[aggregate[i], 1] += sy


@kernel
def settled(matrix, sweeps, b, x):
    """Symmetric Gauss–Seidel sweeps from x = 0: all that the coarsest level needs."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    x[:] = 0.0
    for _ in range(sweeps):
        for i in range(len(b)):
            sx, sy = row_sum(start, column, off, x, i, b[i, 0], b[i, 1])
            x[i, 0], x[i, 1] = sx / diagonal[i], sy / diagonal[i]
        for i in range(len(b) - 1, -1, -1):
            sx, sy = row_sum(start, column, off, x, i, b[i, 0], b[i, 1])
            x[i, 0], x[i, 1] = sx / diagonal[i], sy / diagonal[i]


@kernel
def times(matrix, x, out):
    """Ax."""
    start, column, off, diagonal = matrix.start, matrix.column, matrix.off, matrix.diagonal
    for i in range(len(x)):
        d = diagonal[i]
        sx, sy = row_sum(start, column, off, x, i, -d * x[i, 0], -d * x[i, 1])
        out[i, 0], out[i, 1] = -sx, -sy


@kernel
def product(a, b):
    """The scalar product of two arrays (n, 2) or (n, 3)."""
    total, in_space = 0.0, a.shape[1] == 3
    for i in range(len(a)):
        value = a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1]
        if in_space:
            value += a[i, 2] * b[i, 2]
        total += value
    return total
