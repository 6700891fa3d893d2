"""What every smoother shares: gather a block of stars, judge the proposed shifts, commit those that break nothing.

A block is LANES stars of one colour and degree n. Its free nodes stand in ``x`` as [axis][lane], its rings in ``ring``
as [ring node][axis][lane], flat. Stars of one colour share no cell, so a block may be committed at once.

The rule of the guard stands in kernels.guard. A shift that it does not allow is halved, as the paper's Algorithm 1
does, and dropped after HALVINGS.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.compile import LANES, kernel
from gmsnet.kernels.guard import STAR, permitted, plain_surplus, surplus_above, surplus_bound

HALVINGS, FEW_HALVINGS = 20, 6
MOVED, TRUNCATED, DROPPED = range(3)  # what a sweep counts
COUNTERS = 32  # room for them on cache lines of their own, so that threads do not wait for each other's counts
# Rows of a block's work array; TARGET and KEPT have two, FLOORS n.
SIZE, REACH, TARGET, MARGIN, SHARE, KEPT, EXTENT, BOUND, FLOORS = 0, 1, 2, 4, 5, 6, 8, 9, 10


class Blocks(NamedTuple):
    """The free nodes with their rings in blocks of LANES of one colour and degree (see kernels.layout.blocks).

    filled: how many of the lanes hold stars of their own. most: the largest degree.
    """

    centre: NDArray[np.int32]
    rings: NDArray[np.int32]
    offset: NDArray[np.int64]
    degree: NDArray[np.int32]
    filled: NDArray[np.int32]
    most: int


@kernel
def room(most):
    """The arrays that a sweep works in: x, ring, work (10 + most rows) and counts, for stars of up to so many nodes."""
    return (
        np.empty(2 * LANES),
        np.empty(2 * most * LANES),
        np.empty((FLOORS + most) * LANES),
        np.zeros(COUNTERS, dtype=np.int64),
    )


@kernel
def fetch(points, blocks, block, x, ring, work, local):
    """Gathers a block and brings it to the size of the star (``localise``); returns the degree."""
    n = blocks.degree[block]
    gather(points, blocks, block, n, x, ring)
    localise(x, ring, n, work, local)
    return n


@kernel
def gather(points, blocks, block, n, x, ring):
    """Coordinates of the stars of a block, as they stand now."""
    offset = blocks.offset[block]
    centre = blocks.centre[block * LANES : (block + 1) * LANES]
    for lane in range(LANES):
        i = np.uint32(centre[lane])  # an index that may be negative is looked at twice
        x[lane] = points[i, 0]
        x[LANES + lane] = points[i, 1]
    for j in range(n):
        nodes = blocks.rings[offset + j * LANES : offset + (j + 1) * LANES]
        row = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            i = np.uint32(nodes[lane])
            row[lane] = points[i, 0]
            row[LANES + lane] = points[i, 1]


@kernel
def localise(x, ring, n, work, local):
    """Ring minus centre over the size of the star, in the type of ``local``.

    This is the paper's normalisation: one factor d = max(Δx, Δy), the larger side of the bounding box of the n + 1
    nodes, the free node at the origin. d goes to the rows SIZE and EXTENT of ``work`` (rows of LANES), the largest
    absolute coordinate of the star to row REACH. (EXTENT: no component of the ring minus the centre is larger.)
    """
    for lane in range(LANES):  # rows 4 to 7: left, right, bottom, top
        work[4 * LANES + lane] = work[5 * LANES + lane] = x[lane]
        work[6 * LANES + lane] = work[7 * LANES + lane] = x[LANES + lane]
    for j in range(n):
        p = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            work[4 * LANES + lane] = min(work[4 * LANES + lane], p[lane])
            work[5 * LANES + lane] = max(work[5 * LANES + lane], p[lane])
            work[6 * LANES + lane] = min(work[6 * LANES + lane], p[LANES + lane])
            work[7 * LANES + lane] = max(work[7 * LANES + lane], p[LANES + lane])
    for lane in range(LANES):
        left, right = work[4 * LANES + lane], work[5 * LANES + lane]
        bottom, top = work[6 * LANES + lane], work[7 * LANES + lane]
        size = max(right - left, top - bottom)
        work[SIZE * LANES + lane] = work[EXTENT * LANES + lane] = size
        work[REACH * LANES + lane] = max(max(-left, right), max(-bottom, top))
        work[4 * LANES + lane] = 1.0 / size if size > 0.0 else 0.0
    for j in range(n):
        p = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            q[lane] = (p[lane] - x[lane]) * work[4 * LANES + lane]
            q[LANES + lane] = (p[LANES + lane] - x[LANES + lane]) * work[4 * LANES + lane]


@kernel
def margins(ring, n, floor, work):
    """For each lane the least certified surplus D − φL of a triangle with its node at its target; positive: allowed.

    floor: φ of all triangles, not negative. Rows of work: reads TARGET and the one after it, and BOUND, the
    error bound of a star's surpluses (``bound``); writes MARGIN.
    """
    for lane in range(LANES):
        work[MARGIN * LANES + lane] = np.inf
    twice = 2.0 * floor
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = ring[2 * i * LANES : 2 * (i + 1) * LANES]
        q = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
            surplus = plain_surplus(p[lane] - tx, p[LANES + lane] - ty, q[lane] - tx, q[LANES + lane] - ty, twice)
            # A target that is not finite makes every surplus NaN or −∞, and no comparison with it holds.
            least = work[MARGIN * LANES + lane]
            work[MARGIN * LANES + lane] = surplus if not surplus >= least else least
    for lane in range(LANES):
        work[MARGIN * LANES + lane] -= work[BOUND * LANES + lane]


@kernel
def margins_above(ring, n, work):
    """As ``margins``, each triangle above the floor in its row from FLOORS on."""
    for lane in range(LANES):
        work[MARGIN * LANES + lane] = np.inf
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = ring[2 * i * LANES : 2 * (i + 1) * LANES]
        q = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
            twice = 2.0 * max(work[(FLOORS + j) * LANES + lane], 0.0)
            surplus = plain_surplus(p[lane] - tx, p[LANES + lane] - ty, q[lane] - tx, q[LANES + lane] - ty, twice)
            least = work[MARGIN * LANES + lane]
            work[MARGIN * LANES + lane] = surplus if not surplus >= least else least
    for lane in range(LANES):
        work[MARGIN * LANES + lane] -= work[BOUND * LANES + lane]


@kernel
def gather_floors(blocks, block, guard, work):
    """The floor of each triangle of a block's stars, into the rows from FLOORS on: triangle j lies before ring node j.

    At the level STAR that is the largest of its nodes' floors, else the mesh's.
    """
    n, rings, offset, floors = blocks.degree[block], blocks.rings, blocks.offset[block], guard.floors
    if guard.level != STAR:
        work[FLOORS * LANES : (FLOORS + n) * LANES] = guard.floor
        return
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        for lane in range(LANES):
            floor = floors[blocks.centre[block * LANES + lane]]
            around = max(floors[rings[offset + i * LANES + lane]], floors[rings[offset + j * LANES + lane]])
            work[(FLOORS + j) * LANES + lane] = max(floor, around)


@kernel
def clear(tx, ty, ring, n, lane, delta, floor):
    """Is each triangle of one lane certified above a floor that is not negative, with the free node at (tx, ty)?"""
    px, py = ring[2 * (n - 1) * LANES + lane] - tx, ring[(2 * n - 1) * LANES + lane] - ty
    for j in range(n):
        qx, qy = ring[2 * j * LANES + lane] - tx, ring[(2 * j + 1) * LANES + lane] - ty
        if not surplus_above(px, py, qx, qy, delta, floor) > 0.0:
            return False
        px, py = qx, qy
    return True


@kernel
def allowed(tx, ty, x, ring, n, lane, delta, work):
    """May the free node of one lane move to (tx, ty)? The scalar form of the rule, which also knows inverted cells.

    Rows of work: reads those from FLOORS on; KEPT's are overwritten.
    """
    was, now = work[KEPT * LANES : KEPT * LANES + 6], work[(KEPT + 1) * LANES : (KEPT + 1) * LANES + 6]
    was[4], was[5], now[4], now[5] = x[lane], x[LANES + lane], tx, ty
    for j in range(n):
        a = 2 * (n - 1 if j == 0 else j - 1) * LANES + lane
        b = 2 * j * LANES + lane
        was[0], was[1], was[2], was[3] = ring[a], ring[a + LANES], ring[b], ring[b + LANES]
        now[:4] = was[:4]
        if not permitted(was, now, delta, work[(FLOORS + j) * LANES + lane]):
            return False
    return True


@kernel
def commit(points, blocks, block, x, ring, work, shift, guard, tally):
    """Moves the free nodes of a block by size·shift, truncated by the guard; counts what happened in ``tally``.

    work: rows of LANES as ``localise`` leaves them; shift: (2·LANES,) over the star's size.
    """
    aim(x, work, shift, guard.single)
    bound(x, work, guard)
    if guard.level == STAR:
        gather_floors(blocks, block, guard, work)
        margins_above(ring, blocks.degree[block], work)
        halve_abreast(x, ring, blocks.degree[block], shift, guard.single, work)
    else:
        margins(ring, blocks.degree[block], max(guard.floor, 0.0), work)
    store(points, blocks, block, x, ring, work, shift, guard, tally)


@kernel
def aim(x, work, shift, single):
    """The targets: the free nodes plus size·shift."""
    for lane in range(LANES):
        work[TARGET * LANES + lane] = x[lane] + work[SIZE * LANES + lane] * shift[lane]
        work[(TARGET + 1) * LANES + lane] = x[LANES + lane] + work[SIZE * LANES + lane] * shift[LANES + lane]
    if single:
        for lane in range(TARGET * LANES, (TARGET + 2) * LANES):
            work[lane] = np.float64(np.float32(work[lane]))


@kernel
def bound(x, work, guard):
    """By how much the surpluses of each lane's star may be off, to row BOUND. See ``localise`` for REACH and EXTENT."""
    unit, grain = guard.unit, guard.grain
    for lane in range(LANES):
        tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
        delta = unit * max(work[REACH * LANES + lane], max(abs(tx), abs(ty))) + grain
        extent = work[EXTENT * LANES + lane] + max(abs(tx - x[lane]), abs(ty - x[LANES + lane]))
        work[BOUND * LANES + lane] = surplus_bound(extent, delta)


