"""Legacy VTK: all variants that VTK writes, spellings, damage, real files, conversion."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
import vtk
from hypothesis import given, settings
from hypothesis import strategies as st
from support.contracts import (
    check_all_cuts_refused,
    check_conversion,
    check_splice,
    contents,
    mesh_of,
    moved_points,
    read,
    refused,
)
from support.damage import ENDS, GAPS, NUMBERS, cells_of, damaged, facts, read_or_refuse, regions_of, triangle_grid
from support.vtk_variants import grid_of, legacy_variants, mixed_mesh, points_by_vtk, polydata_of, polyhedral_grid

from gmsnet.errors import FormatError
from gmsnet.io import vtk as vtk_format
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

HEAD = "# vtk DataFile Version {}\ntitle\n{}\nDATASET UNSTRUCTURED_GRID\n"
PLAIN = (
    HEAD.format("3.0", "ASCII") + "POINTS 5 double\n0 0 0  1 0 0  1 1 0\n0 1 0 0.5 0.5 0\n"
    "CELLS 4 16\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\nCELL_TYPES 4\n5 5 5 5\n"
)


def mesh_with(cells: str, more: str = "") -> bytes:
    return (HEAD.format("3.0", "ASCII") + "POINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\n" + cells + more).encode()


@pytest.mark.parametrize("polygonal", [False, True])
@pytest.mark.parametrize("single", [False, True])
def test_all_that_vtk_writes_reads_the_same(polygonal: bool, single: bool, tmp_path: Path) -> None:
    mesh = mixed_mesh()
    grid = (polydata_of if polygonal else grid_of)(mesh, single)
    found = {}
    for how, data in legacy_variants(grid, tmp_path):
        parsed = read(vtk_format, data)
        assert parsed.single == single
        assert mesh_of(parsed).plane == (0, 1)
        found[how] = facts(parsed)
        reader = vtk.vtkPolyDataReader() if polygonal else vtk.vtkUnstructuredGridReader()
        points, _ = points_by_vtk(reader, data, tmp_path / "in.vtk")
        assert np.array_equal(points, parsed.points.astype(points.dtype))
    assert found["ascii 42"] == found["ascii 51"]
    assert found["binary 42"] == found["binary 51"]
    assert found["binary 42"][1] == found["ascii 42"][1]
    exact = mesh.points.astype(np.float32) if single else mesh.points
    assert found["binary 42"][0] == exact.astype(float).tolist()
    kinds = [b[0] for b in found["binary 42"][1]]  # type: ignore[index,attr-defined]
    assert kinds == (["vertex", "line", "triangle", "quad"] if polygonal else [b.kind for b in mesh.cells])
    data_of = read(vtk_format, data)
    assert np.array_equal(data_of.point_data["speed"], mesh.point_data["speed"])
    assert np.array_equal(data_of.point_data["fixed"], mesh.point_data["fixed"])
    assert len(data_of.cell_data["weights"][0][0]) == 3


@pytest.mark.parametrize("polygonal", [False, True])
@pytest.mark.parametrize("single", [False, True])
def test_vtk_reads_moved_points_back(polygonal: bool, single: bool, tmp_path: Path) -> None:
    grid = (polydata_of if polygonal else grid_of)(mixed_mesh(), single)
    for how, data in legacy_variants(grid, tmp_path):
        out = check_splice(vtk_format, data)
        new = moved_points(read(vtk_format, data))
        reader = vtk.vtkPolyDataReader() if polygonal else vtk.vtkUnstructuredGridReader()
        points, again = points_by_vtk(reader, out, tmp_path / "out.vtk")
        assert np.array_equal(points, new.astype(points.dtype)), how
        assert again.GetNumberOfCells() == grid.GetNumberOfCells()


@pytest.mark.parametrize("polygonal", [False, True])
def test_binary_files_cut_anywhere_are_refused(polygonal: bool, tmp_path: Path) -> None:
    bare = Mesh(mixed_mesh().points, mixed_mesh().cells)
    grid = (polydata_of if polygonal else grid_of)(bare)
    for _, data in legacy_variants(grid, tmp_path):
        # polygonal data may end behind each kind of cell, of which vertices come first
        check_all_cuts_refused(vtk_format, data, data.index(b"VERTICES") + 12 if polygonal else None)


def test_a_text_cut_anywhere_keeps_its_mesh_or_is_refused() -> None:
    data = contents(vtk_format.write(mixed_mesh(2)))[".vtk"]
    whole = read(vtk_format, data)
    first = data.index(b"POINT_DATA")
    check_all_cuts_refused(vtk_format, data, len(data[:first].rstrip()) - 1, most=10_000)
    for cut in range(first, len(data)):
        parsed = read_or_refuse(vtk_format, {".vtk": data[:cut]})
        if parsed is not None:  # the format may end behind any section
            assert facts(parsed)[0] == facts(whole)[0]
            assert [b.nodes.tolist() for b in parsed.cells] == [b.nodes.tolist() for b in whole.cells]


@given(st.data())
@settings(max_examples=60)
def test_any_spelling_of_the_numbers(data: st.DataObject) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=12, max_size=12))
    gap, end = data.draw(GAPS), data.draw(ENDS)
    kind = data.draw(st.sampled_from(["double", "Double", "float"]))
    text = f"# vtk DataFile Version 2.0\nany title\nascii\n\nDataset unstructured_grid\nPOINTS 4 {kind}\n"
    text += "\n".join(gap.join(numbers[k : k + 6]) for k in (0, 6)) + "\n\n"
    text += f"CELLS 2 8{gap}\n3 0 1 2 3\n 0 2 3\nCELL_TYPES 2\n5{gap}5\nCELL_DATA 2\nSCALARS Mat_ID int 1\n"
    text += f"LOOKUP_TABLE default\n4{gap}-2\nVECTORS v float\n1 nan 3 -inf 5e39 6\n"
    raw = text.replace("\n", end).encode()
    parsed = read(vtk_format, raw)
    assert parsed.points.ravel().tolist() == [float(n) for n in numbers]
    assert regions_of(parsed, "triangle") == [4, -2]
    assert parsed.single == (kind == "float")
    assert [
        raw[a:b].decode() for a, b in zip(parsed.slots.starts.ravel(), parsed.slots.ends.ravel(), strict=True)
    ] == numbers  # type: ignore[attr-defined]
    assert np.isnan(parsed.cell_data["v"][0][0, 1])


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_metadata_fields_strings_and_tables_are_passed(line_end: str) -> None:
    more = (
        "METADATA\nINFORMATION 1\nNAME L2 LOCATION vtkDataArray\nDATA 2 0 1\n\nCELL_DATA 2\n"
        "FIELD FieldData 3\nmaterial%20id 1 2 int\n8 9\nMETADATA\nCOMPONENT_NAMES\na\n\n"
        "names 1 2 string\nfirst one\n\nbits 1 2 bit\n1 0\n"
        "COLOR_SCALARS c 3\n0 .5 1 1 0 0\nLOOKUP_TABLE colours 2\n0 0 0 1 1 1 1 1\n"
        "POINT_DATA 4\nNORMALS n float\n0 0 1 0 0 1 0 0 1 0 0 1\nTEXTURE_COORDINATES t 2 float\n0 0 0 0 0 0 0 0\n"
        "TENSORS k double\n" + "0 " * 36 + "\nGLOBAL_IDS g vtkIdType\n5 6 7 8\n"
    )
    data = mesh_with("CELLS 2 8\n3 0 1 2 3 0 2 3\nCELL_TYPES 2\n5 5\n", more)
    parsed = read(vtk_format, data.replace(b"\n", line_end.encode()))
    assert set(parsed.cell_data) == {"material id", "bits", "c"}
    assert parsed.point_data["g"].tolist() == [5, 6, 7, 8]
    assert parsed.point_data["k"].shape == (4, 9)
    assert parsed.cell_data["bits"][0].tolist() == [1, 0]


def test_kinds_of_cells() -> None:
    cells = (
        "CELLS 7 31\n2 0 1\n3 0 1 2\n4 0 1 3 2\n4 0 1 2 3\n3 1 2 3\n5 0 1 2 3 0\n3 3 2 1\nCELL_TYPES 7\n3 4 8 9 7 7 2\n"
    )
    parsed = read(vtk_format, mesh_with(cells, "CELL_DATA 7\nSCALARS id int\nLOOKUP_TABLE default\n1 2 3 4 5 6 7\n"))
    assert cells_of(parsed, "line") == [[0, 1], [0, 1], [1, 2]]
    assert cells_of(parsed, "quad") == [[0, 1, 2, 3], [0, 1, 2, 3]]
    assert cells_of(parsed, "triangle") == [[1, 2, 3]]
    assert cells_of(parsed, "polygon") == [[0, 1, 2, 3, 0]]
    assert cells_of(parsed, "vertex") == [[3], [2], [1]]
    assert [a.tolist() for a in parsed.cell_data["id"]] == [[1, 2, 2], [3], [4], [5], [6], [7, 7, 7]]


@pytest.mark.parametrize("single", [False, True])
def test_polyhedra_are_cells_of_all_their_nodes(single: bool, tmp_path: Path) -> None:
    grid, mesh = polyhedral_grid(single)
    for how, data in legacy_variants(grid, tmp_path):
        parsed = read(vtk_format, data)
        found = [(block.kind, sorted(map(sorted, block.nodes.tolist()))) for block in parsed.cells]
        assert found == [(b.kind, sorted(map(sorted, b.nodes.tolist()))) for b in mesh.cells], how
        out = check_splice(vtk_format, data)
        points, again = points_by_vtk(vtk.vtkUnstructuredGridReader(), out, tmp_path / "out.vtk")
        assert np.array_equal(points, moved_points(parsed).astype(points.dtype)), how
        assert [again.GetCell(k).GetNumberOfFaces() for k in (0, 11)] == [10, 10], how
    with pytest.raises(FormatError, match="VTK cannot be written with polyhedra"):
        vtk_format.write(mesh_of(parsed))


def test_a_polyhedron_between_other_cells_is_as_it_is_listed() -> None:
    faces = "4 3 0 3 1 3 3 0 2 3 0 1 2 3 1 3 2"
    parsed = read(vtk_format, mesh_with(f"CELLS 3 26\n3 0 1 2\n17 {faces}\n3 0 2 3\nCELL_TYPES 3\n5 42 5\n"))
    assert cells_of(parsed, "polyhedron") == [[0, 3, 1, 2]]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("numbers", "match"),
    [
        ("", "cell 0 .* is a polyhedron without faces"),
        ("0", "line 8: a polyhedron of 0 faces in a list of 1 numbers"),
        ("-1 3 0 1 2", "line 8: a polyhedron of -1 faces in a list of 5 numbers"),
        ("99999999999 3 0 1 2", "line 8: a polyhedron of 99999999999 faces"),
        ("2 3 0 1 2", "line 8: a polyhedron of 2 faces does not fill its list of 5 numbers"),
        ("1 3 0 1 2 3", "line 8: a polyhedron of 1 face does not fill"),
        ("2 3 0 1 2 3 0 1", "line 8: a polyhedron of 2 faces does not fill"),
        ("2 3 0 1 2 -3 0 1 2", "line 8: a polyhedron of 2 faces does not fill"),
        ("2 3 0 1 2 3 0 1 9", "line 8: a cell names the node 9"),
        ("2 3 0 1 -2 3 0 1 2", "line 8: a cell names the node -2"),
        ("2 3 0 1 2 3 0 1 2", "cell 0 .* has only 3 nodes"),
    ],
)
def test_faces_that_do_not_fill_a_polyhedron_are_refused(numbers: str, match: str) -> None:
    count = len(numbers.split())
    whole = "17 4 3 0 3 1 3 3 0 2 3 0 1 2 3 1 3 2"
    cells = f"CELLS 3 {count + 23}\n{count} {numbers}\n3 0 1 2\n{whole}\nCELL_TYPES 3\n42 5 42\n"
    refused(vtk_format, mesh_with(cells), match)
    behind = f"CELLS 2 {count + 5}\n{count} {numbers}\n3 0 1 4\nCELL_TYPES 2\n42 5\n"
    refused(vtk_format, mesh_with(behind), "|".join([match, "line 9: a cell names the node 4"]))


def test_types_that_alternate_make_few_blocks() -> None:
    count = 5000
    cells = "3 0 1 2\n4 0 1 2 3\n" * count
    text = f"CELLS {2 * count} {9 * count}\n{cells}CELL_TYPES {2 * count}\n{'5 9 ' * count}\n"
    ids = " ".join(map(str, range(2 * count)))
    parsed = read(vtk_format, mesh_with(text, f"CELL_DATA {2 * count}\nSCALARS id int\nLOOKUP_TABLE d\n{ids}\n"))
    assert [(b.kind, len(b.nodes)) for b in parsed.cells] == [("triangle", count), ("quad", count)]
    assert parsed.cell_data["id"][0].tolist() == list(range(0, 2 * count, 2))
    assert parsed.cell_data["id"][1].tolist() == list(range(1, 2 * count, 2))


@pytest.mark.parametrize(
    ("names", "values", "expected"),
    [
        (["material"], [[3, 5]], [3, 5]),
        (["mat_id", "Region"], [[3, 3], [1, 2]], [1, 2]),
        (["partIds"], [[0.5, 0.25]], [2, 1]),
        (["zone"], [[2.0, 7.0]], [2, 7]),
        (["temperature"], [[3, 5]], [0, 0]),
        (["gmsh:physical"], [[-1, 5]], [-1, 5]),
        (["materials_of_cell"], [[3, 5]], [0, 0]),
    ],
)
def test_regions_follow_from_the_names_of_fields(
    names: list[str], values: list[list[float]], expected: list[int]
) -> None:
    kind = "double" if any(isinstance(v, float) for row in values for v in row) else "int"
    fields = "".join(f"{n} 1 2 {kind}\n{' '.join(map(str, row))}\n" for n, row in zip(names, values, strict=True))
    more = f"CELL_DATA 2\nFIELD FieldData {len(names)}\n{fields}"
    parsed = read(vtk_format, mesh_with("CELLS 2 8\n3 0 1 2 3 0 2 3\nCELL_TYPES 2\n5 5\n", more))
    assert regions_of(parsed, "triangle") == expected


ONE_POINT = (HEAD.format("5.1", "BINARY") + "POINTS 1 float\n").encode() + bytes(12)
CELLS = "CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5 5\n"


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "line 1: not a legacy VTK file"),
        (b"solid x\n", "line 1: not a legacy VTK file"),
        (PLAIN.replace("UNSTRUCTURED", "STRUCTURED").encode(), "line 4: a DATASET of type 'STRUCTURED_GRID' is not"),
        (PLAIN.replace("UNSTRUCTURED", "RECTILINEAR").encode(), "line 4: a DATASET of type 'RECTILINEAR_GRID' is not"),
        (mesh_with(""), "CELLS and CELL_TYPES missing"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 3\n"), "CELL_TYPES missing"),
        (mesh_with("CELLS 2 9\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5 5\n"), "line 10: an integer was exp"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n2 0 2 3\nCELL_TYPES 2\n5 5\n"), "line 9: the 2 lists of CELLS end before"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n5 0 2 3\nCELL_TYPES 2\n5 5\n"), "line 9: list 1 of CELLS goes beyond"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 4\nCELL_TYPES 2\n5 5\n"), "line 9: a cell names the node 4"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 -3\nCELL_TYPES 2\n5 5\n"), "line 9: a cell names the node -3"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5 9\n"), "cell 1 .* is a quad with 3 nodes"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n6 5\n"), "triangle strips are not supported"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5 69\n"), "VTK type 69 are not supported"),
        (mesh_with("CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 3\n5 5 5\n"), "there are 2 CELLS, but 3 CELL_TYPES"),
        (mesh_with("CELLS 2 0\n\nCELL_TYPES 2\n5 5\n"), "list 0 of CELLS goes beyond the 0 numbers"),
        (mesh_with(CELLS, "POINT_DATA 3\n"), "line 12: POINT_DATA has 3 rows instead of 4"),
        (mesh_with(CELLS, "CELL_DATA 2\nSCALARS a string\nLOOKUP_TABLE d\n1 2\n"), "unknown type of numbers 'string'"),
        (mesh_with(CELLS, "CELL_DATA 2\nSCALARS a int\n1 2\n"), "line 14: expected LOOKUP_TABLE"),
        (mesh_with(CELLS, "CELL_DATA 2\nSCALARS a int\nLOOKUP_TABLE d\n1\n"), "expected 1 more number"),
        (mesh_with(CELLS, "CELL_DATA 2\nFIELD f 1\nx 1 3 int\n1 2 3\n"), "the array 'x' has 3 rows instead of 2"),
        (mesh_with(CELLS, "WHATEVER 2\n"), "line 12: unknown keyword 'WHATEVER'"),
        (mesh_with(CELLS, CELLS), "line 12: CELLS is given twice"),
        (mesh_with("CELLS 0 0\nCELL_TYPES 0\n"), "no cells"),
        (PLAIN.replace("double", "int").encode(), "line 5: POINTS of type 'int' are not supported"),
        (PLAIN.replace("0.5 0.5", "nan 0.5").encode(), "line 7: a number was expected, found 'nan'"),
        (PLAIN.replace("double", "float").replace("0.5 0.5", "1e39 0").encode(), "line 7: .* too large for the"),
        (PLAIN.replace("POINTS 5", "POINTS 999999999999").encode(), "expected .* more numbers"),
        (PLAIN.replace("CELLS 4 16", "CELLS 4 999999999999").encode(), "expected .* more numbers"),
        (PLAIN.replace("CELLS 4", "CELLS 999999999999").encode(), "list 4 of CELLS goes beyond"),
        ((HEAD.format("3.0", "BINARY") + "POINTS 999999999999 float\n").encode() + bytes(99), "byte .*expected"),
        (ONE_POINT + b"\nCELLS 1 99999999999999\nOFFSETS vtktypeint64\n" + bytes(8), "byte .*expected CONN"),
        (ONE_POINT + b"\nCELLS 1 9999999999\nOFFSETS int\n" + bytes(4) + b"\nCONNECTIVITY int\n", "byte .*expected"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_words(data: bytes, match: str) -> None:
    refused(vtk_format, data, match)


@pytest.mark.parametrize("word", [f"vtktype{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)])
def test_types_of_numbers_as_meshio_calls_them(word: str) -> None:
    field = f"CELL_DATA 2\nFIELD FieldData 1\nmaterial 1 2 {word}\n1 2\n"
    assert regions_of(read(vtk_format, mesh_with(CELLS, field)), "triangle") == [1, 2]


def test_triangle_strips_of_polydata_are_refused() -> None:
    text = mesh_with("TRIANGLE_STRIPS 1 5\n4 0 1 2 3\n").replace(b"UNSTRUCTURED_GRID", b"POLYDATA")
    refused(vtk_format, text, "line 7: TRIANGLE_STRIPS are not supported")


@given(st.data())
@settings(max_examples=150)
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    which = data.draw(st.integers(0, 4))
    original = (_ORIGINALS or _fill_originals())[which]
    read_or_refuse(vtk_format, {".vtk": data.draw(damaged(original))})


_ORIGINALS: list[bytes] = []


def _fill_originals() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        _ORIGINALS.extend(data for _, data in legacy_variants(grid_of(mixed_mesh(2)), Path(folder)))
        _ORIGINALS.append(PLAIN.encode())
    return _ORIGINALS


def test_conversion_keeps_cells_regions_and_data() -> None:
    for mesh in (mixed_mesh(), triangle_grid(3), triangle_grid(3, 3)):
        back, lost = check_conversion(vtk_format, mesh)
        assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in back.cells] == [
            (b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells
        ]
        assert np.array_equal(back.points[:, : mesh.points.shape[1]], mesh.points)
        assert set(mesh.point_data) == set(back.point_data)
        assert bool(lost) == bool(mesh.region_names)
    assert "'bottom wall' (1)" in lost[0]


def test_cells_that_vtk_does_not_have_are_refused() -> None:
    mesh = Mesh(np.random.default_rng(0).random((10, 3)), (CellBlock("triangle10", np.arange(10)[None], np.zeros(1)),))
    with pytest.raises(FormatError, match="cannot hold cells of type 'triangle10'"):
        vtk_format.write(mesh)


@pytest.mark.parametrize(
    ("file", "nodes", "cells", "regions"),
    [
        ("helmholtz_apartment.vtk", 401, [("triangle", 752)], {1: 190, 2: 524, 3: 38}),
        ("square-disc-p2.vtk", 356, [("triangle6", 154)], {1: 154}),
        ("square_quad_10_rand.vtk", 121, [("quad", 100)], {0: 100}),
        ("tangled_quad.vtk", 36, [("quad", 25)], {0: 25}),
        ("sph.vtk", 369, [("triangle", 734)], {0: 734}),
    ],
)
def test_real_files(file: str, nodes: int, cells: list[tuple[str, int]], regions: dict[int, int]) -> None:
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("GMSNET_MESHES does not name the folder of real meshes")
    data = (Path(folder) / file).read_bytes()
    parsed = read(vtk_format, data)
    assert len(parsed.points) == nodes
    assert [(b.kind, len(b.nodes)) for b in parsed.cells] == cells
    assert (
        dict(zip(*map(np.ndarray.tolist, np.unique(parsed.cells[0].regions, return_counts=True)), strict=True))
        == regions
    )
    check_splice(vtk_format, data)
    if "fixed" in parsed.point_data:
        assert int((parsed.point_data["fixed"] != 0).sum()) == {121: 40, 36: 20}[nodes]


def test_a_nan_that_signals_is_data_like_any_other() -> None:
    text = HEAD.format("3.0", "BINARY") + "POINTS 1 float\n"
    data = text.encode() + bytes(12) + b"\nCELLS 1 4\n" + np.array([3, 0, 0, 0], ">i4").tobytes() + b"\nCELL_TYPES 1\n"
    data += np.array([5], ">i4").tobytes() + b"\nCELL_DATA 1\nSCALARS a float\nLOOKUP_TABLE d\n\x7f\x80\0\1"
    assert np.isnan(read(vtk_format, data).cell_data["a"][0]).all()
