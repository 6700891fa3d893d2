"""The mean of volumes of all kinds: the last stage of `auto` on a valid mesh."""

import pytest

import gmsnet
from gmsnet.generate import block_volume, disturb
from gmsnet.run import mean_stage
from gmsnet.topology.mixed_volume import volume_of, wound_of


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "mixed"])
@pytest.mark.parametrize("seed", range(3))
def test_the_mean_of_a_valid_mesh_falls_by_no_more_than_a_thousandth(kind, seed):
    mesh = block_volume(5, kind)
    mesh = disturb(mesh, volume_of(wound_of(mesh)).free, 0.25, seed=seed)
    seen = []
    result = gmsnet.smooth(mesh, callback=lambda sweep: bool(seen.append(sweep.index)))
    assert seen == sorted(set(seen))
    assert result.after.inverted == 0
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.after.shape.mean() >= result.before.shape.mean() - 0.001


@pytest.mark.parametrize("kind", ["wedge", "mixed"])
def test_the_least_gives_nothing_for_a_mean_that_does_not_come_back(kind, monkeypatch):
    """With a mean that none can have wanted, the end is that of a stage that gives nothing. Some nodes are held."""
    mesh = block_volume(5, kind)
    free = volume_of(wound_of(mesh)).free
    mesh = disturb(mesh, free, 0.25, seed=1)
    fixed = free[::5]
    monkeypatch.setattr(mean_stage, "LOSS", -1.0)
    asked = gmsnet.smooth(mesh, fixed=fixed)
    monkeypatch.setattr(mean_stage, "SHARES", (1.0,))
    assert (gmsnet.smooth(mesh, fixed=fixed).points == asked.points).all()
    monkeypatch.setattr(mean_stage, "SHARES", (0.9,))
    assert gmsnet.smooth(mesh, fixed=fixed).judged.after.shape_min < asked.judged.after.shape_min - 0.01
