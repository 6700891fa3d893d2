from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.generate import disturb, kershaw_mesh, random_mesh, random_quad_mesh, sheared_mesh, structured_mesh
from gmsnet.kernels.topology.patch import around
from gmsnet.measure.report import measure
from gmsnet.measure.target import Target
from gmsnet.run import stop
from gmsnet.run.score import Missing
from gmsnet.run.target_run import rows_missing
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


@pytest.fixture(scope="module")
def good():
    """A mesh that is smoothed already."""
    return gmsnet.smooth(gmsnet.random_mesh(3000, seed=2)).mesh


def test_only_what_is_around_the_cells_that_miss_a_target_moves(good):
    """A few nodes were moved in a good mesh: only their neighbourhoods are smoothed, until none misses the target."""
    free = Topology.of(good).free
    bad = disturb(good, free[100:110], 0.6, seed=1)
    target = float(gmsnet.quality(good).shape.min())
    below = gmsnet.quality(bad).shape < target
    assert 0 < below.sum() < 50
    result = gmsnet.smooth(bad, target_quality=target)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= target
    assert 0 < result.moved.sum() < 0.05 * len(good.points)
    corners = Topology.of(bad).triangles
    near = np.zeros(len(good.points), dtype=bool)
    near[corners[below]] = True
    for _ in range(7):  # the largest patches
        near[corners[near[corners].any(axis=1)]] = True
    assert not (result.moved & ~near).any()


@pytest.mark.parametrize("method", ["auto", "gmsnet", "laplacian", "getme", "barrier", "worst-first"])
def test_any_method_can_work_for_a_target(method):
    mesh = gmsnet.random_mesh(500, seed=4)
    start = float(gmsnet.quality(mesh).shape.min())
    result = gmsnet.smooth(mesh, method, target_quality=start + 0.03)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= start + 0.03


def test_angles_can_be_the_target():
    mesh = gmsnet.random_mesh(500, seed=5)
    result = gmsnet.smooth(mesh, target_angle=12.0)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.min_angle.min() >= 12.0 > result.before.min_angle.min()


def test_both_together(good):
    least, angle = gmsnet.quality(good).shape.min(), gmsnet.quality(good).min_angle.min()
    result = gmsnet.smooth(good, target_quality=float(least), target_angle=float(angle))
    assert (result.sweeps, result.stop_reason) == (0, stop.TARGET_REACHED)


def test_no_cell_is_lost_for_another(good):
    """However far the target is out of reach, never more cells miss it than before."""
    for target in (0.5, 0.55, 0.7):
        result = gmsnet.smooth(good, target_quality=target, max_sweeps=60)
        assert (result.after.shape < target).sum() <= (result.before.shape < target).sum()
        assert result.after.shape.min() >= result.before.shape.min()
        assert result.stop_reason in (stop.NO_PROGRESS, stop.MAX_SWEEPS)


def test_what_is_held_cannot_be_mended():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.01]])
    result = gmsnet.smooth((points, np.array([[0, 1, 2]])), target_quality=0.5)
    assert result.stop_reason == stop.NOTHING_TO_MOVE


def test_stopping_is_obeyed_on_patches(good):
    seen = []
    result = gmsnet.smooth(good, "barrier", target_quality=0.99, callback=lambda s: seen.append(s) or len(seen) == 3)
    assert result.stop_reason == stop.CALLBACK
    assert [s.index for s in seen] == [1, 2, 3]
    result = gmsnet.smooth(good, "barrier", target_quality=0.99, max_sweeps=5)
    assert (result.sweeps, result.stop_reason) == (5, stop.MAX_SWEEPS)


def test_what_misses_a_target():
    shape, angle = np.array([0.5, 0.2, -0.9, np.nan, 0.31]), np.array([30.0, 11.0, 60.0, np.nan, 19.0])
    assert Target(quality=0.3).missed(shape, angle).tolist() == [False, True, True, True, False]
    assert Target(angle=20.0).missed(shape, angle).tolist() == [False, True, True, True, True]
    assert not Target().missed(shape, angle).any()
    assert Target(quality=0.3).shape == 0.3
    assert Target(angle=60.0).shape == pytest.approx(1.0)
    assert Target(quality=0.1, angle=30.0).shape == pytest.approx(2 * math.sqrt(3) * (math.sqrt(3) / 2) / 5)


