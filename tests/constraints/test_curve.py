"""Arcs through the nodes of chains: smooth, near to the polyline, exact on lines and circles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.naive_curves import sagittas

import gmsnet
from gmsnet.constraints.curve import ArcSpline, arc_spline, through
from gmsnet.constraints.features import curves_of
from gmsnet.kernels.star.arcs import piece_point, piece_tangent
from gmsnet.topology.ordering import planar_points

SHARES = np.linspace(0.0, 1.0, 21)


def spline_through(points, closed=False) -> ArcSpline:
    return through([np.asarray(points, dtype=float)], np.array([closed]), None)


def samples(spline: ArcSpline, curve: int = 0) -> np.ndarray:
    """(P, 21, 2) places on the pieces of a curve."""
    pieces = range(spline.first[curve], spline.first[curve + 1])
    return np.array([[piece_point(spline.piece, k, t) for t in SHARES] for k in pieces])


def distance(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of points (K, 2) from the segment ab."""
    edge = b - a
    along = np.clip((points - a) @ edge / max(edge @ edge, 1e-300), 0.0, 1.0)
    return np.hypot(*(points - a - along[:, None] * edge).T)


def check(points: np.ndarray, closed: bool) -> None:
    """Nodes are met, tangents agree, each edge's arcs lie within its sagitta and lead on along it."""
    spline = spline_through(points, closed)
    size = np.ptp(points, axis=0).max()
    count = len(points) - 1
    if count == 1:
        assert len(spline.piece) == 1
        return
    places, allowed = samples(spline), sagittas(points, closed)
    for k in range(count):
        edge = points[k + 1] - points[k]
        over = places[2 * k : 2 * k + 2].reshape(-1, 2)
        assert (over[0] == points[k]).all()
        assert (over[-1] == points[k + 1]).all()
        assert distance(over, points[k], points[k + 1]).max() <= allowed[k] * (1.0 + 1e-9) + 1e-13 * size
        along = (over - points[k]) @ edge / (edge @ edge)
        assert (np.diff(along) > -1e-9).all()
    joints = len(spline.piece)
    shortest = np.hypot(*np.diff(points, axis=0).T).min()
    tilt = 1e-12 + 1e-14 * abs(points).max() / shortest  # what rounding of a joint's coordinates does to its tangents
    for k in range(joints if closed else joints - 1):
        end, begin = piece_tangent(spline.piece, k, 1.0), piece_tangent(spline.piece, (k + 1) % joints, 0.0)
        assert np.hypot(end[0] - begin[0], end[1] - begin[1]) < tilt


def polyline(turns: list[float], lengths: list[float]) -> np.ndarray:
    ways = np.radians(np.cumsum([20.0, *turns]))
    steps = np.array(lengths[: len(ways)])[:, None] * np.column_stack([np.cos(ways), np.sin(ways)])
    return np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


@settings(max_examples=300)
@given(
    st.lists(st.one_of(st.floats(-90.0, 90.0), st.just(0.0), st.just(90.0)), max_size=8),
    st.lists(st.sampled_from([1e-4, 0.01, 0.3, 1.0, 2.0, 100.0]), min_size=9, max_size=9),
)
def test_open_polylines(turns, lengths):
    check(polyline(turns, lengths), closed=False)


@settings(max_examples=200)
@given(st.integers(8, 30), st.floats(0.0, 0.25), st.integers(0, 2**32 - 1))
def test_closed_polylines(count, amount, seed):
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(count) + 0.8 * rng.random(count)) / count
    radius = 1.0 + amount * rng.standard_normal(count)
    points = (abs(radius) + 0.3)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.vstack([points, points[:1]])
    way = np.diff(np.vstack([points[-2], points]), axis=0)
    if ((way[:-1] * way[1:]).sum(axis=1) >= 0.0).all():
        check(points, closed=True)


@given(st.floats(-3.0, 3.0), st.integers(4, 200))
def test_spirals(tightness, count):
    angles = np.linspace(0.0, 6.0, count) ** 1.5 if count > 60 else np.linspace(0.0, count / 3.0, count)
    radius = np.exp(tightness * angles / angles.max())
    check(radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), closed=False)


