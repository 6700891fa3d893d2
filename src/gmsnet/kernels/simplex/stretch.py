"""How far and in which direction triangles are stretched, and means of that over neighbourhoods.

Of a triangle with the edges e the tensor M = Σ e eᵀ is a multiple of A Aᵀ, A the map from the equilateral triangle.
With σ₁ ≥ σ₂ the singular values of A, s = σ₁/σ₂ is its *stretch* (q = (s + 1/s)/2), and log M without its mean part is

    v = log(s)·(cos 2φ, sin 2φ),      s² = (tr M + d)/(tr M − d),   d (cos 2φ, sin 2φ) = (M₁₁ − M₂₂, 2 M₁₂),

φ the direction of the stretch. As tr M² − d² = 4 det M = 12 D², D twice the area, nothing cancels in thin triangles.
Means of v are the log-Euclidean means of the metrics (Arsigny and others, 2006): triangles stretched in the same
direction add up, slivers that lie any which way cancel.
"""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined, kernel

ALONG, ACROSS, LENGTH, AREA = range(4)  # columns of a cell: v, |v| = log s, and D (of the sign of the triangle)
COLUMNS = 4
TINY = 1e-300


@inlined
def stretch(ax, ay, bx, by):
    """Of the triangle (0, a, b): d (cos 2φ, sin 2φ), d itself, s², and D."""
    ex, ey = bx - ax, by - ay
    xx = ax * ax + bx * bx + ex * ex
    yy = ay * ay + by * by + ey * ey
    along, across = xx - yy, 2.0 * (ax * ay + bx * by + ex * ey)
    double = ax * by - ay * bx
    part = math.sqrt(along * along + across * across)
    total = xx + yy + part
    # s² = total² / (total · (tr M − d)) = total² / 12 D²
    square = max(total * total, TINY) / max(12.0 * double * double, TINY)
    return along, across, part, square, double


@kernel
def per_cell(points, triangles, orientation, most, cells):
    """v, log s and D of each triangle into cells (T, COLUMNS); log s, and v with it, no longer than ``most``.

    points: (N, 2). orientation: (T,) signs by which D is multiplied. A triangle of a single point is not stretched.
    """
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        along, across, part, square, double = stretch(
            points[j, 0] - points[i, 0], points[j, 1] - points[i, 1],
            points[k, 0] - points[i, 0], points[k, 1] - points[i, 1],
        )  # fmt: skip
        length = max(min(0.5 * math.log(square), most), 0.0)
        share = length / max(part, TINY)
        cells[t, ALONG] = share * along
        cells[t, ACROSS] = share * across
        cells[t, LENGTH] = length
        cells[t, AREA] = orientation[t] * double


@kernel
def to_nodes(triangles, apart, fewest, cells, nodes, number):
    """nodes (N, columns): the mean over the cells around each node, but for those with a node of ``apart``.

    apart: (N,) bool. fewest: where fewer cells count, the sum is divided by so many all the same, so that what one or
    two cells say weighs less. number: (N,) how many cells counted at each node.
    """
    nodes[:] = 0.0
    number[:] = 0
    columns = nodes.shape[1]
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        if not (apart[i] or apart[j] or apart[k]):
            for corner in range(3):
                i = triangles[t, corner]
                number[i] += 1
                for c in range(columns):
                    nodes[i, c] += cells[t, c]
    for i in range(len(nodes)):
        share = 1.0 / max(number[i], fewest)
        for c in range(columns):
            nodes[i, c] *= share


@kernel
def to_cells(triangles, nodes, cells):
    """cells (T, columns): the mean over the three corners of each cell."""
    columns = nodes.shape[1]
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        for c in range(columns):
            cells[t, c] = (nodes[i, c] + nodes[j, c] + nodes[k, c]) / 3.0
