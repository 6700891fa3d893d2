"""The exact signs of areas."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import predicates
from gmsnet.kernels.simplex.exact import exact

Floats = NDArray[np.float64]


def exact_signs(points: Floats, triangles: NDArray[np.int32], orientation: NDArray[np.int8]) -> NDArray[np.int8]:
    """The exact sign of orientation × area of each triangle: float64 where the error bound decides, else exact
    arithmetic."""
    out = np.empty(len(triangles), dtype=np.int8)
    if predicates.signs(points, triangles, orientation, 0.0, out):
        rows = np.flatnonzero(out == 0)
        for t in rows[: exact(points, triangles, rows, orientation, out)].tolist():
            (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in points[i].tolist()] for i in triangles[t])
            area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
            out[t] = int(orientation[t]) * ((area > 0) - (area < 0))
    return out
