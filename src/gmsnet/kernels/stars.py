"""What every smoother shares: gather a block of stars, judge the proposed shifts, commit those that break nothing.

A block is LANES stars of one colour and degree n. Its free nodes stand in ``x`` as [axis][lane], its rings in ``ring``
as [ring node][axis][lane], flat. Stars of one colour share no cell, so a block may be committed at once.

The guard. A triangle is *certified* if its determinant exceeds the error bound of kernels.predicates with the
coordinates known up to ±δ, δ the file's unit of rounding times the star's largest coordinate plus the grain of the
numbers next to zero: it is then positive in exact arithmetic, in float64, and as written. A move is allowed if each
triangle of the star is certified after it, or was certainly inverted before and is certainly less so after it. So no
valid cell becomes invalid, and invalid ones only get better. A shift that is not allowed is halved, as the paper's
Algorithm 1 does, and dropped after HALVINGS.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.compile import LANES, kernel
from gmsnet.kernels.predicates import SHEWCHUK, UNDERFLOW, determinant_and_bound

HALVINGS = 20
MOVED, TRUNCATED, DROPPED = range(3)  # what a sweep counts
COUNTERS = 32  # room for them on cache lines of their own, so that threads do not wait for each other's counts
SIZE, REACH, TARGET, MARGIN = 0, 1, 2, 4  # rows of a block's work array; TARGET has two


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


class Precision(NamedTuple):
    """How exactly the coordinates of a mesh are known once they are written.

    unit: the largest relative error (2⁻⁵³ for float64 and decimal text, 2⁻²⁴ where a file keeps float32).
    grain: the largest absolute error next to zero, where floats are evenly spaced. single: round every new coordinate
    to float32, because the file will.
    """

    unit: float = 2.0**-53
    grain: float = 0.0
    single: bool = False

    @classmethod
    def of(cls, *, single: bool, exponent: int) -> Precision:
        """For coordinates that have been divided by 2 to the power of ``exponent``."""
        if single:
            return cls(2.0**-24, math.ldexp(1.0, -150 - exponent), single=True)
        grain = math.ldexp(1.0, -1075 - exponent)
        return cls(grain=grain if grain > 1e-290 else 0.0)  # a subnormal one would only be slow


@kernel
def room(most):
    """The arrays that a sweep works in: x, ring, work (8 rows) and counts, for stars of up to so many neighbours."""
    return (
        np.empty(2 * LANES),
        np.empty(2 * most * LANES),
        np.empty(8 * LANES),
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
    rings, offset = blocks.rings, blocks.offset[block]
    for lane in range(LANES):
        i = blocks.centre[block * LANES + lane]
        x[lane] = points[i, 0]
        x[LANES + lane] = points[i, 1]
    for j in range(n):
        for lane in range(LANES):
            i = rings[offset + j * LANES + lane]
            ring[2 * j * LANES + lane] = points[i, 0]
            ring[(2 * j + 1) * LANES + lane] = points[i, 1]


@kernel
def localise(x, ring, n, work, local):
    """Ring minus centre over the size of the star, in the type of ``local``.

    This is the paper's normalisation: one factor d = max(Δx, Δy), the larger side of the bounding box of the n + 1
    nodes, the free node at the origin. d goes to row SIZE of ``work`` (rows of LANES), the largest absolute coordinate
    of the star to row REACH.
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
        work[SIZE * LANES + lane] = size
        work[REACH * LANES + lane] = max(max(-left, right), max(-bottom, top))
        work[4 * LANES + lane] = 1.0 / size if size > 0.0 else 0.0
    for j in range(n):
        p = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            q[lane] = (p[lane] - x[lane]) * work[4 * LANES + lane]
            q[LANES + lane] = (p[LANES + lane] - x[LANES + lane]) * work[4 * LANES + lane]


