"""Paths of boundaries, how much they turn, and how the inside follows; beside slow twins."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gmsnet import CellBlock, Mesh
from gmsnet.cells.table import CELLS
from gmsnet.generate import block_volume, layered_mesh, random_mesh, random_volume, structured_mesh
from gmsnet.motion.path import Path
from gmsnet.motion.prescribed import Prescribed
from gmsnet.motion.rigid import ACCURATE, Follower, System
from gmsnet.motion.rotations import SPACE
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import near_points
from gmsnet.topology.outline import held_edges
from gmsnet.topology.topology import Topology


def boundary(topology):
    return topology.held["boundary"]


def connectivity(mesh):
    if mesh.plane:
        return Topology.of(mesh)
    return volume_of(wound_of(mesh, np.zeros(len(mesh.points), dtype=bool)))


def carried(mesh, topology, prescribed):
    """The path of a mesh, and the points and attitudes of its end."""
    near = near_points(mesh, topology)[:, : prescribed.dimension].copy()
    path = Path.of(prescribed, topology, near, mesh.exponent)
    follower = Follower.of(topology, near, (path.end != path.start).any(axis=1), np.zeros(len(near), dtype=bool))
    a, b = follower.edges.T
    still, turns = path.rotations.still(len(near)), path.turns(1.0)
    points, attitude = follower.follow(near, still, near[b] - near[a], path.end, turns, turns, path.sure)
    return path, follower, points, attitude


@settings(max_examples=25)
@given(
    st.floats(-3.1, 3.1), st.floats(-10.0, 10.0), st.sampled_from(["tri", "quad", "tetra", "mixed"]),
    st.integers(0, 3),
)  # fmt: skip
def test_a_motion_of_the_whole_boundary_as_one_body_is_reproduced(angle, shift, kind, seed):
    if kind in ("tri", "quad"):
        mesh = random_mesh(60, seed=seed) if kind == "tri" else structured_mesh(6, 5)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    else:
        mesh = random_volume(60, seed=seed) if kind == "tetra" else block_volume(4, "mixed")
        turn = Rotation.from_rotvec(angle * np.array([2.0, -1.0, 2.0]) / 3.0).as_matrix()
    topology = connectivity(mesh)
    wanted = mesh.points[:, : len(turn)] @ turn.T + shift * np.arange(1, len(turn) + 1)
    ids = boundary(topology)
    _, _, points, _ = carried(mesh, topology, Prescribed.of(mesh, places=wanted[ids], nodes=ids))
    off = np.abs(points * 2.0**mesh.exponent - wanted[topology.memory]).max()
    assert off <= (1e-12 if len(turn) == 2 else 1e-7) * (1.0 + abs(shift))


@pytest.mark.parametrize("mesh", [random_mesh(40, seed=5), random_volume(40, seed=5), block_volume(3)])
def test_a_step_is_the_least_squares_solution_of_a_slow_twin(mesh):
    topology = connectivity(mesh)
    ids = mesh.markers["top"]
    path, follower, points, attitude = carried(
        mesh, topology, Prescribed.of(mesh, (0.1, 0.2, 0.3)[: 2 if mesh.plane else 3], ids)
    )
    at = near_points(mesh, topology)[:, : points.shape[1]].copy()
    free = np.flatnonzero(topology.near_free)
    rows, right = [], []
    for (a, b), stiffness in zip(follower.edges.tolist(), follower.stiffness.tolist(), strict=True):
        way, row = at[b] - at[a], np.zeros(len(at))
        root = math.sqrt(stiffness) / np.linalg.norm(way)
        row[b], row[a] = root, -root
        rows.append(row)
        right.append(root * halfway(attitude[a], attitude[b]).apply(np.append(way, 0.0)[:3])[: len(way)])
    system, right = np.array(rows), np.array(right)
    held = np.setdiff1d(np.arange(len(at)), free)
    found = np.linalg.lstsq(system[:, free], right - system[:, held] @ points[held], rcond=None)[0]
    # The last rotations were fitted after the places were found: by less than what counts as settled.
    assert np.abs(points[free] - found).max() <= 2e-3 * np.abs(path.end - path.start).max()


@pytest.mark.parametrize("turned", [0.0, 0.05, 1.2])
def test_nodes_that_slide_in_a_plane_are_solved_for_as_by_a_dense_twin(turned):
    random = np.random.default_rng(7)
    count, rows = 150, np.sort(random.choice(150, 40, replace=False))
    joins = scipy.sparse.random_array((count, count), density=0.05, rng=random, format="csr")
    joins = (joins + joins.T).tocsr()
    diagonal = joins.sum(axis=1) + 1e-3
    system, along = System(joins, diagonal), random.uniform(0.0, 2.0 * math.pi, len(rows))
    for angles in (along, along + turned, along + 2.0 * turned):
        tangents = np.column_stack([np.cos(angles), np.sin(angles)])
        tangents[0] = 0.0  # a node that can go nowhere
        ways = tangents[:, :, None] * tangents[:, None, :]
        right = random.normal(size=(count, 2))
        found = system.solve(right, rows, ways)
        spread = np.zeros((2 * count, 2 * count - len(rows)))
        inner = np.setdiff1d(np.arange(count), rows)
        for k, node in enumerate(inner):
            spread[2 * node, 2 * k] = spread[2 * node + 1, 2 * k + 1] = 1.0
        for k, (node, tangent) in enumerate(zip(rows, tangents, strict=True)):
            spread[2 * node : 2 * node + 2, 2 * len(inner) + k] = tangent
        spread = spread[:, spread.any(axis=0)]
        matrix = spread.T @ np.kron(np.diag(diagonal) - joins.toarray(), np.eye(2)) @ spread
        wanted = (spread @ np.linalg.solve(matrix, spread.T @ right.ravel())).reshape(-1, 2)
        rest = spread.T @ (right - diagonal[:, None] * found + joins @ found).ravel()
        assert np.linalg.norm(rest) <= 2.0 * ACCURATE * np.linalg.norm(right)
        assert np.abs(found - wanted).max() <= 1e-2 * np.abs(wanted).max()
        np.testing.assert_allclose(found[rows], np.einsum("nij,nj->ni", ways, found[rows]), atol=1e-12)
        if turned == 0.0:
            np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def halfway(one, other):
    """The rotation between two attitudes."""
    if len(one) == 1:
        return Rotation.from_rotvec([0.0, 0.0, 0.5 * float(one[0] + other[0])])
    return Rotation.from_quat([one, other]).mean()


@settings(max_examples=20)
@given(st.integers(0, 1000), st.floats(0.0, 1.5))
def test_kernels_of_rotations_in_space_agree_with_slow_twins(seed, turn):
    rng = np.random.default_rng(seed)
    points, edges = rng.normal(size=(12, 3)), np.array([(i, j) for i in range(12) for j in range(i) if (i + j) % 3])
    ways, weight = rng.normal(size=(len(edges), 3)), rng.uniform(0.5, 2.0, len(edges))
    attitude = Rotation.from_rotvec(turn * rng.normal(size=(12, 3)) / 3.0).as_quat()
    pulls = SPACE.pulls(edges.astype(np.int32), weight, ways, attitude, points)
    wanted = np.zeros((12, 3))
    moments = np.zeros((12, 3, 3))
    for (a, b), w, way in zip(edges.tolist(), weight.tolist(), ways, strict=True):
        now = points[b] - points[a]
        pull = w * (halfway(attitude[a], attitude[b]).apply(way) - now)
        wanted[a] -= pull
        wanted[b] += pull
        for node in (a, b):
            moments[node] += w * np.outer(now, way)
    assert pulls == pytest.approx(wanted, abs=1e-12)
    back = SPACE.back(edges.astype(np.int32), ways, attitude)
    twin = [halfway(attitude[a], attitude[b]).inv().apply(way) for (a, b), way in zip(edges, ways, strict=True)]
    assert back == pytest.approx(np.array(twin), abs=1e-12)
    u, sizes, v = np.linalg.svd(moments)
    turned = u @ v
    chosen = (np.linalg.det(turned) > 0.0) & (sizes[:, 2] > 0.01 * sizes[:, 0])  # the others' best rotation may be two
    near = Rotation.from_matrix(np.where(chosen[:, None, None], turned, np.eye(3)))
    fitted = (Rotation.from_rotvec(0.3 * rng.normal(size=(12, 3))) * near).as_quat()
    before = fitted.copy()
    most = SPACE.fit(edges.astype(np.int32), weight, ways, points, chosen, fitted)
    assert (fitted[~chosen] == before[~chosen]).all()
    apart = (Rotation.from_quat(fitted) * near.inv()).magnitude()
    assert apart[chosen].max(initial=0.0) < 1e-7
    turns = (Rotation.from_quat(fitted) * Rotation.from_quat(before).inv()).magnitude()
    assert most == pytest.approx(turns[chosen].max(initial=0.0), abs=1e-6)


@pytest.mark.parametrize("mesh", [random_volume(60, seed=1), block_volume(3, "mixed"), block_volume(2, "wedge")])
def test_the_edges_of_the_boundary_of_a_volume(mesh):
    topology = connectivity(mesh)
    rim, every = held_edges(topology)
    wanted, joined = set(), set()
    for block in mesh.cells:
        corners = topology.places[block.nodes]
        if block.dimension == 2:
            wanted |= {tuple(sorted(pair)) for row in corners.tolist() for pair in combinations(row, 2)}
        else:
            joined |= {tuple(sorted((row[i], row[j]))) for row in corners.tolist() for i, j in CELLS[block.kind].edges}
    assert {tuple(pair) for pair in rim.tolist()} == wanted
    held = {pair for pair in joined if not topology.near_free[list(pair)].any()}
    assert held <= {tuple(pair) for pair in every.tolist()}


@pytest.mark.parametrize("degrees", [30.0, 90.0, 180.0, 270.0, -540.0])
def test_a_body_in_space_goes_along_an_arc_and_turns_as_asked(degrees):
    mesh = hollow()
    topology = connectivity(mesh)
    ids, axis = mesh.node_sets["hole"], np.array([1.0, 2.0, 2.0]) / 3.0
    prescribed = Prescribed.of(mesh, (1.0, 2.0, 3.0), ids, rotate=(ids, degrees, (0.25, 0.0, 0.5), axis))
    near = near_points(mesh, topology)[:, :3].copy()
    path = Path.of(prescribed, topology, near, mesh.exponent)
    moved = np.zeros(len(near), dtype=bool)
    moved[ids] = True
    moved = moved[topology.memory]
    assert len(path.bodies) == 1
    for share in (0.0, 0.25, 0.5, 1.0):
        places, turns = path.places(share), path.turns(share)
        assert turns[moved] == pytest.approx(np.tile(math.radians(share * degrees) * axis, (moved.sum(), 1)), abs=1e-6)
        assert np.abs(turns[~moved]).max() < 1e-12
        apart = np.abs(np.linalg.norm(places[moved][:, None] - places[moved], axis=-1))
        start = np.linalg.norm(path.start[moved][:, None] - path.start[moved], axis=-1)
        assert apart == pytest.approx(start, abs=1e-9)
        assert (places[~moved] == path.start[~moved]).all()


def hollow():
    """Hexahedra around a cube that is not there."""
    mesh = block_volume(5)
    nodes = mesh.cells[0].nodes
    centre = mesh.points[nodes].mean(axis=1)
    kept = (np.abs(centre - 0.5) > 0.15).any(axis=1)
    inner = np.setdiff1d(np.unique(nodes[~kept]), [])
    block = CellBlock("hexahedron", nodes[kept], np.zeros(int(kept.sum()), dtype=np.int64))
    return Mesh(mesh.points, (block,), node_sets={"hole": inner})


@pytest.mark.parametrize("degrees", [30.0, 90.0, 180.0, 270.0, -540.0])
def test_a_body_goes_along_an_arc_and_turns_as_asked(degrees):
    mesh = layered_mesh(3, 10.0, 30)
    topology = Topology.of(mesh)
    prescribed = Prescribed.of(mesh, (1.0, 2.0), "airfoil", rotate=("airfoil", degrees, (0.25, 0.0)))
    path = Path.of(prescribed, topology, near_points(mesh, topology), mesh.exponent)
    moved = np.zeros(len(topology.memory), dtype=bool)
    moved[mesh.markers["airfoil"]] = True
    moved = moved[topology.memory]
    assert len(path.bodies) == 1
    for share in (0.0, 0.25, 0.5, 1.0):
        places, turns = path.places(share), path.turns(share)
        assert turns[moved] == pytest.approx(math.radians(share * degrees), abs=1e-6)
        assert (turns[topology.near_ringed] == 0.0).all()
        apart, start = (np.linalg.norm(each[:, None] - each, axis=-1) for each in (places[moved], path.start[moved]))
        assert apart == pytest.approx(start, abs=1e-9)
        assert (places[~moved] == path.start[~moved]).all()
    by_id = np.empty((len(places), 2))
    by_id[topology.memory] = places * 2.0**mesh.exponent
    assert (by_id == prescribed.places).all()


def test_a_bend_beyond_half_a_turn_is_told_along_the_boundary():
    mesh = structured_mesh(40, 4)
    topology = Topology.of(mesh)
    ids, angle = boundary(topology), 1.6 * math.pi
    x, y = mesh.points[ids, :2].T
    radius = 1.0 / angle - 0.1 * (y - 0.5)
    places = np.column_stack([radius * np.sin(angle * x), -radius * np.cos(angle * x)])
    path = Path.of(Prescribed.of(mesh, places=places, nodes=ids), topology, near_points(mesh, topology), mesh.exponent)
    order = np.empty(len(topology.memory), dtype=int)
    order[topology.memory] = np.arange(len(order))
    turns = path.turns(1.0)[order[ids], 0]
    turns += 2.0 * math.pi * round(float(np.mean(angle * x - turns)) / (2.0 * math.pi))
    inner = (x > 0.1) & (x < 0.9)
    assert np.abs(turns - angle * x)[inner].max() < 0.1


def test_layers_keep_their_spacing_around_a_wall_that_turns():
    mesh = layered_mesh(10, 100.0, 60)
    topology = Topology.of(mesh)
    layers = np.arange(len(mesh.points)) < 11 * 60
    prescribed = Prescribed.of(mesh, rotate=("airfoil", 30, (0.25, 0.0)))
    near = near_points(mesh, topology)
    path = Path.of(prescribed, topology, near, mesh.exponent)
    follower = Follower.of(topology, near, (path.end != path.start).any(axis=1), layers[topology.memory])
    a, b = follower.edges.T
    still, turns = path.rotations.still(len(near)), path.turns(1.0)
    points, _ = follower.follow(near, still, near[b] - near[a], path.end, turns, turns, path.sure)
    by_id = np.empty_like(points)
    by_id[topology.memory] = points * 2.0**mesh.exponent
    spacing, before = (
        np.linalg.norm(np.diff(each[layers, :2].reshape(11, 60, 2), axis=0), axis=-1) for each in (by_id, mesh.points)
    )
    assert np.abs(spacing / before - 1.0).max() < 0.005