@kernel
def store(points, blocks, block, x, ring, work, shift, guard, tally):
    """Moves the free nodes whose row MARGIN is positive to their targets, and tries the others one by one."""
    n, count, star = blocks.degree[block], blocks.filled[block], guard.level == STAR
    centre = blocks.centre[block * LANES : (block + 1) * LANES]
    refused, moved = 0, 0
    for lane in range(LANES):
        refused += not work[MARGIN * LANES + lane] > 0.0
    for lane in range(count):
        tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
        taken = work[MARGIN * LANES + lane] > 0.0
        moved += taken & ((tx != x[lane]) | (ty != x[LANES + lane]))
    tally[MOVED] += moved
    if star:
        for lane in range(count):
            tally[TRUNCATED] += (work[MARGIN * LANES + lane] > 0.0) & (work[SHARE * LANES + lane] < 1.0)
    if refused == 0:
        for lane in range(count):
            i = np.uint32(centre[lane])
            points[i, 0] = work[TARGET * LANES + lane]
            points[i, 1] = work[(TARGET + 1) * LANES + lane]
        return
    if not star:
        gather_floors(blocks, block, guard, work)
    for lane in range(count):
        i = centre[lane]
        if work[MARGIN * LANES + lane] > 0.0:
            points[i, 0] = work[TARGET * LANES + lane]
            points[i, 1] = work[(TARGET + 1) * LANES + lane]
        elif star and work[MARGIN * LANES + lane] == -np.inf:
            tally[DROPPED] += 1
        else:
            truncate(points, i, x, ring, n, lane, work, shift, guard, tally)


