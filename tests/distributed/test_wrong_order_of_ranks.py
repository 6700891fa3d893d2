"""A quad or hexahedron whose corners are in a wrong order: ranks end with the bits of one process, whoever has it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.ranks import parts_at_random, same
from topology.test_wrong_order import WRONG, mesh_of, thrown_block, thrown_grid

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions


@pytest.mark.parametrize("order", [(0, 2, 1, 3), (1, 0, 2, 3)])
@pytest.mark.parametrize("cell", [0, 27, 35])
def test_one_crossed_quad(cell, order):
    points, quads = thrown_grid()
    quads[cell] = quads[cell, list(order)]
    mesh = mesh_of(points, quads)
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 2, np.random.default_rng(1), "strips"), 2)
    assert told.gathered
    assert told.after.inverted == 1


@pytest.mark.parametrize("order", WRONG)
@pytest.mark.parametrize("cell", [0, 62])
def test_one_hexahedron(cell, order):
    points, hexahedra = thrown_block()
    hexahedra[cell] = hexahedra[cell, list(WRONG[order])]
    mesh = Mesh(points, (CellBlock("hexahedron", hexahedra, np.zeros(len(hexahedra), dtype=np.int64)),))
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 2, np.random.default_rng(1), "strips"), 2)
    assert told.after.inverted == 1
