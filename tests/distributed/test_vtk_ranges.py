"""Binary legacy VTK files, and data of VTK's formats that tell regions and held nodes, on ranks."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, random_volume, recombine
from gmsnet.io import vtk_runs
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.vtk_runs import Field, told_by
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import NUMBERED, regions_of
from gmsnet.mesh.selection import held_by_data

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed, save_vtkhdf
from support.comm import together
from support.vtk_variants import grid_of, legacy_variants, mixed_mesh, vtu_variants

MESHES = {
    "triangles": lambda: random_mesh(300, seed=1),
    "quads and triangles": lambda: recombine(random_mesh(300, seed=3)),
    "tetrahedra": lambda: random_volume(200, seed=1),
    "all volumes": mixed,
}


def legacy(mesh: Mesh, folder: Path, version: int, single: bool = False) -> Path:
    flat = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    written = dict(legacy_variants(grid_of(replace(mesh, points=flat), single), folder))
    (folder / "mesh.vtk").unlink()
    path = folder / "a.vtk"
    path.write_bytes(written[f"binary {version}"])
    return path


def with_data(mesh: Mesh) -> Mesh:
    """Two regions, side by side, and some nodes that are held."""
    middle = np.median(mesh.points[:, 1])
    cells = tuple(np.where(mesh.points[block.nodes].mean(axis=1)[:, 1] < middle, 7, 4) for block in mesh.cells)
    held = (np.arange(len(mesh.points)) % 19 == 2).astype(np.float32)
    heat = np.random.default_rng(1).random((len(mesh.points), 3))
    return replace(mesh, point_data={"heat": heat, "fixed": held}, cell_data={"material": cells})


@pytest.mark.parametrize("ranks", [1, 3, 7])
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("kind", MESHES)
def test_ranks_read_the_mesh_of_one_process(kind: str, version: int, ranks: int, tmp_path: Path) -> None:
    mesh = MESHES[kind]()
    path = legacy(with_data(mesh) if ranks == 3 else mesh, tmp_path, version, single=ranks == 1)
    assert_read_alike(path, "vtk", ranks)


@pytest.mark.parametrize(("kind", "version", "ranks", "method"), [
    ("triangles", 42, 2, "auto"), ("quads and triangles", 51, 3, "barrier"), ("tetrahedra", 42, 3, "laplacian"),
    ("tetrahedra", 51, 1, "barrier"), ("all volumes", 42, 3, "barrier"), ("all volumes", 51, 5, "auto"),
])  # fmt: skip
@pytest.mark.parametrize("data", [False, True])
def test_the_bytes_of_a_serial_run(
    kind: str, version: int, ranks: int, method: str, data: bool, tmp_path: Path
) -> None:
    mesh = MESHES[kind]()
    path = legacy(with_data(mesh) if data else mesh, tmp_path, version, single=data)
    assert_bytes_of_one_process(path, "vtk", ranks, method)


def test_vtu_and_vtkhdf_with_regions_and_held_nodes(tmp_path: Path) -> None:
    mesh = with_data(mixed())
    for name, data in vtu_variants(grid_of(mesh)):
        if name.startswith("raw") and name.endswith("False"):
            (tmp_path / "a.vtu").write_bytes(data)
            assert_bytes_of_one_process(tmp_path / "a.vtu", "vtu", 3, "barrier")
    path = save_vtkhdf(mesh, tmp_path / "a.vtkhdf")
    with h5py.File(path, "a") as file:
        root = file["VTKHDF"]
        root["CellData/material"] = np.concatenate(mesh.cell_data["material"])
        root["CellData/note"] = "no numbers"
        root["PointData/fixed"] = mesh.point_data["fixed"]
    assert_read_alike(path, "vtkhdf", 3)
    assert_bytes_of_one_process(path, "vtkhdf", 2, "barrier")


def with_ghosts(mesh: Mesh, names: tuple[str, ...] = ("vtkGhostType",)) -> Mesh:
    """Some cells at one side are copies of cells of others; of some the mark says something else."""
    x = [mesh.points[block.nodes].mean(axis=1)[:, 0] for block in mesh.cells]
    high = np.quantile(np.concatenate(x), 0.9)
    marks = tuple(np.where(each > high, 1, 4 * (np.arange(len(each)) % 3 == 1)).astype(np.uint8) for each in x)
    return replace(mesh, cell_data={**mesh.cell_data, **dict.fromkeys(names, marks)})


@pytest.mark.parametrize("names", [("vtkGhostType",), ("vtkGhostLevels", "vtkGhostType")])
@pytest.mark.parametrize("kind", ["runs", "in turn"])
def test_ghost_cells_of_vtu(kind: str, names: tuple[str, ...], tmp_path: Path, monkeypatch) -> None:
    """Their nodes are held, as by one process, where they hang together with other cells or not."""
    monkeypatch.setattr(vtk_runs, "AT_ONCE", 100)
    path, mesh = tmp_path / "a.vtu", with_ghosts(alternating(1500) if kind == "in turn" else with_data(mixed()), names)
    variants = dict(vtu_variants(grid_of(mesh)))
    for ranks, variant in enumerate(
        ("raw, header 32, order 1, compress False", "binary, header 64, order 1, compress True"), 2
    ):
        path.write_bytes(variants[variant])
        assert gmsnet.read(path).cells[-1].kind == "vertex"
        assert_read_alike(path, "vtu", ranks)
        if kind == "runs":
            assert_bytes_of_one_process(path, "vtu", ranks, "barrier")


@pytest.mark.parametrize("suffix", ["vtk", "vtkhdf"])
def test_files_of_one_piece_have_no_ghosts(suffix: str, tmp_path: Path) -> None:
    mesh = with_ghosts(random_volume(100, seed=1))
    if suffix == "vtk":
        path = legacy(mesh, tmp_path, 51)
    else:
        path = save_vtkhdf(mesh, tmp_path / "a.vtkhdf")
        with h5py.File(path, "a") as file:
            file["VTKHDF/CellData/vtkGhostType"] = np.concatenate(mesh.cell_data["vtkGhostType"])
    assert_read_alike(path, suffix, 2)
    assert_bytes_of_one_process(path, suffix, 2, "barrier")


def alternating(runs: int) -> Mesh:
    """Cells of all kinds of volumes in turn, so often, and regions of them that alternate otherwise."""
    mesh = mixed()
    cells = [(block.kind, row) for block in mesh.cells for row in block.nodes]
    order = np.random.default_rng(3).permutation(len(cells)).tolist() * 40
    kinds = [order[0]]
    for k in order:
        if cells[k][0] != cells[kinds[-1]][0] and len(kinds) < runs:
            kinds.append(k)
    blocks = [CellBlock(cells[k][0], cells[k][1][None], np.zeros(1, dtype=np.int64)) for k in kinds]
    regions = tuple(np.array([k % 3]) for k in range(len(blocks)))
    return Mesh(mesh.points, tuple(blocks), cell_data={"material": regions})


@pytest.mark.parametrize("at_once", [100, 1 << 18])
@pytest.mark.parametrize(("runs", "ranks"), [(999, 1), (1000, 3), (1001, 2), (1002, 4), (1500, 3)])
def test_types_that_alternate_often(runs: int, ranks: int, at_once: int, tmp_path: Path, monkeypatch) -> None:
    """More than a thousand runs of cells of one type are blocks by type."""
    monkeypatch.setattr(vtk_runs, "AT_ONCE", at_once)
    mesh = alternating(runs)
    for version in (42, 51):
        path = legacy(mesh, tmp_path, version)
        assert (len(gmsnet.read(path).cells) == runs) == (runs <= 1000)
        assert_read_alike(path, "vtk", ranks)
    variants = dict(vtu_variants(grid_of(mesh)))
    for mode in ("raw", "binary"):
        (tmp_path / "a.vtu").write_bytes(variants[f"{mode}, header 32, order 1, compress {mode == 'binary'}"])
        assert_read_alike(tmp_path / "a.vtu", "vtu", ranks)
    path = save_vtkhdf(replace(mesh, cell_data={}), tmp_path / "a.vtkhdf")
    assert_read_alike(path, "vtkhdf", ranks)


@pytest.mark.parametrize("ranks", [1, 3])
def test_the_bytes_where_types_alternate_often(ranks: int, tmp_path: Path) -> None:
    whole = recombine(random_mesh(3000, seed=3))
    cells = [(block.kind, row) for block in whole.cells for row in block.nodes]
    order = np.random.default_rng(3).permutation(len(cells)).tolist()
    blocks = [CellBlock(cells[k][0], cells[k][1][None], np.zeros(1, dtype=np.int64)) for k in order]
    for version in (42, 51):
        path = legacy(Mesh(whole.points, tuple(blocks)), tmp_path, version)
        assert len(gmsnet.read(path).cells) == 3
        assert_bytes_of_one_process(path, "vtk", ranks, "barrier")


def test_held_nodes_of_vectors(tmp_path: Path) -> None:
    mesh = random_mesh(100, seed=2)
    values = np.random.default_rng(0).random((len(mesh.points), 2)) * (np.arange(len(mesh.points)) % 3 == 0)[:, None]
    path = legacy(replace(mesh, point_data={"fixed": values}), tmp_path, 42)
    pieces = together(3, lambda comm: read_ranges(str(path), "vtk", comm).piece)
    held = held_by_data(gmsnet.read(path).point_data["fixed"])
    assert 0 < held.sum() < len(held)
    for piece in pieces:
        assert piece.fixed.tolist() == held[piece.ids].tolist()


def test_real_meshes(real_meshes: Path, tmp_path: Path) -> None:
    for name in ("helmholtz_apartment", "mixed-hex-pyr-tet", "star-mixed-p2", "tangled_quad"):
        mesh = gmsnet.read(real_meshes / f"{name}.vtk")
        for version in (42, 51):
            assert_read_alike(legacy(mesh, tmp_path, version), "vtk", 2)


def test_which_files_are_shared(tmp_path: Path) -> None:
    path, target = tmp_path / "a.vtk", str(tmp_path / "b.vtk")

    def shared(data: bytes) -> str:
        path.write_bytes(data)
        return shared_format(str(path), target)

    for version in (42, 51):
        data = legacy(mixed_mesh(), tmp_path, version).read_bytes()
        assert shared(data) == "vtk"
        assert shared(data.replace(b"UNSTRUCTURED_GRID", b"POLYDATA")) == ""
        assert shared(data.replace(b"weights", b"regions")) == "vtk"  # three numbers a cell are no regions
        assert shared(data.replace(b"material", b"vtkGhostType").replace(b"weights", b"material")) == "vtk"
        assert shared(data.replace(b"\nCELL_TYPES ", b"\nCELL_TYPES 1")) == ""
        assert shared(data.replace(b"CELL_DATA ", b"CELL_DATA 1")) == ""
        assert shared(data.replace(b"CELL_TYPES", b"CELL_KINDS")) == ""
        more = b"\nFIELD a 3\nnames 1 2 string\n\xc3abc\xc1z\nbits 1 9 bit\n\1\2\nNULL_ARRAY\nTENSORS6 %s int\n"
        facts = b"\nMETADATA\nINFORMATION 0\n\n"
        count = int(re.findall(rb"CELL_DATA (\d+)", data)[0])
        bits = more.replace(b"1 2 string", b"1 %d string" % count).replace(b"\xc3abc\xc1z", b"\xc1z" * count)
        bits = bits.replace(b"1 9 bit", b"1 %d bit" % count).replace(b"\1\2", bytes((count + 7) // 8))
        cells = data.index(b"POINT_DATA")
        end = bits.replace(b"TENSORS6 %s int\n", b"")
        assert cells > data.index(b"CELL_DATA")
        assert shared(data[:cells] + facts + end.lstrip() + data[cells:]) == "vtk"
        assert shared(data[:cells] + end.replace(b"bits", b"part") + data[cells:]) == ""
        assert shared(data[:cells] + end.replace(b"names 1 %d" % count, b"names 9 9") + data[cells:]) == ""
    assert shared(dict(legacy_variants(grid_of(mixed_mesh()), tmp_path))["ascii 42"]) == ""


@pytest.mark.parametrize("version", [42, 51])
def test_a_file_cut_anywhere_is_for_the_reader_of_the_whole(version: int, tmp_path: Path) -> None:
    """But where it ends between two arrays: all readers take it as it is then."""
    path = legacy(replace(mixed_mesh(2), point_data={}), tmp_path, version)
    data = path.read_bytes()
    for end in range(len(data)):
        path.write_bytes(data[:end])
        try:
            gmsnet.read(path)
        except gmsnet.InputError:
            assert planned_format(str(path), "vtk") == ""


@pytest.mark.parametrize("version", [42, 51])
def test_damage_is_named_on_all_ranks(version: int, tmp_path: Path) -> None:
    mesh = random_volume(200, seed=1)
    path = legacy(mesh, tmp_path, version)
    data, kind = path.read_bytes(), ">i8" if version == 51 else ">i4"
    first = mesh.cells[0].nodes[:3].astype(kind)
    listed = np.insert(first, 0, first.shape[1], axis=1).astype(kind) if version == 42 else first
    at, size, width = data.index(listed.tobytes()), np.dtype(kind).itemsize, listed.shape[1]

    def said(data: bytes) -> str:
        path.write_bytes(data)
        before = saved(tmp_path)
        found = heard(3, path, "vtk")[0]
        assert saved(tmp_path) == before
        return found

    wrong = np.array([10**6], kind).tobytes()
    byte = at + 2 * width * size  # of the third cell
    nodes = byte + size * (version == 42)
    assert f"byte {nodes}: a cell names the node 1000000, but" in said(data[:nodes] + wrong + data[nodes + size :])
    if version == 42:
        five = np.array([5], kind).tobytes()
        told = said(data[:byte] + five + data[byte + size :])
        assert f"byte {byte}: a {mesh.cells[0].kind} with 5 nodes instead of {width - 1}" in told
    place = data.index(b" double\n") + 8 + 7 * 24
    told = said(data[:place] + np.full(3, np.inf, ">f8").tobytes() + data[place + 24 :])
    assert f"byte {place}: a coordinate of node 7 (counted from 0) is not finite" in told


@given(values=st.lists(st.integers(-3, 80), min_size=1, max_size=70), distinct=st.booleans(), names=st.integers(0, 2))
def test_what_data_tell(
    values: list[int], distinct: bool, names: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """As ``regions_of`` tells it of all numbers, or not at all."""
    array = np.arange(len(values)) if distinct else np.array(values)
    path = tmp_path_factory.mktemp("a") / "a"
    path.write_bytes(array.astype(">i8").tobytes())
    file, rows = Ranges(str(path)), Rows(0, len(array), 8, ">i8")
    fields = [Field(name, rows) for name in ("material", "heat", "part")[: 1 + names]]
    told = told_by(file, [], fields, (0, len(array)))
    if names == 2 or (distinct and len(array) >= NUMBERED):
        assert told is None
    elif told is not None:
        assert told.regions is rows
        assert array.tolist() == regions_of([("material", array)], len(array)).tolist()
    else:
        assert len(np.unique(array[:NUMBERED])) == NUMBERED
