"""Figures that ranks form together, each of its own cells."""

from types import SimpleNamespace

import numpy as np
import pytest

import gmsnet

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together

from gmsnet.distributed.executor import Ranks
from gmsnet.generate.recombine import random_quad_mesh
from gmsnet.measure.totals import totals_of
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize("ends", [[0], [1000], [100, 101, 4000]])
@pytest.mark.parametrize("kind", ["triangles", "quads"])
def test_processes_that_have_a_part_of_the_cells_each_form_the_totals_of_all(ends, kind):
    """To the bit, though none of them sees more than its own cells, and one may have none."""
    mesh = gmsnet.random_mesh(3000, seed=7) if kind == "triangles" else random_quad_mesh(2000, seed=1)
    topology = Topology.of(mesh)
    points, whole = near_points(mesh, topology), topology.simplices
    rows = np.arange(len(whole.rows)) if whole.cells is None else whole.cells
    parts = [whole.take(np.flatnonzero(some)) for some in np.digitize(rows, ends) == np.arange(len(ends) + 1)[:, None]]
    found = together(
        len(parts),
        lambda comm: totals_of(points, parts[comm.rank], Ranks(SimpleNamespace(comm=comm, halo=None))),
    )
    assert [repr(each) for each in found] == [repr(totals_of(points, whole))] * len(parts)  # nan is nan
