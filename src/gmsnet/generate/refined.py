"""Simplices cut into smaller ones alike: n² triangles for each triangle, n³ tetrahedra for each tetrahedron.

Source: H. Edelsbrunner, D. R. Grayson, "Edgewise subdivision of a simplex", Discrete & Computational Geometry 24, 2000.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def refined(corners: Floats, simplices: Ints, n: int) -> tuple[Ints, Ints]:
    """The weights (N, C) of the corners (C, 3) in each new node, which add up to n, and the new simplices (T, D + 1).

    Neighbours that share a side share the new nodes and simplices on it. The orientation is not that of the simplex.
    """
    dimension = simplices.shape[1] - 1
    places, rows = _standard(dimension, n)
    weights = np.zeros((len(simplices), len(places), len(corners)), dtype=np.int64)
    ordered = np.sort(simplices, axis=1)
    for k in range(dimension + 1):
        weights[np.arange(len(simplices)), :, ordered[:, k]] = places[:, k]
    flat = weights.reshape(-1, len(corners))
    found, which = np.unique(flat, axis=0, return_inverse=True)
    number = which.reshape(len(simplices), len(places))
    return found, number[:, rows].reshape(-1, dimension + 1)


def _standard(dimension: int, n: int) -> tuple[Ints, Ints]:
    """Weights of the corners in the nodes of one simplex, n ≥ x₁ ≥ x₂ ≥ … ≥ 0, and Kuhn's simplices of its cubes."""
    grid = [x for x in product(range(n, -1, -1), repeat=dimension) if all(np.diff(x) <= 0)]
    number = {x: k for k, x in enumerate(grid)}
    rows = []
    for x in grid:
        for order in permutations(range(dimension)):
            path, at = [x], list(x)
            for axis in order:
                at[axis] += 1
                path.append(tuple(at))
            if all(each in number for each in path):
                rows.append([number[each] for each in path])
    steps = np.array(grid, dtype=np.int64).reshape(-1, dimension)
    bounds = np.hstack([np.full((len(grid), 1), n), steps, np.zeros((len(grid), 1), dtype=np.int64)])
    return -np.diff(bounds, axis=1), np.array(rows, dtype=np.int64)
