"""GETMe for all elements at once: every node goes to a mean of its places in the transformed triangles of its star.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), section 6.1.2. The transformation is that of
kernels.methods.getme; the mean has the weights (1 − 1/q)^η. All shifts are planned before anything moves; the guard
then makes them colour by colour. (The book puts nodes back until no element is invalid.)
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.getme import shape, transformed
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import SIZE


@part
def mean_shifts(local, n, transformation, weights, shift):
    """Of each star in a block the mean shift of its centre in the n transformed triangles, over the star's size.

    local: ring minus centre over the size, as ``stars.localise`` leaves it. weights: room for LANES. shift: (2·LANES,).
    """
    straight, across = transformation.straight, transformation.across
    for lane in range(LANES):
        weights[lane] = shift[lane] = shift[LANES + lane] = 0.0
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py, qx, qy = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
            gx, gy, ox, oy, _, _, _, _ = transformed(px, py, qx, qy, straight, across)
            weight = 1.0
            for _ in range(transformation.exponent):
                weight *= 1.0 - shape(px, py, qx, qy)
            weights[lane] += weight
            shift[lane] += weight * (gx + ox)
            shift[LANES + lane] += weight * (gy + oy)
    for lane in range(LANES):
        share = transformation.relaxation / weights[lane] if weights[lane] > 0.0 else 0.0
        shift[lane] *= share
        shift[LANES + lane] *= share


@kernel
def plan(points, blocks, first, last, transformation, shifts):
    """The shifts (blocks, 2·LANES) of the stars in the blocks first…last; nothing moves."""
    workspace = stars.workspace_for(blocks.most)
    local, weights = np.empty(2 * blocks.most * LANES), np.empty(LANES)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        mean_shifts(local, n, transformation, weights, shifts[block])
        for lane in range(LANES):
            shifts[block, lane] *= workspace.work[SIZE * LANES + lane]
            shifts[block, LANES + lane] *= workspace.work[SIZE * LANES + lane]


@kernel
def carry_out(points, blocks, first, last, guard, shifts, tally):
    """The guard moves the stars in the blocks first…last, of one colour, by their planned shifts."""
    workspace = stars.workspace_for(blocks.most)
    local, shift = np.empty(2 * blocks.most * LANES), np.empty(2 * LANES)
    for block in range(first, last):
        stars.fetch(points, blocks, block, workspace, local)
        for lane in range(LANES):  # the shifts are absolute: the ring has moved since
            shift[lane] = shifts[block, lane] / workspace.work[SIZE * LANES + lane]
            shift[LANES + lane] = shifts[block, LANES + lane] / workspace.work[SIZE * LANES + lane]
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
