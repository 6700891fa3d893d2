"""Angle-based smoothing (Zhou & Shimada 2000) for a block of stars, in float64, without an angle.

At the ring node j, v is the vector from it to the centre, α₁ and α₂ the angles in [0, π] from v to the ring's edges
e₁ = j → j+1 and e₂ = j → j−1. v is turned by β = (α₂ − α₁)/2, and the turned centres are averaged. With

    a_k = v·e_k,  b_k = |v × e_k|,    P = a₁a₂ + b₁b₂,  Q = b₂a₁ − a₂b₁,    H = √(P² + Q²),

P/H and Q/H are cosine and sine of 2β. As |β| ≤ π/2, cosine and sine of β are H + P and Q over their hypotenuse, which
is √(2H(H + |P|)); where P < 0, in the form |Q| and ±(H − P), which does not cancel. There α₁ and α₂ lie on either side
of π/2, so that the sign is that of a₁.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.star import stars

TINY = 1e-300  # stands in for a hypotenuse that is zero: v is then too short to be turned


@part
def propose(local, n, shift):
    """Shifts (2·LANES, over the star's size) for a block of stars."""
    for k in range(2 * LANES):
        shift[k] = 0.0
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        k = 0 if j == n - 1 else j + 1
        before = local[2 * i * LANES : 2 * (i + 1) * LANES]
        here = local[2 * j * LANES : 2 * (j + 1) * LANES]
        after = local[2 * k * LANES : 2 * (k + 1) * LANES]
        for lane in range(LANES):
            vx, vy = -here[lane], -here[LANES + lane]
            ex, ey = after[lane] + vx, after[LANES + lane] + vy
            fx, fy = before[lane] + vx, before[LANES + lane] + vy
            a, b = vx * ex + vy * ey, abs(vx * ey - vy * ex)
            c, d = vx * fx + vy * fy, abs(vx * fy - vy * fx)
            a = a if a != 0.0 or b != 0.0 else 1.0  # an edge without length makes no angle
            c = c if c != 0.0 or d != 0.0 else 1.0
            p = a * c + b * d
            q = d * a - c * b
            h = math.sqrt(p * p + q * q)
            long = h + abs(p)
            scale = 1.0 / max(math.sqrt(2.0 * h * long), TINY)
            cosine = scale * (long if p >= 0.0 else abs(q))
            sine = scale * (q if p >= 0.0 else (long if a > 0.0 else -long))
            shift[lane] += cosine * vx - sine * vy - vx
            shift[LANES + lane] += sine * vx + cosine * vy - vy
    for k in range(2 * LANES):
        shift[k] /= n


@kernel
def sweep(points, blocks, first, last, guard, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    workspace = stars.workspace_for(blocks.most)
    local, shift = np.empty(2 * blocks.most * LANES), np.empty(2 * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        propose(local, n, shift)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
