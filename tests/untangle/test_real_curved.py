"""The second-order fixtures: valid as they are, and valid again after their inner nodes are thrown."""

from __future__ import annotations

import numpy as np
import pytest
from support.curved_meshes import cell_table

from gmsnet import io
from gmsnet.generate.curved import throw
from gmsnet.kernels.curved.stars import curved_mesh
from gmsnet.measure.curved import judge_curved
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.untangle.curved import untangle_curved


@pytest.mark.parametrize("name", ["square-disc-p2.vtk", "quadratic_quad.msh", "star-mixed-p2.vtk"])
def test_a_fixture_is_valid_and_untangled_when_thrown(real_meshes, name):
    read = io.read(real_meshes / name)
    points = np.ascontiguousarray(read.points[:, :2])
    cells, kinds, held = cell_table(read)
    mesh = curved_mesh(points, cells, kinds, held)
    held[mesh.edges[~mesh.dragged]] = True  # boundary edges with their ends
    assert (judge_curved(points, cells, kinds)[0] == 1).all()
    assert untangle_curved(PlanarCells(points.copy(), mesh, ~held))[:2] == (0, 0)
    thrown = throw(Mesh(points, read.cells), middles=0.4, corners=0.3, seed=1)
    moved = np.array(thrown.points)
    score = untangle_curved(PlanarCells(moved, curved_mesh(moved, cells, kinds, held), ~held))
    assert score.before > 20
    assert score.after == 0
    np.testing.assert_array_equal(moved[held], points[held])
