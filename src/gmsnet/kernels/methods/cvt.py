"""Equation 1 of the paper for a block of stars, in float64: triangle centres C weighted by areas, Σ|T|C / Σ|T|.

With a and b the ring nodes of a triangle minus the star's centre and S its signed area, the circumcentre is

    C = (b_y|a|² − a_y|b|², a_x|b|² − b_x|a|²) / (4S),

so that |T|C is a quarter of the numerator with the sign of S: it has no denominator and stays finite for flat triangles
(one without area counts as the limit of positive ones). The centroid is C = (a + b)/3.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.laplacian import area_mean
from gmsnet.kernels.star import stars


@part
def circumcentres(local, n, row, shift):
    """Shifts (2·LANES, over the star's size) with circumcentres; row: (LANES,) Σ 2|T|. 0/0 where no area is."""
    for lane in range(LANES):
        row[lane] = shift[lane] = shift[LANES + lane] = 0.0
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            ax, ay, bx, by = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
            twice = ax * by - ay * bx
            sign = -1.0 if twice < 0.0 else 1.0
            aa, bb = sign * (ax * ax + ay * ay), sign * (bx * bx + by * by)
            row[lane] += abs(twice)
            shift[lane] += by * aa - ay * bb
            shift[LANES + lane] += ax * bb - bx * aa
    for lane in range(LANES):
        shift[lane] /= 2.0 * row[lane]
        shift[LANES + lane] /= 2.0 * row[lane]


@part
def centroids(local, n, row, shift):
    """Shifts (2·LANES, over the star's size) with centroids; row: (LANES,) as there. Not a number where no area is.

    Σ|T|(a + b)/3 / Σ|T| is two thirds of the mean weighted by areas.
    """
    area_mean(local, n, None, row, shift)
    for k in range(2 * LANES):
        shift[k] *= 2.0 / 3.0


@kernel
def sweep(points, blocks, first, last, guard, circum, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to.

    circum: with circumcentres, else with centroids.
    """
    workspace = stars.workspace_for(blocks.most)
    local, row, shift = np.empty(2 * blocks.most * LANES), np.empty(LANES), np.empty(2 * LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        if circum:
            circumcentres(local, n, row, shift)
        else:
            centroids(local, n, row, shift)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
