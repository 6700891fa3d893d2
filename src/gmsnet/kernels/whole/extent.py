"""How large the triangles of a surface are, in one pass."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel

SPAN, EDGE, AREA, VOLUME, FIGURES = range(5)


@kernel
def measure_triangles(triangles, low, high):
    """Sums over triangles (T, 3, 3): of the longest side of their box, the lengths of edges, twice the area, and six
    times the volume between them and the origin. Writes the box around all: low, high (3,).
    """
    out = np.zeros(FIGURES)
    low[:], high[:] = np.inf, -np.inf
    for t in range(len(triangles)):
        span = 0.0
        for k in range(3):
            a, b, c = triangles[t, 0, k], triangles[t, 1, k], triangles[t, 2, k]
            least, most = min(a, min(b, c)), max(a, max(b, c))
            low[k], high[k], span = min(low[k], least), max(high[k], most), max(span, most - least)
        out[SPAN] += span
        for k in range(3):
            j = (k + 1) % 3
            ex, ey, ez = (
                triangles[t, j, 0] - triangles[t, k, 0], triangles[t, j, 1] - triangles[t, k, 1],
                triangles[t, j, 2] - triangles[t, k, 2],
            )  # fmt: skip
            out[EDGE] += math.sqrt(ex * ex + ey * ey + ez * ez)
        x, y, z = triangles[t, 0, 0], triangles[t, 0, 1], triangles[t, 0, 2]
        px, py, pz = triangles[t, 1, 0], triangles[t, 1, 1], triangles[t, 1, 2]
        qx, qy, qz = triangles[t, 2, 0], triangles[t, 2, 1], triangles[t, 2, 2]
        out[VOLUME] += x * (py * qz - pz * qy) + y * (pz * qx - px * qz) + z * (px * qy - py * qx)
        px, py, pz, qx, qy, qz = px - x, py - y, pz - z, qx - x, qy - y, qz - z
        nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
        out[AREA] += math.sqrt(nx * nx + ny * ny + nz * nz)
    return out
