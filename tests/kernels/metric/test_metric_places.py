"""A metric between nodes: what is linear is found everywhere, by a walk from anywhere."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.generate import moved_hole_mesh, random_mesh, structured_mesh
from gmsnet.kernels.metric.places import evaluate
from gmsnet.metric.field import Metric
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

SLOPES = np.array([[0.3, -0.7], [1.5, 0.2], [-0.4, 0.9]])


def background(mesh):
    topology = Topology.of(mesh)
    points = near_points(mesh, topology)
    logs = points @ SLOPES.T + np.array([0.5, 0.1, -0.2])
    return Metric.at_nodes(topology, points, logs).given


@pytest.mark.parametrize("make", [lambda: random_mesh(300, seed=2), lambda: structured_mesh(7, 9), moved_hole_mesh])
def test_a_linear_field_is_found_at_any_place_from_any_triangle(make):
    given = background(make())
    rng = np.random.default_rng(0)
    rows = rng.integers(0, len(given.triangles), 500)
    share = rng.dirichlet([1.0, 1.0, 1.0], 500)
    places = np.einsum("nc,ncx->nx", share, given.points[given.triangles[rows]])
    start = rng.integers(0, len(given.triangles), 500).astype(np.int32)
    logs, slopes = np.empty((500, 3)), np.empty((500, 3, 2))
    evaluate(given, places, start, logs, slopes)
    np.testing.assert_allclose(logs, places @ SLOPES.T + np.array([0.5, 0.1, -0.2]), atol=1e-9)
    np.testing.assert_allclose(slopes, np.broadcast_to(SLOPES, slopes.shape), atol=1e-5)
    corners = given.points[given.triangles[start]]
    inside = ((corners.min(axis=1) - 1e-9 <= places) & (places <= corners.max(axis=1) + 1e-9)).all()
    assert inside


def test_beyond_the_boundary_the_value_is_one_of_the_boundary():
    given = background(structured_mesh(4, 4))
    places = np.array([[2.0, 0.25], [-0.3, 0.5]]) * given.points.max()
    start, logs = np.zeros(2, dtype=np.int32), np.empty((2, 3))
    evaluate(given, places, start, logs, np.empty((2, 3, 2)))
    low, high = given.logs.min(axis=0), given.logs.max(axis=0)
    assert ((low - 1e-12 <= logs) & (logs <= high + 1e-12)).all()


def test_a_node_without_a_triangle_has_no_metric():
    given, logs = background(structured_mesh(4, 4)), np.ones((1, 3))
    evaluate(given, np.zeros((1, 2)), np.full(1, -1, dtype=np.int32), logs, np.empty((1, 3, 2)))
    assert (logs == 0.0).all()


def test_neighbours_share_the_edge_opposite_to_the_corner():
    given = background(random_mesh(100, seed=5))
    boundary = 0
    for t, corners in enumerate(given.triangles.tolist()):
        for c in range(3):
            other = given.adjacent[t, c]
            boundary += other < 0
            if other >= 0:
                assert set(corners) - {corners[c]} <= set(given.triangles[other].tolist())
                assert t in given.adjacent[other]
    assert boundary == 3 * len(given.triangles) - 2 * (given.adjacent >= 0).sum() // 2
