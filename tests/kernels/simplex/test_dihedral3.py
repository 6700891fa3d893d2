"""Dihedral angles against their definition, and their gradients against differences."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gmsnet.kernels.simplex import dihedral3

EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1))  # as the angles follow each other, node 0 at the origin


@numba.njit
def dihedrals(spokes):
    return dihedral3.dihedrals(*spokes)


def angle_at(points, edge):
    """Between the two faces at an edge, by the parts of the other corners that are square to it."""
    i, j = edge
    k, m = (c for c in range(4) if c not in edge)
    along = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
    first, second = (points[c] - points[i] - along * (along @ (points[c] - points[i])) for c in (k, m))
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    return np.arccos(np.clip(cosine, -1, 1))


def corners(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4, 3)) * 10.0 ** rng.uniform(-1.5, 0, 3)
    return points if np.linalg.det(points[1:] - points[0]) > 0 else points[[0, 2, 1, 3]]


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_angles_and_gradients(seed):
    points = corners(seed)
    double, *turns = dihedrals(tuple((points[1:] - points[0]).ravel()))
    assert double == pytest.approx(np.linalg.det(points[1:] - points[0]))
    size = np.ptp(points)
    for (angle, *slope), edge in zip(turns, EDGES, strict=True):
        assert angle == pytest.approx(angle_at(points, edge), abs=1e-6)
        away = 1e-6 * size * np.linalg.det((points[1:] - points[0]) / size) ** 0.5
        for axis in range(3):
            step = away * np.eye(3)[axis]
            ahead, behind = (
                dihedrals(tuple((points[1:] - points[0] - s).ravel()))[EDGES.index(edge) + 1][0] for s in (step, -step)
            )
            assert slope[axis] == pytest.approx((ahead - behind) / (2 * away), rel=1e-3, abs=1e-4 * np.abs(slope).max())


def test_a_regular_tetrahedron():
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)[[0, 2, 1, 3]]
    _, *turns = dihedrals(tuple((points[1:] - points[0]).ravel()))
    assert [turn[0] for turn in turns] == pytest.approx([np.arccos(1 / 3)] * 6, abs=1e-15)
