from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import settle
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


@pytest.mark.parametrize("seed", range(4))
def test_cells_stay_valid_and_the_boundary_stands_still(seed):
    mesh = gmsnet.random_mesh(200, "lshape", seed=seed)
    settled = settle(mesh, 10)
    assert gmsnet.quality(settled).inverted == 0
    held = np.unique(mesh.cells[1].nodes)
    assert np.array_equal(settled.points[held], mesh.points[held])
    assert gmsnet.quality(settled).shape.mean() > gmsnet.quality(mesh).shape.mean() + 0.1


def test_a_sweep_goes_to_the_mean_of_the_neighbours():
    mesh = gmsnet.random_mesh(60, seed=1)
    smooth = settle(mesh, 50)
    triangles = smooth.cells[0].nodes
    once = settle(smooth, 1)
    for node in np.setdiff1d(triangles, mesh.cells[1].nodes):
        ring = np.setdiff1d(triangles[(triangles == node).any(axis=1)], node)
        assert once.points[node] == pytest.approx(smooth.points[ring].mean(axis=0), abs=1e-12)


def test_no_sweep_changes_nothing():
    mesh = gmsnet.random_mesh(60, seed=1)
    assert np.array_equal(settle(mesh, 0).points, mesh.points)


def test_what_cannot_settle_is_named():
    quad = Mesh(np.eye(4)[:, :2], (CellBlock("quad", np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=int)),))
    with pytest.raises(InputError, match="only meshes of triangles in the plane"):
        settle(quad, 1)
