"""Arcs and segments as kernels know them, against centres and angles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.naive_curves import naive_arc

from gmsnet.kernels.star.arcs import piece_parameter, piece_point, piece_tangent

COORDINATES = st.floats(-10.0, 10.0)


def piece_of(a, b, angle):
    return np.array([[*a, *b, math.cos(angle), math.sin(angle)]])


@given(
    st.tuples(COORDINATES, COORDINATES), st.tuples(COORDINATES, COORDINATES), st.floats(-1.5, 1.5),
    st.tuples(COORDINATES, COORDINATES),
)  # fmt: skip
def test_nearest_point_of_an_arc_is_that_of_its_circle(a, b, angle, point):
    length = math.dist(a, b)
    if length < 0.1 or abs(angle) < 1e-3:
        return
    piece = piece_of(a, b, angle)
    share, x, y = naive_arc(piece[0], *point)
    away = math.dist(point, (x, y))
    t = piece_parameter(piece, 0, *point)
    if 0.0 < share < 1.0:
        assert 0.0 < t < 1.0 or min(share, 1.0 - share) < 1e-9
        np.testing.assert_allclose(piece_point(piece, 0, t), (x, y), atol=1e-9 * (1.0 + away))
    else:
        far = abs(abs(share - 0.5) * 2.0 * abs(angle) - math.pi) < 1e-9  # from both ends
        assert (t < 0.0) == (share < 0.0) or min(abs(share), abs(share - 1.0)) < 1e-9 or far


@given(st.floats(-1.5, 1.5), st.floats(0.0, 1.0))
def test_points_lie_on_the_circle_and_tangents_along_it(angle, t):
    piece = piece_of((1.0, 2.0), (4.0, 6.0), angle)
    x, y = piece_point(piece, 0, t)
    assert piece_parameter(piece, 0, x, y) == pytest.approx(t, abs=1e-12)
    step = 1e-6
    low, high = max(t - step, 0.0), min(t + step, 1.0)
    way = np.subtract(piece_point(piece, 0, high), piece_point(piece, 0, low))
    np.testing.assert_allclose(piece_tangent(piece, 0, t), way / np.hypot(*way), atol=1e-4)
    if abs(angle) > 1e-3:
        np.testing.assert_allclose((x, y), naive_arc(piece[0], x, y)[1:], atol=1e-11)


@given(st.floats(-1.5, 1.5), COORDINATES, COORDINATES)
def test_ends_are_met_to_the_bit(angle, x, y):
    piece = piece_of((x, y), (0.1, 0.7), angle)
    assert piece_point(piece, 0, 0.0) == (x, y)
    assert piece_point(piece, 0, 1.0) == (0.1, 0.7)


def test_flat_arcs_lose_no_digits():
    for angle in (0.0, 1e-300, 1e-17, 1e-12, 1e-8):
        piece = piece_of((0.0, 0.0), (1.0, 0.0), angle)
        assert piece_parameter(piece, 0, 0.3, 0.2) == pytest.approx(0.3, abs=1e-7)
        assert piece_point(piece, 0, 0.25) == pytest.approx((0.25, 0.1875 * angle), rel=1e-12)


def test_a_piece_without_length_and_the_centre_of_an_arc():
    none = piece_of((1.0, 1.0), (1.0, 1.0), 0.0)
    assert piece_parameter(none, 0, 5.0, 5.0) == 0.0
    assert piece_point(none, 0, 0.0) == (1.0, 1.0)
    assert piece_tangent(none, 0, 0.5) == (1.0, 0.0)
    half = np.array([[0.0, 0.0, 2.0, 0.0, 0.0, 1.0]])  # a half circle around (1, 0)
    assert np.isfinite(piece_parameter(half, 0, 1.0, 0.0))
    assert piece_point(half, 0, 0.5) == pytest.approx((1.0, 1.0))
