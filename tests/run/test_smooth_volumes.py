"""smooth() of meshes of tetrahedra: options, records, what is refused, what is said."""

from __future__ import annotations

import numpy as np
import pytest
from support import volumes
from support.blocks import block
from support.same import same

import gmsnet
from gmsnet.errors import InputError
from gmsnet.run import set_up, stop
from gmsnet.topology.volume import Volume


@pytest.fixture(scope="module")
def cube():
    return volumes.mesh_of(*volumes.cube(400, 11))


@pytest.fixture(scope="module")
def free(cube):
    return Volume.of(cube).free


def test_the_default_makes_the_worst_and_the_mean_cell_better(cube, free):
    result = gmsnet.smooth(cube)
    assert result.stop_reason == stop.NO_PROGRESS
    assert result.after.inverted == result.before.inverted == 0
    assert result.after.shape.min() > result.before.shape.min() + 0.2
    assert result.after.shape.mean() > result.before.shape.mean() + 0.02
    assert result.after.min_dihedral.min() > result.before.min_dihedral.min() + 3
    assert result.moved[free].all()
    assert result.moved.sum() == len(free)
    assert {reason: len(ids) for reason, ids in result.held.items()} == {"boundary": len(cube.points) - len(free)}
    assert result.after.volume.sum() == pytest.approx(1, abs=1e-9)


def test_the_record(cube):
    result = gmsnet.smooth(cube, max_sweeps=30)
    last = result.history[-1]
    assert last.index == result.sweeps <= 30
    cells = np.isin(cube.cells[0].nodes, Volume.of(cube).free).any(axis=1)
    assert last.min_shape == pytest.approx(result.after.shape[cells].min())
    least = [sweep.min_shape for sweep in result.history]
    assert max(least) == least[-2]  # the next stage gives some of it for angles
    assert [sweep.stage for sweep in result.history[-2:]] == ["mean, worst kept", "dihedral angles"]
    assert np.isnan(last.qhat)
    assert {sweep.stage for sweep in result.history} != {""}
    assert "η, least" in repr(result)


@pytest.mark.parametrize("sweeps", [0, 1, 2, 5])
def test_max_sweeps(cube, sweeps):
    result = gmsnet.smooth(cube, "barrier", max_sweeps=sweeps)
    assert (result.sweeps, result.stop_reason) == (sweeps, stop.MAX_SWEEPS)
    assert result.moved.any() == (sweeps > 0)


def test_a_callback_can_stop(cube):
    seen = []
    result = gmsnet.smooth(cube, "barrier", callback=lambda sweep: seen.append(sweep) or len(seen) == 3)
    assert (result.sweeps, result.stop_reason) == (3, stop.CALLBACK)
    assert result.history == seen


@pytest.mark.parametrize("method", ["auto", "barrier", "laplacian", "worst-first"])
def test_an_interruption_brings_the_best_mesh_so_far(cube, method):
    def interrupt(sweep):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(cube, method, callback=interrupt)
    result = caught.value.result
    assert result.stop_reason == stop.INTERRUPTED
    assert len(result.history) == 1
    assert result.after.inverted == 0
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.points.tobytes() == gmsnet.smooth(cube, method, max_sweeps=result.sweeps).points.tobytes()


def test_nodes_to_hold(cube, free):
    for fixed in (free[:7], np.isin(np.arange(len(cube.points)), free[:7])):
        result = gmsnet.smooth(cube, fixed=fixed)
        assert not result.moved[free[:7]].any()
        assert result.moved[free[7:]].all()
        assert result.held["fixed by the user"].tolist() == free[:7].tolist()
    everything = gmsnet.smooth(cube, fixed=np.ones(len(cube.points), dtype=bool))
    assert (everything.stop_reason, everything.moved.any()) == (stop.NOTHING_TO_MOVE, False)


def test_nodes_that_were_held_anyway_are_told(cube):
    held = Volume.of(cube).held["boundary"][:3]
    assert gmsnet.smooth(cube, fixed=held, max_sweeps=1).notes == [
        "fixed: 3 nodes are named, and held for other reasons anyway"
    ]


