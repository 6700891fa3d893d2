"""The order in memory: near nodes near each other, and stars of one colour and degree in blocks of LANES."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import LANES, kernel
from gmsnet.kernels.connectivity import counting_order


@kernel
def spread(x):
    """The lower 16 bits of x with a zero between any two."""
    x = (x | (x << 8)) & 0x00FF00FF
    x = (x | (x << 4)) & 0x0F0F0F0F
    x = (x | (x << 2)) & 0x33333333
    return (x | (x << 1)) & 0x55555555


@kernel
def morton_order(points):
    """Ids (int32) of the points (N, 2) along a Morton curve over a grid of 2¹⁶ × 2¹⁶, by two stable counting passes."""
    n = len(points)
    lower = np.empty(n, dtype=np.int32)
    upper = np.empty(n, dtype=np.int32)
    if n == 0:
        return lower
    left, right, bottom, top = np.inf, -np.inf, np.inf, -np.inf
    for i in range(n):
        left, right = min(left, points[i, 0]), max(right, points[i, 0])
        bottom, top = min(bottom, points[i, 1]), max(top, points[i, 1])
    extent = max(right - left, top - bottom)
    scale = 65535.0 / extent if extent > 0.0 else 0.0
    for i in range(n):
        code = spread(np.int64((points[i, 0] - left) * scale)) | (
            spread(np.int64((points[i, 1] - bottom) * scale)) << 1
        )
        lower[i] = code & 0xFFFF
        upper[i] = code >> 16
    order, _ = counting_order(lower, 65536)
    for i in range(n):
        lower[i] = upper[order[i]]
    second, _ = counting_order(lower, 65536)
    for i in range(n):
        upper[i] = order[second[i]]
    return upper


@kernel
def order_faces(first, corner, position):
    """Faces by the lowest place of their nodes in memory: the order; first and corner in that order and by place."""
    faces = len(first) - 1
    lowest = np.empty(faces, dtype=np.int32)
    for f in range(faces):
        least = position[corner[first[f]]] if first[f] < first[f + 1] else 0
        for h in range(first[f] + 1, first[f + 1]):
            least = min(least, position[corner[h]])
        lowest[f] = least
    order, _ = counting_order(lowest, len(position))
    new_first = np.zeros(faces + 1, dtype=np.int32)
    new_corner = np.empty_like(corner)
    end = 0
    for k in range(faces):
        f = order[k]
        for h in range(first[f], first[f + 1]):
            new_corner[end] = position[corner[h]]
            end += 1
        new_first[k + 1] = end
    return order, new_first, new_corner


@kernel
def blocks(free, start, ring, colours, degrees_most, colours_most):
    """Stars in blocks of LANES of one colour and degree, in memory order within each colour and degree.

    All nodes by their places in memory. free: (F,) ascending; start, ring: their rings in CSR form; colours: (N,).
    Returns centre (blocks·LANES,) and rings (flat), offset (blocks,) of each block's rings, degree, count
    (stars in the block; the lanes left over repeat the last one), first (colours + 1) block of each colour.
    A block's rings stand as [ring node][lane].
    """
    stars = len(free)
    key = np.empty(stars, dtype=np.int32)
    for i in range(stars):
        v = free[i]
        key[i] = colours[v] * (degrees_most + 1) + start[v + 1] - start[v]
    order, group = counting_order(key, (degrees_most + 1) * colours_most)
    number, length = 0, 0
    for g in range(len(group) - 1):
        some = (group[g + 1] - group[g] + LANES - 1) // LANES
        number += some
        length += some * LANES * (g % (degrees_most + 1))
    centre = np.empty(number * LANES, dtype=np.int32)
    rings = np.empty(length, dtype=np.int32)
    offset = np.empty(number, dtype=np.int64)
    degree = np.empty(number, dtype=np.int32)
    count = np.empty(number, dtype=np.int32)
    first = np.zeros(colours_most + 1, dtype=np.int32)
    b, end = 0, 0
    for g in range(len(group) - 1):
        n = g % (degrees_most + 1)
        for at in range(group[g], group[g + 1], LANES):
            offset[b], degree[b], count[b] = end, n, min(LANES, group[g + 1] - at)
            for lane in range(LANES):
                v = free[order[at + min(lane, count[b] - 1)]]
                centre[b * LANES + lane] = v
                for j in range(n):
                    rings[end + j * LANES + lane] = ring[start[v] + j]
            end += n * LANES
            b += 1
        first[g // (degrees_most + 1) + 1] = b
    return centre, rings, offset, degree, count, first
