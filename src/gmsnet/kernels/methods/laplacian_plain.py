"""Laplacian smoothing in its plain form, to the mean of the ring: with so little to compute, what is around it counts.

Targets are means in float64. Spokes from the target are taken once, in float32, for the certificate alone. Coordinates
stay in pairs from where they are read to where they are written; what only a star that is not certified needs, or the
level STAR, is made for its block alone.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import (
    CENTRE,
    LOWEST_MARGIN,
    MARGIN,
    MOVED,
    PAIRS,
    REACH,
    SIZE,
    WIDTH,
    ask_ahead,
    gather,
    ring_row,
)
from gmsnet.kernels.star.certificate import COARSE, NARROWEST, WIDER, error_bound, margin_of, widest
from gmsnet.kernels.star.constraint import slides
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of

SHORTEST = 1e-290  # a first spoke that is shorter, whose inverse might be infinite, measures no star
TARGETS, INVERSES = PAIRS, PAIRS + 2  # rows of work, two each, [lane][axis]


@part
def aim(star, n, pattern, single, shift, work):
    """The mean of the ring minus the centre to ``shift``, [lane][axis], and where that leads to the rows TARGETS."""
    for k in range(2 * LANES):
        shift[k] = 0.0
    for j in range(n):
        p = ring_row(star, j)
        if pattern is not None:
            weight = neighbour_weight(pattern, j)
            for k in range(2 * LANES):
                shift[k] += weight * (p[k] - star[k])
        else:
            for k in range(2 * LANES):
                shift[k] += p[k] - star[k]
    factor = 1.0 / neighbours(pattern, n)
    for k in range(2 * LANES):
        shift[k] *= factor
        work[TARGETS * LANES + k] = star[k] + shift[k]
    if single:
        for k in range(TARGETS * LANES, (TARGETS + 2) * LANES):
            work[k] = np.float64(np.float32(work[k]))


@part
def relate(star, n, work, flat, local):
    """Ring minus target over the length of the first spoke, in float32, as [ring node][axis][lane].

    That length (the sum of its components' sizes, from the centre) goes to row SIZE. flat: (2·LANES,) to work in.
    """
    spoke = ring_row(star, 0)
    for lane in range(LANES):
        size = abs(spoke[2 * lane] - star[2 * lane]) + abs(spoke[2 * lane + 1] - star[2 * lane + 1])
        size = size if size > SHORTEST else 1.0
        work[SIZE * LANES + lane] = size
        work[INVERSES * LANES + 2 * lane] = work[INVERSES * LANES + 2 * lane + 1] = 1.0 / size
    for j in range(n):
        p = ring_row(star, j)
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for k in range(2 * LANES):
            flat[k] = (p[k] - work[TARGETS * LANES + k]) * work[INVERSES * LANES + k]
        for lane in range(LANES):
            q[lane], q[LANES + lane] = flat[2 * lane], flat[2 * lane + 1]


@part
def certify(local, n, pattern, floor, unit, grain, work, sums):
    """Row MARGIN: positive where all triangles are certified above the floor, which is not negative, at the targets.

    As certificate.certify, from what ``relate`` leaves. No coordinate of the star is larger than those of its target
    and the ring's extent from there together. Returns how many stars are not certified.
    """
    real = sums.dtype.type
    twice = real(2.0 * WIDER * floor)
    for lane in range(LANES):
        sums[LOWEST_MARGIN * LANES + lane] = np.inf
        sums[WIDTH * LANES + lane] = NARROWEST
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, real)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py, qx, qy = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
            margin, least = margin_of(px, py, qx, qy, twice, weights), sums[LOWEST_MARGIN * LANES + lane]
            sums[LOWEST_MARGIN * LANES + lane] = margin if not margin >= least else least
            sums[WIDTH * LANES + lane] = max(sums[WIDTH * LANES + lane], widest(px, py, qx, qy, weights))
    uncertified = 0
    for lane in range(LANES):
        tx, ty = work[TARGETS * LANES + 2 * lane], work[TARGETS * LANES + 2 * lane + 1]
        width, size = np.float64(sums[WIDTH * LANES + lane]), work[SIZE * LANES + lane]
        delta = WIDER * (unit * (max(abs(tx), abs(ty)) + size * width) + grain) / size
        margin = sums[LOWEST_MARGIN * LANES + lane] - error_bound(width, delta, COARSE)
        work[MARGIN * LANES + lane] = margin
        uncertified += not margin > 0.0
    return uncertified


@part
def put(points, blocks, block, star, work, tally):
    """Moves the free nodes of a block to their targets."""
    centre, count = blocks.centre[block * LANES : (block + 1) * LANES], blocks.filled[block]
    moved = 0
    for lane in range(count):
        x, y = work[TARGETS * LANES + 2 * lane], work[TARGETS * LANES + 2 * lane + 1]
        moved += (x != star[2 * lane]) | (y != star[2 * lane + 1])
    for lane in range(count):
        i = np.uint32(centre[lane])
        points[i, 0] = work[TARGETS * LANES + 2 * lane]
        points[i, 1] = work[TARGETS * LANES + 2 * lane + 1]
    tally[MOVED] += moved


@part
def prepare(star, n, work, shift, steps):
    """What ``stars`` wants to know of a block: rows SIZE, REACH and CENTRE, and the shifts over SIZE, [axis][lane]."""
    stars.take_centres(star, work)
    for lane in range(LANES):
        work[SIZE * LANES + lane] = 1.0
        steps[lane], steps[LANES + lane] = shift[2 * lane], shift[2 * lane + 1]
        work[REACH * LANES + lane] = max(abs(work[CENTRE * LANES + lane]), abs(work[(CENTRE + 1) * LANES + lane]))
    for j in range(n):
        p = ring_row(star, j)
        for lane in range(LANES):
            work[REACH * LANES + lane] = max(work[REACH * LANES + lane], max(abs(p[2 * lane]), abs(p[2 * lane + 1])))


@part
def scale(work, shift, steps):
    """The shifts ([lane][axis]) over SIZE as ``stars.localise`` leaves it, [axis][lane]."""
    for lane in range(LANES):
        size = work[SIZE * LANES + lane]
        inverse = 1.0 / size if size > 0.0 else 0.0
        steps[lane], steps[LANES + lane] = inverse * shift[2 * lane], inverse * shift[2 * lane + 1]


@kernel
def sweep(points, blocks, first, last, guard, tally):
    """Smooths the blocks first…last (of one colour) once: gather, aim, certify, commit. tally: (3,), added to."""
    workspace, flat = stars.workspace_for(blocks.most), np.empty(2 * LANES, dtype=np.float32)
    local = np.empty(2 * blocks.most * LANES, dtype=np.float32)
    star, work, shift, steps = workspace.star, workspace.work, np.empty(2 * LANES), np.empty(2 * LANES)
    floor = max(guard.floor, 0.0)
    for block in range(first, last):
        n, pattern = blocks.degree[block], pattern_at(blocks.patterns, blocks.pattern, block)
        gather(points, blocks, block, n, star)
        ask_ahead(points, blocks, block + 1)
        aim(star, n, pattern, guard.single, shift, work)
        if len(guard) == WITH_FLOORS or slides(guard.constraint):
            if slides(guard.constraint):
                stars.localise(star, n, work, local)
                scale(work, shift, steps)
            else:
                prepare(star, n, work, shift, steps)
            stars.commit(points, blocks, block, workspace, local, steps, guard, workspace.counts)
            continue
        relate(star, n, work, flat, local)
        if certify(local, n, pattern, floor, guard.unit, guard.grain, work, workspace.sums) == 0:
            put(points, blocks, block, star, work, workspace.counts)
        else:
            prepare(star, n, work, shift, steps)
            stars.aim_block(blocks, block, work, steps, guard)
            stars.store(points, blocks, block, workspace, steps, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
