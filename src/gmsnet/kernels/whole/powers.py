"""Powers of q over all corner simplices: with weights of their own, Σq has the gradient of Σ(q/top)^p at a place."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.untangle.barrier import KAPPA, half_of, row_weights


@kernel
def shapes(points, cells, table):
    """The least and the mean of 1/q over simplices of positive area."""
    least, total = np.inf, 0.0
    for t in range(len(cells)):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        shape = (ax * by - ay * bx) / (KAPPA * half_of(ax, ay, bx, by, row_weights(table, t)))
        least = min(least, shape)
        total += shape
    return least, total / len(cells)


@kernel
def shape_of_each(points, cells, table, out):
    """1/q of each simplex into out (S,), negative where its area is."""
    for t in range(len(cells)):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        out[t] = (ax * by - ay * bx) / (KAPPA * half_of(ax, ay, bx, by, row_weights(table, t)))


@kernel
def weighted(points, cells, table, top, doublings, out):
    """Σ(q/top)^p, p = 2^doublings, and the weights (S, 3) of which Σq, held fixed, has here the same gradient.

    cells, table: see ``barrier.energy``. More than any mesh has where a simplex has no area; the weights are then of no
    use.
    """
    total, p = 0.0, 2.0**doublings
    for t in range(len(cells)):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = KAPPA * half_of(ax, ay, bx, by, row_weights(table, t)) / d
        power = q / top
        for _ in range(doublings):
            power *= power
        total += power
        share = p * power / q
        for e in range(3):
            weight = share
            if table is not None:
                weight *= table[t, e]
            out[t, e] = weight
    return total