def test_a_named_marker_can_be_held(cube, free):
    marked = gmsnet.Mesh(cube.points, cube.cells, node_sets={"keep": free[:4]})
    assert gmsnet.smooth(marked, fixed="keep", max_sweeps=1).held["fixed by the user"].tolist() == free[:4].tolist()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target_angle": 10}, "target_angle is of the angles of triangles and quads, .*: give target_dihedral"),
        ({"preserve": "size"}, "preserve='size' is of meshes in a plane, .*: leave it out, or give 'shape' or 'none'"),
        ({"preserve": "metric"}, "preserve='metric' is of meshes in a plane, .*: leave it out, or give 'shape'"),
        ({"size": 1.0}, "cannot be smoothed towards a metric yet: leave out metric and size"),
        (
            {"method": "sized"},
            r"sized moves cells in a plane alone, and this mesh has [\d,]+ tetrahedra: choose auto, ",
        ),
        ({"method": "getme"}, "the variant sequential of getme moves .*: choose one of its variants simultaneous, or"),
        ({"method": "optimize", "objective": "cosine"}, "choose one of its objectives metric, q, q2, or another"),
        ({"method": "gmsnet"}, "gmsnet moves triangles alone"),
        ({"method": "laplacian", "variant": "area"}, "choose one of its variants smart, plain, or another method"),
        ({"fixed": [100_000]}, "the mesh has the nodes 0 to"),
    ],
)
def test_what_cannot_be_asked_is_refused(cube, options, message):
    with pytest.raises(InputError, match=message):
        gmsnet.smooth(cube, **options)


@pytest.mark.parametrize(("kind", "nodes"), [("pyramid13", 13), ("pyramid14", 14), ("polyhedron", 9)])
def test_volumes_of_other_kinds_alone_stay_and_are_told(cube, kind, nodes):
    mesh = gmsnet.Mesh(cube.points, (volumes.block(kind, [np.arange(nodes) * 29]),))
    for options in ({}, {"slide": True}, {"method": "getme"}, {"fixed": [0]}):
        result = gmsnet.smooth(mesh, **options)
        assert result.stop_reason == stop.NOTHING_TO_MOVE
        assert not result.moved.any()
        assert f"not measured, and their nodes are held: 1 {kind} cell" in result.notes
    with pytest.raises(InputError, match=f"a target is asked of cells .*, and this mesh has none: 1 {kind} cell"):
        gmsnet.smooth(mesh, target_quality=0.3)


def test_cells_of_other_kinds_are_carried_through_and_told(cube, free):
    mixed = volumes.mesh_of(
        cube.points, cube.cells[0].nodes, more=[("pyramid13", [[*free[:13]]]), ("triangle", [free[13:16]])]
    )
    result = gmsnet.smooth(mixed)
    first, last = result.notes
    assert first == "not measured, and their nodes are held: 1 pyramid13 cell"
    assert last.startswith("of the cells with a free node: η, least ")
    assert not result.moved[free[:16]].any()
    assert result.moved.sum() == len(free) - 16
    assert [block.kind for block in result.mesh.cells] == ["tetra", "pyramid13", "triangle"]


@pytest.mark.parametrize("flat", [[1, 1, 0], [1, 0, 1], [0, 1, 1]])
def test_volumes_that_lie_in_a_plane_are_refused(cube, flat):
    for points in (cube.points * flat, cube.points[:, :2]):
        for act in (gmsnet.smooth, gmsnet.quality):
            with pytest.raises(InputError, match="all its nodes lie in one plane"):
                act(volumes.mesh_of(points, cube.cells[0].nodes))


def test_a_mesh_without_free_nodes_stays():
    points, cells = volumes.lattice(1)
    result = gmsnet.smooth(volumes.mesh_of(points, cells))
    assert (result.stop_reason, result.moved.any()) == (stop.NOTHING_TO_MOVE, False)
    assert result.held["boundary"].tolist() == list(range(8))


