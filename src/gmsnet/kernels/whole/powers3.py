"""Powers of q^(3/2) over all corner simplices in space, as a function of the places of all nodes at once."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.simplex.mean_ratio3 import WEIGHTS3, measured_by
from gmsnet.kernels.simplex.orientation3 import spokes_of


@kernel
def largest(points, rows, orientation, shapes):
    """The largest S^(3/2)/D, that of the least η; +∞ where a simplex has no volume."""
    most = 0.0
    for t in range(len(rows)):
        ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
        w = WEIGHTS3[0 if shapes is None else shapes[t]]
        double, lengths, _, _, _, _, _, _ = measured_by(
            ax, ay, az, bx, by, bz, cx, cy, cz, w[0], w[1], w[2], w[3], w[4], w[5]
        )
        double *= orientation[t]
        if not double > 0.0:
            return np.inf
        most = max(most, lengths * math.sqrt(lengths) / double)
    return most


@kernel
def powered(points, rows, orientation, shapes, top, doublings, gradient, weights):
    """Σ(r/top)^p over simplices, r = S^(3/2)/D and p = 2^doublings, and its gradient (N, 3).

    weights: (S,) how S counts where D is held fixed: half the second derivative along an edge of weight 1. +∞ where a
    simplex has no volume; what is written is of no use then.
    """
    total, p = 0.0, 2.0**doublings
    gradient[:] = 0.0
    for t in range(len(rows)):
        ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
        w = WEIGHTS3[0 if shapes is None else shapes[t]]
        double, lengths, _, _, _, _, _, _ = measured_by(
            ax, ay, az, bx, by, bz, cx, cy, cz, w[0], w[1], w[2], w[3], w[4], w[5]
        )
        if not double * orientation[t] > 0.0:
            return np.inf
        f = lengths * math.sqrt(lengths) / (double * orientation[t] * top)
        for _ in range(doublings):
            f *= f
        total += f
        of_s, of_d = 3.0 * p * f / lengths, -p * f / double
        weights[t] = of_s
        ends = (
            (w[0] * ax + w[3] * (ax - bx) + w[5] * (ax - cx), by * cz - bz * cy),
            (w[0] * ay + w[3] * (ay - by) + w[5] * (ay - cy), bz * cx - bx * cz),
            (w[0] * az + w[3] * (az - bz) + w[5] * (az - cz), bx * cy - by * cx),
            (w[1] * bx + w[3] * (bx - ax) + w[4] * (bx - cx), cy * az - cz * ay),
            (w[1] * by + w[3] * (by - ay) + w[4] * (by - cy), cz * ax - cx * az),
            (w[1] * bz + w[3] * (bz - az) + w[4] * (bz - cz), cx * ay - cy * ax),
            (w[2] * cx + w[5] * (cx - ax) + w[4] * (cx - bx), ay * bz - az * by),
            (w[2] * cy + w[5] * (cy - ay) + w[4] * (cy - by), az * bx - ax * bz),
            (w[2] * cz + w[5] * (cz - az) + w[4] * (cz - bz), ax * by - ay * bx),
        )
        for k in range(9):
            slope = of_s * ends[k][0] + of_d * ends[k][1]
            gradient[rows[t, 1 + k // 3], k % 3] += slope
            gradient[rows[t, 0], k % 3] -= slope
    return total
