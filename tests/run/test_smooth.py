from __future__ import annotations

import threading
import time
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import Delaunay

import gmsnet
from gmsnet import CellBlock, InputError, Mesh
from gmsnet.generate import disturb
from gmsnet.parallel import threads as workers
from gmsnet.run import stop
from gmsnet.topology.topology import Topology


@pytest.fixture(scope="module")
def square():
    return gmsnet.random_mesh(400, seed=11)


def hold_everything(mesh):
    return np.ones(len(mesh.points), dtype=bool)


def test_the_input_is_not_changed(square):
    points = square.points.copy()
    triangles = next(b.nodes for b in square.cells if b.kind == "triangle").copy()
    result = gmsnet.smooth((points, triangles), max_sweeps=2)
    np.testing.assert_array_equal(points, square.points)
    assert result.points is not points
    assert (result.points != points).any()


def test_max_sweeps_is_kept_and_the_history_tells(square):
    result = gmsnet.smooth(square, "gmsnet", max_sweeps=3)
    assert (result.sweeps, result.stop_reason) == (3, stop.MAX_SWEEPS)
    assert [s.index for s in result.history] == [1, 2, 3]
    assert result.history[0].moved > 0
    assert result.seconds > 0


def test_no_sweeps_change_nothing_and_say_so(square):
    result = gmsnet.smooth(square, max_sweeps=0)
    assert (result.sweeps, result.stop_reason) == (0, stop.MAX_SWEEPS)
    assert result.points.tobytes() == square.points.tobytes()
    assert not result.moved.any()


def test_a_long_run_ends_when_nothing_is_gained(square):
    result = gmsnet.smooth(square, max_sweeps=1000)
    assert result.stop_reason == stop.NO_PROGRESS
    assert result.sweeps < 300
    best = max(s.qhat for s in result.history)
    assert result.judged.after.qhat == pytest.approx(best, abs=1e-12)  # the best on the way, not the last
    worse = [b for a, b in pairwise(result.history) if b.qhat < a.qhat]
    assert worse or result.judged.after.qhat >= result.history[-1].qhat - 1e-12


def test_a_target_that_is_met_stops_the_run(square):
    start = gmsnet.quality(square).shape.min()
    result = gmsnet.smooth(square, target_quality=start + 0.02)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= start + 0.02
    assert all(s.min_shape < start + 0.02 for s in result.history[:-1])


def test_a_target_met_beforehand_moves_nothing(square):
    result = gmsnet.smooth(square, target_quality=float(gmsnet.quality(square).shape.min()))
    assert (result.sweeps, result.stop_reason) == (0, stop.TARGET_REACHED)


def test_a_target_out_of_reach_is_not_called_reached(square):
    result = gmsnet.smooth(square, target_quality=1.0, max_sweeps=30)
    assert result.stop_reason in (stop.MAX_SWEEPS, stop.NO_PROGRESS)


def test_the_callback_sees_each_sweep_and_stops_the_run(square):
    seen = []
    result = gmsnet.smooth(square, "gmsnet", callback=lambda sweep: seen.append(sweep) or len(seen) == 4)
    assert result.stop_reason == stop.CALLBACK
    assert seen == result.history
    assert result.sweeps == 4


def test_an_error_in_the_callback_reaches_the_caller(square):
    def fail(sweep):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        gmsnet.smooth(square, callback=fail)


def test_nothing_to_move_is_said(square):
    result = gmsnet.smooth(square, fixed=hold_everything(square))
    assert result.stop_reason == stop.NOTHING_TO_MOVE
    assert result.sweeps == 0
    assert sum(map(len, result.held.values())) == len(square.points)
    assert "fixed by the user" in result.held


def test_every_form_of_fixed(square):
    free = [i for i in range(len(square.points)) if i not in set(np.concatenate(list(gmsnet.smooth(
        square, max_sweeps=0).held.values())).tolist())]  # fmt: skip
    chosen = np.array(free[:7])
    mask = np.zeros(len(square.points), dtype=bool)
    mask[chosen] = True
    for form in (chosen, chosen.tolist(), mask, chosen.astype(np.uint16)):
        result = gmsnet.smooth(square, fixed=form, max_sweeps=2)
        assert result.held["fixed by the user"].tolist() == chosen.tolist()
        assert not result.moved[chosen].any()
    assert gmsnet.smooth(square, fixed=[], max_sweeps=1).held.get("fixed by the user") is None


def test_markers_and_regions_can_be_held_by_name():
    rng = np.random.default_rng(0)
    points = rng.random((50, 2))
    triangles = Delaunay(points).simplices
    mesh = Mesh(
        points,
        (CellBlock("triangle", triangles, np.r_[np.ones(10, int), np.full(len(triangles) - 10, 2)]),),
        region_names={(2, 1): "core"},
    )
    result = gmsnet.smooth(mesh, fixed="core", max_sweeps=1)
    assert not result.moved[np.unique(triangles[:10])].any()
    with pytest.raises(InputError, match="no marker 'cor'; did you mean 'core'"):
        gmsnet.smooth(mesh, fixed="cor")


