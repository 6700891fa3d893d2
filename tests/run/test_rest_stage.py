"""Cells that held nodes keep bad do not keep the others from becoming better."""

from __future__ import annotations

import numpy as np
import pytest
from support import volumes

import gmsnet
from gmsnet.methods import above
from gmsnet.run import rest_stage, stop
from gmsnet.topology.volume import Volume


@pytest.fixture(scope="module")
def cube():
    return volumes.mesh_of(*volumes.cube(1500, 4))


@pytest.fixture(scope="module")
def held(cube):
    """The nodes of the worst cells of the input, which stay."""
    shape = gmsnet.quality(cube).shape
    return np.unique(cube.cells[0].nodes[np.argsort(shape)[:6]])


def without(mesh, **options):
    """The result without the stage, and without walls that look at the rest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rest_stage, "TIMES", 0)
        patch.setattr(above, "APART", np.inf)
        return gmsnet.smooth(mesh, **options)


def own(mesh, held):
    """Which cells have a free node."""
    free = np.zeros(len(mesh.points), dtype=bool)
    free[Volume.of(mesh).free] = True
    free[held] = False
    return free[mesh.cells[0].nodes].any(axis=1)


def test_bad_cells_behind_the_worst_become_fewer(cube, held):
    before, after = without(cube, fixed=held), gmsnet.smooth(cube, fixed=held)
    rows = own(cube, held)
    was, now = (result.after.shape[rows] for result in (before, after))
    assert now.min() >= was.min() - 1e-3  # as good as held nodes let it be
    assert (now < 0.3).sum() < 0.6 * (was < 0.3).sum()
    assert (now < 0.25).sum() < 0.2 * (was < 0.25).sum()
    assert now.mean() > was.mean() - 0.01
    assert after.after.inverted == 0
    assert rest_stage.PHASE in {sweep.stage for sweep in after.history}
    assert after.stop_reason == stop.NO_PROGRESS
    assert [sweep.index for sweep in after.history] == sorted({sweep.index for sweep in after.history})
    last = after.history[-1]
    assert (last.min_shape, last.mean_shape) == pytest.approx((now.min(), now.mean()))
    assert after.points[held].tobytes() == cube.points[held].tobytes()


@pytest.mark.parametrize("level", ["valid", "worst", "star"])
def test_levels_and_threads(cube, held, level):
    one, two = (gmsnet.smooth(cube, fixed=held, guard=level, threads=threads) for threads in (1, 2))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.after.inverted == 0
    if level != "valid":
        assert one.after.shape.min() >= one.before.shape.min()


def test_it_leaves_alone_a_mesh_whose_worst_cells_are_many_alike(cube):
    assert gmsnet.smooth(cube).points.tobytes() == without(cube).points.tobytes()


def test_sweeps_are_no_more_than_asked_for(cube, held):
    few = without(cube, fixed=held).sweeps + 3
    result = gmsnet.smooth(cube, fixed=held, max_sweeps=few)
    assert result.sweeps <= few
    seen = []
    whole = gmsnet.smooth(cube, fixed=held, callback=seen.append)
    assert [sweep.stage for sweep in seen] == [sweep.stage for sweep in whole.history]
    stopped = gmsnet.smooth(cube, fixed=held, callback=lambda sweep: sweep.stage == rest_stage.PHASE)
    assert stopped.stop_reason == stop.CALLBACK
    assert stopped.history[-1].stage == rest_stage.PHASE


def test_a_look_at_some_cells_says_the_same_as_one_at_all(cube, monkeypatch):
    whole, thrown = gmsnet.smooth(cube), gmsnet.smooth(cube, fixed=np.arange(300, 330))
    monkeypatch.setattr(rest_stage, "_are_alike", lambda *_: False)
    assert gmsnet.smooth(cube).points.tobytes() == whole.points.tobytes()
    assert gmsnet.smooth(cube, fixed=np.arange(300, 330)).points.tobytes() == thrown.points.tobytes()
