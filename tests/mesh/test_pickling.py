"""Meshes, results and reports through pickle and copy, and to other processes: the same values, the same file."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import weakref

import numpy as np
import pytest
from support.formats import FILES

import gmsnet
from gmsnet.errors import InputError
from gmsnet.io import contents, read, write
from gmsnet.io.formats import FORMATS as TABLE
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

NODES = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def again(thing):
    return pickle.loads(pickle.dumps(thing))


def facts(mesh):
    return (
        mesh.points.tolist(),
        [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells],
        dict(mesh.region_names),
        {name: values.tolist() for name, values in mesh.point_data.items()},
        {name: [part.tolist() for part in parts] for name, parts in mesh.cell_data.items()},
        {name: ids.tolist() for name, ids in mesh.node_sets.items()},
        mesh.single,
        mesh.plane,
    )


@pytest.fixture
def full():
    return Mesh(
        SQUARE,
        (CellBlock("triangle", NODES, [0, 1]), CellBlock("line", [[0, 1]], [7])),
        {(1, 7): "inlet"},
        {"t": np.arange(4), "names": np.array(["a", "b", "c", "d"], dtype=object)},
        {"m": (np.arange(2.0), np.arange(1.0))},
        True,
        node_sets={"some": [1, 3]},
    )


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_mesh_comes_back_as_it_was(full, protocol):
    back = pickle.loads(pickle.dumps(full, protocol))
    assert facts(back) == facts(full)
    arrays = [back.points, *(a for b in back.cells for a in (b.nodes, b.regions)), *back.point_data.values()]
    assert not any(array.flags.writeable for array in [*arrays, *back.node_sets.values(), *back.cell_data["m"]])
    with pytest.raises(TypeError, match="item assignment"):
        back.point_data["t"] = arrays[0]


def test_a_mesh_is_its_own_copy(full):
    assert copy.copy(full) is full
    assert copy.deepcopy(full) is full
    assert copy.deepcopy([full])[0] is full
    moved = full.with_points(SQUARE + 1.0)
    assert (full.points == SQUARE).all()
    assert moved.cells is full.cells


def test_points_alone_stay_in_their_plane(full):
    bare = Mesh(SQUARE[:, [0, 1, 1]] * [1.0, 0.0, 1.0], full.cells).without_cells()
    assert again(bare).plane == bare.plane == (0, 2)


@pytest.mark.parametrize("key", FILES)
@pytest.mark.parametrize("large", [False, True])
def test_the_file_goes_along(key, large, tmp_path, monkeypatch):
    """What is written afterwards is the file with new coordinates, byte for byte; also if the file is gone."""
    if large:
        monkeypatch.setattr(contents, "LARGE", 1)
    suffix = TABLE[key].suffixes[0]
    for name in ("in", "out", "expected"):
        write(gmsnet.random_mesh(60, seed=2), tmp_path / f"{name}{suffix}")
    mesh = read(tmp_path / f"in{suffix}")
    points = gmsnet.smooth(mesh, "laplacian", max_sweeps=2).points
    assert write(mesh.with_points(points), tmp_path / f"expected{suffix}") == []
    data = pickle.dumps(mesh)
    for path in tmp_path.glob("in.*"):
        path.unlink()
    assert write(pickle.loads(data).with_points(points), tmp_path / f"out{suffix}") == []
    for path in tmp_path.glob("expected.*"):
        assert (tmp_path / f"out{path.suffix}").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("compressor", [None, "zlib"])
@pytest.mark.parametrize("large", [False, True])
def test_an_encoded_file_goes_along(compressor, large, tmp_path, monkeypatch):
    meshio = pytest.importorskip("meshio")
    if large:
        monkeypatch.setattr(contents, "LARGE", 1)
    made = gmsnet.random_mesh(60, seed=2)
    points = np.column_stack([made.points, np.zeros(len(made.points))])
    meshio.vtu.write(
        tmp_path / "in.vtu", meshio.Mesh(points, [("triangle", made.cells[0].nodes)]), compression=compressor
    )
    mesh = read(tmp_path / "in.vtu")
    moved = gmsnet.smooth(mesh, "laplacian", max_sweeps=2).points
    write(mesh.with_points(moved), tmp_path / "expected.vtu")
    assert write(again(mesh).with_points(moved), tmp_path / "out.vtu") == []
    assert (tmp_path / "out.vtu").read_bytes() == (tmp_path / "expected.vtu").read_bytes()
    assert (tmp_path / "out.vtu").read_bytes() != (tmp_path / "in.vtu").read_bytes()


@pytest.mark.parametrize("options", [{}, {"target_quality": 0.5}, {"method": "gmsnet"}, {"max_sweeps": 0}])
def test_results_and_reports_come_back_as_they_were(options):
    tangled = gmsnet.random_mesh(150, seed=3)
    points = tangled.points.copy()
    free = gmsnet.smooth(tangled, max_sweeps=1).moved.nonzero()[0]
    points[free[:10]] = points[free[20]]  # some that are untangled, and perhaps some that are not
    result = gmsnet.smooth(tangled.with_points(points), **options)
    back = again(result)
    assert facts(back.mesh) == facts(result.mesh)
    assert back.points.tobytes() == result.points.tobytes()
    assert (back.history, back.notes, back.stop_reason) == (result.history, result.notes, result.stop_reason)
    assert (back.sweeps, back.unmended, back.seconds) == (result.sweeps, result.unmended, result.seconds)
    assert back.moved.tolist() == result.moved.tolist()
    assert {k: v.tolist() for k, v in back.held.items()} == {k: v.tolist() for k, v in result.held.items()}
    assert back.before.summary() == result.before.summary()
    assert back.after.summary() == result.after.summary()
    assert again(result.after).worst(5).tolist() == result.after.worst(5).tolist()
    assert back.limits.bound.tolist() == result.limits.bound.tolist()
    assert gmsnet.smooth(back.mesh).points.tobytes() == gmsnet.smooth(result.mesh).points.tobytes()


def test_errors_come_back():
    for error in (InputError("one"), gmsnet.errors.FormatError("two"), gmsnet.errors.MissingExtraError("three")):
        assert type(again(error)) is type(error)
        assert str(again(error)) == str(error)


def test_meshes_and_results_go_to_other_processes_and_back():
    meshes = [gmsnet.random_mesh(80, seed=seed) for seed in range(3)]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.map(gmsnet.smooth, meshes)
    for mesh, result in zip(meshes, found, strict=True):
        assert result.points.tobytes() == gmsnet.smooth(mesh).points.tobytes()


def test_nothing_is_kept_of_what_is_let_go(tmp_path):
    """No cycle, no registry: meshes and results go when the last name does. What is asked for of a report stays."""
    write(gmsnet.random_mesh(200, seed=1), tmp_path / "in.su2")
    mesh = read(tmp_path / "in.su2")
    result = gmsnet.smooth(mesh)
    shape = result.after.shape.copy()
    report, points = again(result).after, result.points
    gone = [weakref.ref(thing) for thing in (mesh, mesh.source, result, result.mesh, result.topology)]
    kept = result.after
    del mesh, result
    assert [ref() for ref in gone] == [None] * len(gone)
    assert report.shape.tolist() == shape.tolist() == kept.shape.tolist()
    assert np.isfinite(points).all()
