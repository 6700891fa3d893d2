"""The exact sign of a triangle's area, where the error bound of kernels.simplex.predicates leaves a doubt.

D = a_x b_y − a_x c_y − c_x b_y − a_y b_x + a_y c_x + c_y b_x. Each product is the sum of two floats (Dekker 1971), and
the twelve are added up without an error to floats that do not overlap, whose sum has the sign of the largest of them
(Shewchuk 1997, theorem 10, Grow-Expansion).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part

SPLITTER = 2.0**27 + 1.0
LEAST, MOST = 2.0**-400, 2.0**400  # sizes between which no product loses digits, nor its halves
TERMS = 12


@inlined
def halves(x):
    """The upper and the lower 26 bits of a float."""
    c = SPLITTER * x
    high = c - (c - x)
    return high, x - high


@part
def product(x, y):
    """x·y as a float and what rounding it has taken away."""
    p = x * y
    xh, xl = halves(x)
    yh, yl = halves(y)
    return p, xl * yl - (((p - xh * yh) - xl * yh) - xh * yl)


@part
def sign_of_sum(terms, sums):
    """The sign of the exact sum of the terms (TERMS,). sums: (TERMS,) to work in."""
    for k in range(len(terms)):
        rest = terms[k]
        for i in range(k):
            total = rest + sums[i]
            back = total - rest
            sums[i] = (rest - (total - back)) + (sums[i] - back)
            rest = total
        sums[k] = rest
    for k in range(len(terms) - 1, -1, -1):
        if sums[k] != 0.0:
            return 1 if sums[k] > 0.0 else -1
    return 0


@kernel
def exact(points, triangles, rows, orientation, out):
    """Writes orientation × the exact sign of the area of some triangles; returns how many are not told, at the front
    of rows.

    points: (N, 2) float64. rows: int64, of triangles (T, 3), orientation (T,) ±1 and out (T,) int8. Where a coordinate
    is too small or too large for products without rounding, nothing is written.
    """
    terms, sums, unknown = np.empty(TERMS), np.empty(TERMS), 0
    for k in range(len(rows)):
        t = rows[k]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        known = True
        for i in (a, b, c):
            for axis in range(2):
                size = abs(points[i, axis])
                known &= size == 0.0 or LEAST < size < MOST
        if not known:
            rows[unknown] = t
            unknown += 1
            continue
        ax, ay, bx, by, cx, cy = (
            points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1],
        )  # fmt: skip
        terms[0], terms[1] = product(ax, by)
        terms[2], terms[3] = product(-ax, cy)
        terms[4], terms[5] = product(-cx, by)
        terms[6], terms[7] = product(-ay, bx)
        terms[8], terms[9] = product(ay, cx)
        terms[10], terms[11] = product(cy, bx)
        out[t] = orientation[t] * sign_of_sum(terms, sums)
    return unknown
