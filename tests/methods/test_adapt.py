"""Towards a metric: cells become those of the metric, none is inverted, and the least quality in it never falls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from support.hell import hellish

import gmsnet
from gmsnet.generate import Front, disturb, good_mesh, hybrid_mesh, random_mesh, random_quad_mesh, structured_mesh
from gmsnet.generate.curves import Curve
from gmsnet.methods import adapt
from gmsnet.methods.metric_sum import Problem
from gmsnet.run.stop import NO_PROGRESS
from gmsnet.topology.topology import Topology

FRONT = Front(0.05, 10.0, bend=0.05)
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SIDES = [Curve(CORNERS[[k, (k + 1) % 4]], f"side {k}") for k in range(4)]


def length(points):
    """Ten times as long at the right as at the left."""
    return 0.02 * 10.0 ** points[:, 0]


@pytest.fixture(scope="module")
def adapted():
    return FRONT.mesh()


@pytest.fixture(scope="module")
def thrown(adapted):
    return disturb(adapted, Topology.of(adapted).free, 0.35, seed=2, edge="shortest")


@pytest.fixture(scope="module")
def graded():
    return good_mesh([SIDES], length)


def conforms(result, share, least):
    before, after = result.conformity
    assert not result.after.inverted
    assert after.least >= max(before.least, least)
    assert after.near_one >= max(before.near_one, share)
    assert after.mean > before.mean


def test_a_metric_that_is_given_is_had_again(thrown):
    by_place = gmsnet.smooth(thrown, metric=FRONT.metric)
    conforms(by_place, 0.97, 0.7)
    assert by_place.stop_reason == NO_PROGRESS
    at_nodes = gmsnet.smooth(thrown, metric=FRONT.metric(thrown.points))
    conforms(at_nodes, 0.95, 0.7)


def test_a_metric_that_is_recovered_keeps_the_stretch_and_not_the_slivers(thrown):
    result = gmsnet.smooth(thrown, preserve="metric")
    conforms(result, 0.93, 0.7)
    true = gmsnet.smooth(result.mesh, metric=FRONT.metric, max_sweeps=0).conformity.before
    given = gmsnet.smooth(thrown, metric=FRONT.metric, max_sweeps=0).conformity.before
    assert true.near_mean > given.near_mean + 0.2
    assert true.least > given.least + 0.3
    assert (
        gmsnet.smooth(thrown, preserve="none").after.shape.min() > result.after.shape.min() + 0.1
    )  # no stretch is left


@pytest.mark.parametrize("jitter", [0.0, 0.4])
def test_sizes_that_vary_ten_times_are_had_where_the_cells_are_as_many(graded, jitter):
    mesh = disturb(graded, Topology.of(graded).free, jitter, seed=1) if jitter else graded
    conforms(gmsnet.smooth(mesh, size=length), 0.97, 0.8)
    conforms(gmsnet.smooth(mesh, size=length(mesh.points)), 0.97, 0.8)


def test_sizes_are_had_from_a_tangle(graded):
    rng = np.random.default_rng(0)
    free, points = Topology.of(graded).free, graded.points.copy()
    points[free] = rng.random((len(free), 2))
    result = gmsnet.smooth(graded.with_points(points), size=length)
    assert result.before.inverted > 100
    assert not result.after.inverted
    assert result.conformity.after.near_one > 0.95


@pytest.mark.parametrize(
    "make",
    [
        lambda: random_mesh(300, seed=1),
        lambda: random_quad_mesh(200, seed=1),
        lambda: disturb(h := hybrid_mesh(200, seed=1), Topology.of(h).free, 0.3),
        lambda: disturb(g := structured_mesh(12, 12), Topology.of(g).free, 0.3, seed=4),
    ],
)
@pytest.mark.parametrize("options", [{"preserve": "metric"}, {"size": length}, {"metric": FRONT.metric}])
def test_the_least_quality_in_the_metric_never_falls(make, options):
    result = gmsnet.smooth(make(), **options)
    before, after = result.conformity
    assert not result.after.inverted
    assert after.least >= before.least
    least = [before.least, *(sweep.min_shape for sweep in result.history)]
    assert (np.diff(least) >= 0).all()
    assert after.mean > before.mean or not result.moved.any()
    assert result.moved.any()


def test_at_the_level_valid_the_result_is_not_worse_either():
    mesh = random_mesh(300, seed=3)
    result = gmsnet.smooth(mesh, size=length, guard="valid")
    assert not result.after.inverted
    assert result.conformity.after.least >= result.conformity.before.least


def test_cells_that_no_node_can_help_do_not_keep_the_others_from_moving():
    mesh = disturb(m := structured_mesh(12, 12), Topology.of(m).free, 0.3, seed=1)
    held = np.unique(mesh.cells[0].nodes[:40])
    result = gmsnet.smooth(mesh, size=np.full(len(mesh.points), 1 / 12), fixed=held)
    assert result.conformity.after.mean > result.conformity.before.mean + 0.05
    assert not result.moved[held].any()


def test_neither_the_number_of_threads_nor_the_unit_of_length_matters(thrown):
    one, two = (gmsnet.smooth(thrown, preserve="metric", threads=threads).points for threads in (1, 2))
    assert one.tobytes() == two.tobytes()
    large = thrown.with_points(thrown.points * 2.0**30)
    scaled = gmsnet.smooth(large, metric=lambda p: FRONT.metric(p * 2.0**-30) * 4.0**-30)
    plain = gmsnet.smooth(thrown, metric=FRONT.metric)
    np.testing.assert_allclose(scaled.points * 2.0**-30, plain.points, atol=1e-6)
    assert scaled.conformity.after.near_one == pytest.approx(plain.conformity.after.near_one, abs=1e-3)


def test_one_call_ends_where_more_calls_end(thrown):
    once = gmsnet.smooth(thrown, metric=FRONT.metric)
    again = gmsnet.smooth(once.mesh, metric=FRONT.metric)
    assert again.conformity.after.mean < once.conformity.after.mean + 1e-3
    assert again.conformity.after.least < once.conformity.after.least + 0.02


def test_single_precision_is_kept():
    mesh = random_mesh(200, seed=1)
    points = np.float64(np.float32(mesh.points))
    result = gmsnet.smooth(gmsnet.Mesh(points, mesh.cells, single=True), size=length)
    assert result.moved.any()
    assert (np.float32(result.points) == result.points).all()
    assert not result.after.inverted


def test_a_mesh_in_another_plane_has_the_metric_of_its_plane(thrown):
    points = np.zeros((len(thrown.points), 3))
    points[:, [0, 2]] = thrown.points
    upright = gmsnet.smooth(gmsnet.Mesh(points, thrown.cells), metric=FRONT.metric)
    plain = gmsnet.smooth(thrown, metric=FRONT.metric)
    assert upright.points[:, [0, 2]].tobytes() == plain.points.tobytes()


@pytest.mark.parametrize("options", [{"preserve": "metric"}, {"size": lambda p: np.full(len(p), 0.1)}])
@pytest.mark.parametrize("level", ["valid", "worst"])
@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(3, 40))
@settings(max_examples=6, deadline=None)
def test_nothing_is_lost_on_meshes_from_hell(options, level, seed, nodes):
    mesh = hellish(seed, nodes)
    result = gmsnet.smooth(mesh, **options, guard=level, untangle=bool(seed % 3))
    assert np.isfinite(result.points).all()
    assert not any(result.moved[ids].any() for ids in result.held.values())
    topology = result.topology
    was, now = (
        naive.signs(points[:, topology.plane], topology.triangles.tolist(), topology.orientation)
        for points in (mesh.points, result.points)
    )
    assert not ((np.array(was) > 0) & (np.array(now) <= 0)).any()
    if result.conformity is not None and not result.before.inverted:
        assert result.conformity.after.least >= result.conformity.before.least
    if mesh.single:
        assert (np.float64(np.float32(result.points)) == result.points).all()


def test_boundary_nodes_slide_towards_sizes():
    """Corners stay, sides keep their bits, and cells come nearer to their sizes than with the boundary held."""
    mesh = structured_mesh(24)
    held, slid = (gmsnet.smooth(mesh, size=length, slide=slide) for slide in (None, True))
    assert not slid.after.inverted
    assert slid.conformity[1].least > held.conformity[1].least + 0.05
    assert slid.conformity[1].mean > held.conformity[1].mean + 0.05
    for axis in range(2):
        for side in (0.0, 1.0):
            on = mesh.points[:, axis] == side
            assert (slid.points[on, axis] == side).all()
            order = np.argsort(mesh.points[on, 1 - axis])
            assert (np.diff(slid.points[on, 1 - axis][order]) > 0.0).all()


@pytest.mark.parametrize("seed", [1, 4, 7])  # they end at 0.33, 0.48 or more, and 0.41, by the processor's sines
def test_they_slide_on_arcs_too(seed):
    mesh = random_mesh(600, "circle", seed=seed)
    middle = mesh.points.mean(axis=0)
    boundary = np.setdiff1d(np.arange(len(mesh.points)), Topology.of(mesh).free)
    slid = gmsnet.smooth(mesh, preserve="metric", slide=True)
    radius, before = (np.hypot(*(points[boundary] - middle).T) for points in (slid.points, mesh.points))
    assert slid.moved[boundary].any()
    assert radius.max() / before.max() - 1.0 < 1e-6
    assert 1.0 - radius.min() / before.min() < 1e-6
    conforms(slid, 0.0, 0.3)


@pytest.fixture
def swept(monkeypatch):
    """Single nodes move first in small meshes, too. How often they were asked."""
    calls, whole = [], Problem.swept

    def counted(problem, points):
        assert problem.sliders is None
        calls.append(len(problem.moved))
        return whole(problem, points)

    monkeypatch.setattr(adapt, "LARGE", 0)
    monkeypatch.setattr(Problem, "swept", counted)
    return calls


MIXED = hybrid_mesh(400, seed=1)
SWEPT = [
    (random_mesh(900, seed=1), {"preserve": "metric"}),
    (random_mesh(900, seed=2), {"size": lambda points: np.full(len(points), 0.04)}),
    (disturb(MIXED, Topology.of(MIXED).free, 0.4, seed=1), {"preserve": "metric"}),
]


@pytest.mark.parametrize(("mesh", "options"), SWEPT)
def test_single_nodes_move_first_where_the_mesh_is_near_to_its_metric(mesh, options, swept, monkeypatch):
    first = gmsnet.smooth(mesh, **options)
    assert len(swept) > 2
    least = [first.conformity.before.least, *(sweep.min_shape for sweep in first.history)]
    assert (np.diff(least) >= 0).all()
    monkeypatch.setattr(adapt, "LARGE", len(mesh.points))
    swept.clear()
    plain = gmsnet.smooth(mesh, **options)
    assert not swept
    (_, one), (_, other) = first.conformity, plain.conformity
    assert one.mean > other.mean - 1e-3
    assert one.mean + one.least > other.mean + other.least - 1e-3
    assert not first.after.inverted


def test_they_do_not_where_nodes_have_far_to_go_or_slide(swept, thrown):
    gmsnet.smooth(random_mesh(300, seed=1), size=length)  # ten times as long at the right
    gmsnet.smooth(thrown, metric=FRONT.metric)  # near already
    gmsnet.smooth(random_mesh(300, seed=1), preserve="metric", slide=True)
    assert not swept


@pytest.mark.parametrize("slide", [None, True])
def test_a_gradient_that_points_nowhere_is_no_end(slide):
    """Across a sliver of this mesh the metric that is recovered changes as fast as its quality does."""
    result = gmsnet.smooth(random_mesh(686, "circle", seed=44631), preserve="metric", slide=slide)
    assert result.conformity.before.least < 1e-3
    conforms(result, 0.5, 0.3)
    assert result.conformity.after.mean > 0.8


@pytest.mark.parametrize(("nodes", "seed"), [(2050, 51878), (4149, 82555), (4471, 47318)])
def test_slivers_that_untangling_leaves_are_no_end(nodes, seed):
    """All other cells have to give way to them at first, or the metric changes as fast as their quality does."""
    mesh = random_mesh(nodes, seed=seed + 6)
    tangled = disturb(mesh, Topology.of(mesh).free, 1.0, seed=seed, keep_valid=False)
    result = gmsnet.smooth(tangled, preserve="metric")
    assert result.before.inverted
    conforms(result, 0.4, 0.2)
    assert result.conformity.after.mean > 0.8
