"""Facets in a grid of boxes, so that the nearest ones to points are found."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.whole import extent, nearest

Floats = NDArray[np.float64]

BOXES, ENTRIES = 16, 16  # for each facet, at most


class Grid:
    """Triangles (T, 3, 3) in boxes. sums: see kernels.whole.extent.measure_triangles."""

    boxes: nearest.Boxes
    sums: Any

    def __init__(self, triangles: Floats) -> None:
        triangles = np.ascontiguousarray(triangles)
        low, high, count = np.empty(3), np.empty(3), len(triangles)
        self.sums = extent.measure_triangles(triangles, low, high)
        size = high - low
        width = max(float(self.sums[extent.SPAN]) / count, float(size.max()) * 1e-6) or 1.0
        while True:
            shape = np.maximum(np.ceil(size / width), 1.0).astype(np.int64)
            if np.prod(shape.astype(float)) <= BOXES * count + 64:
                entries = nearest.count_entries(triangles, low, width, shape)
                if entries <= ENTRIES * count + 64:
                    break
            width *= 1.25
        start = np.zeros(int(np.prod(shape)) + 2, dtype=np.int64)
        self.boxes = nearest.Boxes(triangles, low, width, shape, start, np.empty(entries, dtype=np.int32))
        nearest.fill(triangles, low, width, shape, start, self.boxes.entries)

    def nearest(self, points: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """The distances of points (P, 3) from the nearest facets, and which these are."""
        far, which = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
        nearest.nearest(self.boxes, np.ascontiguousarray(points), far, which)
        return far, which


def no_boxes() -> nearest.Boxes:
    """Without a triangle."""
    none, one = np.empty(0, dtype=np.int32), np.ones(3, dtype=np.int64)
    return nearest.Boxes(np.empty((0, 3, 3)), np.zeros(3), 1.0, one, np.zeros(3, dtype=np.int64), none)
