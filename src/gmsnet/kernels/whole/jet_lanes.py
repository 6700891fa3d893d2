"""The normals of kernels.whole.jets, WIDE nodes at a time: where two rings tell a cubic, which is nearly everywhere.

Coordinates and sums stand as [what][lane], so that the lanes of a sum lie side by side.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.whole.jets import CUBIC, MORE, MOST, TINY, TOLD, UPRIGHT, UPSET, least_left, turn

WIDE = 64
TERMS = CUBIC + 1  # and the heights


@kernel
def list_neighbours(own, start, facets, first, around):
    """Writes the numbers around each number, each once. own, start, facets: see jets.list_facets.

    first: (numbers + 1,). around: (6F,), of which the beginning is written.
    """
    mark, count = np.full(len(first) - 1, -1, dtype=np.int32), 0
    for v in range(len(first) - 1):
        first[v] = count
        mark[v] = v
        for at in range(start[v], start[v + 1]):
            for k in range(3):
                u = own[np.uint32(facets[at]), k]
                if mark[np.uint32(u)] != v:
                    mark[np.uint32(u)], around[count] = v, u
                    count += 1
    first[len(first) - 1] = count


@part
def collect(v, first, around, mark, ring):
    """As jets.gather, by the numbers around each."""
    count, mark[v] = 0, v
    for at in range(first[v], first[v + 1]):
        if count < MOST:
            u = np.uint32(around[at])
            mark[u], ring[count] = v, u
            count += 1
    near = count
    for j in range(near):
        for at in range(first[ring[j]], first[ring[j] + 1]):
            u = np.uint32(around[at])
            if mark[u] != v and count < MOST:
                mark[u], ring[count] = v, u
                count += 1
    return near, count


@part
def take_in(place, v, ring, near, count, lane, away):
    """Writes the nodes of two rings into a lane, over the mean distance of those of the first one; False: all in one
    place."""
    x, y, z, total = place[v, 0], place[v, 1], place[v, 2], 0.0
    for j in range(count):
        u = np.uint32(ring[j])
        dx, dy, dz = place[u, 0] - x, place[u, 1] - y, place[u, 2] - z
        away[3 * j, lane], away[3 * j + 1, lane], away[3 * j + 2, lane] = dx, dy, dz
        total += dx * dx + dy * dy + dz * dz if j < near else 0.0
    scale = math.sqrt(near / total) if total > 0.0 else 0.0
    for k in range(3 * count):
        away[k, lane] *= scale
    return scale > 0.0


@part
def add_up(away, count, frame, row, moments):
    """The equations of all lanes, as jets.add_rows has them: the upper triangle, and the heights."""
    for k in range(CUBIC * TERMS):
        for lane in range(WIDE):
            moments[k, lane] = 0.0
    for j in range(count):
        for lane in range(WIDE):
            dx, dy, dz = away[3 * j, lane], away[3 * j + 1, lane], away[3 * j + 2, lane]
            square = dx * dx + dy * dy + dz * dz
            there = square > 0.0
            share = (1.0 if there else 0.0) / (square if there else 1.0)
            x = dx * frame[0, lane] + dy * frame[1, lane] + dz * frame[2, lane]
            y = dx * frame[3, lane] + dy * frame[4, lane] + dz * frame[5, lane]
            z = dx * frame[6, lane] + dy * frame[7, lane] + dz * frame[8, lane]
            xx, yy, u, w = x * x, y * y, share * x, share * y
            row[0, lane], row[1, lane] = x, y
            row[2, lane], row[3, lane] = u * (xx - 3.0 * yy), w * (3.0 * xx - yy)
            row[4, lane], row[5, lane], row[6, lane] = 1.0 if there else 0.0, share * (xx - yy), 2.0 * u * y
            row[7, lane], row[8, lane], row[9, lane] = u, w, share * z
        for p in range(CUBIC):
            for q in range(p, TERMS):
                k = TERMS * p + q
                for lane in range(WIDE):
                    moments[k, lane] += row[p, lane] * row[q, lane]


@part
def eliminate(moments, factor, told):
    """All unknowns but the last two, as jets.solve does."""
    for lane in range(WIDE):
        told[lane] = True
    for p in range(CUBIC - 2):
        for q in range(p + 1, CUBIC):
            for lane in range(WIDE):
                pivot = moments[(TERMS + 1) * p, lane]
                fits = pivot > TINY
                told[lane] = told[lane] and fits
                factor[lane] = moments[TERMS * p + q, lane] / (pivot if fits else 1.0)
            for r in range(q, TERMS):
                for lane in range(WIDE):
                    moments[TERMS * q + r, lane] -= factor[lane] * moments[TERMS * p + r, lane]


@kernel
def fit_in_lanes(place, first, around, chosen, before, normal, again, left):
    """Normals of chosen numbers (K,) from the cubic, each in the frame of its normal so far, into ``normal``.

    before: (numbers, 3) the normals at first. again, left: (K,), filled with the numbers whose frame is to be turned
    once more, and with those of which two rings do not tell enough; returns how many of each.
    """
    mark, ring = np.full(len(place), -1, dtype=np.int32), np.empty(MOST, dtype=np.int32)
    away, axes = np.zeros((3 * MOST, WIDE)), np.empty((3, 3))
    frame, row, moments = np.zeros((9, WIDE)), np.empty((TERMS, WIDE)), np.empty((CUBIC * TERMS, WIDE))
    factor, told, enough = np.empty(WIDE), np.empty(WIDE, dtype=np.bool_), np.empty(WIDE, dtype=np.bool_)
    counts, more, fewer = np.zeros(WIDE, dtype=np.int64), 0, 0
    for begin in range(0, len(chosen), WIDE):
        lanes, most = min(WIDE, len(chosen) - begin), 0
        for lane in range(lanes):
            v = chosen[begin + lane]
            near, count = collect(v, first, around, mark, ring)
            enough[lane] = count >= CUBIC + MORE and take_in(place, v, ring, near, count, lane, away)
            counts[lane] = count if enough[lane] else 0
            most = max(most, counts[lane])
            turn(axes, normal[v, 0], normal[v, 1], normal[v, 2])
            for k in range(9):
                frame[k, lane] = axes[k // 3, k % 3]
        for lane in range(WIDE):
            for k in range(3 * (counts[lane] if lane < lanes else 0), 3 * most):
                away[k, lane] = 0.0
        add_up(away, most, frame, row, moments)
        a, b, c = moments[7 * TERMS + 7].copy(), moments[7 * TERMS + 8].copy(), moments[8 * TERMS + 8].copy()
        eliminate(moments, factor, told)
        for lane in range(lanes):
            v = chosen[begin + lane]
            d, e, f = moments[7 * TERMS + 7, lane], moments[7 * TERMS + 8, lane], moments[8 * TERMS + 8, lane]
            if not (enough[lane] and told[lane] and least_left(a[lane], b[lane], c[lane], d, e, f) > TOLD):
                left[fewer] = v
                fewer += 1
                continue
            g, h = moments[7 * TERMS + 9, lane], moments[8 * TERMS + 9, lane]
            h = (d * h - e * g) / (d * f - e * e)
            g = (g - e * h) / d
            x = frame[6, lane] - g * frame[0, lane] - h * frame[3, lane]
            y = frame[7, lane] - g * frame[1, lane] - h * frame[4, lane]
            z = frame[8, lane] - g * frame[2, lane] - h * frame[5, lane]
            length = math.sqrt(x * x + y * y + z * z)
            x, y, z = x / length, y / length, z / length
            if not x * before[v, 0] + y * before[v, 1] + z * before[v, 2] >= UPRIGHT:
                left[fewer] = v
                fewer += 1
                continue
            normal[v, 0], normal[v, 1], normal[v, 2] = x, y, z
            if g * g + h * h >= UPSET:
                again[more] = v
                more += 1
    return more, fewer
