"""Nodes of second-order cells move with their middles, and never make a valid cell invalid in exact arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import curved, curved_meshes, naive
from support.curved_kernels import commit_all

from gmsnet.kernels.curved.commit import follow
from gmsnet.kernels.curved.stars import CENTRE, counter_clockwise, dragged
from gmsnet.kernels.simplex.bernstein import CORNERS, NAMES, NODES
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.guard import MeshGuard, StarGuard
from gmsnet.measure.curved import judge_curved

VALID = MeshGuard(2.0**-53, 0.0, False, -np.inf)
SINGLE = MeshGuard(2.0**-24, 2.0**-150, True, -np.inf)


def complex_of(points):
    return points[:, 0] + 1j * points[:, 1]


def corners_of(mesh, free):
    return np.flatnonzero(free & (np.diff(mesh.edge_start) > 0))


def exact_signs(points, mesh):
    return np.array(
        [
            curved.exact_sign(points[c[: NODES[k]]], NAMES[k], depth=7)
            for c, k in zip(mesh.cells, mesh.kinds, strict=True)
        ]
    )


def straight_signs(points, mesh):
    """Of each cell the least sign of the triangles at its corners."""
    least = []
    for cell, kind in zip(mesh.cells, mesh.kinds, strict=True):
        ring = points[cell[: CORNERS[kind]]]
        least.append(min(naive.exact_area_sign(ring[k - 2], ring[k - 1], ring[k]) for k in range(len(ring))))
    return np.array(least)


def commit(points, mesh, nodes, targets, guard=VALID):
    tally = np.zeros(3, dtype=np.int64)
    commit_all(points, mesh, np.asarray(nodes), np.asarray(targets, dtype=float), guard, -np.inf, tally)
    return tally


@pytest.mark.parametrize("seed", range(10))
def test_middles_follow_their_edges_turned_and_scaled(seed):
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(seed))
    before = points.copy()
    i = corners_of(mesh, free)[seed % 3]
    dragged(points, mesh, np.array([i]), before[[i]] + [[0.01, -0.02]], False)
    was, now = complex_of(before), complex_of(points)
    for e, (a, b, m) in enumerate(mesh.edges):
        if i in (a, b):
            assert mesh.dragged[e]
            ratio = (was[m] - (was[a] + was[b]) / 2) / (was[b] - was[a])
            assert now[m] == pytest.approx((now[a] + now[b]) / 2 + ratio * (now[b] - now[a]), abs=1e-13)
        else:
            assert now[m] == was[m]
    for c, cell in enumerate(mesh.cells):
        if mesh.kinds[c] == 2:
            serendipity = [(2 * z[cell[4:8]].sum() - z[cell[:4]].sum()) / 4 for z in (was, now)]
            frames = [z[cell[2]] - z[cell[0]] - 1j * (z[cell[3]] - z[cell[1]]) for z in (was, now)]
            ratio = (was[cell[CENTRE]] - serendipity[0]) / frames[0]
            assert now[cell[CENTRE]] == pytest.approx(serendipity[1] + ratio * frames[1], abs=1e-13)
            assert (now[cell[CENTRE]] == was[cell[CENTRE]]) == (i not in cell)


def test_a_move_and_back_is_a_move_of_nothing_but_roundings():
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(3))
    before, i = points.copy(), corners_of(mesh, free)[0]
    for target in (before[i] + 0.05, before[i]):
        dragged(points, mesh, np.array([i]), target[None], False)
    np.testing.assert_allclose(points, before, atol=1e-15)


@pytest.mark.parametrize("seed", range(10))
def test_turned_and_grown_as_a_whole_the_mesh_keeps_its_shape(seed):
    """All corners are moved by a similarity: middles between moved corners must land where it takes them."""
    points, mesh, _ = curved_meshes.tables(curved_meshes.known_valid(seed))
    corner = np.flatnonzero(np.diff(mesh.edge_start) > 0)
    before = complex_of(points)
    moved = before * (0.8 + 0.6j) * 3 + 1 - 2j
    targets = np.column_stack([moved.real, moved.imag])
    dragged(points, mesh, corner, targets[corner], False)
    middles = mesh.edges[mesh.dragged, 2]
    np.testing.assert_allclose(complex_of(points)[middles], moved[middles], atol=1e-13)


@given(st.integers(0, 2**32 - 1), st.sampled_from([VALID, SINGLE]), st.booleans(), st.sampled_from([0.0, 100.0]))
@settings(max_examples=60)
def test_no_valid_cell_becomes_invalid_in_exact_arithmetic(seed, guard, tangled, offset):
    rng = np.random.default_rng(seed)
    mesh = curved_meshes.thrown(seed % 20) if tangled else curved_meshes.known_valid(seed % 20)
    mesh = mesh.with_points(mesh.points + offset)
    if guard.single:
        mesh = mesh.with_points(np.float64(np.float32(mesh.points)))
    points, mesh, free = curved_meshes.tables(mesh)
    before, signs, straight = points.copy(), exact_signs(points, mesh), straight_signs(points, mesh)
    nodes = rng.choice(np.flatnonzero(free), 12)
    tally = commit(points, mesh, nodes, points[nodes] + rng.choice([0.03, 0.3, 30]) * rng.normal(size=(12, 2)), guard)
    assert tally[MOVED] + tally[DROPPED] == 12
    np.testing.assert_array_equal(points[~free], before[~free])
    now = exact_signs(points, mesh)
    assert (now[signs == 1] == 1).all()
    assert (straight_signs(points, mesh)[straight > 0] > 0).all()
    if guard.single:
        np.testing.assert_array_equal(points, np.float32(points))
    for c in np.flatnonzero(now != 1):
        kind = mesh.kinds[c]
        rows = mesh.cells[c, : NODES[kind]]
        if (points[rows] == before[rows]).all():
            continue
        was, least = (
            min(curved.bernstein(curved.determinant(p[rows], NAMES[kind]), NAMES[kind])) for p in (before, points)
        )
        assert least > was  # still invalid, and less so


def test_a_move_that_is_allowed_is_made_exactly_and_one_too_far_is_halved():
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(2))
    i = corners_of(mesh, free)[0]
    target = points[i] + [1e-3, 2e-3]
    assert commit(points, mesh, [i], [target]).tolist() == [1, 0, 0]
    np.testing.assert_array_equal(points[i], target)
    tally = commit(points, mesh, [i], [points[i] + [5.0, 0.0]])
    assert tally.tolist() == [1, 1, 0]
    assert 0 < points[i, 0] - target[0] < 1


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_or_no_move_is_dropped_and_leaves_all_bits(bad):
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(4))
    before, i = points.copy(), corners_of(mesh, free)[0]
    tally = commit(points, mesh, [i, i], [[bad, 0.0], points[i]])
    assert tally.tolist() == [0, 0, 2]
    np.testing.assert_array_equal(points, before)


def test_no_straight_corner_falls_below_the_floor():
    for seed in range(5):
        points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(seed))
        floor = 0.3  # of 1/q
        guard = VALID._replace(floor=floor / 12**0.5)  # of D/L
        before = points.copy()
        nodes = corners_of(mesh, free)
        rng = np.random.default_rng(seed)
        tally = commit(points, mesh, nodes, points[nodes] + 0.1 * rng.normal(size=(len(nodes), 2)), guard)
        assert tally[TRUNCATED] + tally[DROPPED] > 0
        for cell, kind in zip(mesh.cells, mesh.kinds, strict=True):
            ring = points[cell[: CORNERS[kind]]]
            if (ring != before[cell[: CORNERS[kind]]]).any():
                assert inverse_q(ring) > floor


def inverse_q(ring):
    """4√3·area/Σl² of a triangle, the least 2·det/(|e₁|² + |e₂|²) of a quad."""
    if len(ring) == 3:
        return naive.quality(*ring)[2]
    values = []
    for k in range(4):
        p, q = ring[(k + 1) % 4] - ring[k], ring[k - 1] - ring[k]
        values.append(2 * (p[0] * q[1] - p[1] * q[0]) / (p @ p + q @ q))
    return min(values)


@pytest.mark.parametrize("kind", range(3))
def test_read_the_other_way_round_a_clockwise_cell_is_counter_clockwise(kind):
    nodes = curved.random_cell(np.random.default_rng(1), NAMES[kind], 0.05)
    cells = np.full((1, 9), -1, dtype=np.int32)
    cells[0, : NODES[kind]] = range(NODES[kind])
    turned = counter_clockwise(cells, np.array([kind]), np.array([True]))
    mirrored = nodes * [-1, 1]
    assert curved.exact_sign(mirrored, NAMES[kind]) == -1
    assert curved.exact_sign(mirrored[turned[0, : NODES[kind]]], NAMES[kind]) == 1


def test_middles_on_the_boundary_and_held_ones_are_not_dragged():
    made = curved_meshes.known_valid(4)
    _, mesh, free = curved_meshes.tables(made)
    uses = np.bincount(mesh.cells[mesh.cells >= 0])
    for (_, _, m), goes in zip(mesh.edges, mesh.dragged, strict=True):
        assert goes == (uses[m] == 2)
    assert (free[mesh.edges[:, 2]] == mesh.dragged).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_no_valid_cell_comes_below_the_room(seed):
    rng = np.random.default_rng(seed)
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(seed % 20))
    room = judge_curved(points, mesh.cells, mesh.kinds)[1].min() * rng.choice([0.3, 1.0])
    nodes, tally = rng.choice(np.flatnonzero(free), 12), np.zeros(3, dtype=np.int64)
    commit_all(points, mesh, nodes, points[nodes] + 0.2 * rng.normal(size=(12, 2)), VALID, room, tally)
    sign, quality = judge_curved(points, mesh.cells, mesh.kinds)
    assert (sign == 1).all()
    assert quality.min() >= room * (1 - 1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_no_cell_comes_below_the_floors_of_its_corners(seed):
    """Each straight cell that changes is then above the largest of the floors at its corners."""
    rng = np.random.default_rng(seed)
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(seed % 20))
    before, floors = points.copy(), np.full(len(points), -np.inf)
    corners = corners_of(mesh, free)
    floors[corners] = rng.uniform(0.0, 0.2, len(corners))
    guard, tally = StarGuard(2.0**-53, 0.0, False, -np.inf, None, floors), np.zeros(3, dtype=np.int64)
    nodes = rng.choice(corners, 12)
    commit_all(points, mesh, nodes, points[nodes] + 0.1 * rng.normal(size=(12, 2)), guard, -np.inf, tally)
    for cell, kind in zip(mesh.cells, mesh.kinds, strict=True):
        ring = cell[: CORNERS[kind]]
        if (points[ring] != before[ring]).any():
            assert inverse_q(points[ring]) >= floors[ring].max() * 12**0.5


def test_a_middle_moves_in_a_cell_whose_straight_edges_are_at_the_floor():
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(2))
    middle = mesh.edges[mesh.dragged, 2][0]
    assert free[middle]
    target = points[middle] + 1e-4
    assert commit(points, mesh, [middle], [target], VALID._replace(floor=0.28)).tolist() == [1, 0, 0]


def test_nodes_follow_in_their_order_and_those_that_are_there_stay():
    """Its slow twin: ``commit_all`` of one node after the other, without those that are there."""
    for seed in range(5):
        points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(seed))
        rng, nodes = np.random.default_rng(seed), corners_of(mesh, free)
        places = points.copy()
        places[nodes[1:]] += 0.05 * rng.normal(size=(len(nodes) - 1, 2))
        slow, expected = points.copy(), np.zeros(3, dtype=np.int64)
        for i in nodes[1:]:
            expected += commit(slow, mesh, [i], places[[i]])
        tally = np.zeros(3, dtype=np.int64)
        left = follow(points, mesh, nodes, places, VALID, -np.inf, tally)
        np.testing.assert_array_equal(points, slow)
        np.testing.assert_array_equal(tally, expected)
        assert left == (points[nodes] != places[nodes]).any(axis=1).sum()