def test_patches_against_a_slow_twin():
    mesh = gmsnet.random_mesh(300, seed=6)
    topology = Topology.of(mesh)
    chosen = topology.near[[7, 200]]
    for rings in (1, 2, 3):
        wanted = set(chosen.ravel().tolist())
        for ring in range(rings):
            wanted = {node for node in wanted if topology.near_free[node]}
            if ring < rings - 1:
                wanted |= {n for row in topology.near if wanted & set(row.tolist()) for n in row.tolist()}
        active = around(chosen, rings, topology.near_free, topology.near_start, topology.near_ring)
        free = {node for node in wanted if topology.near_free[node]}
        assert set(np.flatnonzero(active).tolist()) == free
        patch = topology.restricted(active)
        assert set(topology.memory[np.flatnonzero(active)].tolist()) == set(patch.free.tolist())
        assert set(np.flatnonzero(patch.near_free).tolist()) == free
        expected = sorted(sorted(row) for row in topology.near.tolist() if free & set(row))
        assert sorted(sorted(row) for row in patch.near.tolist()) == expected
        points = near_points(mesh, topology)
        a, b, c = (points[patch.near[:, k]] for k in range(3))
        assert ((b - a)[:, 0] * (c - a)[:, 1] > (b - a)[:, 1] * (c - a)[:, 0]).all()
        assert patch.changeable[0] is patch.near
        assert (patch.near_orientation == 1).all()


def test_what_a_target_gains_is_kept_though_the_mean_pays_for_it():
    """A held sliver is the worst cell; around other cells below the target the mean may fall."""
    for seed in range(6):
        mesh = gmsnet.smooth(gmsnet.random_mesh(300, seed=seed)).mesh
        corners = Topology.of(mesh).triangles
        sliver = np.array([[5.0, 0.0], [6.0, 0.0], [5.5, 1e-3]])
        points = np.vstack([mesh.points[:, :2], sliver])
        cells = np.vstack([corners, len(mesh.points) + np.arange(3)])
        before = gmsnet.quality((points, cells))
        result = gmsnet.smooth((points, cells), target_quality=0.5)
        below, left = ((report.shape < 0.5).sum() for report in (before, result.after))
        assert left <= below
        assert (left < below) == result.moved.any()


def test_no_star_gets_worse_for_a_target_at_the_level_star():
    for seed in range(3):
        mesh = gmsnet.random_mesh(400, seed=seed)
        result = gmsnet.smooth(mesh, target_quality=0.6, guard="star")
        topology = Topology.of(mesh)
        around_each = [np.flatnonzero((topology.triangles == node).any(axis=1)) for node in topology.free]
        before, after = result.before.shape, result.after.shape
        assert result.moved.any()
        assert all(after[rows].min() >= before[rows].min() - 1e-12 for rows in around_each)


@pytest.mark.parametrize(
    ("target", "more"), [({"target_quality": 0.6}, 1.0), ({"target_quality": 0.68}, 0.8), ({"target_angle": 28.0}, 0.5)]
)
def test_fewer_cells_miss_a_target_than_after_a_full_run(target, more):
    """The default works for the cells that miss it, so that fewer are left; and the worst one is as good as before."""
    goal, left, full = Target(**{name.removeprefix("target_"): value for name, value in target.items()}), 0, 0
    for seed in range(3):
        mesh = gmsnet.random_mesh(3000, seed=seed)
        result = gmsnet.smooth(mesh, **target)
        left += len(goal.missed_in(result.after))
        full += len(goal.missed_in(gmsnet.smooth(mesh).after))
        assert result.after.shape.min() >= result.before.shape.min()
    assert left <= more * full


def test_a_target_that_most_cells_cannot_meet_is_told_so_and_makes_nothing_worse(good):
    result = gmsnet.smooth(good, target_quality=0.98)
    assert result.stop_reason == stop.NO_PROGRESS
    assert (result.after.shape < 0.98).sum() <= (result.before.shape < 0.98).sum()
    assert result.after.shape.min() >= result.before.shape.min()


def test_the_worst_quality_there_is_as_the_target_is_met_already():
    """Whatever rounding says of a cell right at the target: what the report says of it counts."""
    for seed in range(8):
        mesh = gmsnet.random_mesh(400, seed=seed)
        report = gmsnet.quality(mesh)
        least, angle = float(report.shape.min()), float(report.min_angle.min())
        for target in ({"target_quality": least}, {"target_angle": angle}):
            result = gmsnet.smooth(mesh, **target)
            assert (result.sweeps, result.stop_reason, result.moved.any()) == (0, stop.TARGET_REACHED, False)
        above = gmsnet.smooth(mesh, target_quality=math.nextafter(least, 1.0))
        assert above.moved.any()
        assert above.after.shape.min() > least


