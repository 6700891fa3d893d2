from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import split_edges
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


@pytest.fixture(scope="module")
def mesh():
    return gmsnet.random_mesh(300, seed=1)


def areas(mesh):
    (ax, ay), (bx, by), (cx, cy) = (mesh.points[mesh.cells[0].nodes[:, k]].T for k in range(3))
    return 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


@pytest.mark.parametrize("count", [0, 1, 9])
def test_each_split_edge_gives_a_node_of_degree_four(mesh, count):
    split = split_edges(mesh, count, seed=2)
    triangles = split.cells[0].nodes
    assert len(split.points) == len(mesh.points) + count
    assert len(triangles) == len(mesh.cells[0].nodes) + 2 * count
    assert np.array_equal(split.points[: len(mesh.points)], mesh.points)
    assert (areas(split) > 0).all()
    assert areas(split).sum() == pytest.approx(1.0)
    assert [(triangles == node).sum() for node in range(len(mesh.points), len(split.points))] == [4] * count
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, times = np.unique(edges, axis=0, return_counts=True)
    assert np.array_equal(unique[times == 1], np.unique(np.sort(split.cells[1].nodes, axis=1), axis=0))
    assert times.max() == 2


def test_new_nodes_are_far_from_one_another_and_from_the_boundary(mesh):
    split = split_edges(mesh, 9, seed=2)
    triangles = split.cells[0].nodes
    new = np.arange(len(mesh.points), len(split.points))
    for row in triangles[np.isin(triangles, new).any(axis=1)]:
        assert np.isin(row, new).sum() == 1
        assert not np.isin(row, split.cells[1].nodes).any()


def test_the_seed_decides(mesh):
    first, again, other = (split_edges(mesh, 5, seed=seed) for seed in (0, 0, 1))
    assert np.array_equal(first.points, again.points)
    assert not np.array_equal(first.points, other.points)


def test_what_cannot_be_split_is_named(mesh):
    with pytest.raises(InputError, match=r"only \d+ edges of this mesh can be split, not 1000"):
        split_edges(mesh, 1000)
    quad = Mesh(np.eye(4)[:, :2], (CellBlock("quad", np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=int)),))
    with pytest.raises(InputError, match="only the edges of triangles"):
        split_edges(quad, 1)
