"""Bands for areas and heights of simplices: which D they may have, and how far a node may slide so that none leaves.

Of a corner simplex (p, r_i, r_j) with what is around it fixed, D is an affine function of the free node's place p. So
the places where D lies in a band form a strip, and those where all simplices of a star do form a convex polygon. Twice
the area of a quad is the sum of the D at two opposite corners. As one of its nodes moves, the D opposite to that, its
``rest``, does not change. So the band of a quad is one for the D at the moving node, less the rest; the D at the
corners beside have none.

A band reaches from 1 − AREA to 1 + AREA times what D is at the start. Where areas are noisy, so that nobody meant
them, it is wider: it reaches to the share ``blend`` of the way (of logarithms) from there to the mean of the areas
around, and beyond both ends by the factor ``room``.

Simplices at a wall, with two corners on it, have a band for their height over these, too: the same with HEIGHT instead
of AREA, and the wider the less ``firm`` the wall is. With L the distance of the two, D is L times the height. So this
is a band for D, as long as they stay; where they slide, it goes with L.

A node that slides goes to places on its curve, beside the straight line of its shift. They, and those of its halves,
must lie in bands of areas that are wider by ROOM, and in those of heights; else the shift is halved.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.star.constraint import snap
from gmsnet.kernels.star.pattern import (
    AT_FIRST,
    AT_SECOND,
    NONE,
    OWN,
    corner_of,
    count_of,
    other_of,
    pair_of,
    pattern_at,
)

AREA, HEIGHT = 0.099, 0.0198  # a tenth and a fiftieth, and room for rounding, and for nodes that slide
# Times the ends for areas those for heights are.
LOWER, UPPER = (1.0 - HEIGHT) / (1.0 - AREA), (1.0 + HEIGHT) / (1.0 + AREA)
NOWHERE, OPPOSITE, FIRST, SECOND = range(4)  # where the wall is: at the pair, or at the centre and one of the pair
ROOM = 0.0005  # of the ends of a band
TRIES = 8  # halvings of the shift of a node that slides
HALVES = 6  # of a shift that are looked at: smaller ones are off the straight line by less than ROOM
TINY = 1e-300


class Bands(NamedTuple):
    """The ends of the band of each simplex of the stars in blocks, [simplex][lane]; ±∞ where it has none.

    They are of twice the area of its cell: of D, and for a quad of D and the rest. first: (B,) where those of each
    block begin. edge: int8, which two of its corners are on a wall. least, most: the ends for its height over these,
    where they are.
    """

    first: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    edge: NDArray[np.int8]
    least: NDArray[np.float64]
    most: NDArray[np.float64]


def bands_for(first: NDArray[np.int64], count: int) -> Bands:
    """Of so many simplices, to be written by ``limit``."""
    low, high, least, most = np.empty((4, count))
    return Bands(first, low, high, np.empty(count, dtype=np.int8), least, most)


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
def limit(start, kept, log_mean, blend, room, firm, blocks, bands):
    """Writes the bands of all stars. Cells have one that have all corners ``kept`` and, at the start, a positive D.

    start: (N, 2). kept: (N,) bool. log_mean: as ``mean_areas`` leaves it; of a quad it is compared with half of its
    sum of D. blend, room: (N,), of a simplex the means of its corners'. firm: (N,), above 0 where a node is on a wall
    with bands for heights.
    """
    for block in range(len(blocks.degree)):
        n, offset, first = blocks.degree[block], blocks.offset[block], bands.first[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        for k in range(count_of(pattern, n)):
            i, j = pair_of(pattern, n, k)
            other, corner = other_of(pattern, k, i), corner_of(pattern, k)
            for lane in range(LANES):
                at, c = first + k * LANES + lane, blocks.centre[block * LANES + lane]
                a, b = blocks.rings[offset + i * LANES + lane], blocks.rings[offset + j * LANES + lane]
                o = blocks.rings[offset + other * LANES + lane]
                ax, ay = start[a, 0] - start[c, 0], start[a, 1] - start[c, 1]
                bx, by = start[b, 0] - start[c, 0], start[b, 1] - start[c, 1]
                d = ax * by - ay * bx
                bands.low[at], bands.high[at], bands.edge[at] = -np.inf, np.inf, NOWHERE
                if not (d > 0.0 and kept[a] and kept[b] and kept[c] and kept[o]):
                    continue
                noise = (blend[a] + blend[b] + blend[c]) / 3.0
                mean = (log_mean[a] + log_mean[b] + log_mean[c]) / 3.0
                far = (room[a] + room[b] + room[c]) / 3.0
                if corner == NONE:
                    bands.low[at], bands.high[at] = band_about(d, mean, noise, far)
                elif corner == OWN:
                    rest = rest_of(ax, ay, bx, by, start[o, 0] - start[c, 0], start[o, 1] - start[c, 1])
                    if rest > 0.0:
                        low, high = band_about(0.5 * (d + rest), mean, noise, far)
                        bands.low[at], bands.high[at] = 2.0 * low, 2.0 * high
                if firm[a] > 0.0 and firm[b] > 0.0 and firm[c] == 0.0 and corner != OWN:
                    bands.edge[at], p, q = OPPOSITE, a, b
                elif firm[c] > 0.0 and firm[a] > 0.0 and firm[b] == 0.0 and corner != AT_SECOND:
                    bands.edge[at], p, q = FIRST, c, a
                elif firm[c] > 0.0 and firm[b] > 0.0 and firm[a] == 0.0 and corner != AT_FIRST:
                    bands.edge[at], p, q = SECOND, c, b
                else:
                    continue
                calm = min(firm[p], firm[q]) * (1.0 - noise)
                length = math.hypot(start[p, 0] - start[q, 0], start[p, 1] - start[q, 1])
                low, high = band_about(d, mean, noise, far)
                bands.least[at] = low * LOWER**calm / length
                bands.most[at] = high * UPPER**calm / length


@part
def band_about(d, mean, noise, far):
    """The ends of a band for areas about ``d``. mean: the logarithm of the mean around; noise: the blend; far: room."""
    way = noise * (mean - math.log(max(d, TINY)))
    return (1.0 - AREA) * d * math.exp(min(way, 0.0)) / far, (1.0 + AREA) * d * math.exp(max(way, 0.0)) * far


@part
def rest_of(ax, ay, bx, by, ox, oy):
    """D at the corner opposite to the free node in a quad, of which a and b are beside it, and o is opposite."""
    return (ox - ax) * (by - ay) - (oy - ay) * (bx - ax)


@part
def rest_in(pattern, k, i, j, where, first, step):
    """The rest of simplex k with the pair (i, j); 0 but at a quad's own corner.

    where: x of the node in row r of those around at first + 2·r·LANES, y ``step`` further.
    """
    if pattern is None or corner_of(pattern, k) != OWN:
        return 0.0
    a, b, o = first + 2 * i * LANES, first + 2 * j * LANES, first + 2 * other_of(pattern, k, i) * LANES
    return rest_of(where[a], where[a + step], where[b], where[b + step], where[o], where[o + step])


@part
def ends_of(bands, at, rest, length):
    """The band of a simplex, as D, now that its rest is this, and the pair's nodes are so far from each other."""
    low, high = bands.low[at] - rest, bands.high[at] - rest
    if bands.edge[at] == OPPOSITE:
        low, high = max(low, length * bands.least[at]), min(high, length * bands.most[at])
    return low, high


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
            inside &= heights_kept(bands, blocks, block, lane, star, tx - x, ty - y)
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
        rest = rest_in(pattern, k, i, j, star, 2 * (LANES + lane), 1)
        low = (1.0 - wider) * bands.low[first + k * LANES + lane] - rest
        high = (1.0 + wider) * bands.high[first + k * LANES + lane] - rest
        p, q = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
        px, py, qx, qy = star[p] - x, star[p + 1] - y, star[q] - x, star[q + 1] - y
        share = min(share, share_inside(low, high, px, py, qx, qy, dx, dy))
    return share


@part
def heights_kept(bands, blocks, block, lane, star, dx, dy):
    """Are the heights over a wall that a lane's node is on in their bands, if it goes by (dx, dy) along it?"""
    n, first, kept = blocks.degree[block], bands.first[block], True
    pattern = pattern_at(blocks.patterns, blocks.pattern, block)
    x, y = star[2 * lane] + dx, star[2 * lane + 1] + dy
    for k in range(count_of(pattern, n)):
        at = first + k * LANES + lane
        edge = bands.edge[at]
        if edge in (FIRST, SECOND):
            i, j = pair_of(pattern, n, k)
            p, q = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
            px, py, qx, qy = star[p] - x, star[p + 1] - y, star[q] - x, star[q + 1] - y
            length = math.hypot(px, py) if edge == FIRST else math.hypot(qx, qy)
            d = px * qy - py * qx
            kept &= length * bands.least[at] < d < length * bands.most[at]
    return kept


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
