"""The facets of a surface that are nearest to points, found exactly through a grid of boxes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part


class Boxes(NamedTuple):
    """Triangles (T, 3, 3) in a grid of boxes: its low corner (3,), their width, and how many there are along each axis
    (3,); the triangles of each in CSR form, with one entry of start more than is needed."""

    triangles: NDArray[np.float64]
    low: NDArray[np.float64]
    width: float
    shape: NDArray[np.int64]
    start: NDArray[np.int64]
    entries: NDArray[np.int32]


@inlined
def to_segment(px, py, pz, a, b):
    """The squared distance of a point from the segment between points a and b (3,)."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    wx, wy, wz = px - a[0], py - a[1], pz - a[2]
    square, t = ux * ux + uy * uy + uz * uz, 0.0
    if square > 0.0:
        t = min(max((wx * ux + wy * uy + wz * uz) / square, 0.0), 1.0)
    wx, wy, wz = wx - t * ux, wy - t * uy, wz - t * uz
    return wx * wx + wy * wy + wz * wz


@part
def to_triangle(triangle, px, py, pz):
    """The squared distance of a point from a triangle (3, 3), which may have no area."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = px - a[0], py - a[1], pz - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    if square > 0.0:
        # Barycentric coordinates of the foot, times the square.
        s = (wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz
        t = (uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz
        if s >= 0.0 and t >= 0.0 and s + t <= square:
            height = wx * nx + wy * ny + wz * nz
            return height * height / square
    least = min(to_segment(px, py, pz, a, b), to_segment(px, py, pz, b, c))
    return min(least, to_segment(px, py, pz, c, a))


@inlined
def box_of(value, low, width, count):
    """The number of the box along one axis in which a coordinate lies, or that is nearest to it."""
    return min(max(np.int64(math.floor((value - low) / width)), 0), count - 1)


@part
def boxes_around(triangle, low, width, shape, first, last):
    """Writes the boxes (3,) that the bounds of a triangle lie in."""
    for k in range(3):
        least = min(triangle[0, k], min(triangle[1, k], triangle[2, k]))
        most = max(triangle[0, k], max(triangle[1, k], triangle[2, k]))
        first[k], last[k] = box_of(least, low[k], width, shape[k]), box_of(most, low[k], width, shape[k])


@kernel
def count_entries(triangles, low, width, shape):
    """How often triangles (T, 3, 3) lie in a box of a grid."""
    first, last, total = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64), 0
    for t in range(len(triangles)):
        boxes_around(triangles[t], low, width, shape, first, last)
        total += (last[0] - first[0] + 1) * (last[1] - first[1] + 1) * (last[2] - first[2] + 1)
    return total


@kernel
def fill(triangles, low, width, shape, start, entries):
    """Writes the triangles of each box in CSR form. start: zeros, two more than boxes."""
    first, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for storing in range(2):
        for t in range(len(triangles)):
            boxes_around(triangles[t], low, width, shape, first, last)
            for i in range(first[0], last[0] + 1):
                for j in range(first[1], last[1] + 1):
                    for k in range(first[2], last[2] + 1):
                        box = (i * shape[1] + j) * shape[2] + k
                        if storing:
                            entries[start[box + 1]] = t
                            start[box + 1] += 1
                        else:
                            start[box + 2] += 1
        if not storing:
            for box in range(2, len(start)):
                start[box] += start[box - 1]


@part
def nearest_one(boxes, x, y, z):
    """The squared distance of a point from the nearest triangle, and its number, of several the least one.

    Boxes are searched in shells around the one of the point, until none further away can hold a nearer triangle.
    """
    low, width, start = boxes.low, boxes.width, boxes.start
    n0, n1, n2 = boxes.shape[0], boxes.shape[1], boxes.shape[2]
    i0, j0, k0 = box_of(x, low[0], width, n0), box_of(y, low[1], width, n1), box_of(z, low[2], width, n2)
    best, found, shell = np.inf, -1, 0
    while True:
        for i in range(max(i0 - shell, 0), min(i0 + shell, n0 - 1) + 1):
            for j in range(max(j0 - shell, 0), min(j0 + shell, n1 - 1) + 1):
                rim = i == i0 - shell or i == i0 + shell or j == j0 - shell or j == j0 + shell
                for k in range(max(k0 - shell, 0), min(k0 + shell, n2 - 1) + 1):
                    if not rim and k != k0 - shell and k != k0 + shell:
                        continue
                    box = (i * n1 + j) * n2 + k
                    for e in range(start[box], start[box + 1]):
                        t = boxes.entries[e]
                        square = to_triangle(boxes.triangles[t], x, y, z)
                        if square < best or (square == best and t < found):
                            best, found = square, t
        reach = np.inf  # what is not searched lies further away than this
        for value, at, least, count in ((x, i0, low[0], n0), (y, j0, low[1], n1), (z, k0, low[2], n2)):
            if at - shell > 0:
                reach = min(reach, value - (least + (at - shell) * width))
            if at + shell < count - 1:
                reach = min(reach, least + (at + shell + 1) * width - value)
        if reach == np.inf or (reach > 0.0 and best < reach * reach):
            return best, found
        shell += 1


@kernel
def nearest(boxes, points, far, which):
    """Writes the distance (P,) of points (P, 3) from the nearest triangle and its number, of several the least one."""
    for p in range(len(points)):
        best, which[p] = nearest_one(boxes, points[p, 0], points[p, 1], points[p, 2])
        far[p] = math.sqrt(best)
