"""The metric of a mesh is recovered from its cells."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.generate import Front, disturb, good_mesh, hybrid_mesh, structured_mesh
from gmsnet.generate.curves import Curve
from gmsnet.metric.tensors import logs_of, tensors_of
from gmsnet.preserve.recovered import recovered, unit_tensors
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

FRONT = Front(0.05, 10.0, width=0.1, bend=0.03)


def found(mesh):
    topology = Topology.of(mesh)
    points = near_points(mesh, topology)
    return recovered(topology, points), points * 2.0**mesh.exponent, topology


def good_square(edge):
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return good_mesh([[Curve(corners[[k, (k + 1) % 4]], "side") for k in range(4)]], edge)


@pytest.mark.parametrize("shapes", [None, np.array([1], dtype=np.uint8)])
def test_a_simplex_is_ideal_in_its_own_metric(shapes):
    corners = np.array([[[0.1, 0.2], [1.3, 0.4], [0.5, 2.0]]])
    (m,), good = unit_tensors(corners, shapes)
    tensor = np.array([[m[0], m[1]], [m[1], m[2]]])
    a, b = corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0]
    lengths = [e @ tensor @ e for e in (a, b)]
    np.testing.assert_allclose(lengths, 1.0)
    np.testing.assert_allclose((b - a) @ tensor @ (b - a), 1.0 if shapes is None else 2.0)
    assert good.all()
    assert not unit_tensors(np.array([[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]]), shapes)[1].any()


def test_a_grid_that_is_mapped_has_the_metric_of_the_map():
    grid = structured_mesh(10, 10)
    jacobian = np.array([[3.0, 1.0], [0.0, 0.2]])
    mesh = grid.with_points(grid.points @ jacobian.T)
    logs, _, _ = found(mesh)
    inverse = 10.0 * np.linalg.inv(jacobian)
    tensor = inverse.T @ inverse
    wanted = np.array([tensor[0, 0], tensor[0, 1], tensor[1, 1]]) * 4.0**mesh.exponent
    np.testing.assert_allclose(tensors_of(logs), np.broadcast_to(wanted, logs.shape), rtol=1e-5)


@pytest.fixture(scope="module")
def adapted():
    return FRONT.mesh()


@pytest.mark.parametrize("jitter", [0.0, 0.2, 0.4])
def test_the_metric_of_an_adapted_mesh_is_found_though_nodes_were_thrown(jitter, adapted):
    mesh = adapted
    if jitter:
        mesh = disturb(mesh, Topology.of(mesh).free, jitter, seed=4, edge="shortest")
    logs, points, _ = found(mesh)
    away = logs - logs_of(FRONT.metric(points))
    away[:, 0] -= np.median(away[:, 0])
    assert np.median(np.abs(away[:, 1:]).max(axis=1)) < 0.2  # of 1.15, half the logarithm of the aspect
    assert np.median(np.abs(away[:, 0])) < 0.2


def test_slivers_hardly_change_what_is_found():
    mesh = good_square(0.1)
    topology = Topology.of(mesh)
    clean, _, _ = found(mesh)
    node = topology.free[len(topology.free) // 2]
    start, ring = topology.patches
    row = int(np.flatnonzero(topology.free == node)[0])
    a, b = mesh.points[ring[start[row] : start[row] + 2]]
    points = mesh.points.copy()
    points[node] = 0.5 * (a + b) + 1e-6 * (points[node] - 0.5 * (a + b))  # a cell of aspect 1e6
    thrown, _, _ = found(mesh.with_points(points))
    assert np.abs(thrown - clean).max() < 1.0  # that cell's own logarithms are about 14
    assert np.median(np.abs(thrown - clean)) < 0.02


def test_flat_and_inverted_cells_tell_nothing():
    mesh = hybrid_mesh(80, seed=2)
    points = mesh.points.copy()
    topology = Topology.of(mesh)
    points[topology.free[:10]] = points[topology.free[10:20]]
    logs, _, _ = found(mesh.with_points(points))
    assert np.isfinite(logs).all()
