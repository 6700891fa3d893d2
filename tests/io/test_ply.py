"""PLY: text and both binary orders, lists of any length, damage, false counts, conversion."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import pyvista
import vtk
from hypothesis import given, settings
from hypothesis import strategies as st
from support.contracts import (
    check_all_cuts_refused,
    check_conversion,
    check_splice,
    contents,
    moved_points,
    read,
    refused,
)
from support.damage import ENDS, GAPS, NUMBERS, cells_of, damaged, facts, read_or_refuse, regions_of, triangle_grid
from support.vtk_variants import mixed_mesh, points_by_vtk

from gmsnet.errors import FormatError
from gmsnet.io import ply
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
CODES = {"uchar": "B", "int": "i", "float": "f", "double": "d", "short": "h", "uint8": "B", "int32": "i"}
HEAD = "ply\nformat {} 1.0\ncomment made by hand\nobj_info x 1\n"
ELEMENTS = """element vertex 6
property uchar red
property {0} y
property {0} x
property short mark
property {0} z
element material 2
property list uchar float colour
property int id
element face {1}
property int material
property list uint8 float texture
property list uchar int vertex_indices
property float quality
element edge 2
property int vertex1
property int vertex2
property uchar region
end_header
"""
FACES = [[0, 1, 4], [1, 2, 3, 4], [0, 1, 2, 3, 5], [4, 3, 5], [5, 0, 1]]


def ply_file(form: str = "ascii", kind: str = "double", faces: list[list[int]] = FACES) -> bytes:
    """A mesh with all that PLY has: properties in odd order, lists of different lengths, an element of another kind."""
    order, text = ORDERS[form], HEAD.format(form) + ELEMENTS.format(kind, len(faces))
    rows: list[list[tuple[str, float]]] = []
    for k in range(6):
        rows.append([("uchar", k), (kind, k * 0.5), (kind, k * k * 0.25), ("short", -k), (kind, 2.5)])
    rows += [[("uchar", 2), ("float", 0.5), ("float", 1.5), ("int", 7)], [("uchar", 0), ("int", 8)]]
    for k, face in enumerate(faces):
        texture = [("float", 0.5)] * (k % 3)
        corners = [("int", node) for node in face]
        rows.append([("int", k % 2), ("uchar", len(texture)), *texture, ("uchar", len(face)), *corners, ("float", k)])
    rows += [[("int", 0), ("int", 1), ("uchar", 1)], [("int", 1), ("int", 2), ("uchar", 0)]]
    if not order:
        return (text + "".join(" ".join(repr(value) for _, value in row) + "\n" for row in rows)).encode()
    return text.encode() + b"".join(struct.pack(order + CODES[t], value) for row in rows for t, value in row)


@pytest.mark.parametrize("kind", ["float", "double"])
def test_text_and_binary_say_the_same(kind: str) -> None:
    found = [facts(read(ply, ply_file(form, kind))) for form in ORDERS]
    assert found[0] == found[1] == found[2]
    parsed = read(ply, ply_file(kind=kind))
    assert parsed.single == (kind == "float")
    assert parsed.points.tolist() == [[k * k * 0.25, k * 0.5, 2.5] for k in range(6)]
    assert cells_of(parsed, "triangle") == [[0, 1, 4], [4, 3, 5], [5, 0, 1]]
    assert cells_of(parsed, "quad") == [[1, 2, 3, 4]]
    assert cells_of(parsed, "polygon") == [[0, 1, 2, 3, 5]]
    assert cells_of(parsed, "line") == [[0, 1], [1, 2]]
    assert set(parsed.point_data) == {"red", "mark"}
    assert parsed.point_data["mark"].tolist() == [0, -1, -2, -3, -4, -5]
    assert [a.tolist() for a in parsed.cell_data["quality"]] == [[0], [1], [2], [3, 4], [0, 0]]
    # two properties name regions, so that each combination is one
    assert regions_of(parsed, "triangle") == [1, 3, 1]
    assert regions_of(parsed, "line") == [2, 1]


@pytest.mark.parametrize("form", ORDERS)
@pytest.mark.parametrize("kind", ["float", "double"])
def test_only_coordinates_change(form: str, kind: str) -> None:
    check_splice(ply, ply_file(form, kind))
    check_splice(ply, ply_file(form, kind, [[0, 1, 4]] * 5))


@pytest.mark.parametrize("form", ORDERS)
def test_a_file_cut_anywhere_is_refused(form: str) -> None:
    for faces in (FACES, [[0, 1, 4]] * 5):
        data = ply_file(form, "double", faces)
        check_all_cuts_refused(ply, data, None if form == "ascii" else len(data), most=1500)


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_files_of_vtk(kind: int, tmp_path: Path) -> None:
    mesh = triangle_grid(4, 3)
    faces = np.pad(mesh.cells[0].nodes, ((0, 0), (1, 0)), constant_values=3).ravel()
    writer = vtk.vtkPLYWriter()
    writer.SetFileName(str(tmp_path / "in.ply"))
    writer.SetInputData(pyvista.PolyData(mesh.points, faces=faces))
    if kind == 0:
        writer.SetFileTypeToASCII()
    else:
        writer.SetFileTypeToBinary()
        writer.SetDataByteOrder(kind - 1)
    writer.Write()
    data = (tmp_path / "in.ply").read_bytes()
    parsed = read(ply, data)
    assert parsed.single
    assert cells_of(parsed, "triangle") == mesh.cells[0].nodes.tolist()
    points, _ = points_by_vtk(vtk.vtkPLYReader(), check_splice(ply, data), tmp_path / "out.ply")
    assert np.array_equal(points, moved_points(parsed).astype(np.float32))


def test_many_faces_of_different_lengths() -> None:
    count = 3000
    faces = [[0, 1, 4], [1, 2, 3, 4]] * count
    for form in ORDERS:
        parsed = read(ply, ply_file(form, "double", faces))
        assert [(b.kind, len(b.nodes)) for b in parsed.cells] == [("triangle", count), ("quad", count), ("line", 2)]


@given(st.data())
@settings(max_examples=60)
def test_any_spelling_of_the_numbers(data: st.DataObject) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=12, max_size=12))
    gap, end = data.draw(GAPS), data.draw(ENDS)
    lines = ["ply", "comment element face 9", "format ascii 1.0", "element vertex 4", "property float32 x"]
    lines += ["property float32 y", "property float32 z", "element face 2", "property list uint8 int32 vertex_index"]
    lines += [
        "end_header",
        *(gap + gap.join(numbers[k : k + 3]) for k in range(0, 12, 3)),
        f"3{gap}0 1 2 ",
        "",
        "3 0 2 3",
    ]
    raw = end.join([*lines, ""]).encode()
    parsed = read(ply, raw)
    assert parsed.points.ravel().tolist() == [float(n) for n in numbers]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [0, 2, 3]]
    slots = parsed.slots
    assert [raw[a:b].decode() for a, b in zip(slots.starts.ravel(), slots.ends.ravel(), strict=True)] == numbers  # type: ignore[attr-defined]


TEXT = ply_file()
LIST_OF_X = b"""ply
format ascii 1.0
element vertex 3
property list uchar double x
property double y
property double z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
2 0 0 0 0
1 0 0 0
3 0 1 2
"""


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "line 1: not a PLY file"),
        (b"play\n", "line 1: not a PLY file"),
        (b"ply\nformat ascii 1.0\n", "line 3: the header has no 'end_header'"),
        (b"ply\nend_header\n", "the header has no 'format'"),
        (TEXT.replace(b"ascii", b"utf8"), "line 2: not a line of a PLY header"),
        (TEXT.replace(b"short mark", b"half mark"), "line 9: not a line of a PLY header.*half"),
        (TEXT.replace(b"uint8 float texture", b"float float texture"), "not a line of a PLY header"),
        (TEXT.replace(b"short mark", b"short red"), "line 9: the property 'red' is given twice"),
        (TEXT.replace(b"element edge", b"element face"), "the element 'face' is given twice"),
        (TEXT.replace(b"element face", b"element tristrips"), "triangle strips are not supported"),
        (TEXT.replace(b"double z", b"double w"), "line 5: vertices must have the properties x, y and z"),
        (TEXT.replace(b"double z", b"float z"), "line 5: vertices must have the properties x, y and z"),
        (TEXT.replace(b"element edge 2", b"element " + b"e" * 9999 + b" 3"), "3 rows of the element 'e{24}', found 2"),
        (LIST_OF_X, "line 3: vertices must have .*, and no lists"),
        (TEXT.replace(b"vertex_indices", b"corners"), "faces must have one list"),
        (TEXT.replace(b"int vertex2", b"float vertex2"), "edges must have"),
        (TEXT.replace(b"element vertex 6", b"element vertex 7"), "line 30: a row of the element 'vertex' is cut off"),
        (TEXT.replace(b"element edge 2", b"element edge 3"), "expected 3 rows of the element 'edge', found 2"),
        (TEXT.replace(b"element edge 2", b"element edge 1"), "line 38: more rows than the header announces"),
        (TEXT.replace(b"element edge 2", b"element edge 999999999999"), "expected 999999999999 rows"),
        (TEXT.replace(b"3 0 1 4", b"3 0 1 6"), "line 32: a cell names the node 6"),
        (TEXT.replace(b"3 0 1 4", b"2 0 1"), "face 0 .* has 2 corners"),
        (TEXT.replace(b"3 0 1 4", b"9 0 1 4"), "line 32: a row of the element 'face' is cut off"),
        (TEXT.replace(b"3 0 1 4", b"-3 0 1 4"), "line 32: a row of the element 'face' is cut off"),
        (TEXT.replace(b"3 0 1 4", b"3 0 1 4 7"), "line 32: more numbers than the properties"),
        (TEXT.replace(b"0.25 -1 2.5", b"nan -1 2.5"), "line 25: a number was expected, found 'nan'"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "the file has no cells"),
        (ply_file("binary_little_endian").replace(b"vertex 6", b"vertex 999999999999"), "do not fit into the rest"),
        (ply_file("binary_little_endian").replace(b"face 5", b"face 999999999999"), "do not fit into the rest"),
        (ply_file("binary_little_endian") + b"xy", "more bytes than the header announces"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_words(data: bytes, match: str) -> None:
    refused(ply, data, match)


def test_lists_that_lie_are_refused_without_memory() -> None:
    head = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
    head += b"".join(b"property float %s\n" % axis for axis in (b"x", b"y", b"z"))
    for kind, size in (("int", 4), ("uint", 4)):
        text = head + b"element face 1\nproperty list %s int vertex_indices\nend_header\n" % kind.encode()
        for count in (2**31 - 1, -1, 4):
            data = text + bytes(36) + (count % 2**32).to_bytes(size, "little") + bytes(12)
            refused(ply, data, "cut off|negative length")
    refused(
        ply, text + bytes.fromhex("0000c07f") * 9 + b"\3" + bytes(15), "byte .* a coordinate is not a finite number"
    )


@given(st.data())
@settings(max_examples=200)
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    form, faces = data.draw(st.sampled_from(sorted(ORDERS))), data.draw(st.sampled_from([FACES, [[0, 1, 2]] * 4]))
    read_or_refuse(ply, {".ply": data.draw(damaged(ply_file(form, "float", faces)))})


def test_conversion_keeps_faces_edges_and_regions() -> None:
    for mesh in (mixed_mesh(), triangle_grid(3), triangle_grid(3, 3)):
        back, lost = check_conversion(ply, mesh)
        assert np.array_equal(back.points[:, : mesh.points.shape[1]], mesh.points)
        for kind in ("triangle", "line", "quad"):
            assert cells_of(back, kind) == cells_of(mesh, kind)
            assert regions_of(back, kind) == regions_of(mesh, kind)
        assert len(lost) == (3 if mesh.point_data else 1)
    lost = ply.write(mixed_mesh()).lost
    assert ["vertex cells: 1" in lost[0], "'speed'" in lost[1], "'weights'" in lost[2]] == [True] * 3


@pytest.mark.parametrize("kind", ["triangle6", "tetra"])
def test_cells_that_are_no_faces_are_refused(kind: str) -> None:
    size = {"triangle6": 6, "tetra": 4}[kind]
    mesh = Mesh(np.random.default_rng(0).random((size, 3)), (CellBlock(kind, np.arange(size)[None], np.zeros(1)),))
    with pytest.raises(FormatError, match=f"cannot hold cells of type '{kind}'"):
        ply.write(mesh)


def test_vtk_reads_what_is_written(tmp_path: Path) -> None:
    mesh = triangle_grid(3)
    points, poly = points_by_vtk(vtk.vtkPLYReader(), contents(ply.write(mesh))[".ply"], tmp_path / "a.ply")
    assert np.array_equal(points[:, :2], mesh.points.astype(np.float32))
    assert poly.GetNumberOfPolys() == len(mesh.cells[0].nodes)


def test_a_mesh_of_vertices_alone_is_refused() -> None:
    with pytest.raises(FormatError, match="PLY holds faces and edges only"):
        ply.write(Mesh(np.zeros((1, 2)), (CellBlock("vertex", np.zeros((1, 1), int), np.zeros(1, int)),)))
