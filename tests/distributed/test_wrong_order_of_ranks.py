"""A quad whose corners are in a wrong order: ranks end with the bits of one process, whoever has it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.ranks import parts_at_random, same
from topology.test_wrong_order import mesh_of, thrown_grid

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
