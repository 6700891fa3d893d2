"""A metric between the nodes of a mesh: linear in its logarithm on each triangle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part

OUTSIDE = -1e-9  # a barycentric coordinate: so far beyond an edge is rounding


class Background(NamedTuple):
    """Triangles (T, 3), counter-clockwise, of nodes at points (N, 2) with logarithms of the metric (N, 3).

    adjacent: (T, 3) the triangle beyond the edge opposite to each corner, −1 where there is none. first: (N,) a
    triangle of each node, −1 where it has none.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    adjacent: NDArray[np.int32]
    first: NDArray[np.int32]
    logs: NDArray[np.float64]


@kernel
def adjacency(triangles, order, keys, adjacent):
    """Fills in ``adjacent``. order: the half-edges 3t + c (opposite to corner c) by keys, which are alike for both."""
    adjacent[:] = -1
    for n in range(len(order) - 1):
        one, other = order[n], order[n + 1]
        if keys[one] == keys[other]:
            adjacent[one // 3, one % 3] = other // 3
            adjacent[other // 3, other % 3] = one // 3


@part
def barycentric(background, t, x, y):
    """The three coordinates of a place in triangle t; of a triangle without area all are NaN or infinite."""
    i, j, k = background.triangles[t, 0], background.triangles[t, 1], background.triangles[t, 2]
    p = background.points
    ax, ay, bx, by = p[i, 0] - x, p[i, 1] - y, p[j, 0] - x, p[j, 1] - y
    cx, cy = p[k, 0] - x, p[k, 1] - y
    one, two, three = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    inverse = 1.0 / (one + two + three)
    return one * inverse, two * inverse, three * inverse


@part
def locate(background, start, x, y):
    """The triangle of a place, on foot from ``start``; where the walk ends at a boundary, the nearest of all.

    Nearest is the one whose least barycentric coordinate is the largest.
    """
    t = start
    for _ in range(len(background.triangles)):
        one, two, three = barycentric(background, t, x, y)
        corner, least = 0, one
        if two < least:
            corner, least = 1, two
        if three < least:
            corner, least = 2, three
        if least >= OUTSIDE:
            return t
        t = background.adjacent[t, corner]
        if t < 0:
            break
    best, nearest = -np.inf, start
    for t in range(len(background.triangles)):
        one, two, three = barycentric(background, t, x, y)
        least = min(one, min(two, three))
        if least > best:
            best, nearest = least, t
            if least >= OUTSIDE:
                break
    return nearest


@inlined
def found_at(background, t, x, y, logs, slopes, n):
    """Writes row n of the logarithms and of their slopes at a place in triangle t, or at the nearest place of it."""
    p = background.points
    one, two, three = barycentric(background, t, x, y)
    one, two, three = max(one, 0.0), max(two, 0.0), max(three, 0.0)
    inverse = 1.0 / (one + two + three)
    i, j, k = background.triangles[t, 0], background.triangles[t, 1], background.triangles[t, 2]
    ax, ay, bx, by = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1], p[k, 0] - p[i, 0], p[k, 1] - p[i, 1]
    area = 1.0 / (ax * by - ay * bx)
    for c in range(3):
        at, to_j, to_k = background.logs[i, c], background.logs[j, c], background.logs[k, c]
        logs[n, c] = (one * at + two * to_j + three * to_k) * inverse
        to_j, to_k = to_j - at, to_k - at
        slopes[n, c, 0] = (to_j * by - to_k * ay) * area
        slopes[n, c, 1] = (to_k * ax - to_j * bx) * area


@kernel
def evaluate(background, places, start, logs, slopes):
    """The logarithms (n, 3) at places (n, 2), and their slopes (n, 3, 2) there.

    start: (n,) a triangle to look in first; it is written: where each place was found. Where it is negative, there is
    no metric, and the answer is 0. Beyond the boundary the value is that of the nearest place of a triangle.
    """
    for n in range(len(places)):
        if start[n] < 0:
            logs[n, :] = 0.0
            slopes[n, :, :] = 0.0
            continue
        start[n] = locate(background, start[n], places[n, 0], places[n, 1])
        found_at(background, start[n], places[n, 0], places[n, 1], logs, slopes, n)


@kernel
def evaluate_some(background, points, nodes, start, logs, slopes):
    """The same for some nodes (k,) of all points (N, 2), each with a triangle to look in first: their rows of start,
    logs and slopes are written."""
    for n in nodes:
        start[n] = locate(background, start[n], points[n, 0], points[n, 1])
        found_at(background, start[n], points[n, 0], points[n, 1], logs, slopes, n)
