"""Areas that are kept within a band around those of the input: shifts are shortened so that no cell leaves it.

Of a corner simplex (p, r_i, r_j) with what is around it fixed, D is an affine function of the free node's place p. So
the places where D lies in a band form a strip, and those where all simplices of a star do form a convex polygon. A
shift that ends outside ends where it leaves the polygon instead; what is halved after that remains inside. Twice the
area of a quad is the sum of the D at two opposite corners: it stays in the band with them.

A node that slides goes to places on its curve, beside the straight line of its shift. They, and those of its halves,
must lie in bands that are wider by ROOM; else the shift is halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, part
from gmsnet.kernels.star.constraint import snap
from gmsnet.kernels.star.pattern import count_of, other_of, pair_of, pattern_at

ROOM = 0.0005  # of D of the input
TRIES = 8  # halvings of the shift of a node that slides
HALVES = 6  # of a shift that are looked at: smaller ones are off the straight line by less than ROOM


class Bands(NamedTuple):
    """Which cells keep their areas: those whose corners are all ``kept``, each corner simplex that was positive.

    start: (N, 2) the points of the input, in memory order. kept: (N,) bool; both empty where there are none. width:
    the band is [1 − width, 1 + width] times D of the input.
    """

    start: NDArray[np.float64]
    kept: NDArray[np.bool_]
    width: float


def no_bands() -> Bands:
    """No cell has one."""
    return Bands(np.empty((0, 2)), np.empty(0, dtype=np.bool_), 0.0)


@part
def shorten(bands, constraint, blocks, block, star, sizes, shift):
    """Shortens the shifts (2·LANES, over the stars' sizes) of a block so that they end inside all bands.

    star: as ``block.gather`` leaves it; sizes: (LANES,).
    """
    for lane in range(LANES):
        c = blocks.centre[block * LANES + lane]
        if not bands.kept[c]:
            continue
        size = sizes[lane]
        dx, dy = size * shift[lane], size * shift[LANES + lane]
        if constraint is not None and constraint.row[c] >= 0:
            dx, dy = shortened_on_curve(bands, constraint, blocks, block, lane, star, dx, dy)
            if size > 0.0:
                shift[lane], shift[LANES + lane] = dx / size, dy / size
            continue
        share = share_in_all(bands, bands.width, blocks, block, lane, star, dx, dy)
        shift[lane] *= share
        shift[LANES + lane] *= share


@part
def shortened_on_curve(bands, constraint, blocks, block, lane, star, dx, dy):
    """The shift of a node that slides, so short that its place on the curve, and those of its halves, are in all bands.

    (0, 0) where no such shift is found.
    """
    c, x, y = blocks.centre[block * LANES + lane], star[2 * lane], star[2 * lane + 1]
    tx, ty, _ = snap(constraint, c, x + dx, y + dy)
    dx, dy = tx - x, ty - y
    share = share_in_all(bands, bands.width, blocks, block, lane, star, dx, dy)
    for _ in range(TRIES):
        tx, ty, _ = snap(constraint, c, x + share * dx, y + share * dy)
        dx, dy, inside = tx - x, ty - y, True
        for half in range(HALVES + 1):
            part_of = 0.5**half
            tx, ty, _ = snap(constraint, c, x + part_of * dx, y + part_of * dy)
            inside &= share_in_all(bands, bands.width + ROOM, blocks, block, lane, star, tx - x, ty - y) == 1.0
        if inside:
            return dx, dy
        share = 0.5
    return 0.0, 0.0


@part
def share_in_all(bands, width, blocks, block, lane, star, dx, dy):
    """How much of the shift (dx, dy) of a lane's node keeps all simplices of its star in their bands, 0 to 1."""
    n, offset, pattern = blocks.degree[block], blocks.offset[block], pattern_at(blocks.patterns, blocks.pattern, block)
    c, share = blocks.centre[block * LANES + lane], 1.0
    x, y = star[2 * lane], star[2 * lane + 1]
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        if not bands.kept[blocks.rings[offset + other_of(pattern, k, i) * LANES + lane]]:
            continue
        a, b = blocks.rings[offset + i * LANES + lane], blocks.rings[offset + j * LANES + lane]
        p, q = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
        px, py, qx, qy = star[p] - x, star[p + 1] - y, star[q] - x, star[q + 1] - y
        share = min(share, share_inside(bands, width, c, a, b, px, py, qx, qy, dx, dy))
    return share


@part
def share_inside(bands, width, c, a, b, px, py, qx, qy, dx, dy):
    """How much of the shift (dx, dy) of node c keeps the simplex c, a, b (counter-clockwise) in its band, 0 to 1.

    width: of the band. p, q: the nodes a and b minus c, as they are now. One that has left its band, by rounding, may
    go back but no further away. A shift that is not finite is none of this function's business.
    """
    if not (bands.kept[a] and bands.kept[b] and bands.kept[c]):
        return 1.0
    start = bands.start
    d = (start[a, 0] - start[c, 0]) * (start[b, 1] - start[c, 1])
    d -= (start[a, 1] - start[c, 1]) * (start[b, 0] - start[c, 0])
    slope = dx * (py - qy) + dy * (qx - px)  # D along the shift: D + s·slope
    if not (d > 0.0 and abs(slope) > 0.0 and abs(slope) < np.inf):
        return 1.0
    end = (1.0 + width if slope > 0.0 else 1.0 - width) * d
    return min(max((end - (px * qy - py * qx)) / slope, 0.0), 1.0)
