"""Boundary layers around an airfoil: valid, right angles, the wanted aspects, nodes shared with the mesh outside."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import layered_mesh
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize(("layers", "aspect", "around"), [(20, 1000.0, 120), (1, 1.0, 20), (8, 50.0, 61)])
def test_rows_around_an_airfoil(layers, aspect, around):
    mesh = layered_mesh(layers, aspect, around)
    report, topology = gmsnet.quality(mesh), Topology.of(mesh)
    assert report.inverted == 0
    edges = topology.triangles[:, [[0, 1], [1, 2]]].reshape(-1, 2).T
    graph = coo_matrix((np.ones(edges.shape[1]), edges), shape=(len(mesh.points),) * 2)
    assert connected_components(graph, directed=False)[0] == 1
    assert (topology.orientation == 1).all()
    lines = mesh.cells[1].nodes
    assert sorted(topology.held["boundary"].tolist()) == sorted(set(lines.ravel().tolist()))
    assert len(lines) == len(topology.held["boundary"])
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)
    assert mesh.markers["airfoil"].tolist() == list(range(around))
    chord = mesh.points[:around]
    assert np.ptp(chord[:, 0]) == pytest.approx(1.0)
    assert np.ptp(chord[:, 1]) < 0.25
    np.testing.assert_allclose(
        np.linalg.norm(mesh.points[mesh.markers["farfield"]] - [0.5, 0.0], axis=1), 3.0, rtol=0.01
    )
    rows = mesh.points[: (layers + 1) * around].reshape(layers + 1, around, 2)
    across = np.linalg.norm(np.diff(rows, axis=0), axis=-1)
    along = np.linalg.norm(rows - np.roll(rows, 1, axis=1), axis=-1)[:-1]
    if around > 100:  # close enough to the conformal map's derivative
        middle = slice(around // 6, around // 3)
        np.testing.assert_allclose((along / across)[0, middle], aspect, rtol=0.1)
    outside = report.shape[2 * layers * around :]
    assert outside.min() > 0.6
    assert outside.mean() > 0.95


def test_the_same_arguments_give_the_same_mesh():
    assert layered_mesh(3, 10.0, 30).points.tobytes() == layered_mesh(3, 10.0, 30).points.tobytes()


@pytest.mark.parametrize("wrong", [{"layers": 0}, {"layers": 2.5}, {"layers": True}, {"aspect": 0.5},
                                   {"aspect": float("inf")}, {"around": 19}])  # fmt: skip
def test_what_makes_no_mesh_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        layered_mesh(**wrong)