@kernel
def halve_abreast(x, ring, n, shift, single, work):
    """Halves the shifts of the lanes that are not allowed, all at once, until none is left or FEW_HALVINGS are made.

    For the level STAR, which refuses many moves whatever their length: those that make the worst cell of a star worse
    to first order. Row MARGIN: positive where the target is allowed; −∞ where the shift is to be dropped; else the
    scalar form, which knows inverted cells, is to try. Row SHARE: how much of the shift is left, 0 if none is allowed.
    """
    for lane in range(LANES):
        work[SHARE * LANES + lane] = 1.0
    for _ in range(FEW_HALVINGS):
        refused = 0
        for lane in range(LANES):
            halve = not work[MARGIN * LANES + lane] > 0.0
            refused += halve
            share = work[SHARE * LANES + lane] * (0.5 if halve else 1.0)
            work[SHARE * LANES + lane] = share
            size = work[SIZE * LANES + lane] * share
            work[TARGET * LANES + lane] = x[lane] + size * shift[lane]
            work[(TARGET + 1) * LANES + lane] = x[LANES + lane] + size * shift[LANES + lane]
        if single:
            for lane in range(TARGET * LANES, (TARGET + 2) * LANES):
                work[lane] = np.float64(np.float32(work[lane]))
        if refused == 0:
            return
        margins_above(ring, n, work)
    for lane in range(LANES):
        allowed_now = work[MARGIN * LANES + lane] > 0.0
        work[SHARE * LANES + lane] = work[SHARE * LANES + lane] if allowed_now else 0.0
        work[KEPT * LANES + lane] = work[TARGET * LANES + lane]
        work[(KEPT + 1) * LANES + lane] = work[(TARGET + 1) * LANES + lane]
        work[TARGET * LANES + lane] = x[lane]
        work[(TARGET + 1) * LANES + lane] = x[LANES + lane]
    margins(ring, n, 0.0, work)  # of the stars as they are
    for lane in range(LANES):
        margin = -np.inf if work[MARGIN * LANES + lane] > 0.0 else 0.0
        work[MARGIN * LANES + lane] = 1.0 if work[SHARE * LANES + lane] > 0.0 else margin
        work[TARGET * LANES + lane] = work[KEPT * LANES + lane]
        work[(TARGET + 1) * LANES + lane] = work[(KEPT + 1) * LANES + lane]


