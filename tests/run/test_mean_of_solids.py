"""The mean of volumes of all kinds: the last stage of `auto` on a valid mesh."""

import pytest

import gmsnet
from gmsnet.generate import block_volume, disturb
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
