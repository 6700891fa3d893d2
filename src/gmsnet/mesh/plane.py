"""The coordinates of points along the two axes of their plane, and how large they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def in_plane(points: NDArray[np.float64], plane: tuple[int, int] | None) -> NDArray[np.float64]:
    """A view (N, 2) of points (N, dim) along two axes; the first two where they are in no plane."""
    first, second = plane or (0, 1)
    return points[:, first : second + 1 : second - first]


def extents(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """A quarter of what points (N, D) extend along each axis (D,): that does not overflow."""
    return np.array([0.25 * x.max(initial=-np.inf) - 0.25 * x.min(initial=np.inf) for x in points.T])


def flat_axes(extent: NDArray[np.float64]) -> tuple[int, int] | None:
    """The two axes in which nodes vary that extend by so much (3,); None if no coordinate is constant."""
    for flat in (2, 1, 0):
        if extent[flat] <= 1e-9 * extent.max():
            return {2: (0, 1), 1: (0, 2), 0: (1, 2)}[flat]
    return None


def exponent_of(points: NDArray[np.float64], plane: tuple[int, int] | None, single: bool) -> int:
    """The power of two that brings the largest coordinate in the plane, or in space, near 1.

    0 in single precision, where no product of coordinates can under- or overflow.
    """
    if single:
        return 0
    coordinates = points if plane is None else in_plane(points, plane)
    largest = max(-float(coordinates.min(initial=0.0)), float(coordinates.max(initial=0.0)))
    return int(np.frexp(largest)[1])
