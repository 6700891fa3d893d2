"""A side whose ends are pushed over held nodes beside it: no mesh is valid there, and none is looked for."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import random_mesh, random_quad_mesh
from gmsnet.run.journey import Journey
from gmsnet.untangle.crossings import angle_sums, doubled_back

MESHES = {"triangle": random_mesh, "quad": random_quad_mesh}


@pytest.mark.parametrize(("cells", "angle", "wound"), [("triangle", 0.0, 1), ("triangle", 0.3, -1), ("quad", 0.0, -1)])
def test_a_side_stops_before_the_nodes_that_it_would_lie_on(cells, angle, wound, monkeypatch):
    made = MESHES[cells](1500, seed=1)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    (block,) = (each for each in made.cells if each.kind == cells)
    mesh = gmsnet.mesh_from_arrays(made.points @ turn, block.nodes[:, ::wound])
    in_vain, untangled = [], Journey.untangled

    def counted(self, state, step, executor):
        found = untangled(self, state, step, executor)
        in_vain.append(found.why)
        return found

    monkeypatch.setattr(Journey, "untangled", counted)
    ids = np.flatnonzero(made.points[:, 0] == 0.0)
    done = gmsnet.deform(mesh, np.array([0.1, 0.0]) @ turn, ids)
    beside = made.points[:, 1] % 1.0 == 0.0
    first = np.sort(made.points[beside & (made.points[:, 0] > 0.0), 0])[0]
    assert 0.5 * first < 0.1 * done.fraction < first
    assert done.after.inverted == 0
    assert "boundar" in done.reason
    assert (angle != 0.0) or "the boundary would lie on itself at" in done.reason
    assert not any(in_vain)


def test_a_slit_and_a_spike_are_told_apart():
    # A square of which node 1 has an edge to node 2 that goes back over the one to node 0, without and with cells.
    points = np.array([[1.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    edges = np.array([[1, 0], [2, 1], [2, 3], [3, 4]])
    assert doubled_back(points, edges).tolist() == [1]
    around = np.array([[1, 2, 3], [1, 3, 4], [1, 4, 5], [1, 5, 0]])
    assert angle_sums(points, *around.T)[1] == pytest.approx(2.0 * np.pi)
    spike = np.array([[1, 2, 3], [1, 3, 0]])
    assert angle_sums(points, *spike.T)[1] == pytest.approx(0.0)