def test_single_precision_stays_single(cube):
    mesh = gmsnet.Mesh(np.float64(np.float32(cube.points)), cube.cells, single=True)
    result = gmsnet.smooth(mesh)
    assert result.points.tobytes() == np.float64(np.float32(result.points)).tobytes()
    assert result.after.shape.min() > result.before.shape.min() + 0.2
    signs = volumes.exact_signs(result.points, cube.cells[0].nodes)
    assert set(signs) == {1}


@pytest.mark.parametrize("size", [1e-300, 1e-150, 1e150, 1e300])
def test_coordinates_at_the_ends_of_the_range(cube, size):
    result = gmsnet.smooth(cube.with_points(cube.points * size), max_sweeps=5)
    assert np.isfinite(result.points).all()
    assert result.after.inverted == 0
    assert result.after.shape.min() > result.before.shape.min()


@pytest.mark.parametrize("size", [1e-37, 1e-40, 3e-44, 1e37])
def test_single_precision_at_the_ends_of_the_range(cube, size):
    """Where float32 has few digits left, cells are flat and stay."""
    with np.errstate(under="ignore"):
        points = np.float64(np.float32(cube.points * size))
    mesh = gmsnet.Mesh(points, cube.cells, single=True)
    result = gmsnet.smooth(mesh, max_sweeps=3)
    assert np.isfinite(result.points).all()
    before, after = (np.array(volumes.exact_signs(p, cube.cells[0].nodes)) for p in (points, result.points))
    assert (after[before > 0] > 0).all()


def test_a_cluster_of_nodes_far_smaller_than_float32_can_tell(cube, free):
    for size in (1e-30, 1e-38, 1e-40, 1e-45, 1e-60, 1e-100):
        points = cube.points - 0.5
        points[free] *= size
        for method in ("auto", "barrier", "laplacian"):
            result = gmsnet.smooth(volumes.mesh_of(points, cube.cells[0].nodes), method, max_sweeps=2, untangle=False)
            assert np.isfinite(result.points).all()
            assert result.after.inverted <= result.before.inverted


def test_forms_of_meshes(cube):
    """Arrays, and meshes that come back in their own type."""
    points, cells = cube.points, cube.cells[0].nodes
    result = gmsnet.smooth((points, [("tetra", cells)]), max_sweeps=3)
    assert result.points.tobytes() == gmsnet.smooth(cube, max_sweeps=3).points.tobytes()
    with pytest.raises(InputError, match="may be quads or tetrahedra"):
        gmsnet.smooth((points, cells))


def test_marks_of_planar_meshes_stay_what_they_were():
    """A block without cells makes no volume of a mesh in a plane."""
    mesh = gmsnet.random_mesh(100, seed=0)
    with_nothing = gmsnet.Mesh(mesh.points, (*mesh.cells, volumes.block("tetra", np.empty((0, 4)))))
    assert not with_nothing.has_volumes
    one, other = gmsnet.smooth(mesh, max_sweeps=5), gmsnet.smooth(with_nothing, max_sweeps=5)
    assert one.points.tobytes() == other.points.tobytes()
    assert "1/q" in repr(one)


@pytest.mark.parametrize(
    "make", [lambda: volumes.mesh_of(*volumes.cube(400, 3)), lambda: block(5, 5, 5, jitter=0.2, seed=1)]
)
def test_stars_are_made_beside_the_look_where_there_are_threads(make, monkeypatch):
    mesh, beside, plainly = make(), [], Volume.stars_beside

    def counted(topology, look):
        found = plainly(topology, look)
        again = topology.stars_of(np.flatnonzero(topology.near_free))
        assert same(topology.stars, again)
        beside.append(topology)
        return found

    monkeypatch.setattr(set_up, "MANY", 0)
    monkeypatch.setattr(Volume, "stars_beside", counted)
    one, two = (gmsnet.smooth(mesh, threads=threads) for threads in (1, 2))
    assert len(beside) == 1
    assert one.points.tobytes() == two.points.tobytes()
    gmsnet.smooth(mesh, threads=2, target_quality=0.1)
    assert len(beside) == 1
