"""Certifies shifts in SIMD lanes: positive margins are proofs. Others may be allowed all the same: see
kernels.star.truncation.

Loops are vectorised where offsets into one array are constants: slices of it could overlap, for all that is known.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.simplex.mean_ratio2 import half_lengths
from gmsnet.kernels.simplex.predicates import UNDERFLOW
from gmsnet.kernels.star.block import FLOORS, LOWEST_MARGIN, MARGIN, PAIRS, REACH, SIZE, TARGET, WIDTH, ring_row
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.pattern import count_of, other_of, pair_of, pattern_at, weights_of

WIDER = 1.0 + 2.0**-20  # so that what is rounded to float32 is an upper bound
NARROWEST = 0.25  # what counts as a star's extent at least, over its size, so that what underflows does not matter
COARSE, FINE = 2.0**-24, 2.0**-53  # units of rounding


@inlined
def error_bound(m, delta, u):
    """By how much the minimum margin D − φL of a star, as computed, may be off, whatever φ is.

    m: no component of the ring or the target minus the centre is larger, or none of the ring minus the target larger
    than 2m. delta: by how much a coordinate may be off. u: the unit of rounding. A component of a spoke, from the
    target, is off by at most e = 8(u·m + δ): by the rounding of a component, of its scaling and of the difference of
    two, by that of the target, and by what is not known of it and of the ring. D changes by 8·m·e + 2e² with that, and
    by 16u·m² for its own rounding; L/2 by 24·m·e + 6e² and 88u·m²; 2φ is at most 1/√3; the difference rounds by
    36u·m². That is 22·m·e + 6e² + 104u·m² in all, which is less than 512·m·(u·m + δ), or that is more than any margin.
    Of other weights, none above √3 and one of them 0, L/2 changes by 28·m·e + 7e², and by 128u·m² for its rounding, so
    that with the difference it is less than that, too.
    """
    return 512.0 * m * (u * m + delta)


@part
def certify(local, n, pattern, shift, floor, unit, grain, work, sums):
    """Row MARGIN: positive where all triangles are certified above the floor, which is not negative, after the shift.

    local, shift: over row SIZE of work, as stars.localise leaves them, [axis][lane]. Reads TARGET and REACH, too.
    sums: two rows to work in, float32.
    """
    real = sums.dtype.type
    twice = real(2.0 * WIDER * floor)
    for lane in range(LANES):
        sums[LOWEST_MARGIN * LANES + lane] = np.inf
        sums[WIDTH * LANES + lane] = max(NARROWEST, max(abs(shift[lane]), abs(shift[LANES + lane])))
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, real)
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py = real(p[lane] - shift[lane]), real(p[LANES + lane] - shift[LANES + lane])
            qx, qy = real(q[lane] - shift[lane]), real(q[LANES + lane] - shift[LANES + lane])
            margin = margin_of(px, py, qx, qy, twice, weights)
            least = sums[LOWEST_MARGIN * LANES + lane]
            # A shift that is not finite makes every margin NaN or −∞, and no comparison with it holds.
            sums[LOWEST_MARGIN * LANES + lane] = margin if not margin >= least else least
            sums[WIDTH * LANES + lane] = max(sums[WIDTH * LANES + lane], widest(px, py, qx, qy, weights))
    for lane in range(LANES):
        reach = max(
            work[REACH * LANES + lane], max(abs(work[TARGET * LANES + lane]), abs(work[(TARGET + 1) * LANES + lane]))
        )
        delta = WIDER * (unit * reach + grain) / work[SIZE * LANES + lane]
        work[MARGIN * LANES + lane] = sums[LOWEST_MARGIN * LANES + lane] - error_bound(
            sums[WIDTH * LANES + lane], delta, COARSE
        )


@inlined
def margin_of(px, py, qx, qy, twice, weights):
    """D − φL of the simplex (0, p, q), as computed; 2φ given."""
    return (px * qy - py * qx) - twice * half_lengths(px, py, qx, qy, weights)


@inlined
def widest(px, py, qx, qy, weights):
    """The largest component of the two spokes; of a fan, where each node is the second one once, of the second."""
    if weights is None:
        return max(abs(qx), abs(qy))
    return max(max(abs(px), abs(py)), max(abs(qx), abs(qy)))


@part
def certify_stars(star, n, pattern, above, unit, grain, work):
    """As ``certify``, each triangle above ``above`` times the floor in its row from FLOORS on, in float64 from the
    coordinates: for the level STAR, at which most stars are near their floors.
    """
    for lane in range(LANES):
        work[MARGIN * LANES + lane] = np.inf
        work[PAIRS * LANES + lane] = 0.0
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, np.float64)
        p, q = ring_row(star, i), ring_row(star, j)
        for lane in range(LANES):
            tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
            px, py, qx, qy = p[2 * lane] - tx, p[2 * lane + 1] - ty, q[2 * lane] - tx, q[2 * lane + 1] - ty
            twice = 2.0 * above * max(work[(FLOORS + k) * LANES + lane], 0.0)
            margin, least = margin_of(px, py, qx, qy, twice, weights), work[MARGIN * LANES + lane]
            work[MARGIN * LANES + lane] = margin if not margin >= least else least
            work[PAIRS * LANES + lane] = max(work[PAIRS * LANES + lane], widest(px, py, qx, qy, weights))
    for lane in range(LANES):
        tx, ty = work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane]
        delta = unit * max(work[REACH * LANES + lane], max(abs(tx), abs(ty))) + grain
        work[MARGIN * LANES + lane] -= error_bound(work[PAIRS * LANES + lane], delta, FINE) + UNDERFLOW


@part
def gather_floors(blocks, block, guard, work):
    """The floor of each simplex of a block's stars, into the rows from FLOORS on.

    At the level STAR that is the largest of the floors of its cell's nodes, else the mesh's.
    """
    n, pattern = blocks.degree[block], pattern_at(blocks.patterns, blocks.pattern, block)
    if len(guard) != WITH_FLOORS:
        for k in range(FLOORS * LANES, (FLOORS + count_of(pattern, n)) * LANES):
            work[k] = guard.floor
        return
    rings, offset, floors = blocks.rings, blocks.offset[block], guard.floors
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        other = other_of(pattern, k, i)
        for lane in range(LANES):
            floor = floors[blocks.centre[block * LANES + lane]]
            around = max(floors[rings[offset + i * LANES + lane]], floors[rings[offset + j * LANES + lane]])
            around = max(around, floors[rings[offset + other * LANES + lane]])
            work[(FLOORS + k) * LANES + lane] = max(floor, around)