@kernel
def truncate(points, i, x, ring, n, lane, work, shift, guard, tally):
    """Halves the shift of one lane until it is allowed (Algorithm 1), or drops it.

    Below a floor a triangle comes by its first-order change, so that more than FEW_HALVINGS hardly ever help.
    """
    single, halvings = guard.single, HALVINGS if guard.floor <= 0.0 else FEW_HALVINGS
    size = work[SIZE * LANES + lane]
    dx = size * shift[lane]
    dy = size * shift[LANES + lane]
    if not (np.isfinite(dx) and np.isfinite(dy)):
        tally[DROPPED] += 1
        return
    for halving in range(halvings):
        tx = x[lane] + dx
        ty = x[LANES + lane] + dy
        if single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        if tx == x[lane] and ty == x[LANES + lane]:
            break
        delta = guard.unit * max(work[REACH * LANES + lane], max(abs(tx), abs(ty))) + guard.grain
        # Above a positive floor no triangle is inverted; what was inverted is for the whole rule to judge.
        if (
            clear(tx, ty, ring, n, lane, delta, guard.floor)
            if guard.floor > 0.0
            else allowed(tx, ty, x, ring, n, lane, delta, work)
        ):
            points[i, 0] = tx
            points[i, 1] = ty
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx *= 0.5
        dy *= 0.5
    tally[DROPPED] += 1
