"""C-grids: valid, one row of nodes in the wake, the wanted aspects; layers that smoothing keeps."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import c_grid_mesh, disturb
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize(("layers", "aspect", "around"), [(20, 1000.0, 120), (1, 1.0, 20), (8, 50.0, 62)])
@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_rows_around_an_airfoil_and_its_wake(layers, aspect, around, cells):
    mesh = c_grid_mesh(layers, aspect, around, cells=cells)
    report, topology = gmsnet.quality(mesh), Topology.of(mesh)
    assert report.inverted == 0
    lines = mesh.cells[1].nodes
    assert sorted(topology.held["boundary"].tolist()) == sorted(set(lines.ravel().tolist()))
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)
    wall = mesh.points[mesh.markers["airfoil"]]
    assert len(wall) == around  # the tail is one node
    assert np.ptp(wall[:, 0]) == pytest.approx(1.0, abs=2e-3)
    assert np.ptp(wall[:, 1]) < 0.25
    wake = np.flatnonzero((mesh.points[:, 1] == 0.0) & (mesh.points[:, 0] > 1.0))
    assert len(wake) >= around // 3
    inside = np.isin(wake, topology.free)
    assert inside.sum() >= len(wake) - 2  # but for the last one, at the outlet, and the tail


def test_cells_at_the_wall_have_the_wanted_aspect():
    mesh = c_grid_mesh(8, 50.0, 200)
    quads = mesh.points[mesh.cells[0].nodes]
    row = quads[np.isin(mesh.cells[0].nodes[:, :2], mesh.markers["airfoil"]).all(axis=1)]
    along, across = np.linalg.norm(row[:, 1] - row[:, 0], axis=1), np.linalg.norm(row[:, 3] - row[:, 0], axis=1)
    middle = (row[:, 0, 0] > 0.2) & (row[:, 0, 0] < 0.9)
    assert middle.sum() > 50
    np.testing.assert_allclose((along / across)[middle], 50.0, rtol=0.1)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_smoothing_keeps_the_layers_and_mends_the_rest(cells):
    mesh = c_grid_mesh(8, 60.0, 60, cells=cells)
    topology = Topology.of(mesh)
    held = gmsnet.smooth(mesh, max_sweeps=1).held["stretched layer"]
    loose = np.setdiff1d(topology.free, held)
    thrown = disturb(mesh, loose, 0.4, seed=3, edge="shortest")
    result = gmsnet.smooth(thrown)
    assert result.after.inverted == 0
    stayed = (result.points[held] == mesh.points[held]).all(axis=1)
    assert stayed.sum() >= len(held) - 2  # the last row ends where its neighbours are no longer stretched
    assert result.after.shape.mean() > result.before.shape.mean() + 0.02


def test_the_same_arguments_give_the_same_mesh():
    assert c_grid_mesh(3, 10.0, 30).points.tobytes() == c_grid_mesh(3, 10.0, 30).points.tobytes()


@pytest.mark.parametrize("wrong", [{"layers": 0}, {"layers": 2.5}, {"aspect": 0.5}, {"aspect": float("inf")},
                                   {"around": 19}, {"around": 31}, {"cells": "mixed"}])  # fmt: skip
def test_what_makes_no_mesh_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        c_grid_mesh(**wrong)