def test_turning_or_mirroring_a_mesh_turns_or_mirrors_what_a_target_makes_of_it():
    mesh = gmsnet.random_mesh(800, seed=9)
    quarter, mirror = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.diag([-1.0, 1.0])
    for target in ({"target_quality": 0.4}, {"target_angle": 20.0}):
        expected = gmsnet.smooth(mesh, **target).points[:, :2]
        for change in (quarter, mirror):
            turned = gmsnet.smooth((mesh.points[:, :2] @ change, mesh.cells[0].nodes), **target)
            np.testing.assert_allclose(turned.points, expected @ change, rtol=0, atol=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_what_a_full_run_meets_a_target_run_meets_on_small_meshes_too(seed):
    """Where all is near the cells that miss it, patches may be as large as the mesh."""
    mesh = gmsnet.random_mesh((2, 5, 12, 20, 35, 60)[seed % 6], seed=seed)
    target = 0.97 * float(gmsnet.smooth(mesh).after.shape.min())
    result = gmsnet.smooth(mesh, target_quality=target)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= target


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [1.05, 1.2, 1.4])
def test_where_many_cannot_reach_it_no_more_miss_it_than_after_a_full_run(seed, share):
    mesh = gmsnet.random_mesh(1500, seed=seed) if seed % 2 else random_quad_mesh(1500, seed=seed, cells="mixed")
    full = gmsnet.smooth(mesh).after.shape
    target = share * float(full.min())
    result = gmsnet.smooth(mesh, target_quality=target)
    assert (result.after.shape < target).sum() <= (full < target).sum() < (result.before.shape < target).sum()


@pytest.mark.parametrize(
    ("mesh", "angle", "quality"),
    [
        (sheared_mesh(30, amplitude=0.3), None, 0.8659),
        (kershaw_mesh(12, flatness=0.05), 21.28, None),
    ],
)
def test_a_target_just_below_what_a_full_run_reaches_is_met_where_sweeps_from_patches_end_worse(mesh, angle, quality):
    result = gmsnet.smooth(mesh, target_angle=angle, target_quality=quality)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= (quality or 0.0)
    assert result.after.min_angle.min() >= (angle or 0.0)
    assert [each.index for each in result.history] == sorted({each.index for each in result.history})


@pytest.mark.parametrize(("seed", "share"), [(2, 1.2), (8, 1.4), (15, 1.4), (23, 1.4), (32, 1.4), (39, 1.2), (55, 1.2)])
def test_on_the_smallest_meshes_no_more_miss_it_than_after_a_full_run(seed, share):
    mesh = gmsnet.random_mesh((12, 20, 35, 60, 90)[seed % 5], seed=seed)
    full = gmsnet.smooth(mesh).after.shape
    target = share * float(full.min())
    result = gmsnet.smooth(mesh, target_quality=target)
    assert (result.after.shape < target).sum() <= (full < target).sum()


def test_a_cell_in_one_place_meets_no_angle():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.8], [3.0, 3.0], [3.0, 3.0], [3.0, 3.0]])
    mesh = (points, np.array([[0, 1, 2], [3, 4, 5]]))
    target = Target(angle=10.0)
    assert target.missed_in(gmsnet.quality(mesh)).tolist() == [1]
    assert gmsnet.smooth(mesh, target_angle=10.0).stop_reason != stop.TARGET_REACHED


def test_held_cells_that_miss_a_target_do_not_change_what_is_done_for_the_others(good):
    """Slivers that cannot move, far away, are no share of any patch."""
    bad = disturb(good, Topology.of(good).free[100:130], 0.6, seed=1)
    corners, count = Topology.of(bad).triangles, len(bad.points)
    slivers = np.array([[5.0, 0.0], [6.0, 0.0], [5.5, 1e-3]])
    points = np.vstack([bad.points[:, :2], *(slivers + np.array([0.0, k]) for k in range(60))])
    cells = np.vstack([corners, count + np.arange(180).reshape(60, 3)])
    alone, beside = (
        gmsnet.smooth(mesh, target_quality=0.45) for mesh in ((bad.points[:, :2], corners), (points, cells))
    )
    assert [sweep.stage for sweep in beside.history] == [sweep.stage for sweep in alone.history]
    below = [int((result.after.shape < 0.45).sum()) for result in (alone, beside)]
    assert below[1] == below[0] + 60
    only = gmsnet.smooth((points[count:], cells[len(corners) :] - count), target_quality=0.45)
    assert only.stop_reason == stop.NOTHING_TO_MOVE


def test_any_number_says_what_the_target_is():
    """In single precision the slack for rounding would be none."""
    assert Target(np.float32(0.5)).limits == Target(0.5).limits
    assert Target(angle=np.float32(20)).limits == Target(angle=20).limits
    assert Target(0.5).limits[0] > 0.5


