"""New coordinates in the old file: exactly the tokens of moved nodes change."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import spliced
from support.damage import triangle_grid
from support.formats import FILES

from gmsnet.io import FORMATS, read, write
from gmsnet.io.file_source import FileSource
from gmsnet.io.places import Lattice, Places
from gmsnet.io.splice import BinarySlots, TextSlots
from gmsnet.io.text import Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

TEXT = b"head 1.50 2e0 | +3.25\t.5\r\n7. 1E1 1.50 tail"
STARTS = Text(TEXT).tokens(0, 10)[0][[1, 2, 4, 5, 6, 7]].reshape(3, 2)
OLD, ENDS = Text(TEXT).spans(STARTS)
SLOTS = TextSlots(STARTS, ENDS)


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 1), st.floats(allow_nan=False, allow_infinity=False))))
def test_only_what_changed_in_value_is_written(changes: list[tuple[int, int, float]]) -> None:
    new = OLD.copy()
    for row, column, value in changes:
        new[row, column] = value
    expected, end = b"", 0
    for start, stop, old, value in zip(STARTS.flat, ENDS.flat, OLD.flat, new.ravel().tolist(), strict=True):
        expected += TEXT[end:start] + (TEXT[start:stop] if old == value else repr(value).encode())
        end = stop
    expected += TEXT[end:]
    assert spliced(SLOTS, TEXT, OLD, new) == expected


def test_slots_in_any_order_and_repeated_nodes() -> None:
    swapped = TextSlots(STARTS[::-1], ENDS[::-1], np.array([0, 1, 0]))
    old = np.array([[7.0, 10.0], [3.25, 0.5]])
    new = np.array([[8.0, 10.0], [3.25, 0.25]])
    assert spliced(swapped, TEXT, old, new) == b"head 8.0 2e0 | +3.25\t0.25\r\n8.0 1E1 1.50 tail"


@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", ">f8"])
def test_binary_slots(dtype: str) -> None:
    old = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    width = np.dtype(dtype).itemsize
    data = b"ab" + old.astype(dtype).tobytes() + b"c" + old[:1].astype(dtype).tobytes()
    columns = (0, width, 2 * width)
    places = Places(Lattice(2, 2, 3 * width, columns), Lattice(3 + 6 * width, 1, 1, columns))
    new = old.copy()
    new[0, 1] = -7.5
    got = spliced(BinarySlots(places, dtype, np.array([0, 1, 0])), data, old, new)
    assert got == b"ab" + new.astype(dtype).tobytes() + b"c" + new[:1].astype(dtype).tobytes()


def test_a_source_knows_its_cells() -> None:
    cells = (CellBlock("triangle", [[0, 1, 2]], [4]),)
    source = FileSource("su2", ".su2", TEXT, OLD, SLOTS, cells, {".ele": b"x"})
    assert source.fits(Mesh(OLD, cells))
    assert source.fits(Mesh(OLD + 1, (CellBlock("triangle", [[0, 1, 2]], [4]),)))
    assert not source.fits(Mesh(OLD, ()))
    assert not source.fits(Mesh(np.vstack([OLD, OLD]), cells))
    for other in (CellBlock("triangle", [[0, 2, 1]], [4]), CellBlock("triangle", [[0, 1, 2]], [5])):
        assert not source.fits(Mesh(OLD, (other,)))
    for same in (OLD, OLD.copy()):
        assert {suffix: bytes(pieces) for suffix, pieces in source.splice(same).items()} == {".su2": TEXT, ".ele": b"x"}
    new = OLD + 1.0
    assert bytes(source.splice(new)[".su2"]) == spliced(SLOTS, TEXT, OLD, new) != TEXT


FACTS = {
    "region_names": {(2, 4): "core"},
    "point_data": {"t": np.array([1.0, np.nan, 3.0]), "names": np.array(["a", "b", "c"], dtype=object)},
    "cell_data": {"material": (np.array([4]),)},
}


def test_a_source_knows_all_else_that_it_read() -> None:
    cells = (CellBlock("triangle", [[0, 1, 2]], [4]),)
    mesh = Mesh(OLD, cells, **FACTS)
    source = FileSource("su2", ".su2", TEXT, mesh.points, SLOTS, mesh.cells, {}, **FACTS)
    assert source.fits(mesh)
    assert source.fits(mesh.with_points(OLD + 1))
    assert source.fits(replace(mesh, **{name: dict(value) for name, value in FACTS.items()}))  # equal, not the same


@pytest.mark.parametrize(
    "change",
    [
        {"region_names": {}},
        {"region_names": {(2, 4): "rim"}},
        {"region_names": {(2, 4): "core", (1, 1): "wall"}},
        {"point_data": {}},
        {"point_data": {**FACTS["point_data"], "new": np.zeros(3)}},
        {"point_data": {**FACTS["point_data"], "t": np.array([1.0, np.nan, 4.0])}},
        {"point_data": {**FACTS["point_data"], "t": np.array([1.0, np.nan, 3.0], dtype=np.float32)}},
        {"point_data": {**FACTS["point_data"], "t": np.array([[1.0], [np.nan], [3.0]])}},
        {"point_data": {**FACTS["point_data"], "names": np.array(["a", "b", "d"], dtype=object)}},
        {"point_data": {"t": FACTS["point_data"]["t"], "other": FACTS["point_data"]["names"]}},
        {"cell_data": {}},
        {"cell_data": {"material": (np.array([5]),)}},
        {"node_sets": {"probe": [0]}},
    ],
)
def test_a_mesh_with_other_data_or_names_does_not_fit(change: dict) -> None:
    cells = (CellBlock("triangle", [[0, 1, 2]], [4]),)
    mesh = Mesh(OLD, cells, **FACTS)
    source = FileSource("su2", ".su2", TEXT, mesh.points, SLOTS, mesh.cells, {}, **FACTS)
    assert not source.fits(replace(mesh, **change))


@pytest.mark.parametrize("key", FILES)
def test_new_coordinates_alone_are_spliced_in_every_format(key: str, tmp_path: Path) -> None:
    path, out = (tmp_path / (stem + FORMATS[key].suffixes[0]) for stem in ("in", "out"))
    write(triangle_grid(), path)
    mesh = read(path)
    points = mesh.points.copy()
    points[12, 0] += 0.03125
    moved = mesh.with_points(points)
    assert mesh.source is not None
    assert mesh.source.fits(moved)
    assert write(moved, out) == []
    assert out.read_bytes() == bytes(mesh.source.splice(points)[FORMATS[key].suffixes[0]])


@pytest.mark.parametrize("key", ["vtk", "vtu", "gmsh"])
def test_replaced_data_are_written(key: str, tmp_path: Path) -> None:
    path, out = (tmp_path / (stem + FORMATS[key].suffixes[0]) for stem in ("in", "out"))
    grid = triangle_grid()
    write(replace(grid, point_data={"old": np.arange(float(len(grid.points)))}), path)
    mesh = read(path)
    values = np.arange(float(len(mesh.points))) ** 2
    lost = write(replace(mesh, point_data={"new": values}), out)
    again = read(out)
    if "new" in again.point_data:
        assert list(again.point_data) == ["new"]
        assert again.point_data["new"].tolist() == values.tolist()
    else:
        assert any("'new'" in line for line in lost)
    assert (again.points == mesh.points).all()


def test_what_the_format_cannot_hold_of_a_change_is_named(tmp_path: Path) -> None:
    path, out = tmp_path / "in.su2", tmp_path / "out.su2"
    write(triangle_grid(), path)
    mesh = read(path)
    assert write(mesh, out) == []
    (lost,) = write(replace(mesh, point_data={"new": np.zeros(len(mesh.points))}), out)
    assert "'new'" in lost
    (lost,) = write(replace(mesh, node_sets={"probe": [3]}), out)
    assert "'probe'" in lost
    renamed = {key: f"{name}-2" for key, name in mesh.region_names.items()}
    assert write(replace(mesh, region_names=renamed), out) == []
    assert dict(read(out).region_names) == renamed
    assert renamed


REAL = {
    "mesh_NACA0012_inv.su2": (5233, {"triangle": 10216, "line": 250}),
    "osteonT1_11.mesh": (1228, {"triangle": 2292}),
    "square_triquad.mesh": (470, {"triangle": 458, "quad": 200}),
    "cylinder_in_box.mesh": (764, {"tetra": 3344}),
    "matrix_fiber.mesh": (2421, {"hexahedron": 1952}),
}


@pytest.mark.parametrize("name", REAL)
def test_real_files(name: str) -> None:
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("set GMSNET_MESHES to the folder of real meshes")
    path = Path(folder) / name
    mesh = read(path)
    nodes, cells = REAL[name]
    assert len(mesh.points) == nodes
    assert {kind: sum(len(b.nodes) for b in mesh.cells if b.kind == kind) for kind in cells} == cells
    assert {b.kind for b in mesh.cells} == set(cells)
    assert mesh.source is not None
    (was,) = map(bytes, mesh.source.splice(mesh.points).values())
    assert was == path.read_bytes()

    moved = mesh.points.copy()
    moved[[3, nodes - 1], 0] += 0.1
    (now,) = map(bytes, mesh.source.splice(moved).values())
    old, new = was.split(b"\n"), now.split(b"\n")
    assert len(old) == len(new)
    different = [k for k, (a, b) in enumerate(zip(old, new, strict=True)) if a != b]
    assert len(different) == 2
    for line in different:
        assert old[line].split()[1:] == new[line].split()[1:]


def test_figures_of_real_files() -> None:
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("set GMSNET_MESHES to the folder of real meshes")
    airfoil = read(Path(folder) / "mesh_NACA0012_inv.su2")
    assert dict(airfoil.region_names) == {(1, 1): "airfoil", (1, 2): "farfield"}
    assert [len(b.nodes) for b in airfoil.cells] == [10216, 200, 50]
    assert {name: len(ids) for name, ids in airfoil.markers.items() if name != "0"} == {"airfoil": 200, "farfield": 50}
    bone = read(Path(folder) / "osteonT1_11.mesh")
    assert len(np.unique(bone.cells[0].regions)) == 67
    assert not bone.point_data
    mixed = read(Path(folder) / "square_triquad.mesh")
    assert [(b.kind, np.unique(b.regions).tolist()) for b in mixed.cells] == [("triangle", [2]), ("quad", [1])]
    box = read(Path(folder) / "cylinder_in_box.mesh")
    assert np.unique(box.cells[0].regions).tolist() == [444, 555]
