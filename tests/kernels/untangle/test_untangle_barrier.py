"""The barrier against a slow twin, and its derivatives against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from gmsnet.kernels.star.pattern import Stars
from gmsnet.kernels.untangle import barrier


def twin(points, cells, scale, epsilon):
    """E as it is written down in the docstring."""
    total = 0.0
    for i, j, k in cells:
        a, b = points[j] - points[i], points[k] - points[i]
        d = a[0] * b[1] - a[1] * b[0]
        e = epsilon * (scale[i] + scale[j] + scale[k]) / 3
        chi = (d + np.sqrt(e**2 + d**2)) / 2
        total += (a @ a + b @ b - a @ b) / np.sqrt(3) / chi
    return total


def tangled(seed, nodes=20):
    rng = np.random.default_rng(seed)
    points = rng.random((nodes, 2))
    cells = Delaunay(points).simplices.astype(np.int32)
    return points + 0.1 * rng.normal(size=points.shape), cells, 0.5 + rng.random(nodes)


def numeric(function, x, h=1e-6):
    out = np.empty_like(x)
    for k in range(x.size):
        there = x.copy()
        there.flat[k] += h
        back = x.copy()
        back.flat[k] -= h
        out.flat[k] = (function(there) - function(back)) / (2 * h)
    return out


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 0.1, 0.01]))
def test_energy_and_gradient(seed, epsilon):
    points, cells, scale = tangled(seed)
    gradient = np.empty_like(points)
    value = barrier.energy(points, cells, None, scale, epsilon, gradient)
    assert value == pytest.approx(twin(points, cells, scale, epsilon), rel=1e-7)
    expected = numeric(lambda p: barrier.energy(p, cells, None, scale, epsilon, np.empty_like(p)), points)
    np.testing.assert_allclose(gradient, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())


def test_a_valid_mesh_has_the_sum_of_q_in_the_limit():
    points = np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)], [1.5, np.sqrt(0.75)]])
    cells = np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)
    assert barrier.energy(points, cells, None, np.ones(4), 1e-9, np.empty((4, 2))) == pytest.approx(2.0)


@given(st.integers(0, 2**32 - 1), st.integers(3, 9), st.sampled_from([1.0, 0.1, 0.01]))
def test_star_is_the_part_of_the_energy_that_moves(seed, degree, epsilon):
    rng = np.random.default_rng(seed)
    angle = np.sort(2 * np.pi * rng.random(degree))
    points = np.vstack([rng.normal(size=2), np.column_stack([np.cos(angle), np.sin(angle)])])
    ring = np.arange(1, degree + 1, dtype=np.int32)
    start = np.array([0, degree], dtype=np.int32)
    scale = 0.5 + rng.random(degree + 1)
    cells = np.array([(0, 1 + i, 1 + (i + 1) % degree) for i in range(degree)], dtype=np.int32)
    gradient = np.empty_like(points)
    value, gx, gy, xx, xy, yy = barrier.star(points, *points[0], 0, Stars(start, ring), scale, epsilon)
    assert value == pytest.approx(barrier.energy(points, cells, None, scale, epsilon, gradient), rel=1e-9)
    np.testing.assert_allclose([gx, gy], gradient[0], rtol=1e-6, atol=1e-9 * abs(value))
    assert xx >= 0
    assert yy >= 0
    assert xx * yy - xy * xy >= -1e-9 * (xx + yy) ** 2


def test_the_hessian_is_exact_where_all_is_far_from_inverted():
    """With ε → 0 the term that is left out vanishes."""
    angle = np.pi / 3 * np.arange(6)
    points = np.vstack([[0.1, -0.2], np.column_stack([np.cos(angle), np.sin(angle)])])
    ring, start, scale = np.arange(1, 7, dtype=np.int32), np.array([0, 6], dtype=np.int32), np.ones(7)
    _, _, _, xx, xy, yy = barrier.star(points, *points[0], 0, Stars(start, ring), scale, 1e-6)

    def gradient(place):
        return np.array(barrier.star(points, *place, 0, Stars(start, ring), scale, 1e-6)[1:3])

    h = 1e-6
    columns = [(gradient(points[0] + h * e) - gradient(points[0] - h * e)) / (2 * h) for e in np.eye(2)]
    np.testing.assert_allclose([[xx, xy], [xy, yy]], columns, rtol=1e-6)


def test_deep_below_zero_nothing_cancels():
    points = np.array([[0.0, 0.0], [0.0, 1e3], [1e3, 0.0]])
    gradient = np.empty_like(points)
    value = barrier.energy(points, np.array([[0, 1, 2]], dtype=np.int32), None, np.ones(3), 1e-3, gradient)
    assert value == pytest.approx(2e6 / np.sqrt(3) * 4e6 / 1e-6, rel=1e-6)
    assert np.isfinite(gradient).all()


def test_local_areas_follow_the_grading():
    """Of a mesh blown up by an exponential, the areas go by a factor of e⁸ with the cells."""
    flat = np.random.default_rng(0).random((200, 2))
    cells = Delaunay(flat).simplices.astype(np.int32)
    z = np.exp(4 * (flat[:, 0] + 1j * flat[:, 1]))
    points = np.column_stack([z.real, z.imag])
    area = barrier.local_area(points, cells, 2)
    expected = 16 * np.abs(z) ** 2 / 200
    assert np.abs(np.log(area / expected)).max() < 3.0  # on the hull, slivers
    np.testing.assert_allclose(barrier.local_area(8 * points, cells, 2), 64 * area, rtol=1e-9)
