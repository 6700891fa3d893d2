"""Sums over triangles against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.kernels.whole.extent import AREA, EDGE, SPAN, VOLUME, measure_triangles


@pytest.mark.parametrize("seed", range(5))
def test_sums_of_triangles(seed):
    p = np.random.default_rng(seed).normal(size=(50, 3, 3))
    low, high = np.empty(3), np.empty(3)
    sums = measure_triangles(p, low, high)
    assert np.array_equal(low, p.min(axis=(0, 1)))
    assert np.array_equal(high, p.max(axis=(0, 1)))
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    expected = np.empty(4)
    expected[SPAN] = np.ptp(p, axis=1).max(axis=1).sum()
    expected[EDGE] = sum(np.linalg.norm(p[:, k] - p[:, k - 1], axis=1).sum() for k in range(3))
    expected[AREA] = np.linalg.norm(normals, axis=1).sum()
    expected[VOLUME] = np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2]))
    assert np.allclose(sums, expected, rtol=1e-12)
