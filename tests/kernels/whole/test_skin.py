"""Normals and extents of a skin against NumPy's, bit for bit."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.whole import skin


def facets(seed, nodes=40, count=70):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(nodes, 3))
    rows = np.array([rng.choice(nodes, 3, replace=False) for _ in range(count)])
    rows[0, 1] = rows[0, 0]  # one without an area, and an edge without a length
    return points, rows, rng.integers(0, 4, count)


def test_each_node_has_a_number_in_each_of_its_patches():
    for seed in range(20):
        _, rows, patch = facets(seed)
        own, numbers = np.empty(rows.shape, dtype=np.int64), np.full(rows.size + 40, -1)
        count = skin.number_corners(rows, patch, 40, numbers, numbers.copy(), own)
        assert own.max() < count
        keys = patch[:, None] * 40 + rows
        pairs = set(zip(keys.ravel().tolist(), own.ravel().tolist(), strict=True))
        assert len(pairs) == len(np.unique(keys)) == len(np.unique(own))
        assert np.array_equal(own < 40, own == rows)


def test_normals_are_summed_as_they_stand():
    points, rows, _ = facets(1)
    rng = np.random.default_rng(2)
    unit, area, corner = rng.normal(size=(70, 3)), rng.uniform(size=70), points[rows]
    total, expected = np.zeros((40, 3)), np.zeros((40, 3))
    skin.add_normals(points, rows, unit, area, rows, total)
    for k in range(3):
        for f, row in enumerate(rows):
            a, b = corner[f, (k + 1) % 3] - corner[f, k], corner[f, (k + 2) % 3] - corner[f, k]
            square = [(v[0] * v[0] + v[1] * v[1]) + v[2] * v[2] for v in (a, b)]
            weight = square[0] * square[1]
            expected[row[k]] += unit[f] * (area[f] / weight if weight else 0.0)
    assert np.array_equal(total, expected)


def test_extents_and_distances_of_patches():
    points, rows, patch = facets(5)
    low, high = np.full((4, 3), np.inf), np.full((4, 3), -np.inf)
    origin, away = np.zeros((4, 3)), np.zeros(4)
    skin.bound_patches(rows, patch, points, low, high, origin)
    normal = np.random.default_rng(6).normal(size=(4, 3))
    skin.leave_planes(rows, patch, points, origin, normal, away)
    for p in range(4):
        corners = points[rows[patch == p]].reshape(-1, 3)
        assert np.array_equal(low[p], corners.min(axis=0))
        assert np.array_equal(high[p], corners.max(axis=0))
        assert np.array_equal(origin[p], corners[-1])
        w = corners - origin[p]
        dots = (w[:, 0] * normal[p, 0] + w[:, 1] * normal[p, 1]) + w[:, 2] * normal[p, 2]
        assert away[p] == abs(dots).max()