@pytest.mark.parametrize("count", [20, 60, 200])
def test_naca(count):
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count)))
    half = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    upper, lower = np.column_stack([x, half]), np.column_stack([x, -half])
    points = np.vstack([upper[::-1], lower[1:]])
    spline, fine = spline_through(points), 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 40 * (count - 1) + 1)))
    check(points, closed=False)
    true = 0.6 * (0.2969 * np.sqrt(fine) - 0.126 * fine - 0.3516 * fine**2 + 0.2843 * fine**3 - 0.1036 * fine**4)
    on, _ = spline.project(0, np.column_stack([fine, true]))
    error = np.hypot(on[:, 0] - fine, on[:, 1] - true)[200:].max()  # behind the first five edges at the nose
    assert error < {20: 1e-4, 60: 2e-5, 200: 6e-7}[count]  # third order


@given(st.integers(3, 60), st.integers(0, 2**32 - 1), st.floats(-1e3, 1e3))
def test_circles_are_reproduced_however_uneven_their_nodes(count, seed, middle):
    rng = np.random.default_rng(seed)
    gaps = rng.uniform(0.05, 1.0, count) ** 2
    angles = np.cumsum(gaps) / gaps.sum() * rng.uniform(0.3, 1.0) * min(2.0 * np.pi, 0.4 * count)
    points = middle + np.column_stack([np.cos(angles), np.sin(angles)])
    radius = np.hypot(*(samples(spline_through(points)) - middle).reshape(-1, 2).T)
    near = np.hypot(*np.diff(points, axis=0).T).min()  # rounding of coordinates tilts tangents by it over the edge
    assert abs(radius - 1.0).max() < 1e-15 * (1.0 + abs(middle)) * (10.0 + 10.0 / near)


def test_two_nodes_and_equal_nodes_make_one_segment():
    one = spline_through([[0.0, 0.0], [3.0, 4.0]])
    assert one.piece.tolist() == [[0.0, 0.0, 3.0, 4.0, 1.0, 0.0]]
    places, parameters = one.project(0, np.array([[3.0, 0.0], [9.0, 9.0]]))
    np.testing.assert_allclose(places, [[1.08, 1.44], [3.0, 4.0]])
    np.testing.assert_allclose(parameters, [0.36, 1.0])
    none = spline_through([[1.0, 2.0], [1.0, 2.0]])
    places, parameters = none.project(0, np.array([[5.0, 5.0]]))
    assert places.tolist() == [[1.0, 2.0]]
    assert none.tangent(0, parameters).tolist() == [[1.0, 0.0]]


def test_three_nodes_closed():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.9], [0.0, 0.0]])
    spline = spline_through(points, closed=True)  # not made by curves_of: a corner turns by more than 90 degrees
    assert len(spline.piece) == 6
    assert np.isfinite(spline.piece).all()


@given(st.integers(0, 2**32 - 1))
def test_projection_is_nearest(seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(0.1, 1.0, (6, 2)), axis=0)
    spline = spline_through(points)
    asked = points.mean(axis=0) + rng.standard_normal((20, 2))
    places, parameters = spline.project(0, asked)
    fine = samples(spline).reshape(-1, 2)
    for k in range(len(asked)):
        best = np.hypot(*(fine - asked[k]).T).min()
        own = np.hypot(*(places[k] - asked[k]))
        assert own <= best + 1e-12
        number = min(int(parameters[k]), len(spline.piece) - 1)
        np.testing.assert_allclose(piece_point(spline.piece, number, parameters[k] - number), places[k], atol=1e-14)
        if 0.0 < parameters[k] < len(spline.piece):
            assert abs(spline.tangent(0, parameters[k : k + 1])[0] @ (asked[k] - places[k])) < 1e-9


@pytest.mark.parametrize("name", ["mesh_NACA0012_inv.su2", "japan_sea.msh", "osteonT1_11.mesh", "ex28.msh"])
def test_curves_of_real_meshes_lie_within_their_sagittas(real_meshes, name):
    mesh = gmsnet.read(real_meshes / name)
    curves, points = curves_of(mesh), planar_points(mesh)
    spline = arc_spline(curves, points)
    for c in range(len(curves)):
        p = points[curves.nodes_of(c)]
        if curves.straight[c]:
            assert spline.first[c + 1] - spline.first[c] == 1
            assert distance(p, p[0], p[-1]).max() < 1e-12
        else:
            check(p, bool(curves.closed[c]))