def test_targets_on_cells_wound_both_ways_and_in_any_plane(good):
    bad = disturb(good, Topology.of(good).free[100:200], 0.6, seed=1)
    corners, flat = Topology.of(bad).triangles, bad.points[:, :2]
    expected = gmsnet.smooth((flat, corners), target_quality=0.5).points
    backwards = corners.copy()
    backwards[::2] = backwards[::2, ::-1]
    np.testing.assert_allclose(gmsnet.smooth((flat, backwards), target_quality=0.5).points, expected, atol=1e-12)
    for axis in range(3):
        points = np.insert(flat, axis, 2.0, axis=1)
        for threads in (1, 3):
            moved = gmsnet.smooth((points, corners), target_quality=0.5, threads=threads).points
            np.testing.assert_allclose(np.delete(moved, axis, axis=1), expected, atol=1e-9)


@pytest.mark.parametrize("target", [Target(0.4), Target(angle=25.0), Target(0.2, 30.0), Target(0.6, 10.0), Target(1.0)])
def test_cells_that_miss_a_target_are_found_among_those_whose_shape_allows_it(target):
    mesh = gmsnet.random_mesh(3000, seed=6)
    topology, points = Topology.and_points(mesh)
    shapes = np.empty(len(topology.near), dtype=np.float32)
    report = measure(mesh, topology, points, shapes=shapes)
    np.testing.assert_allclose(np.sort(shapes), np.sort(report.shape), rtol=1e-7)
    rows = rows_missing(points, topology, target)
    assert rows_missing(points, topology, target, shapes).tolist() == rows.tolist()
    assert len(rows) == np.count_nonzero(target.missed(report.shape, report.min_angle))


@given(st.floats(1e-3, 60.0), st.floats(0.05, 20.0))
def test_no_triangle_with_a_smaller_angle_has_a_larger_shape_than_a_target_allows(angle, ratio):
    alpha = math.radians(angle)
    report = gmsnet.quality(([[0, 0], [1, 0], [ratio * math.cos(alpha), ratio * math.sin(alpha)]], [[0, 1, 2]]))
    assert report.min_angle[0] <= angle * (1 + 1e-9)
    assert report.shape[0] <= Target(angle=angle).max_shape * (1 + 1e-12)


@pytest.mark.parametrize("look", [2, 5, 8])
def test_a_callback_that_stops_all_cells_stops_the_patches_after_them(look):
    """Many cells miss the target, so that after the first patches all cells are smoothed, then patches again."""
    mesh, looks = random_mesh(800, seed=1), []
    result = gmsnet.smooth(
        mesh, target_quality=0.97, callback=lambda sweep: bool(looks.append(sweep)) or len(looks) == look
    )
    assert len(looks) == look
    assert result.stop_reason == stop.CALLBACK


@pytest.mark.parametrize("angle", [50.0, 75.0, 89.0])
def test_quads_may_be_asked_for_more_than_the_angles_of_triangles(angle):
    even = structured_mesh(20)
    quads = disturb(even, Topology.of(even).free, 0.3, seed=0)
    before = gmsnet.quality(quads)
    result = gmsnet.smooth(quads, target_angle=angle)
    assert before.min_angle.min() < angle <= result.after.min_angle.min()
    assert result.stop_reason == stop.TARGET_REACHED


def test_triangles_have_no_such_angle():
    mesh = random_mesh(100, seed=0)
    with pytest.raises(gmsnet.InputError, match="no triangle has a minimum angle of more than 60°"):
        gmsnet.smooth(mesh, target_angle=75.0)


def test_cells_are_counted_and_not_their_corners():
    """All four quads miss it wherever the node in the middle is, with more corners where the worst one is better."""
    points = np.array([
        (0.06, -0.3), (-0.28, 1.24), (1.09, 0.14), (0.66, 1.12), (-0.88, 0.0), (-0.87, 0.93), (-0.29, -0.84),
        (-0.86, -0.62), (0.84, -0.74),
    ])  # fmt: skip
    quads = np.array([(0, 2, 3, 1), (0, 1, 5, 4), (0, 4, 7, 6), (0, 6, 8, 2)])
    result = gmsnet.smooth((points, {"quad": quads}), target_quality=0.9855)
    assert (result.before.shape < 0.9855).all()
    assert (result.after.shape < 0.9855).all()
    assert result.after.shape.min() > 0.8 > 0.5 > result.before.shape.min()


def test_what_misses_a_target_is_counted_by_cells():
    corners = np.zeros((5, 3), dtype=np.int32)
    assert Missing.of(corners).cells == 5
    assert Missing.of(corners, np.array([0, 0, 2, 2, 5])).cells == 3
    assert Missing.of(corners[:0], np.array([], dtype=np.int32)).cells == 0
