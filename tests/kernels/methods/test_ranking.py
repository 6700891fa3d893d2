"""Ranking against NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import ranking
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def test_shapes_are_those_of_the_report():
    mesh = gmsnet.random_mesh(300, seed=1)
    report, topology = gmsnet.quality(mesh), Topology.of(mesh)
    points, count = planar_points(mesh), len(topology.triangles)
    shape, some = np.empty(count), np.empty(3)
    simplices = Simplices(topology.triangles, topology.orientation)
    ranking.shapes(points, simplices, 0, -(-count // LANES), shape)
    np.testing.assert_allclose(shape, report.shape, rtol=1e-12)
    cells = np.array([5, 0, count - 1], dtype=np.int32)
    ranking.shapes_of(points, simplices, cells, some)
    np.testing.assert_allclose(some, report.shape[cells], rtol=1e-12)


def test_free_nodes_once_each():
    topology = Topology.of(gmsnet.random_mesh(500, seed=2))
    rng = np.random.default_rng(3)
    triangles, free = topology.near, topology.near_free
    cells = rng.choice(len(triangles), 60, replace=False).astype(np.int32)
    shape = rng.random(60)
    seen = np.zeros(len(free), dtype=np.bool_)
    nodes = ranking.free_nodes(triangles, cells, shape, 0.5, free, topology.memory, seen)
    wanted = np.unique(triangles[cells[shape <= 0.5]])
    np.testing.assert_array_equal(np.sort(nodes), wanted[free[wanted]])
    assert (np.diff(topology.memory[nodes]) > 0).all()
    assert not seen.any()


@given(st.integers(0, 2**32 - 1), st.integers(1, 400))
def test_nodes_in_the_order_of_their_ids(seed, count):
    """Few among many, which are sorted, and so many that all are gone through."""
    rng = np.random.default_rng(seed)
    for total in (count, 16 * count, 20 * count):
        memory = rng.permutation(total).astype(np.int32)
        nodes = rng.choice(total, count, replace=False).astype(np.int32)
        wanted = nodes[np.argsort(memory[nodes])].tolist()
        ranking.by_id(nodes, memory)
        assert nodes.tolist() == wanted
