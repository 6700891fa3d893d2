"""Bands for the areas of simplices: which D they may have, and how far a node may slide so that none leaves its band.

Of a corner simplex (p, r_i, r_j) with what is around it fixed, D is an affine function of the free node's place p. So
the places where D lies in a band form a strip, and those where all simplices of a star do form a convex polygon. Twice
the area of a quad is the sum of the D at two opposite corners: it stays in the band with them.

A band reaches from 1 − width to 1 + width times what D is at the start. Where areas are noisy, so that nobody meant
them, it is wider: it reaches to the share ``blend`` of the way (of logarithms) from there to the mean of the areas
around, and beyond both ends by the factor ``room``.

A node that slides goes to places on its curve, beside the straight line of its shift. They, and those of its halves,
must lie in bands that are wider by ROOM; else the shift is halved.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.star.constraint import snap
from gmsnet.kernels.star.pattern import count_of, other_of, pair_of, pattern_at

ROOM = 0.0005  # of the ends of a band
TRIES = 8  # halvings of the shift of a node that slides
HALVES = 6  # of a shift that are looked at: smaller ones are off the straight line by less than ROOM
TINY = 1e-300


class Bands(NamedTuple):
    """The ends of the band of each simplex of the stars in blocks, [simplex][lane], as D; ±∞ where it has none.

    first: (B,) where those of each block begin.
    """

    first: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@kernel
def mean_areas(points, triangles, log_mean):
    """(N,) the logarithm of the mean |D| of the simplices (T, 3) around each node."""
    number = np.zeros(len(points))
    log_mean[:] = 0.0
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        for c in range(3):
            log_mean[triangles[t, c]] += abs(ax * by - ay * bx)
            number[triangles[t, c]] += 1.0
    for i in range(len(points)):
        log_mean[i] = math.log(max(log_mean[i] / max(number[i], 1.0), TINY))


@kernel
def limit(start, kept, width, log_mean, blend, room, blocks, bands):
    """Writes the bands of all stars. Cells have one that have all corners ``kept`` and, at the start, a positive D.

    start: (N, 2). kept: (N,) bool. log_mean: as ``mean_areas`` leaves it. blend, room: (N,), of a simplex the means of
    its corners'.
    """
    for block in range(len(blocks.degree)):
        n, offset, first = blocks.degree[block], blocks.offset[block], bands.first[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        for k in range(count_of(pattern, n)):
            i, j = pair_of(pattern, n, k)
            other = other_of(pattern, k, i)
            for lane in range(LANES):
                at, c = first + k * LANES + lane, blocks.centre[block * LANES + lane]
                a, b = blocks.rings[offset + i * LANES + lane], blocks.rings[offset + j * LANES + lane]
                d = (start[a, 0] - start[c, 0]) * (start[b, 1] - start[c, 1])
                d -= (start[a, 1] - start[c, 1]) * (start[b, 0] - start[c, 0])
                bands.low[at], bands.high[at] = -np.inf, np.inf
                if d > 0.0 and kept[a] and kept[b] and kept[c] and kept[blocks.rings[offset + other * LANES + lane]]:
                    way = (blend[a] + blend[b] + blend[c]) / 3.0
                    way *= (log_mean[a] + log_mean[b] + log_mean[c]) / 3.0 - math.log(max(d, TINY))
                    far = (room[a] + room[b] + room[c]) / 3.0
                    bands.low[at] = (1.0 - width) * d * math.exp(min(way, 0.0)) / far
                    bands.high[at] = (1.0 + width) * d * math.exp(max(way, 0.0)) * far


@part
def shorten(bands, constraint, blocks, block, star, sizes, shift):
    """Shortens the shifts (2·LANES, over the stars' sizes) of a block's nodes that slide, so that all end in bands.

    star: as ``block.gather`` leaves it; sizes: (LANES,).
    """
    if constraint is None:
        return
    for lane in range(LANES):
        if constraint.row[blocks.centre[block * LANES + lane]] >= 0 and sizes[lane] > 0.0:
            dx, dy = sizes[lane] * shift[lane], sizes[lane] * shift[LANES + lane]
            dx, dy = shortened_on_curve(bands, constraint, blocks, block, lane, star, dx, dy)
            shift[lane], shift[LANES + lane] = dx / sizes[lane], dy / sizes[lane]


@part
def shortened_on_curve(bands, constraint, blocks, block, lane, star, dx, dy):
    """The shift of a node that slides, so short that its place on the curve, and those of its halves, are in all bands.

    (0, 0) where no such shift is found.
    """
    c, x, y = blocks.centre[block * LANES + lane], star[2 * lane], star[2 * lane + 1]
    tx, ty, _ = snap(constraint, c, x + dx, y + dy)
    dx, dy = tx - x, ty - y
    share = share_in_all(bands, 0.0, blocks, block, lane, star, dx, dy)
    for _ in range(TRIES):
        tx, ty, _ = snap(constraint, c, x + share * dx, y + share * dy)
        dx, dy, inside = tx - x, ty - y, True
        for half in range(HALVES + 1):
            part_of = 0.5**half
            tx, ty, _ = snap(constraint, c, x + part_of * dx, y + part_of * dy)
            inside &= share_in_all(bands, ROOM, blocks, block, lane, star, tx - x, ty - y) == 1.0
        if inside:
            return dx, dy
        share = 0.5
    return 0.0, 0.0


@part
def share_in_all(bands, wider, blocks, block, lane, star, dx, dy):
    """How much of the shift (dx, dy) of a lane's node keeps all simplices of its star in their bands, 0 to 1.

    wider: by this share of their ends.
    """
    n, first, share = blocks.degree[block], bands.first[block], 1.0
    pattern = pattern_at(blocks.patterns, blocks.pattern, block)
    x, y = star[2 * lane], star[2 * lane + 1]
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        low, high = bands.low[first + k * LANES + lane], bands.high[first + k * LANES + lane]
        p, q = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
        px, py, qx, qy = star[p] - x, star[p + 1] - y, star[q] - x, star[q + 1] - y
        share = min(share, share_inside((1.0 - wider) * low, (1.0 + wider) * high, px, py, qx, qy, dx, dy))
    return share


@part
def share_inside(low, high, px, py, qx, qy, dx, dy):
    """How much of the shift (dx, dy) keeps D of the simplex with the spokes p and q between low and high, 0 to 1.

    One that has left its band, by rounding, may go back but no further away. A shift that is not finite is none of
    this function's business, and a band without ends lets all pass.
    """
    slope = dx * (py - qy) + dy * (qx - px)  # D along the shift: D + s·slope
    end = high if slope > 0.0 else low
    if not (abs(end) < np.inf and abs(slope) > 0.0 and abs(slope) < np.inf):
        return 1.0
    return min(max((end - (px * qy - py * qx)) / slope, 0.0), 1.0)
