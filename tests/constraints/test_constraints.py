"""Nodes that slide: on their line, on their circle, in their order."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.naive_curves import sagittas
from support.sliding import constraint_by_ids, push, ring_mesh

import gmsnet
from gmsnet import Mesh
from gmsnet.constraints.constraints import OFF
from gmsnet.constraints.features import curves_of
from gmsnet.generate import random_quad_mesh
from gmsnet.generate.random import random_mesh
from gmsnet.kernels.star.constraint import limits, locate, snap, tangent_at
from gmsnet.topology.ordering import planar_points


def moved_about(mesh: Mesh, seed: int, rounds: int, reach: float):
    """Curves, constraint and points after random moves; order and ends are looked at after each round."""
    rng, curves = np.random.default_rng(seed), curves_of(mesh)
    constraint, points = constraint_by_ids(mesh, curves), planar_points(mesh)
    nodes = np.flatnonzero(curves.slides)
    for _ in range(rounds):
        for node in rng.permutation(nodes).tolist():
            low, high = limits(constraint, constraint.row[node])
            push(constraint, points, node, *(points[node] + reach * rng.standard_normal(2)))
            count = constraint.first[constraint.curve[constraint.row[node]] + 1]
            count -= constraint.first[constraint.curve[constraint.row[node]]]
            u = constraint.parameter[constraint.row[node]]
            assert any(low < v < high for v in (u - count, u, u + count))
        check_order(curves, constraint)
    return curves, constraint, points


def check_order(curves, constraint) -> None:
    for c in range(len(curves)):
        nodes = curves.nodes_of(c)
        count = constraint.first[c + 1] - constraint.first[c]
        if curves.closed[c]:
            u = constraint.parameter[constraint.row[nodes]]
            steps = np.diff(u) % count
            assert (steps > 0.0).all()
            assert steps.sum() == pytest.approx(count)
            assert ((u >= 0.0) & (u < count)).all()
        elif len(nodes) > 2:
            u = constraint.parameter[constraint.row[nodes[1:-1]]]
            assert (np.diff(np.concatenate([[0.0], u, [count]])) > 0.0).all()


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["square", "circle", "plate", "lshape"]), st.floats(1e-6, 2.0))
def test_order_is_kept_and_curves_are_not_left(seed, shape, reach):
    mesh = random_mesh(60, shape, boundary="random", seed=seed % 7)
    curves, _, points = moved_about(mesh, seed, 4, reach)
    old = planar_points(mesh)
    assert (points[~curves.slides] == old[~curves.slides]).all()
    for c in range(len(curves)):
        p = old[curves.nodes_of(c)]
        allowed = sagittas(p, bool(curves.closed[c])).max() * (1.0 + 1e-9) + 1e-15
        for node in curves.nodes_of(c):
            edge = np.diff(p, axis=0)
            along = np.clip(((points[node] - p[:-1]) * edge).sum(axis=1) / (edge * edge).sum(axis=1), 0.0, 1.0)
            assert np.hypot(*(points[node] - p[:-1] - along[:, None] * edge).T).min() <= allowed


def test_a_circle_with_random_nodes_stays_a_circle():
    mesh = random_mesh(2000, "circle", boundary="random", seed=1)
    curves, _, points = moved_about(mesh, 0, 10, 0.01)
    points = np.ldexp(points, mesh.exponent)
    radius = np.hypot(*(points[curves.slides] - 0.5).T)
    edge = 1.0 / np.sqrt(2000)
    assert (points != mesh.points)[curves.slides].any(axis=1).all()
    assert abs(radius - 0.5).max() < 1e-13 * edge / 1e-2


@pytest.mark.parametrize("scale", [1.0, 1e-7, 3e150])
def test_sides_along_an_axis_keep_the_bits_of_their_coordinate(scale):
    mesh = random_mesh(100, "square", boundary="random", seed=2, size=scale * 0.7)
    curves, _, points = moved_about(mesh, 1, 5, 0.1)
    old = planar_points(mesh)
    for c in range(4):
        nodes = curves.nodes_of(c)
        axis = int(np.flatnonzero((old[nodes] == old[nodes[0]]).all(axis=0))[0])
        assert (points[nodes, axis] == old[nodes[0], axis]).all()
        assert (points[nodes[1:-1], 1 - axis] != old[nodes[1:-1], 1 - axis]).all()


@pytest.mark.parametrize("single", [False, True])
def test_other_straight_sides_are_met_to_rounding(single):
    corners = np.array([[0.1, 0.2], [3.3, 1.7], [2.1, 4.4], [-1.2, 2.9]])
    share = np.array([0.0, 0.1, 0.45, 0.7])[:, None]
    points = np.vstack([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
    if single:
        points = points.astype(np.float32).astype(float)
    mesh = ring_mesh(points, single=single)
    curves, _, points = moved_about(mesh, 3, 5, 0.3)
    assert curves.straight.all()
    scale = 2.0**mesh.exponent
    for c in range(4):
        nodes = curves.nodes_of(c)
        (ax, ay), (bx, by) = ([Fraction(v) for v in points[node]] for node in nodes[[0, -1]])
        for node in nodes[1:-1]:
            x, y = map(Fraction, points[node])
            away = abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / Fraction(np.hypot(float(bx - ax), float(by - ay)))
            assert float(away) <= (2.0**-23 if single else 2.0**-52) * abs(points).max()
            if single:
                assert (points[node] * scale == (points[node] * scale).astype(np.float32)).all()


def test_a_node_pushed_far_goes_nine_tenths_of_the_way_to_its_neighbour():
    angles = 2.0 * np.pi * np.arange(64) / 64
    mesh = ring_mesh(np.column_stack([np.cos(angles), np.sin(angles)]))
    constraint = constraint_by_ids(mesh, curves_of(mesh))
    # Nodes of a closed curve stand two pieces apart; the node 0 is at the parameter 0.
    for aim, wanted in ((angles[5], 1.8), (-angles[5], 128.0 - 1.8)):
        x, y, u = snap(constraint, 0, np.cos(aim), np.sin(aim))
        assert u == pytest.approx(wanted)
        assert np.hypot(x, y) == pytest.approx(np.hypot(*planar_points(mesh)[0]))
    for _ in range(400):  # again and again: it never gets there
        x, y, u = snap(constraint, 0, np.cos(0.5), np.sin(0.5))
        constraint.parameter[constraint.row[0]] = u
        assert u < 2.0
    assert u > 2.0 - 1e-14


@pytest.mark.parametrize("count", [13, 14, 16, 18])
@pytest.mark.parametrize("way", [1, -1])
def test_an_edge_leaves_out_no_more_of_its_curve_than_a_share_of_the_edges_there(count, way):
    """On a circle the chord over an angle of a is 1 - cos(a/2) off."""
    angles = 2.0 * np.pi * np.arange(count) / count
    mesh = ring_mesh(np.column_stack([np.cos(angles), np.sin(angles)]))
    constraint = constraint_by_ids(mesh, curves_of(mesh))
    length = 2.0 * np.sin(np.pi / count)
    for _ in range(3):
        x, y, constraint.parameter[constraint.row[3]] = snap(
            constraint, 3, np.cos(angles[3] + way * 0.9 * angles[1]), np.sin(angles[3] + way * 0.9 * angles[1])
        )
    grown = way * (np.arctan2(y, x) - angles[3]) + angles[1]
    assert 1.0 - np.cos(grown / 2.0) == pytest.approx(OFF * length, rel=0.02)
    assert np.hypot(x, y) == pytest.approx(np.hypot(*planar_points(mesh)[3]))
    x, y, u = snap(constraint, 3, np.cos(angles[3]), np.sin(angles[3]))
    assert u == pytest.approx(6.0)  # back is no matter


def test_an_edge_that_leaves_out_more_may_become_shorter():
    angles = np.delete(2.0 * np.pi * np.arange(16) / 16, [1, 2])
    full = ring_mesh(np.column_stack([np.cos(angles), np.sin(angles)]))
    constraint = constraint_by_ids(full, curves_of(full, feature_angle=100.0))
    before = constraint.parameter[constraint.row[1]]
    for aim, wanted in ((angles[2], before), (0.0, before - 0.2)):
        _, _, u = snap(constraint, 1, np.cos(aim), np.sin(aim))
        assert u == pytest.approx(before) if wanted == before else u < wanted


def test_straight_curves_leave_nothing_out():
    mesh = ring_mesh([(x, 0.0) for x in range(6)] + [(5.0, 2.0), (0.0, 2.0)])
    constraint = constraint_by_ids(mesh, curves_of(mesh))
    assert not constraint.cost.any()


@pytest.mark.parametrize("seed", [0, 1, 2, 5])
def test_nodes_of_the_input_stay_near_the_edges_of_the_result(seed):
    mesh = random_quad_mesh(60, "circle", cells="quad", seed=seed)
    result = gmsnet.smooth(mesh, slide=True)
    rim = curves_of(mesh).nodes_of(0)
    before, after = mesh.points[rim][:-1, :2], result.points[rim][:, :2]
    begin, way = after[:-1], np.diff(after, axis=0)
    from_begin = before[:, None] - begin
    share = np.clip((from_begin * way).sum(axis=2) / (way * way).sum(axis=1), 0.0, 1.0)
    off = np.linalg.norm(from_begin - share[..., None] * way, axis=2).min(axis=1)
    edges = np.linalg.norm(np.diff(mesh.points[rim][:, :2], axis=0), axis=1)
    assert result.moved[rim].any()
    assert off.max() <= 1.2 * OFF * edges.mean()


@pytest.mark.parametrize("shape", ["circle", "square"])
def test_garbage_moves_no_node(shape):
    mesh = random_mesh(100, shape, boundary="random", seed=4)
    curves, points = curves_of(mesh), planar_points(mesh)
    constraint = constraint_by_ids(mesh, curves)
    for node in np.flatnonzero(curves.slides):
        for aim in ((np.nan, 0.0), (0.0, np.nan), (np.nan, np.nan), (np.inf, -np.inf), (1e308, -1e308)):
            x, y, u = snap(constraint, node, *aim)
            low, high = limits(constraint, constraint.row[node])
            assert np.isfinite([x, y, u]).all()
            count = constraint.first[constraint.curve[constraint.row[node]] + 1]
            assert any(low < v < high for v in (u - count, u, u + count)) or shape == "square"
            if np.isnan(aim).any():
                np.testing.assert_allclose((x, y), points[node], atol=1e-16)


def test_snapping_where_a_node_is_does_not_move_it():
    for shape in ("circle", "square"):
        mesh = random_mesh(100, shape, boundary="random", seed=4)
        curves, points = curves_of(mesh), planar_points(mesh)
        constraint = constraint_by_ids(mesh, curves)
        for node in np.flatnonzero(curves.slides):
            x, y, u = snap(constraint, node, *points[node])
            np.testing.assert_allclose((x, y), points[node], atol=1e-16)
            assert u == pytest.approx(constraint.parameter[constraint.row[node]], abs=1e-12)


def test_tangents_of_a_circle():
    mesh = random_mesh(100, "circle", boundary="random", seed=4)
    curves, points = curves_of(mesh), planar_points(mesh)
    constraint = constraint_by_ids(mesh, curves)
    middle = np.ldexp(0.5, -mesh.exponent)
    for node in np.flatnonzero(curves.slides):
        out = (points[node] - middle) / np.hypot(*(points[node] - middle))
        assert abs(np.dot(tangent_at(constraint, node), out)) < 1e-12


def test_a_curve_that_ends_where_it_begins_keeps_this_node():
    angles = np.linspace(0.0, 2.0 * np.pi, 41)[:-1]
    points = np.column_stack([np.cos(angles) + 0.6 * np.exp(-5.0 * angles * (2.0 * np.pi - angles)), np.sin(angles)])
    mesh = ring_mesh(points)
    curves, _, after = moved_about(mesh, 5, 10, 0.3)
    (whole,) = (c for c in range(len(curves)) if len(curves.nodes_of(c)) > 30)
    nodes = curves.nodes_of(whole)
    if nodes[0] == nodes[-1]:
        assert not curves.closed[whole]
    assert (after[nodes[[0, -1]]] == planar_points(mesh)[nodes[[0, -1]]]).all()


def test_parameters_are_found_again():
    for shape in ("circle", "square", "plate"):
        mesh = random_mesh(200, shape, boundary="random", seed=6)
        curves, constraint, points = moved_about(mesh, 6, 3, 0.03)
        wanted = constraint.parameter.copy()
        constraint.parameter[:] = constraint_by_ids(mesh, curves).parameter
        locate(constraint, points)
        np.testing.assert_allclose(constraint.parameter, wanted, atol=1e-9)


def test_without_nodes_that_slide_there_is_no_constraint():
    mesh = random_mesh(20)
    with pytest.raises(AssertionError):
        constraint_by_ids(mesh, curves_of(mesh, None))


def test_rows_follow_the_order_in_memory():
    from gmsnet.constraints.constraints import constraint_of

    mesh = random_mesh(100, "circle", seed=3)
    curves = curves_of(mesh)
    memory = np.random.default_rng(0).permutation(len(mesh.points)).astype(np.int32)
    mixed = constraint_of(curves, planar_points(mesh), memory, False)
    plain = constraint_by_ids(mesh, curves)
    assert (mixed.row == plain.row[memory]).all()
    for name in ("curve", "before", "after", "parameter", "piece"):
        assert (getattr(mixed, name) == getattr(plain, name)).all()
