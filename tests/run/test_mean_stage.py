"""The stage for the mean η: what it brings, and that neither the least η nor the smallest angle pays for it."""

from __future__ import annotations

import numpy as np
import pytest
from support import blocks, volumes

import gmsnet
import gmsnet.generate
from gmsnet.measure.dihedral import WIDE, measures_of, most_shape_below
from gmsnet.methods.mean_in_space import MeanInSpace
from gmsnet.run import mean_stage, stop
from gmsnet.topology.volume import Volume


@pytest.fixture(scope="module")
def cube():
    return volumes.mesh_of(*volumes.cube(1500, 4))


def without(mesh, **options):
    """The result without the stage."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mean_stage, "GAIN", np.inf)
        return gmsnet.smooth(mesh, **options)


def figures(result):
    """Least and mean η and the least measure of the angles over the cells with a free node."""
    volume, report = Volume.of(result.mesh), result.after
    free = np.zeros(len(result.points), dtype=bool)
    free[volume.free] = True
    own = free[result.mesh.cells[0].nodes].any(axis=1)[report.cell]
    columns = np.array([report.min_dihedral[own], report.max_dihedral[own]])
    return report.shape[own].min(), report.shape[own].mean(), measures_of(columns, WIDE).min()


@pytest.mark.parametrize("shares", [(0.94, 1.0), (1.0,), (0.5, 1.0)])
def test_the_mean_gains_and_nothing_pays(cube, monkeypatch, shares):
    monkeypatch.setattr(mean_stage, "SHARES", shares)
    before, after = without(cube), gmsnet.smooth(cube)
    least, mean, angle = figures(before)
    now = figures(after)
    assert now[0] >= least
    assert now[1] > mean + 5e-4
    assert now[2] >= angle * (1 - 1e-9)
    assert after.after.inverted == 0
    last = after.history[-1]
    assert (last.stage, last.index) == (MeanInSpace.phase, before.sweeps + 1)
    assert last.mean_shape == pytest.approx(now[1])
    assert after.stop_reason == before.stop_reason == stop.NO_PROGRESS


def test_cells_below_the_floor_stay_as_they_are(cube, monkeypatch):
    monkeypatch.setattr(mean_stage, "SHARES", (1.0,))
    before, after = without(cube), gmsnet.smooth(cube)
    floor = most_shape_below(figures(before)[2], WIDE)
    low = before.after.shape < floor * (1 - 1e-6)
    assert low.sum() > 20
    assert (before.after.shape[low] == after.after.shape[low]).all()
    assert (after.after.shape[~low] >= floor * (1 - 1e-5)).all()
    nodes = cube.cells[0].nodes[before.after.cell[low]]
    assert before.points[nodes].tobytes() == after.points[nodes].tobytes()


def test_threads_make_the_same_bits(cube):
    assert gmsnet.smooth(cube, threads=1).points.tobytes() == gmsnet.smooth(cube, threads=2).points.tobytes()


def test_where_it_is_not_made(cube):
    exact = gmsnet.smooth(cube)

    def stages(mesh, **options):
        return {sweep.stage for sweep in gmsnet.smooth(mesh, **options).history}

    assert MeanInSpace.phase in {sweep.stage for sweep in exact.history}
    assert MeanInSpace.phase not in stages(cube, max_sweeps=exact.sweeps - 1)
    assert MeanInSpace.phase not in stages(cube, method="barrier")
    assert MeanInSpace.phase not in stages(cube, guard="star")
    assert MeanInSpace.phase not in stages(cube, target_dihedral=5.0)
    assert MeanInSpace.phase not in stages(blocks.block(4, 4, 4, jitter=0.2, seed=1))
    stopped = gmsnet.smooth(cube, callback=lambda sweep: sweep.stage == MeanInSpace.phase)
    assert stopped.stop_reason == stop.CALLBACK
    assert stopped.points.tobytes() == exact.points.tobytes()


def test_nodes_that_slide_stay_on_their_faces():
    mesh = gmsnet.generate.random_volume(800, seed=3)
    before, after = without(mesh, slide=True), gmsnet.smooth(mesh, slide=True)
    assert figures(after)[1] > figures(before)[1]
    on = (mesh.points == 0) | (mesh.points == 1)
    assert (after.points[on] == mesh.points[on]).all()
    assert after.after.volume.sum() == pytest.approx(1, abs=1e-12)
