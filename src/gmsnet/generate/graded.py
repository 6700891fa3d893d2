"""Delaunay triangulations of random points in a square whose density falls from left to right."""

from __future__ import annotations

import numpy as np

from gmsnet.errors import InputError
from gmsnet.generate.delaunay import labelled, triangulate
from gmsnet.generate.random import generator
from gmsnet.mesh.mesh import Mesh

SIDES = ("bottom", "right", "top", "left")


def graded_mesh(nodes: int, ratio: float = 100.0, *, seed: int = 0) -> Mesh:
    """The Delaunay triangulation of random points in the unit square, their density ∝ ratio^(−x).

    nodes: how many points lie inside. ratio: of the densities at the left and the right side. On the boundary the
    spacing is the mean one inside at the same x, 1/√density. seed: the same arguments give the same mesh.

    Returns counter-clockwise triangles of the region "domain", and the sides as line cells by marker. Raises InputError
    for numbers out of range.
    """
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer) or nodes < 1:
        raise InputError(f"a graded mesh needs a whole number of nodes, at least 1, got {nodes!r}")
    if not (np.isfinite(ratio) and 1 < ratio <= 1e6):
        raise InputError(f"the ratio of densities must lie between 1 and 1e6, got {ratio!r}")
    rng, rate = generator(seed), np.log(ratio)
    # P(x < t) = (1 − ratio^−t)/(1 − 1/ratio)
    inner = np.column_stack([-np.log1p(rng.random(nodes) * (1.0 / ratio - 1.0)) / rate, rng.random(nodes)])
    densest = nodes * rate / (1.0 - 1.0 / ratio)
    # Along x the nodes lie evenly in u = ∫ √density dx ∝ 1 − ratio^(−x/2).
    whole = 2.0 / rate * (1.0 - ratio**-0.5)
    count = max(1, round(np.sqrt(densest) * whole))
    x = -2.0 / rate * np.log1p(np.arange(count) / count * (ratio**-0.5 - 1.0))
    left, right = (np.arange(k) / k for k in (max(1, round(np.sqrt(densest / r))) for r in (1.0, ratio)))
    back = np.append(x[1:], 1.0)[::-1]
    parts = [
        np.column_stack([x, np.zeros_like(x)]),
        np.column_stack([np.ones_like(right), right]),
        np.column_stack([back, np.ones_like(back)]),
        np.column_stack([np.zeros_like(left), 1.0 - left]),
    ]
    outline = np.concatenate(parts)
    node = np.arange(len(outline))
    side = np.repeat(np.arange(4), [len(part) for part in parts])
    return labelled(triangulate(outline, np.column_stack([node, np.roll(node, -1)]), side, inner), SIDES)
