"""Laplacian smoothing for a block of stars, in float64: the weighted mean of the ring, p_j its nodes minus the centre.

    shift = Σ w_j p_j / Σ w_j,    w_j = 1,  1/|p_j|,  or the areas of the two triangles at the edge p_j.

In other cells than triangles the ring is that of the nodes that an edge joins to the free one; areas are those of all
corner simplices of the star, each with its two nodes.

The smart form takes the mean only where the sum of q over the star falls by it and no triangle is inverted by it. It is
certified by what it has been judged with. The plain form stands in kernels.methods.laplacian_plain.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import MARGIN, REACH, SIZE, ask_ahead
from gmsnet.kernels.star.certificate import COARSE, WIDER, error_bound
from gmsnet.kernels.star.constraint import slides
from gmsnet.kernels.star.guard import WITH_FLOORS, unit_of_steps
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of

SMART, INVERSE_LENGTH, AREA = range(3)
TINY = 1e-300  # stands in for a product of areas that is not positive: the star is judged by its signs then
# What the smart form is judged by.
GAIN, SOUND, WAS_SOUND, ABOVE, WAS_ABOVE = range(5)
ROWS = 5


@part
def mean(local, n, pattern, shift):
    """w_j = 1."""
    for k in range(2 * LANES):
        shift[k] = 0.0
    for j in range(n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        if pattern is not None:
            weight = neighbour_weight(pattern, j)
            for k in range(2 * LANES):
                shift[k] += weight * p[k]
        else:
            for k in range(2 * LANES):
                shift[k] += p[k]
    factor = 1.0 / neighbours(pattern, n)
    for k in range(2 * LANES):
        shift[k] *= factor


@part
def inverse_length_mean(local, n, pattern, row, shift):
    """w_j = 1/|p_j|; not a number, so no move, where a neighbour lies on the centre. row: the sum of weights."""
    for lane in range(LANES):
        row[lane] = shift[lane] = shift[LANES + lane] = 0.0
    for j in range(n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        share = neighbour_weight(pattern, j)
        if share == 0.0:
            continue
        for lane in range(LANES):
            u, v = p[lane], p[LANES + lane]
            weight = share / np.sqrt(u * u + v * v)
            row[lane] += weight
            shift[lane] += weight * u
            shift[LANES + lane] += weight * v
    for lane in range(LANES):
        shift[lane] /= row[lane]
        shift[LANES + lane] /= row[lane]


@part
def area_mean(local, n, pattern, row, shift):
    """w_j = |T_j−1| + |T_j|, so Σ w_j p_j = Σ |T_j|(p_j + p_j+1) and Σ w_j = 2 Σ |T_j|; row: the latter.

    Not a number, so no move, where no triangle has an area.
    """
    for lane in range(LANES):
        row[lane] = shift[lane] = shift[LANES + lane] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py, qx, qy = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
            twice = abs(px * qy - py * qx)
            row[lane] += twice
            shift[lane] += twice * (px + qx)
            shift[LANES + lane] += twice * (py + qy)
    for lane in range(LANES):
        shift[lane] /= 2.0 * row[lane]
        shift[LANES + lane] /= 2.0 * row[lane]


@inlined
def with_opposite(px, py, qx, qy, opposite, weights):
    """L of the simplex (0, p, q), given the square of its third edge."""
    if weights is None:
        return px * px + py * py + qx * qx + qy * qy + opposite
    return weights.a * (px * px + py * py) + weights.b * (qx * qx + qy * qy) + weights.opposite * opposite


@part
def judge(local, n, pattern, shift, floor, row):
    """What the shift does to the star, into the rows of LANES

    GAIN: by how much Σ q falls, if all triangles are positive before and after (times 2√3). SOUND: positive if each
    triangle is positive after it, or less inverted than before. WAS_SOUND: positive if all triangles are positive
    before it. ABOVE, WAS_ABOVE: the minimum margin D − floor·L after and before.
    """
    for lane in range(LANES):
        row[GAIN * LANES + lane] = 0.0
    row[SOUND * LANES : ROWS * LANES] = np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py, qx, qy = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
            opposite = (px - qx) * (px - qx) + (py - qy) * (py - qy)
            before = px * qy - py * qx
            lengths_before = with_opposite(px, py, qx, qy, opposite, weights)
            px, py = px - shift[lane], py - shift[LANES + lane]
            qx, qy = qx - shift[lane], qy - shift[LANES + lane]
            after = px * qy - py * qx
            lengths = with_opposite(px, py, qx, qy, opposite, weights)
            row[GAIN * LANES + lane] += (lengths_before * after - lengths * before) / max(before * after, TINY)
            row[SOUND * LANES + lane] = min(row[SOUND * LANES + lane], max(after, after - before))
            row[WAS_SOUND * LANES + lane] = min(row[WAS_SOUND * LANES + lane], before)
            row[ABOVE * LANES + lane] = min(row[ABOVE * LANES + lane], after - floor * lengths)
            row[WAS_ABOVE * LANES + lane] = min(row[WAS_ABOVE * LANES + lane], before - floor * lengths_before)


@part
def smart_mean(local, n, pattern, floor, row, shift):
    """The mean where nothing is inverted by it and Σ q falls, or is infinite before (a tangled star); else 0.

    Row ABOVE: the minimum margin D − floor·L with that.
    """
    mean(local, n, pattern, shift)
    judge(local, n, pattern, shift, floor, row)
    for lane in range(LANES):
        falls = row[GAIN * LANES + lane] > 0.0 or row[WAS_SOUND * LANES + lane] <= 0.0
        taken = row[SOUND * LANES + lane] > 0.0 and falls
        shift[lane] = shift[lane] if taken else 0.0
        shift[LANES + lane] = shift[LANES + lane] if taken else 0.0
        above, was_above = row[ABOVE * LANES + lane], row[WAS_ABOVE * LANES + lane]
        row[ABOVE * LANES + lane] = above if taken else was_above


@part
def certify_smart(row, unit, grain, work):
    """Row MARGIN: positive where all triangles are certified above the floor of ``smart_mean`` after its shift.

    As certificate.certify, and with its bound, though surpluses have been taken in float64. Nodes and mean lie in the
    bounding box of the star, whose larger side is the unit: no component is larger than 1 but for rounding.
    """
    for lane in range(LANES):
        delta = WIDER * (unit * WIDER * work[REACH * LANES + lane] + grain) / work[SIZE * LANES + lane]
        work[MARGIN * LANES + lane] = row[ABOVE * LANES + lane] - error_bound(WIDER, delta, COARSE)


@part
def propose(local, n, pattern, variant, floor, row, shift):
    """Shifts (2·LANES, over the star's size) of a variant for a block of stars. row: (ROWS·LANES,) to work in."""
    if variant == SMART:
        smart_mean(local, n, pattern, floor, row, shift)
    elif variant == INVERSE_LENGTH:
        inverse_length_mean(local, n, pattern, row, shift)
    else:
        area_mean(local, n, pattern, row, shift)


@kernel
def sweep(points, blocks, first, last, guard, variant, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    workspace = stars.workspace_for(blocks.most)
    local, row, shift = np.empty(2 * blocks.most * LANES), np.empty(ROWS * LANES), np.empty(2 * LANES)
    floor = max(guard.floor, 0.0)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        ask_ahead(points, blocks, block + 1)
        propose(local, n, pattern_at(blocks.patterns, blocks.pattern, block), variant, floor, row, shift)
        if variant == SMART and len(guard) != WITH_FLOORS and not slides(guard.constraint):
            stars.aim_block(blocks, block, workspace.work, shift, guard)
            certify_smart(row, unit_of_steps(guard), guard.grain, workspace.work)
            stars.store(points, blocks, block, workspace, shift, guard, workspace.counts)
        else:
            stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
