"""deform(): no cell inverted, places exact, all else as it was, and an honest report where it cannot be done."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import gmsnet
from gmsnet import InputError, Mesh
from gmsnet.generate import (
    block_volume,
    layered_mesh,
    layered_volume,
    moved_hole_mesh,
    random_mesh,
    random_volume,
    second_order,
    second_order_volume,
    sphere_surface,
    structured_mesh,
)
from gmsnet.run import stop
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.topology import Topology

HOLE = np.array([0.5, 0.5])


@pytest.fixture(scope="module")
def plate():
    return moved_hole_mesh(0.06, shift=0.0)


def held_nodes(mesh):
    held = np.zeros(len(mesh.points), dtype=bool)
    topology = Topology.of(mesh) if mesh.plane else volume_of(wound_of(mesh, held))
    for ids in topology.held.values():
        held[ids] = True
    return held


def check(mesh, result, ids, places):
    """What holds of every result."""
    assert result.after.inverted <= result.before.inverted
    assert 0.0 <= result.fraction <= 1.0
    still = held_nodes(mesh)
    still[ids] = False
    assert (result.points[still] == mesh.points[still]).all()
    if result.fraction == 1.0:
        assert (result.points[ids, : places.shape[1]] == places).all()
        assert result.reason == ""
    else:
        assert result.reason
    assert (result.moved == (result.points != mesh.points).any(axis=1)).all()
    assert all((one.nodes == other.nodes).all() for one, other in zip(mesh.cells, result.mesh.cells, strict=True))


def small(cells, seed):
    """A mesh of some tens of nodes in the unit square or cube."""
    if cells == "triangle":
        return random_mesh(40, seed=seed)
    if cells == "quad":
        return structured_mesh(6, 4)
    return random_volume(60, seed=seed) if cells == "tetra" else block_volume(4, cells)


KINDS = ["triangle", "quad", "tetra", "hexahedron", "wedge", "mixed"]


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 5), st.sampled_from(KINDS), st.floats(0.0, 0.4), st.floats(-1.0, 1.0),
    st.sampled_from(["top", "every"]), st.booleans(),
)  # fmt: skip
def test_whatever_is_asked_for_no_cell_is_inverted(seed, cells, noise, shift, which, single):
    mesh = small(cells, seed)
    if single:
        mesh = Mesh(mesh.points.astype(np.float32), mesh.cells, mesh.region_names, single=True)
    ids = np.flatnonzero(held_nodes(mesh)) if which == "every" else mesh.markers["top"]
    rng, dimension = np.random.default_rng(seed), 2 if mesh.plane else 3
    places = mesh.points[ids, :dimension] + shift + noise * rng.normal(size=(len(ids), dimension))
    if single:
        places = places.astype(np.float32).astype(float)
    result = gmsnet.deform(mesh, places=places, nodes=ids, threads=1)
    assert result.before.inverted == 0
    check(mesh, result, ids, places)


def test_a_hole_is_moved_and_the_mesh_smoothed(plate):
    ids = plate.markers["hole"]
    result = gmsnet.deform(plate, (0.2, 0.1), "hole")
    check(plate, result, ids, plate.points[ids, :2] + [0.2, 0.1])
    assert (result.fraction, result.steps) == (1.0, 1)
    assert result.after.shape.min() > 0.3
    assert result.sweeps > 0
    assert "the boundary is in place (in 1 step)" in repr(result)
    assert result.history[0].stage == "moving, 1 of the way"


def test_a_small_motion_only_carries_nodes_along(plate):
    result = gmsnet.deform(plate, (0.004, 0.0), "hole")
    assert (result.fraction, result.sweeps, result.stop_reason) == (1.0, 0, stop.IN_PLACE)


def test_a_hole_that_would_leave_the_plate_stops_before_it(plate):
    ids = plate.markers["hole"]
    result = gmsnet.deform(plate, (0.5, 0.0), "hole")
    check(plate, result, ids, None)
    assert 0.6 < result.fraction < 0.7  # it touches the side at 0.7
    assert result.stop_reason == stop.NOT_IN_PLACE
    assert "boundaries would cross each other at 1 0." in result.reason
    assert result.points[ids, :2] == pytest.approx(plate.points[ids, :2] + [0.5 * result.fraction, 0.0])


@pytest.mark.parametrize("degrees", [60.0, 180.0])
def test_a_hole_that_turns(plate, degrees):
    ids = plate.markers["hole"]
    result = gmsnet.deform(plate, rotate=("hole", degrees, tuple(HOLE)))
    assert result.fraction == 1.0
    assert result.after.inverted == 0
    z = (plate.points[ids, :2] - HOLE) @ [1.0, 1.0j] * np.exp(1j * np.radians(degrees))
    assert result.points[ids, :2] - HOLE == pytest.approx(np.column_stack([z.real, z.imag]))


def test_nodes_inside_can_be_placed_too(plate):
    node = int(np.flatnonzero(~held_nodes(plate))[0])
    place = plate.points[[node], :2] + 0.01
    result = gmsnet.deform(plate, places=place, nodes=[node])
    check(plate, result, [node], place)
    assert result.fraction == 1.0


@pytest.mark.parametrize("cells", ["triangle", "mixed"])
def test_layers_are_carried_with_their_wall(cells):
    mesh = layered_mesh(10, 200.0, 60, cells=cells)
    ids = mesh.markers["airfoil"]
    result = gmsnet.deform(mesh, (0.0, 0.5), "airfoil", rotate=("airfoil", -20, (0.25, 0.0)))
    check(mesh, result, ids, result.points[ids, :2])
    assert result.fraction == 1.0
    rows = [points[: 11 * 60, :2].reshape(11, 60, 2) for points in (mesh.points, result.points)]
    before, after = (np.linalg.norm(np.diff(each, axis=0), axis=-1) for each in rows)
    assert np.abs(after / before - 1.0).max() < 0.01


def test_cells_outside_of_layers_are_smoothed_where_they_are_worse_than_any_there_were():
    """Those of the layers, which are worse by far, are meant."""
    mesh = layered_mesh(10, 200.0, 60, cells="quad")
    result = gmsnet.deform(mesh, rotate=("airfoil", -30, (0.25, 0.0)))
    before, after = result.judged
    assert result.before.shape.min() < 0.1 * before.shape_min
    assert sum(sweep.moved for sweep in result.history[1:]) > 100
    assert after.shape_min > 0.9


def test_the_same_bits_for_any_number_of_threads(plate):
    one, two = (gmsnet.deform(plate, (0.15, -0.1), "hole", threads=threads).points for threads in (1, 2))
    assert (one == two).all()


def test_inverted_cells_of_the_input_are_mended_first():
    mesh = structured_mesh(10, 10)
    points = mesh.points.copy()
    points[[60, 61]] = points[[61, 60]]
    mesh = mesh.with_points(points)
    assert gmsnet.quality(mesh).inverted > 0
    result = gmsnet.deform(mesh, (0.0, 0.2), "top")
    assert (result.fraction, result.after.inverted) == (1.0, 0)


def test_a_callback_stops_the_motion_and_the_sweeps(plate):
    result = gmsnet.deform(plate, (0.2, 0.0), "hole", callback=lambda sweep: True)
    assert (result.fraction, result.sweeps, result.stop_reason) == (1.0, 0, stop.CALLBACK)
    result = gmsnet.deform(plate, (0.2, 0.0), "hole", callback=lambda sweep: sweep.index > 0)
    assert result.fraction == 1.0
    assert result.stop_reason == stop.CALLBACK


def test_an_interruption_brings_the_last_valid_mesh(plate):
    def interrupt(sweep):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.deform(plate, (0.2, 0.0), "hole", callback=interrupt)
    result = caught.value.result
    assert (result.fraction, result.stop_reason, result.after.inverted) == (1.0, stop.INTERRUPTED, 0)
    ids = plate.markers["hole"]
    assert (result.points[ids, :2] == plate.points[ids, :2] + [0.2, 0.0]).all()


def test_stopped_half_way_the_report_says_so(plate):
    def interrupt(sweep):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.deform(plate, (0.5, 0.0), "hole", callback=interrupt)
    stopped = gmsnet.deform(plate, (0.5, 0.0), "hole", callback=lambda sweep: True)
    for result, reason in ((caught.value.result, stop.INTERRUPTED), (stopped, stop.CALLBACK)):
        assert (result.fraction, result.reason, result.stop_reason) == (0.5, reason, reason)
        assert result.after.inverted == 0
        assert f"the boundary has come 50 % of its way (in 1 step): {reason}" in repr(result)


def test_a_mesh_without_free_nodes():
    mesh = structured_mesh(1, 1)
    result = gmsnet.deform(mesh, (0.25, 1.0), "top")
    assert result.fraction == 1.0
    assert (result.points[mesh.markers["top"], :2] == mesh.points[mesh.markers["top"], :2] + [0.25, 1.0]).all()
    folded = gmsnet.deform(mesh, (0.0, -2.0), "top")
    assert 0.4 < folded.fraction < 0.5
    assert "would be inverted" in folded.reason


def test_nodes_in_one_place_are_parted():
    mesh = structured_mesh(4, 4)
    points = mesh.points.copy()
    points[[6, 7]] = points[12]
    result = gmsnet.deform(mesh.with_points(points), (0.1, 0.2), "top")
    assert (result.fraction, result.after.inverted) == (1.0, 0)


def test_boundaries_that_are_not_moved_slide_if_they_may(plate):
    result = gmsnet.deform(plate, (0.2, 0.0), "hole", slide="right")
    right = plate.markers["right"]
    assert (result.points[right, 0] == 1.0).all()
    assert result.moved[right].any()
    held = gmsnet.deform(plate, (0.2, 0.0), "hole")
    assert not held.moved[right].any()


def test_sizes_are_kept_with_preserve_size(plate):
    def areas(points):
        a, b, c = (points[plate.cells[0].nodes[:, k], :2] for k in range(3))
        return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]

    def spread(result):
        return np.std(np.log(areas(result.points) / areas(plate.points)))

    free, sized = (gmsnet.deform(plate, (0.2, 0.0), "hole", preserve=preserve) for preserve in ("shape", "size"))
    assert spread(sized) < spread(free)


def test_what_comes_in_goes_out():
    mesh = random_mesh(40, seed=2)
    pair = (mesh.points, mesh.cells[0].nodes)
    result = gmsnet.deform(pair, (0.1, 0.0), mesh.markers["top"])
    assert type(result.mesh) is tuple
    assert (result.mesh[0][:, :2] == result.points[:, :2]).all()


def test_a_plane_of_constant_y():
    mesh = structured_mesh(5, 5)
    upright = np.column_stack([mesh.points[:, 0], np.full(len(mesh.points), 3.0), mesh.points[:, 1]])
    result = gmsnet.deform(Mesh(upright, mesh.cells, mesh.region_names), (0.1, 0.0, 0.3), "top")
    flat = gmsnet.deform(mesh, (0.1, 0.3), "top")
    assert (result.points[:, 1] == 3.0).all()
    assert (result.points[:, [0, 2]] == flat.points[:, :2]).all()


@pytest.mark.parametrize("size", [1.0, 1e-30])
@pytest.mark.parametrize("far", [1e250, 1e300])
def test_far_away_of_a_volume_is_told_and_nothing_breaks(size, far):
    mesh = random_volume(60, seed=1, size=size)
    for ids in ("top", np.flatnonzero(held_nodes(mesh))):
        result = gmsnet.deform(mesh, (0.0, 0.0, far), ids)
        assert result.after.inverted == 0
        assert result.fraction < 0.01
        assert result.reason


def test_far_away_is_told_and_nothing_breaks(plate):
    result = gmsnet.deform(plate, (1e250, 0.0), "hole")
    assert result.fraction < 0.01
    assert result.after.inverted == 0
    assert result.reason


def test_what_cannot_be_used_is_refused(plate):
    with pytest.raises(InputError, match=r"fixed names the node \d+, which is to be moved"):
        gmsnet.deform(plate, (0.1, 0.0), "hole", fixed="hole")
    with pytest.raises(InputError, match="second-order cells"):
        gmsnet.deform(second_order(structured_mesh(3, 3)), (0.1, 0.0), "top")
    with pytest.raises(InputError, match=r"second-order cells \(tetra10\)"):
        gmsnet.deform(second_order_volume(random_volume(30, seed=1)), (0.1, 0.0, 0.0), "top")
    with pytest.raises(InputError, match="boundaries of surfaces in space cannot be moved"):
        gmsnet.deform(sphere_surface(100).mesh, (0.1, 0.0, 0.0), [0])
    with pytest.raises(InputError, match="max_sweeps"):
        gmsnet.deform(plate, (0.1, 0.0), "hole", max_sweeps=-1)


@pytest.mark.parametrize("degrees", [30.0, 90.0, 179.0, 200.0])
@pytest.mark.parametrize("cells", ["tetra", "mixed"])
def test_a_volume_whose_boundary_moves_as_one_body_moves_so(cells, degrees):
    mesh = small(cells, 3)
    axis, centre = (1.0, 2.0, 2.0), (0.3, 0.2, 0.1)
    ids = np.flatnonzero(held_nodes(mesh))
    result = gmsnet.deform(mesh, (1.0, 2.0, 3.0), ids, rotate=(ids, degrees, centre, axis), max_sweeps=0)
    assert (result.fraction, result.steps) == (1.0, 1)
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array(axis) / 3.0)
    wanted = turn.apply(mesh.points - centre) + np.array(centre) + [1.0, 2.0, 3.0]
    assert np.abs(result.points - wanted).max() < 1e-6


def test_a_side_of_a_volume_is_pushed_in():
    mesh = random_volume(600, seed=2)
    ids = mesh.markers["top"]
    x, y, _ = mesh.points[ids].T
    shifts = np.column_stack([0.0 * x, 0.0 * x, -0.3 * np.sin(np.pi * x) ** 2 * np.sin(np.pi * y) ** 2])
    result = gmsnet.deform(mesh, shifts, ids)
    check(mesh, result, ids, mesh.points[ids] + shifts)
    assert result.fraction == 1.0
    assert result.after.shape.min() > 0.9 * result.before.shape.min()
    assert (result.points == gmsnet.deform(mesh, shifts, ids, threads=2).points).all()


def test_cells_between_held_nodes_alone_end_the_way():
    mesh = block_volume(5)
    result = gmsnet.deform(mesh, (0.0, 0.0, -0.5), "top")
    check(mesh, result, mesh.markers["top"], None)
    assert 0.3 < result.fraction <= 0.4  # the cells beside the sides are as high as a fifth of the cube
    assert "a corner of it is held with the nodes beside it, at 0" in result.reason


@pytest.mark.parametrize("cells", ["tetra", "wedge"])
def test_a_wall_of_a_volume_takes_its_layers_along(cells):
    rows, side = 8, 9
    mesh = layered_volume(side - 1, rows, kind=cells)
    ids = mesh.markers["bottom"]
    x, y, _ = mesh.points[ids].T
    shifts = np.column_stack([0.0 * x, 0.0 * x, 0.2 * np.sin(np.pi * x) ** 2 * np.sin(np.pi * y) ** 2])
    result = gmsnet.deform(mesh, shifts, ids)
    check(mesh, result, ids, mesh.points[ids] + shifts)
    assert result.fraction == 1.0
    before, after = (
        np.linalg.norm(np.diff(points[: 4 * side**2].reshape(4, side, side, 3), axis=0), axis=-1)
        for points in (mesh.points, result.points)
    )
    assert np.abs(after / before - 1.0)[:, 1:-1, 1:-1].max() < 0.02


@pytest.mark.parametrize("way", [-0.4, 0.5])
@pytest.mark.parametrize("cells", ["triangle", "quad", "tetra", "hexahedron", "mixed"])
def test_sides_that_slide_follow_a_piston(cells, way):
    mesh = small(cells, 2)
    dimension = 2 if mesh.plane else 3
    ids, up = mesh.markers["top"], np.eye(dimension)[-1]
    result = gmsnet.deform(mesh, way * up, "top", slide=True)
    assert (result.fraction, result.steps, result.after.inverted) == (1.0, 1, 0)
    assert (result.points[ids, :dimension] == mesh.points[ids, :dimension] + way * up).all()
    for axis in range(dimension - 1):
        for side in (0.0, 1.0):
            there = mesh.points[:, axis] == side
            assert (result.points[there, axis] == side).all()
    assert (result.points[mesh.points[:, dimension - 1] == 0.0, dimension - 1] == 0.0).all()
    slid = held_nodes(mesh) & result.moved & ~np.isin(np.arange(len(mesh.points)), ids)
    shift = (result.points - mesh.points)[slid, dimension - 1]
    assert np.sign(shift.mean()) == np.sign(way)
    assert (result.points == gmsnet.deform(mesh, way * up, "top", slide=True, threads=2).points).all()


def test_a_wing_on_a_symmetry_plane_moves_with_its_root():
    mesh = random_volume(800, seed=4)
    x, y, _ = mesh.points.T
    ids = mesh.markers["bottom"][(np.hypot(x - 0.5, y - 0.5) < 0.2)[mesh.markers["bottom"]]]
    with_slide, without = (gmsnet.deform(mesh, (0.2, 0.0, 0.0), ids, slide=slide) for slide in ("bottom", None))
    assert (with_slide.fraction, with_slide.after.inverted) == (1.0, 0)
    assert (with_slide.points[mesh.markers["bottom"], 2] == 0.0).all()
    assert without.fraction < 1.0
    others = np.setdiff1d(np.arange(len(x)), mesh.markers["bottom"])
    assert not with_slide.moved[np.intersect1d(others, np.flatnonzero(held_nodes(mesh)))].any()


def test_a_metric_is_not_carried_along(plate):
    with pytest.raises(InputError, match="preserve must be 'shape', 'size' or 'none'"):
        gmsnet.deform(plate, (0.2, 0.0), "hole", preserve="metric")


def test_reasons_count_the_nodes_that_stay(plate):
    result = gmsnet.deform(plate, (0.2, 0.0), "hole")
    still = np.zeros(len(result.points), dtype=bool)
    for ids in result.held.values():
        still[ids] = True
    told = result._account(plate).reasons()
    assert told == f"boundary: {np.count_nonzero(still & ~result.moved):,}"
    assert np.count_nonzero(still & result.moved) == len(plate.markers["hole"])
