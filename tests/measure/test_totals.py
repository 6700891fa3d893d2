"""Figures of the cells with a free node and of the others, put together."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import hybrid_mesh, random_quad_mesh
from gmsnet.kernels.simplex.measures import grids
from gmsnet.measure.totals import totals_of, totals_with_others
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize("held", [0.0, 0.3, 0.6, 0.97, 1.0])
@pytest.mark.parametrize("made", [(gmsnet.random_mesh, 700), (random_quad_mesh, 300), (hybrid_mesh, 200)])
def test_those_of_scored_cells_and_of_others_make_those_of_all_to_the_bit(made, held):
    make, nodes = made
    mesh = make(nodes, seed=4)
    fixed = np.random.default_rng(5).random(len(mesh.points)) < held
    topology = Topology.of(mesh, fixed)
    points = near_points(mesh, topology)
    rows = len(topology.simplices.rows)
    assert len(topology.scored.rows) + len(topology.others.rows) == rows
    scored = totals_of(points, topology.scored)
    found, wanted = totals_with_others(points, topology, scored), totals_of(points, topology.simplices)
    assert repr(found) == repr(wanted)
    others = totals_of(points, topology.others, among=rows)
    if scored is not None and others is not None:
        joined, alike = scored.joined(others), grids(len(topology.scored.rows)) == grids(rows)
        assert (joined is None) == (not alike)
        assert joined is None or repr(joined) == repr(wanted)
