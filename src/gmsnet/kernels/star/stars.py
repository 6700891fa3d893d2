"""What every smoother shares: gather a block of stars, judge the proposed shifts, commit those that break nothing.

Stars of one colour share no cell, so a block (kernels.star.block) may be committed at once. The rule of the guard
stands in kernels.star.guard.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.star.block import (
    CENTRE,
    DROPPED,
    MARGIN,
    MOVED,
    PAIRS,
    REACH,
    SHARE,
    SIZE,
    TARGET,
    TRUNCATED,
    gather,
    ring_row,
)  # fmt: skip
from gmsnet.kernels.star.block import Blocks as Blocks
from gmsnet.kernels.star.block import workspace_for as workspace_for
from gmsnet.kernels.star.certificate import certify, certify_stars, gather_floors
from gmsnet.kernels.star.constraint import follow, snap
from gmsnet.kernels.star.guard import WITH_FLOORS, unit_of_steps
from gmsnet.kernels.star.pattern import pattern_at
from gmsnet.kernels.star.truncation import halve_in_lanes, truncate


@part
def fetch(points, blocks, block, workspace, local):
    """Gathers a block and brings it to the size of the star (``localise``); returns the degree."""
    n = blocks.degree[block]
    gather(points, blocks, block, n, workspace.star)
    localise(workspace.star, n, workspace.work, local)
    return n


@part
def localise(star, n, work, local):
    """Ring minus centre over the size of the star, in the type of ``local``, as [ring node][axis][lane].

    This is the paper's normalisation: one factor d = max(Δx, Δy), the larger side of the bounding box of the n + 1
    nodes, the free node at the origin. d goes to row SIZE of ``work`` (rows of LANES), the centres to the rows CENTRE,
    the largest absolute coordinate of the star to row REACH.
    """
    low, high = PAIRS * LANES, (PAIRS + 2) * LANES
    for k in range(2 * LANES):
        work[low + k] = work[high + k] = star[k]
    for j in range(n):
        p = ring_row(star, j)
        for k in range(2 * LANES):
            work[low + k] = min(work[low + k], p[k])
            work[high + k] = max(work[high + k], p[k])
    inverse = high
    for lane in range(LANES):
        left, right = work[low + 2 * lane], work[high + 2 * lane]
        bottom, top = work[low + 2 * lane + 1], work[high + 2 * lane + 1]
        size = max(right - left, top - bottom)
        work[SIZE * LANES + lane] = size
        work[REACH * LANES + lane] = max(max(-left, right), max(-bottom, top))
        work[inverse + 2 * lane] = work[inverse + 2 * lane + 1] = 1.0 / size if size > 0.0 else 0.0
    take_centres(star, work)
    for j in range(n):
        p = ring_row(star, j)
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for k in range(2 * LANES):
            work[low + k] = (p[k] - star[k]) * work[inverse + k]
        for lane in range(LANES):
            q[lane] = work[low + 2 * lane]
            q[LANES + lane] = work[low + 2 * lane + 1]


@inlined
def centre_of(blocks, block):
    """The free nodes of a block."""
    return blocks.centre[block * LANES : (block + 1) * LANES]


@part
def take_centres(star, work):
    """The rows CENTRE."""
    for lane in range(LANES):
        work[CENTRE * LANES + lane] = star[2 * lane]
        work[(CENTRE + 1) * LANES + lane] = star[2 * lane + 1]


@part
def commit(points, blocks, block, workspace, local, shift, guard, tally):
    """Moves the free nodes of a block by size·shift, truncated by the guard; counts what happened in ``tally``.

    workspace, local: as ``fetch`` leaves them; shift: (2·LANES,), [axis][lane], over the star's size.
    """
    n, work = blocks.degree[block], workspace.work
    pattern = pattern_at(blocks.patterns, blocks.pattern, block)
    aim_block(blocks, block, work, shift, guard)
    if len(guard) == WITH_FLOORS:
        gather_floors(blocks, block, guard, work)
        certify_stars(workspace.star, n, pattern, 1.0, guard.unit, guard.grain, work)
        halve_in_lanes(n, pattern, centre_of(blocks, block), workspace, shift, guard)
    else:
        floor, unit = max(guard.floor, 0.0), unit_of_steps(guard)
        certify(local, n, pattern, shift, floor, unit, guard.grain, work, workspace.sums)
    store(points, blocks, block, workspace, shift, guard, tally)


@part
def aim_block(blocks, block, work, shift, guard):
    """The targets of a block; of nodes that slide, the place on the curve that their shift leads to.

    The shift of such a node becomes what leads there.
    """
    aim(work, shift, guard.single)
    snap_targets(guard.constraint, centre_of(blocks, block), work, shift)


@part
def aim(work, shift, single):
    """The targets: the free nodes plus size·shift."""
    for lane in range(LANES):
        size = work[SIZE * LANES + lane]
        work[TARGET * LANES + lane] = work[CENTRE * LANES + lane] + size * shift[lane]
        work[(TARGET + 1) * LANES + lane] = work[(CENTRE + 1) * LANES + lane] + size * shift[LANES + lane]
    if single:
        for k in range(TARGET * LANES, (TARGET + 2) * LANES):
            work[k] = np.float64(np.float32(work[k]))


@part
def snap_targets(constraint, centre, work, shift):
    """The targets of the nodes that slide go to their curves, and their shifts with them."""
    if constraint is not None:
        for lane in range(LANES):
            i, size = centre[lane], work[SIZE * LANES + lane]
            if constraint.row[i] < 0:
                continue
            tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
            x, y, _ = snap(constraint, i, tx, ty)
            work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane] = x, y
            if size > 0.0:
                shift[lane] = (x - work[CENTRE * LANES + lane]) / size
                shift[LANES + lane] = (y - work[(CENTRE + 1) * LANES + lane]) / size


@part
def store(points, blocks, block, workspace, shift, guard, tally):
    """Moves the free nodes whose row MARGIN is positive to their targets, and tries the others one by one.

    At the level STAR, row SHARE: how much is left of the shift.
    """
    n, count, work = blocks.degree[block], blocks.filled[block], workspace.work
    to_the_star = len(guard) == WITH_FLOORS
    centre = centre_of(blocks, block)
    refused, moved = 0, 0
    for lane in range(LANES):
        refused += not work[MARGIN * LANES + lane] > 0.0
    for lane in range(count):
        elsewhere = work[TARGET * LANES + lane] != work[CENTRE * LANES + lane]
        elsewhere |= work[(TARGET + 1) * LANES + lane] != work[(CENTRE + 1) * LANES + lane]
        moved += elsewhere & (work[MARGIN * LANES + lane] > 0.0)
    tally[MOVED] += moved
    if refused == 0:
        for lane in range(count):
            i = np.uint32(centre[lane])
            points[i, 0] = work[TARGET * LANES + lane]
            points[i, 1] = work[(TARGET + 1) * LANES + lane]
            follow(guard.constraint, i, points[i, 0], points[i, 1])
    else:
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        gather_floors(blocks, block, guard, work)
        for lane in range(count):
            i = centre[lane]
            if work[MARGIN * LANES + lane] > 0.0:
                points[i, 0] = work[TARGET * LANES + lane]
                points[i, 1] = work[(TARGET + 1) * LANES + lane]
                follow(guard.constraint, i, points[i, 0], points[i, 1])
            elif shift[lane] == 0.0 and shift[LANES + lane] == 0.0:
                continue  # nothing is held back
            elif to_the_star and work[MARGIN * LANES + lane] == -np.inf:
                tally[DROPPED] += 1
            else:
                truncate(points, i, n, pattern, lane, workspace, shift, guard, tally)
    if len(guard) == WITH_FLOORS:
        for lane in range(count):
            tally[TRUNCATED] += (work[MARGIN * LANES + lane] > 0.0) & (work[SHARE * LANES + lane] < 1.0)
