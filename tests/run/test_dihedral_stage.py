"""The last stage of ``auto`` on volumes: smallest dihedral angles, and what may go for them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import volumes

import gmsnet
import gmsnet.generate
from gmsnet.methods.dihedral import Dihedral
from gmsnet.run import dihedral_stage, stop
from gmsnet.topology.volume import Volume

MESHES = os.environ.get("GMSNET_MESHES")


@pytest.fixture(scope="module")
def cube():
    return volumes.mesh_of(*volumes.cube(1500, 4))


@pytest.fixture(scope="module")
def both(cube):
    """The result, and what it is without the stage."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dihedral_stage, "GAIN", np.inf)
        before = gmsnet.smooth(cube)
    return before, gmsnet.smooth(cube)


def own(mesh, report):
    """Which cells have a free node, by rows of a report."""
    free = np.zeros(len(mesh.points), dtype=bool)
    free[Volume.of(mesh).free] = True
    return free[mesh.cells[0].nodes].any(axis=1)[report.cell]


def test_the_smallest_angle_gains_more_than_is_lost(cube, both):
    before, after = both
    rows = own(cube, after.after)
    was, now = (report.after.min_dihedral[rows].min() for report in both)
    assert now > was + 0.5
    least = [report.after.shape[rows].min() for report in both]
    assert 1 / least[1] <= 1 / least[0] + dihedral_stage.SPENT[-1] + 1e-9
    assert after.after.shape.mean() > before.after.shape.mean() - 0.003
    assert after.after.inverted == 0
    last = after.history[-1]
    assert (last.stage, last.index) == (Dihedral.phase, before.sweeps + 1)
    assert last.min_shape == pytest.approx(least[1])
    assert len(after.history) == len(before.history) + 1
    assert after.stop_reason == before.stop_reason == stop.NO_PROGRESS


@pytest.mark.parametrize("level", ["worst", "star"])
def test_no_cell_becomes_worse_than_the_worst_of_the_input(cube, level):
    good = gmsnet.smooth(cube, "barrier", objective="q4", max_sweeps=40).mesh
    result = gmsnet.smooth(good, guard=level)
    assert result.after.shape.min() >= result.before.shape.min()


def test_where_it_is_not_made(cube):
    assert Dihedral.phase not in {sweep.stage for sweep in gmsnet.smooth(cube, max_sweeps=5).history}
    assert Dihedral.phase not in {sweep.stage for sweep in gmsnet.smooth(cube, "barrier").history}
    exact = gmsnet.smooth(cube)
    again = gmsnet.smooth(cube, max_sweeps=exact.sweeps - 1)
    assert again.sweeps == exact.sweeps - 1
    seen = []
    gmsnet.smooth(cube, callback=seen.append)
    assert seen[-1].stage == Dihedral.phase
    stopped = gmsnet.smooth(cube, callback=lambda sweep: sweep.stage == Dihedral.phase)
    assert stopped.stop_reason == stop.CALLBACK
    assert stopped.points.tobytes() == exact.points.tobytes()


@pytest.mark.skipif(not MESHES, reason="GMSNET_MESHES names no folder of meshes")
def test_a_mesh_whose_smallest_angle_is_a_held_one():
    mesh = gmsnet.read(Path(MESHES or "", "cub_wedge_like.vtk"))
    result = gmsnet.smooth(mesh)
    after = result.after
    assert after.min_dihedral.min() >= 28.5
    assert after.shape.min() >= 0.51
    assert after.shape.mean() >= 0.895
    assert after.inverted == 0
    held = np.setdiff1d(np.arange(len(mesh.points)), Volume.of(mesh).free)
    assert result.points[held].tobytes() == mesh.points[held].tobytes()


def test_nodes_that_slide_stay_on_their_faces(monkeypatch):
    mesh = gmsnet.generate.random_volume(800, seed=3)
    monkeypatch.setattr(dihedral_stage, "GAIN", np.inf)
    before = gmsnet.smooth(mesh, slide=True)
    monkeypatch.undo()
    result = gmsnet.smooth(mesh, slide=True)
    assert result.history[-1].stage == Dihedral.phase
    assert result.after.min_dihedral.min() > before.after.min_dihedral.min()
    on = (mesh.points == 0) | (mesh.points == 1)
    assert (result.points[on] == mesh.points[on]).all()
    corners = on.sum(axis=1) >= 2
    assert (result.moved & on.any(axis=1)).any()
    assert corners.sum() > 8
    assert result.after.volume.sum() == pytest.approx(1, abs=1e-12)


def test_the_floor_of_the_input_is_that_of_a_look_at_it(cube, monkeypatch):
    """It is kept from the first sweep on; where it is not, all cells are looked at once more."""
    exact, seen = gmsnet.smooth(cube), []
    plain = dihedral_stage.floor_for_angles

    def forgetful(state, *arguments):
        assert state.floor is not None
        assert state.floor_of is state.start
        seen.append(plain(state, *arguments) == plain(replace(state, floor=None, floor_of=None), *arguments))
        return plain(replace(state, floor=None, floor_of=None), *arguments)

    monkeypatch.setattr(dihedral_stage, "floor_for_angles", forgetful)
    assert gmsnet.smooth(cube).points.tobytes() == exact.points.tobytes()
    assert seen
    assert all(seen)