@kernel
def margins(ring, n, work):
    """For each lane the least certified surplus of a triangle with the free node at its target; positive: allowed.

    Rows of work: reads TARGET and the one after it, and REACH, which becomes the uncertainty δ; writes MARGIN.
    """
    for lane in range(LANES):
        work[MARGIN * LANES + lane] = np.inf
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = ring[2 * i * LANES : 2 * (i + 1) * LANES]
        q = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            delta = work[REACH * LANES + lane]
            px = p[lane] - work[TARGET * LANES + lane]
            py = p[LANES + lane] - work[(TARGET + 1) * LANES + lane]
            qx = q[lane] - work[TARGET * LANES + lane]
            qy = q[LANES + lane] - work[(TARGET + 1) * LANES + lane]
            left = px * qy
            right = py * qx
            around = abs(px) + abs(py) + abs(qx) + abs(qy) + 4.0 * delta
            bound = SHEWCHUK * (abs(left) + abs(right)) + UNDERFLOW + 4.0 * delta * around
            surplus = (left - right) - bound
            least = work[MARGIN * LANES + lane]
            # A target that is not finite makes every surplus NaN or −∞, and no comparison with it holds.
            work[MARGIN * LANES + lane] = surplus if not surplus >= least else least


@kernel
def allowed(tx, ty, x, ring, n, lane, delta):
    """May the free node of one lane move to (tx, ty)? The scalar form of the rule, which also knows inverted cells."""
    for j in range(n):
        a = 2 * (n - 1 if j == 0 else j - 1) * LANES + lane
        b = 2 * j * LANES + lane
        after, doubt = determinant_and_bound(ring[a], ring[a + LANES], ring[b], ring[b + LANES], tx, ty, delta)
        if after > doubt:
            continue
        before, doubt_before = determinant_and_bound(
            ring[a], ring[a + LANES], ring[b], ring[b + LANES], x[lane], x[LANES + lane], delta
        )
        if not (before < -doubt_before and after - doubt > before + doubt_before):
            return False
    return True


@kernel
def commit(points, blocks, block, x, ring, work, shift, precision, tally):
    """Moves the free nodes of a block by size·shift, truncated by the guard; counts what happened in ``tally``.

    work: rows of LANES as ``localise`` leaves them; shift: (2·LANES,) over the star's size.
    """
    n, count, centre = blocks.degree[block], blocks.filled[block], blocks.centre
    unit, grain, single = precision.unit, precision.grain, precision.single
    for lane in range(LANES):
        tx = x[lane] + work[SIZE * LANES + lane] * shift[lane]
        ty = x[LANES + lane] + work[SIZE * LANES + lane] * shift[LANES + lane]
        work[TARGET * LANES + lane] = tx
        work[(TARGET + 1) * LANES + lane] = ty
    if single:
        for lane in range(TARGET * LANES, (TARGET + 2) * LANES):
            work[lane] = np.float64(np.float32(work[lane]))
    for lane in range(LANES):
        target = max(abs(work[TARGET * LANES + lane]), abs(work[(TARGET + 1) * LANES + lane]))
        work[REACH * LANES + lane] = unit * max(work[REACH * LANES + lane], target) + grain
    margins(ring, n, work)
    for lane in range(count):
        i = centre[block * LANES + lane]
        if work[MARGIN * LANES + lane] > 0.0:
            tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
            tally[MOVED] += tx != x[lane] or ty != x[LANES + lane]
            points[i, 0] = tx
            points[i, 1] = ty
        else:
            size, delta = work[SIZE * LANES + lane], work[REACH * LANES + lane]
            truncate(points, i, x, ring, n, lane, size, shift, delta, single, tally)


@kernel
def truncate(points, i, x, ring, n, lane, size, shift, delta, single, tally):
    """Halves the shift of one lane until it is allowed (Algorithm 1), or drops it."""
    dx = size * shift[lane]
    dy = size * shift[LANES + lane]
    if not (np.isfinite(dx) and np.isfinite(dy)):
        tally[DROPPED] += 1
        return
    for halving in range(HALVINGS):
        tx = x[lane] + dx
        ty = x[LANES + lane] + dy
        if single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        if tx == x[lane] and ty == x[LANES + lane]:
            break
        if allowed(tx, ty, x, ring, n, lane, delta):
            points[i, 0] = tx
            points[i, 1] = ty
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx *= 0.5
        dy *= 0.5
    tally[DROPPED] += 1