def test_a_files_own_fixed_nodes_are_held(square):
    flags = np.zeros(len(square.points))
    free = int(np.flatnonzero(gmsnet.smooth(square, max_sweeps=1).moved)[0])
    flags[free] = 1
    mesh = Mesh(square.points, square.cells, point_data={"fixed": flags})
    result = gmsnet.smooth(mesh, max_sweeps=1)
    assert not result.moved[free]


def test_single_precision_results_are_exact_in_float32(square):
    mesh = Mesh(np.float64(np.float32(square.points)), square.cells, single=True)
    result = gmsnet.smooth(mesh, max_sweeps=10)
    assert result.moved.any()
    np.testing.assert_array_equal(result.points, np.float64(np.float32(result.points)))
    assert result.after.inverted == 0


def test_planes_of_constant_x_y_and_z_give_the_same_result(square):
    flat = gmsnet.smooth(square, max_sweeps=3).points
    for axis in range(3):
        points = np.insert(square.points, axis, 2.5, axis=1)
        result = gmsnet.smooth(Mesh(points, square.cells), max_sweeps=3)
        np.testing.assert_array_equal(np.delete(result.points, axis, axis=1), flat)
        assert (result.points[:, axis] == 2.5).all()


def test_tangled_cells_are_never_added_to_and_some_are_mended(square):
    tangled = disturb(square, Topology.of(square).free, 0.8, seed=1, keep_valid=False)
    result = gmsnet.smooth(tangled, max_sweeps=30)
    assert result.before.inverted > 0
    assert result.after.inverted < result.before.inverted
    assert result.after.valid[result.before.valid].all()


def test_many_runs_at_once_give_what_one_gives(square):
    alone = gmsnet.smooth(square, max_sweeps=5).points.tobytes()
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(gmsnet.smooth(square, max_sweeps=5).points.tobytes()))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [alone] * 4


def test_no_threads_are_left_behind(monkeypatch):
    monkeypatch.setattr(workers, "FEWEST_BLOCKS", 1)
    mesh = gmsnet.random_mesh(20_000, seed=0)
    gmsnet.smooth(mesh, max_sweeps=1, threads=3)
    for _ in range(100):
        if threading.active_count() == 1 + sum(t.daemon for t in threading.enumerate() if t.name != "MainThread"):
            break
        time.sleep(0.01)
    assert not [t for t in threading.enumerate() if "ThreadPool" in t.name]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "gmsnett"}, "unknown method 'gmsnett'; did you mean gmsnet"),
        ({"method": "zzz"}, "choose one of"),
        ({"max_sweeps": -1}, "max_sweeps must be"),
        ({"max_sweeps": 2.5}, "max_sweeps must be"),
        ({"threads": 0}, "threads must be"),
        ({"target_quality": 0.0}, r"in \(0, 1\]"),
        ({"target_quality": 1.5}, r"in \(0, 1\]"),
        ({"target_quality": float("nan")}, r"in \(0, 1\]"),
        ({"fixed": [10_000]}, "the mesh has the nodes 0 to"),
        ({"fixed": [-1]}, "fixed names the node -1"),
        ({"fixed": np.ones(3, dtype=bool)}, "one value per node"),
        ({"fixed": [0.5]}, "fixed must be"),
        ({"fixed": "nowhere"}, "no marker 'nowhere'"),
        ({"method": "gmsnet", "weights": "no-such.safetensors"}, "no-such.safetensors"),
    ],
)
def test_what_cannot_be_used_is_refused(square, options, message):
    with pytest.raises(InputError, match=message):
        gmsnet.smooth(square, **options)


@pytest.mark.parametrize("size", [4e-310, 1e-200, 1e200, 1.5e308])
def test_coordinates_at_the_ends_of_the_range(square, size):
    mesh = Mesh(square.points * size, square.cells)
    result = gmsnet.smooth(mesh, max_sweeps=3)
    assert np.isfinite(result.points).all()
    assert result.after.inverted == 0
    assert result.after.qhat > result.before.qhat


@pytest.mark.parametrize("size", [1e-37, 1e-41, 5e-44])
def test_single_precision_next_to_zero(square, size):
    mesh = Mesh(np.float64(np.float32(square.points * size)), square.cells, single=True)
    result = gmsnet.smooth(mesh, max_sweeps=3)
    np.testing.assert_array_equal(result.points, np.float64(np.float32(result.points)))
    assert result.after.valid[result.before.valid].all()


def test_the_best_mesh_is_chosen_by_the_metric_that_is_asked_for():
    mesh = gmsnet.random_mesh(400, seed=11)
    results = {by: gmsnet.smooth(mesh, best_by=by) for by in ("shape", "aspect")}
    assert results["shape"].history[0].qhat != results["aspect"].history[0].qhat
    assert results["aspect"].after.qhat_aspect >= results["shape"].after.qhat_aspect
    assert results["shape"].after.qhat >= results["aspect"].after.qhat
    for by, result in results.items():
        best = max(sweep.qhat for sweep in result.history)
        after = result.judged.after
        assert best == pytest.approx(after.qhat if by == "shape" else after.qhat_aspect, abs=1e-12)
