"""A little of the least η of tetrahedra is given where the worst cells have cost the others much of their mean."""

from __future__ import annotations

import pytest

import gmsnet
from gmsnet.generate import ball_volume, disturb_on, random_volume
from gmsnet.run import dihedral_stage, mean_stage

MESHES = {
    "cube": random_volume(60, seed=1),
    "ball": disturb_on(ball_volume(150), 0.4, seed=3).mesh,
    "other ball": disturb_on(ball_volume(150), 0.4, seed=2).mesh,
}


def ends(result):
    return result.judged.after.shape_min, result.judged.after.shape_mean


@pytest.mark.parametrize("name", MESHES)
def test_what_is_given_and_what_comes_back(name, monkeypatch):
    mesh = MESHES[name]
    result = gmsnet.smooth(mesh)
    assert gmsnet.smooth(mesh, threads=2).points.tobytes() == result.points.tobytes()
    monkeypatch.setattr(dihedral_stage, "SPENT", ())
    given = ends(gmsnet.smooth(mesh))
    monkeypatch.setattr(mean_stage, "GIVEN", ())
    kept = ends(gmsnet.smooth(mesh))
    assert mean_stage.MeanInSpace.phase in [sweep.stage for sweep in result.history]
    assert kept[0] > given[0] >= 0.96 * kept[0] - 1e-9
    assert given[1] > kept[1] + 0.001


@pytest.mark.parametrize("level", ["valid", "worst", "star"])
def test_no_cell_falls_below_the_worst_of_the_input(level):
    """A result is the input of the next call, and has little to give."""
    mesh = MESHES["ball"]
    for _ in range(3):
        result = gmsnet.smooth(mesh, guard=level)
        before, after = result.judged.before, result.judged.after
        assert after.shape_min >= before.shape_min or level == "valid"
        mesh = result.mesh


@pytest.mark.parametrize("name", MESHES)
def test_angles_cost_little_of_the_mean(name, monkeypatch):
    result = gmsnet.smooth(MESHES[name])
    monkeypatch.setattr(dihedral_stage, "SPENT", ())
    plain = gmsnet.smooth(MESHES[name])
    assert ends(result)[1] >= ends(plain)[1] - dihedral_stage.MEAN - 1e-12
