"""How a mesh conforms to a metric: lengths, areas, and what the number of cells allows."""

from __future__ import annotations

import numpy as np
import pytest
from support import naive_metric as naive

from gmsnet.generate import Front, hybrid_mesh, structured_mesh
from gmsnet.metric.conformity import Conformity, cell_qualities, edge_lengths, edges_of
from gmsnet.metric.field import Metric
from gmsnet.metric.tensors import checked_metric, checked_sizes, logs_of
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


def sizes(function):
    return lambda points: checked_sizes(function(points), len(points), "point")


def test_lengths_are_integrals_where_sizes_change_by_one_factor_per_way():
    points = np.array([[0.0, 0.0], [3.0, 4.0], [1.0, 0.0]])
    logs = checked_sizes([0.5, 2.0, 0.5], 3, "node")
    lengths = edge_lengths(points, logs, np.array([[0, 1], [0, 2], [1, 1]], dtype=np.int32))
    share = (np.arange(100_000) + 0.5) / 100_000
    np.testing.assert_allclose(lengths[0], (5.0 / (0.5 * 4.0**share)).mean(), rtol=1e-8)
    assert lengths[1] == 2.0
    assert lengths[2] == 0.0
    tensor = logs_of(np.array([[9.0, 1.0, 4.0]] * 3))
    length = edge_lengths(points, tensor, np.array([[0, 1]], dtype=np.int32))
    np.testing.assert_allclose(length, np.sqrt(9 * 9 + 2 * 12 + 4 * 16), rtol=1e-12)


@pytest.mark.parametrize("turn", [0.3, 1.0, 2.5])
def test_lengths_across_a_very_flat_metric_are_those_of_its_small_axis(turn):
    # log M has the eigenvalues ±18.4 along (cos, sin) and across it; its entries are 10⁸, which cancel across it.
    large = np.log(1e8)
    logs = np.array([[0.0, large * np.cos(2.0 * turn), large * np.sin(2.0 * turn)]] * 2)
    points = np.array([[0.0, 0.0], [-np.sin(turn), np.cos(turn)]])
    length = edge_lengths(points, logs, np.array([[0, 1]], dtype=np.int32))
    np.testing.assert_allclose(length, 1e-4, rtol=1e-6)


def test_every_edge_counts_once():
    mesh = structured_mesh(4, 3)
    edges = edges_of(Topology.of(mesh))
    assert len(edges) == 4 * 4 + 5 * 3
    assert len(np.unique(edges, axis=0)) == len(edges)
    mixed = Topology.of(hybrid_mesh(100, seed=1))
    faces = len(mixed.triangles) + len(mixed.quads)
    assert len(mixed.memory) - len(edges_of(mixed)) + faces == 1  # Euler


@pytest.mark.parametrize("scale", [1.0, 2.0**-40, 1000.0])
def test_a_mesh_of_squares_conforms_to_their_side(scale):
    mesh = structured_mesh(8, 8, size=scale)
    topology = Topology.of(mesh)
    near = near_points(mesh, topology)
    metric = Metric.of_place(topology, near, sizes(lambda p: np.full(len(p), scale / 8)), mesh.exponent)
    found = Conformity.of(near, topology, metric)
    assert metric.reachable == pytest.approx(1.0)
    assert (found.least, found.length, found.near_one, found.near_mean) == pytest.approx((1.0, 1.0, 1.0, 1.0))
    assert found.quasi_unit == 1.0
    coarse = Metric.of_place(topology, near, sizes(lambda p: np.full(len(p), scale / 4)), mesh.exponent)
    found = Conformity.of(near, topology, coarse)
    assert coarse.reachable == pytest.approx(0.5)
    assert (found.least, found.length, found.near_one, found.near_mean) == pytest.approx((1.0, 0.5, 0.0, 1.0))
    assert found.quasi_unit == 0.0
    for side, share in ((1.4, 1.0), (1.43, 0.0), (0.72, 1.0), (0.7, 0.0)):
        found = Conformity.of(
            near,
            topology,
            Metric.of_place(
                topology, near, sizes(lambda p, side=side: np.full(len(p), side * scale / 8)), mesh.exponent
            ),
        )
        assert found.quasi_unit == share


def test_cells_are_judged_by_their_worst_corner_as_matrices_judge_it():
    mesh = hybrid_mesh(60, seed=3)
    topology = Topology.of(mesh)
    near = near_points(mesh, topology)
    rng = np.random.default_rng(1)
    logs = 0.3 * rng.standard_normal((len(near), 3)) + np.array([4.0, 0.0, 0.0])
    values = cell_qualities(near, topology.simplices, logs)
    simplices = topology.simplices
    wanted = {}
    for t, row in enumerate(simplices.rows.tolist()):
        row = row if simplices.orientation[t] > 0 else [row[0], row[2], row[1]]
        value = naive.quality(near[row], logs[row], ("equilateral", "square")[simplices.shapes[t]])
        cell = int(simplices.cells[t])
        wanted[cell] = min(value, wanted.get(cell, 1.0))
    np.testing.assert_allclose(values, list(wanted.values()), rtol=1e-9)


def test_a_mesh_made_for_a_metric_conforms_to_it():
    front = Front(0.04, 10.0, bend=0.05)
    mesh = front.mesh()
    topology = Topology.of(mesh)
    near = near_points(mesh, topology)

    def logs(points):
        return checked_metric(front.metric(points), len(points), "point")

    metric = Metric.of_place(topology, near, logs, mesh.exponent)
    found = Conformity.of(near, topology, metric)
    assert metric.reachable == pytest.approx(1.0, abs=0.03)
    assert found.near_one > 0.97
    assert found.mean > 0.97
