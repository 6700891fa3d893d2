"""Fluent meshes: cells are put together from faces; the splice; damage; the suffix that they share with Gmsh."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
from gmsnet.errors import InputError
from gmsnet.io import fluent

# Two triangles and a quadrilateral; the cells of the second zone are the third.
PLAIN = b"""(0 "made (by) hand")
(2 2)
(10 (0 1 6 0))
(12 (0 1 3 0))
(13 (0 1 8 0))
(10 (1 1 6 1 2)(
0.0 0.0
1.0 0.0
1.0 1.0
0.0 1.0
2.0 0.0
2.0 1.0))
(12 (2 1 2 1 1))
(12 (3 3 3 1 3))
(13 (4 1 2 2 2)(
1 3 1 2
2 3 3 1
))
(13 (5 3 8 3 2)(
1 2 1 0
3 4 2 0
4 1 2 0
2 5 3 0
5 6 3 0
6 3 3 0
))
(45 (3 fluid box)())
(45 (5 wall far field)())
(38 (some unknown section))
"""
PLAIN = PLAIN.replace(b"1 3 1 2", b"1 3 2 1").replace(b"2 3 3 1", b"2 3 1 3")
# A hexahedron and a pyramid on its top, faces of mixed sizes.
VOLUME = b"""(2 3)
(10 (0 1 9 0 3))
(10 (1 1 9 1 3)(
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
0.5 0.5 2
))
(12 (0 1 2 0))
(12 (2 1 2 1 0)(4 5))
(13 (0 1 a 0))
(13 (3 1 1 2 4)(
5 6 7 8 2 1
))
(13 (4 2 6 3 4)(
1 2 3 4 1 0
1 5 6 2 1 0
2 6 7 3 1 0
3 7 8 4 1 0
4 8 5 1 1 0
))
(13 (5 7 a 3 0)(
3 5 9 6 2 0
3 6 9 7 2 0
3 7 9 8 2 0
3 8 9 5 2 0
))
(39 (5 wall roof 1)())
"""


def in_binary(data: bytes, kind: str = "f8", order: str = "<") -> bytes:
    """The same file with its nodes, cells and faces as binary sections."""

    def section(found: re.Match[bytes]) -> bytes:
        key, head, words = int(found[1]), found[2].split(), found[3].split()
        if key == 10:
            numbers = np.array([float(word) for word in words], f"{order}{kind}")
        else:
            numbers = np.array([int(word, 16) for word in words], f"{order}i4")
        key += 2000 if kind == "f4" else 3000
        body = b"(%d (%s)(%s)" % (key, b" ".join(head), numbers.tobytes())
        return body + b"\nEnd of Binary Section   %d)" % key

    machine = {"<": b"(4 (60 0 0 1 2 4 4 4 8 4 4))\n", ">": b"(4 (0 60 0 1 2 4 4 4 8 4 4))\n"}[order]
    found = re.sub(rb"\((10|12|13) \(([1-9a-f][^()]*)\)\(([^()]+)\)\)", section, data)
    return found.replace(b"(10 (0 ", machine + b"(10 (0 ", 1)


FORMS = {
    f"{name} {kind}{order}": in_binary(data, kind, order)
    for name, data in (("plane", PLAIN), ("volume", VOLUME))
    for kind in ("f4", "f8")
    for order in "<>"
}


@pytest.mark.parametrize("key", FORMS)
def test_binary_sections(key: str) -> None:
    data, text = FORMS[key], read(fluent, PLAIN if key.startswith("plane") else VOLUME)
    assert re.search(rb"End of Binary Section +[23]013\)", data)
    parsed = read(fluent, data)
    assert parsed.points.tolist() == text.points.tolist()
    assert parsed.single == ("f4" in key)
    assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells] == [
        (b.kind, b.nodes.tolist(), b.regions.tolist()) for b in text.cells
    ]
    assert dict(parsed.region_names) == dict(text.region_names)
    assert len(check_splice(fluent, data)) == len(data)


def test_zones_of_nodes_in_any_order() -> None:
    """Of two binary zones the second stands first; other binary sections are passed over."""
    head, _, rest = PLAIN.partition(b"(10 (1 1 6 1 2)(")
    listed, _, rest = rest.partition(b"))")
    lines = listed.split(b"\n")[1:]
    zones = b"(10 (8 5 6 1 2)(%s))\n(10 (7 1 4 1 2)(%s))" % (b"\n".join(lines[4:]), b"\n".join(lines[:4]))
    data = in_binary(head + zones + rest)
    data += b"(3500 (1 2)(\x00)(\n((End of Binary Section   3500)\n"
    parsed = read(fluent, data)
    assert parsed.points.tolist() == read(fluent, PLAIN).points.tolist()
    assert "sections of the number 3500" in parsed.unread
    check_splice(fluent, data)


def test_a_plain_file() -> None:
    parsed = read(fluent, PLAIN)
    assert sorted(map(sorted, cells_of(parsed, "triangle"))) == [[0, 1, 2], [0, 2, 3]]
    assert sorted(map(sorted, cells_of(parsed, "quad"))) == [[1, 2, 4, 5]]
    assert regions_of(parsed, "triangle") == [2, 2]
    assert regions_of(parsed, "quad") == [3]
    assert regions_of(parsed, "line") == [5] * 6
    assert dict(parsed.region_names) == {(1, 5): "far", (2, 3): "box"}
    assert "sections of the number 38" in parsed.unread
    check_splice(fluent, PLAIN)
    signs = {np.sign(np.linalg.det(parsed.points[row[1:3]] - parsed.points[row[0]]))
             for kind in ("triangle", "quad") for row in cells_of(parsed, kind)}  # fmt: skip
    assert len(signs) == 1


def test_a_dimension_of_too_many_digits_is_none() -> None:
    assert len(read(fluent, VOLUME.replace(b"(2 3)", b"(2 " + 5000 * b"9" + b")")).points) == 9


def test_volumes() -> None:
    parsed = read(fluent, VOLUME)
    assert sorted(cells_of(parsed, "hexahedron")[0]) == list(range(8))
    assert sorted(cells_of(parsed, "pyramid")[0][:4]) == [4, 5, 6, 7]
    assert cells_of(parsed, "pyramid")[0][4] == 8
    assert len(cells_of(parsed, "quad")) == 5
    assert len(cells_of(parsed, "triangle")) == 4
    assert dict(parsed.region_names) == {(2, 5): "roof"}
    check_splice(fluent, VOLUME)


def test_errors() -> None:
    refused(fluent, PLAIN.replace(b"(10 (1", b"(3010 (1"), "line 6: the binary section 3010 is not closed")
    binary = FORMS["plane f8<"]
    refused(fluent, binary.replace(b"(3010 (1 1 6", b"(3010 (1 1 5"), "line 7: 10 numbers do not fill the binary")
    refused(fluent, binary.replace(b"(3010 (1 1 6", b"(3010 (1 1 ffffffffffffff"), "numbers do not fill the binary")
    refused(
        fluent, binary.replace(b"(3010 (1 1 6 1 2", b"(3010 (1 1 4 1 3"), "12 coordinates do not fit the nodes 1 to 4"
    )
    refused(fluent, binary.replace(np.float64(2).tobytes(), np.float64(np.nan).tobytes()), "not a finite number")
    mixed = FORMS["volume f8<"]
    start = mixed.find(b"(3013 (5") + len(b"(3013 (5 7 a 3 0)(")
    refused(fluent, mixed[:start] + b"\x7f" + mixed[start + 1 :], "face 0 .* has a wrong number of nodes")
    added = PLAIN.replace(b"(45 (3", b"(10 (9 7 7 1 2)(9 9))(45 (3")
    refused(fluent, in_binary(PLAIN) + added[added.find(b"(10 (9") : added.find(b"(45")], "write them in one form")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b"5 7 3 0\n"), "a face names a node that is none of 1 to 6")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b""), "23|do not make 6 faces")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b"5 2 3 0\n"), "the faces of cell 3 do not run around it")
    refused(fluent, PLAIN.replace(b"2.0 1.0))", b"2.0))"), "line 6: 11 coordinates do not fit the nodes 1 to 6")
    refused(fluent, PLAIN[:300], "is the file cut off|is the file damaged")


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("kind", ["triangle", "tetra"])
def test_the_form_of_meshio_is_named(kind: str, binary: bool, tmp_path: Path) -> None:
    """What meshio makes of the suffix, where it is not told the format."""
    meshio = pytest.importorskip("meshio")
    size, dimension = (3, 2) if kind == "triangle" else (4, 3)
    points = np.random.default_rng(1).random((600, dimension))
    mesh = meshio.Mesh(points, [(kind, np.arange(600).reshape(-1, size))])
    meshio.write(tmp_path / "a.msh", mesh, **({} if binary else {"file_format": "ansys", "binary": False}))
    with pytest.raises(InputError, match=r'a.msh: meshio wrote this file in a form of its own, .*"gmsh22", or as .vtu'):
        gmsnet.read(tmp_path / "a.msh")
    meshio.write(tmp_path / "b.msh", mesh, file_format="gmsh22")
    assert len(gmsnet.read(tmp_path / "b.msh").points) == 600
    assert read(fluent, b'(1 "meshio 9.9")' + PLAIN).points.shape == (6, 2)


@given(data=damaged(PLAIN))
def test_damage(data: bytes) -> None:
    read_or_refuse(fluent, {".msh": data})


@given(data=damaged(FORMS["volume f4<"]))
def test_damage_of_binary_sections(data: bytes) -> None:
    read_or_refuse(fluent, {".msh": data})


@given(data=damaged(VOLUME))
def test_damage_of_volumes(data: bytes) -> None:
    read_or_refuse(fluent, {".msh": data})


def test_the_contents_tell_it_from_gmsh(tmp_path: Path) -> None:
    for name, data in (("a.msh", VOLUME), ("a.cas", VOLUME), ("b.msh", FORMS["volume f8<"])):
        path = tmp_path / name
        path.write_bytes(data)
        mesh = gmsnet.read(path)
        new = mesh.points + 0.25
        assert gmsnet.write(mesh.with_points(new), path) == []
        assert path.read_bytes().startswith(b"(2 3)")
        assert gmsnet.read(path).points.tolist() == new.tolist()


@pytest.mark.parametrize("kind", ["", "f4", "f8"])
@pytest.mark.parametrize("name", ["PLAIN", "VOLUME"])
def test_vtk_reads_the_same(name: str, kind: str, tmp_path: Path) -> None:
    """The same cells from the same faces, and the points that were written. It wants a name for every zone."""
    geometry = pytest.importorskip("vtkmodules.vtkIOGeometry")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = {"PLAIN": PLAIN.replace(b"(38 (some unknown section))\n", b""), "VOLUME": VOLUME.replace(b"(39", b"(45")}[
        name
    ]
    for zone in range(2, 6):
        data += b"" if b"(45 (%d " % zone in data else b"(45 (%d fluid zone%d)())\n" % (zone, zone)
    path, out = tmp_path / "a.cas", tmp_path / "b.cas"
    path.write_bytes(in_binary(data, kind) if kind else data)
    mesh = gmsnet.read(path)
    new = mesh.points * 1.5
    gmsnet.write(mesh.with_points(new), out)
    reader = geometry.vtkFLUENTReader()
    reader.SetFileName(str(out))
    reader.Update()
    points, cells = None, set()
    for k in range(reader.GetOutput().GetNumberOfBlocks()):
        grid = reader.GetOutput().GetBlock(k)
        points = vtk_to_numpy(grid.GetPoints().GetData())
        for cell in map(grid.GetCell, range(grid.GetNumberOfCells())):
            cells.add(frozenset(cell.GetPointId(j) for j in range(cell.GetNumberOfPoints())))
    assert points is not None
    assert points[:, : new.shape[1]].tolist() == new.tolist()
    dimension = 2 if name == "PLAIN" else 3
    ours = {frozenset(row) for block in mesh.cells if block.dimension == dimension for row in block.nodes.tolist()}
    assert ours <= cells
