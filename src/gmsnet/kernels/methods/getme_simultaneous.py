"""GETMe for all elements at once: every node goes to a mean of its places in the transformed cells around it.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), section 6.1.2. The transformations are those of
kernels.methods.getme_elements; the mean has the weights (1 − 1/q)^η. All shifts are planned before anything moves; the
guard then makes them colour by colour. (The book puts nodes back until no element is invalid.)
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.getme_elements import shape, square_shape, transformed, transformed_quad
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import SIZE
from gmsnet.kernels.star.pattern import count_of, other_of, pair_of, pattern_at, weights_of


@part
def mean_shifts(local, n, pattern, transformation, quad, weights, shift):
    """Of each star in a block the mean shift of its centre in the transformed cells, over the star's size.

    local: ring minus centre over the size, as ``stars.localise`` leaves it. quad: room for the corners of one, weights
    for LANES. shift: (2·LANES,).
    """
    straight, across = transformation.straight, transformation.across
    for lane in range(LANES):
        weights[lane] = shift[lane] = shift[LANES + lane] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        if pattern is not None:
            of_corner = weights_of(pattern, k, np.float64)
            if of_corner.a == 0.0 or of_corner.b == 0.0:
                continue  # of a quad that has its turn with its corner at the centre
            if of_corner.opposite == 0.0:
                other = other_of(pattern, k, i)
                r = local[2 * other * LANES : 2 * (other + 1) * LANES]
                add_quads(p, r, q, transformation, quad, weights, shift)
                continue
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


@part
def add_quads(a, d, b, transformation, quad, weights, shift):
    """Adds what the quads 0, a, d, b of a block's lanes call for. quad: room for eight numbers."""
    for lane in range(LANES):
        quad[0], quad[1] = 0.0, 0.0
        quad[2], quad[3] = a[lane], a[LANES + lane]
        quad[4], quad[5] = d[lane], d[LANES + lane]
        quad[6], quad[7] = b[lane], b[LANES + lane]
        gap = 1.0 - square_shape(quad[2], quad[3], quad[4], quad[5], quad[6], quad[7])
        gx, gy = transformed_quad(quad, transformation.quad_across, transformation.quad_inward)
        weight = 1.0
        for _ in range(transformation.exponent):
            weight *= gap
        weights[lane] += weight
        shift[lane] += weight * (gx + quad[0])
        shift[LANES + lane] += weight * (gy + quad[1])


@kernel
def plan(points, blocks, first, last, transformation, shifts):
    """The shifts (blocks, 2·LANES) of the stars in the blocks first…last; nothing moves."""
    workspace = stars.workspace_for(blocks.most)
    local, weights, quad = np.empty(2 * blocks.most * LANES), np.empty(LANES), np.empty(8)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        mean_shifts(local, n, pattern, transformation, quad, weights, shifts[block])
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
