"""One Newton step on F = Σ Q^p over the triangles of a star, Q = √3·q, p = 1, 2 or 4, for a block of stars.

The formulas: see ``barrier_lanes``.

Lanes compute in float32, relative to a length of the star. Where triangles are FLAT, F does not fall beyond doubt, or
falls below FAR of what it was, the star is done over in float64, with as many steps as fall so far (``descend``).
So F never rises, but for the rounding of float32. A tangled star goes to the mean of its ring.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.barrier_lanes import (
    DOUBT,
    GX,
    GY,
    LOWEST_MARGIN,
    REDO,
    ROUND,
    SUMS,
    WIDTH,
    XX,
    XY,
    YY,
    average,
    derive,
    judge,
    propose,
    settle,
)
from gmsnet.kernels.methods.barrier_star import descend
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import MARGIN, PAIRS, REACH, SIZE, ask_ahead, gather, ring_row
from gmsnet.kernels.star.certificate import COARSE, NARROWEST, WIDER, error_bound
from gmsnet.kernels.star.constraint import along_curve, slides
from gmsnet.kernels.star.guard import WITH_FLOORS, unit_of_steps
from gmsnet.kernels.star.pattern import pattern_at

FLAT = 300.0  # mean Q of a star: D of a triangle is off by a few times 2⁻²⁴·Q in float32


@part
def relate(star, n, guard, work, flat, local, sums):
    """Ring minus centre over a length of the star, in the type of ``local``; see stars.localise.

    As there, but for the length, which is that of the first spoke (the sum of its components' sizes), so that it takes
    one pass. To row REACH goes an upper bound of the largest coordinate; to row WIDTH of sums the ring's largest
    component, to row DOUBT δ without the target's part, both over SIZE. flat: (2·LANES,) to work in.
    """
    spoke = ring_row(star, 0)
    for lane in range(LANES):
        size = abs(spoke[2 * lane] - star[2 * lane]) + abs(spoke[2 * lane + 1] - star[2 * lane + 1])
        size = size if size > 0.0 else 1.0
        work[SIZE * LANES + lane] = size
        work[PAIRS * LANES + 2 * lane] = work[PAIRS * LANES + 2 * lane + 1] = 1.0 / size
        sums[WIDTH * LANES + lane] = NARROWEST
    for j in range(n):
        p = ring_row(star, j)
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for k in range(2 * LANES):
            flat[k] = (p[k] - star[k]) * work[PAIRS * LANES + k]
        for lane in range(LANES):
            qx, qy = flat[2 * lane], flat[2 * lane + 1]
            q[lane], q[LANES + lane] = qx, qy
            sums[WIDTH * LANES + lane] = max(sums[WIDTH * LANES + lane], max(abs(qx), abs(qy)))
    stars.take_centres(star, work)
    unit, grain = unit_of_steps(guard), guard.grain
    for lane in range(LANES):
        reach, size = max(abs(star[2 * lane]), abs(star[2 * lane + 1])), work[SIZE * LANES + lane]
        sums[DOUBT * LANES + lane] = WIDER * (unit * reach + grain) / size
        work[REACH * LANES + lane] = reach + WIDER * size * sums[WIDTH * LANES + lane]


@part
def restrict(constraint, centre, sums):
    """The derivatives of the nodes that slide, for steps along their curves. ``propose`` says how they are kept."""
    if constraint is not None:
        real = sums.dtype.type
        for lane in range(LANES):
            if constraint.row[centre[lane]] < 0:
                continue
            even = np.float64(sums[ROUND * LANES + lane])
            xx, xy, yy = sums[XX * LANES + lane] + even, 0.5 * sums[XY * LANES + lane], sums[YY * LANES + lane] + even
            gx, gy = np.float64(sums[GX * LANES + lane]), np.float64(sums[GY * LANES + lane])
            gx, gy, xx, xy, yy = along_curve(constraint, centre[lane], gx, gy, xx, xy, yy)
            sums[GX * LANES + lane], sums[GY * LANES + lane] = real(gx), real(gy)
            sums[XX * LANES + lane], sums[YY * LANES + lane] = real(xx), real(yy)
            sums[XY * LANES + lane], sums[ROUND * LANES + lane] = real(2.0 * xy), real(0.0)


@part
def refine(star, n, pattern, centre, constraint, count, work, power, sums, shift):
    """The shifts of the lanes that are to be done over, as ``descend`` finds them."""
    for lane in range(count):
        if sums[REDO * LANES + lane] > 0.0:
            dx, dy = descend(star, n, pattern, lane, power, constraint, centre[lane])
            shift[lane] = dx / work[SIZE * LANES + lane]
            shift[LANES + lane] = dy / work[SIZE * LANES + lane]


@part
def certify(sums, step, unit, work):
    """Row MARGIN of work: positive where all triangles are certified above the guard's floor after the step.

    As certificate.certify, but from what ``judge`` has found. Returns how many are not.
    """
    real = sums.dtype.type
    unit, zero = real(unit), real(0.0)
    uncertified = 0
    for lane in range(LANES):
        m = max(sums[WIDTH * LANES + lane], max(abs(step[lane]), abs(step[LANES + lane])))
        certain = sums[LOWEST_MARGIN * LANES + lane] - error_bound(m, sums[DOUBT * LANES + lane] + unit * m, COARSE)
        certain = certain if sums[REDO * LANES + lane] == zero else 0.0
        work[MARGIN * LANES + lane] = certain
        uncertified += not certain > 0.0
    return uncertified


@kernel
def sweep(points, blocks, first, last, guard, power, relaxation, stretch, tally):
    """Visits the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to.

    stretch: that many times the way to the mean of the ring is taken instead of a step where F falls by it; 0: steps
    only.
    """
    workspace, local = stars.workspace_for(blocks.most), np.empty(2 * blocks.most * LANES, dtype=np.float32)
    sums, mean_sums = np.empty(SUMS * LANES, dtype=np.float32), np.empty(SUMS * LANES, dtype=np.float32)
    step, mean = np.empty(2 * LANES, dtype=np.float32), np.empty(2 * LANES, dtype=np.float32)
    star, work, shift = workspace.star, workspace.work, np.empty(2 * LANES)
    floor, most = max(guard.floor, 0.0), FLAT * (power.one + FLAT * (power.two + power.four * (FLAT * FLAT)))
    for block in range(first, last):
        n, count = blocks.degree[block], blocks.filled[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        gather(points, blocks, block, n, star)
        ask_ahead(points, blocks, block + 1)
        relate(star, n, guard, work, workspace.sums, local, sums)
        derive(local, n, pattern, power, sums)
        restrict(guard.constraint, stars.centre_of(blocks, block), sums)
        propose(sums, relaxation, power.ratio, step)
        judge(local, n, pattern, power, step, floor, sums)
        if stretch > 0.0:
            average(local, n, pattern, stretch, mean)
            judge(local, n, pattern, power, mean, floor, mean_sums)
        settle(sums, most * n, step, mean, mean_sums, stretch > 0.0)
        for k in range(2 * LANES):
            shift[k] = step[k]
        uncertified = certify(sums, step, unit_of_steps(guard), work)
        if uncertified:
            centre = stars.centre_of(blocks, block)
            refine(star, n, pattern, centre, guard.constraint, count, work, power, sums, shift)
        if len(guard) == WITH_FLOORS or slides(guard.constraint):
            stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
            continue
        stars.aim_block(blocks, block, work, shift, guard)
        stars.store(points, blocks, block, workspace, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
