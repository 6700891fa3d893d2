"""VTU: every encoding that VTK writes, damage, false sizes, real files, conversion."""

from __future__ import annotations

import base64
import contextlib
import os
import re
import sys
import zlib
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
    moved_points,
    read,
    refused,
)
from support.damage import cells_of, damaged, facts, read_or_refuse, regions_of, triangle_grid
from support.vtk_variants import grid_of, mixed_mesh, points_by_vtk, polyhedral_grid, vtu_variants

from gmsnet.errors import FormatError, MissingExtraError
from gmsnet.io import gmsh, ply, stl, vtu
from gmsnet.io import vtk as vtk_format
from gmsnet.io.vtu_arrays import Encoding, decode
from gmsnet.io.vtu_compressors import COMPRESSORS
from gmsnet.io.vtu_xml import Document
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PLAIN = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="2">
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 1 1 0 <!-- 7 7 7 --> 0 1 0
</DataArray></Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 5</DataArray>
</Cells>
<CellData><DataArray type="Int32" Name="material" format="ascii">4 9</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>
"""


def variants(single: bool = False, n: int = 3) -> dict[str, bytes]:
    return dict(vtu_variants(grid_of(mixed_mesh(n), single)))


def test_a_plain_file() -> None:
    parsed = read(vtu, PLAIN.encode())
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [0, 2, 3]]
    assert regions_of(parsed, "triangle") == [4, 9]
    assert parsed.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    out = check_splice(vtu, PLAIN.encode())
    assert b"<!-- 7 7 7 -->" in out


def test_letters_behind_an_element_within_an_array() -> None:
    data = variants()["binary, header 32, order 1, compress True"]
    more = re.sub(rb"(<DataArray[^>]*format=\"binary\"[^>]*>)", rb"\1<InformationKey/>", data)
    assert more != data
    assert read(vtu, more).points.tolist() == read(vtu, data).points.tolist()


@pytest.mark.parametrize("single", [False, True])
def test_every_encoding_reads_the_same(single: bool) -> None:
    mesh = mixed_mesh()
    files = variants(single)
    assert len(files) == 32
    whole = {how: facts(read(vtu, data)) for how, data in files.items()}
    exact = mesh.points.astype(np.float32).astype(float) if single else mesh.points
    for how, found in whole.items():
        parsed = read(vtu, files[how])
        assert parsed.single == single
        assert found[1] == [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells], how
        assert np.array_equal(parsed.points.astype(np.float32), exact.astype(np.float32)), how
        if not how.startswith("ascii"):
            assert np.array_equal(parsed.points, exact), how
            assert np.array_equal(parsed.point_data["speed"], mesh.point_data["speed"]), how
            assert np.array_equal(parsed.cell_data["weights"][0], mesh.cell_data["weights"][0]), how


@pytest.mark.parametrize("single", [False, True])
def test_vtk_reads_moved_points_back(single: bool, tmp_path: Path) -> None:
    for how, data in variants(single).items():
        out = check_splice(vtu, data)
        new = moved_points(read(vtu, data))
        points, grid = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), out, tmp_path / "out.vtu")
        assert np.array_equal(points, new.astype(points.dtype)), how
        _, before = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), data, tmp_path / "in.vtu")
        for which in ("GetPointData", "GetCellData"):
            for k in range(2):
                was, now = (getattr(g, which)().GetArray(k) for g in (before, grid))
                assert np.array_equal(np.array(was), np.array(now)), how


@pytest.mark.parametrize("single", [False, True])
def test_polyhedra_are_cells_of_all_their_nodes(single: bool, tmp_path: Path) -> None:
    grid, mesh = polyhedral_grid(single)
    for how, data in vtu_variants(grid):
        assert b"face" in data
        parsed = read(vtu, data)
        found = [(block.kind, sorted(map(sorted, block.nodes.tolist()))) for block in parsed.cells]
        assert found == [(b.kind, sorted(map(sorted, b.nodes.tolist()))) for b in mesh.cells], how
        out = check_splice(vtu, data)
        points, again = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), out, tmp_path / "out.vtu")
        assert np.array_equal(points, moved_points(parsed).astype(points.dtype)), how
        assert [again.GetCell(k).GetNumberOfFaces() for k in (0, 11)] == [10, 10], how
    with pytest.raises(FormatError, match="VTU cannot be written with polyhedra"):
        vtu.write(mesh)


def test_faces_in_the_older_arrays_stay_as_they_are(tmp_path: Path) -> None:
    """Until VTK 9.4: the faces of all polyhedra in one array, and where each ends, -1 for other cells."""
    faces = "4 3 0 1 2 3 0 1 3 3 0 2 3 3 1 2 3"
    old = (
        f'<DataArray type="Int64" Name="faces" format="ascii">{faces}</DataArray>\n'
        '<DataArray type="Int64" Name="faceoffsets" format="ascii">-1 17</DataArray>'
    )
    text = PLAIN.replace("<!-- 7 7 7 --> 0 1 0", "0 1 1").replace("0 2 3<", "0 1 2 3<")
    data = text.replace("3 6<", "3 7<").replace("5 5<", "5 42<").replace("</Cells>", f"{old}</Cells>").encode()
    parsed = read(vtu, data)
    assert cells_of(parsed, "polyhedron") == [[0, 1, 2, 3]]
    out = check_splice(vtu, data)
    assert out[out.index(b"<Cells>") :] == data[data.index(b"<Cells>") :]
    _, grid = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), out, tmp_path / "out.vtu")
    assert grid.GetCell(1).GetNumberOfFaces() == 4


def test_only_the_points_and_the_offsets_behind_them_change() -> None:
    for how, data in variants().items():
        if "binary" in how or "raw, " in how or "base64" in how:
            out = check_splice(vtu, data, seed=3)
            strip = [re.sub(rb'offset="\d+"', b"", part.split(b"<AppendedData")[0]) for part in (data, out)]
            inline = [re.sub(rb"(?s)(<Points>.*?<DataArray[^>]*>).*?</DataArray>", rb"\1", part) for part in strip]
            assert inline[0] == inline[1], how


@pytest.mark.parametrize("single", [False, True])
def test_a_file_cut_anywhere_is_refused(single: bool) -> None:
    for data in variants(single, 2).values():
        check_all_cuts_refused(vtu, data, most=60)
    check_all_cuts_refused(vtu, PLAIN.encode(), most=2000)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (PLAIN, "", "line 1: not an XML file"),
        ("</Piece>", "", "the XML is not well formed: mismatched tag"),
        ("<VTKFile", '<!DOCTYPE x [<!ENTITY a "b">]><VTKFile', "line 2: a DOCTYPE is not allowed"),
        ("0 0 0 1", "&a; 0 0 1", "not well formed: undefined entity"),
        ('type="UnstructuredGrid"', 'type="PolyData"', "line 2: a VTKFile of type 'PolyData' is not supported"),
        ('type="UnstructuredGrid"', 'type="PUnstructuredGrid"', "line 2: a VTKFile of type 'PUnstructuredGrid' is"),
        ("</Piece>", '</Piece><Piece NumberOfPoints="0"/>', "several pieces"),
        ('byte_order="LittleEndian"', 'compressor="vtkBZip2"', "'vtkBZip2' is not supported: write .* vtkLZ4DataCompr"),
        ('byte_order="LittleEndian"', 'byte_order="Middle"', "unknown byte_order 'Middle'"),
        ('Points="4"', 'Points="5"', "line 6: expected 3 more numbers"),
        ('Points="4"', 'Points="3"', "line 5: more than the expected 9 numbers"),
        ('Points="4"', 'Points="999999999999"', "expected .* more numbers"),
        ('Points="4"', 'Points="-4"', "no NumberOfPoints, or one that is no count: '-4'"),
        ('Cells="2"', 'Cells="3"', "expected 1 more number"),
        ('Cells="2"', 'Cells="0"', "more than the expected 0 numbers"),
        ("5 5", "5 42", "cell 1 .* has only 3 nodes"),
        ("5 5", "5 9", "cell 1 .* is a quad with 3 nodes instead of 4"),
        ("3 6", "6 3", "the array 'offsets': the offsets do not rise"),
        ("3 6", "3 7", "expected 1 more number"),
        ("0 2 3<", "0 2 4<", "line 8: a cell names the node 4"),
        ("1 1 0", "1 x 0", "line 5: a number was expected, found 'x'"),
        ("1 1 0", "1 nan 0", "line 5: a number was expected, found 'nan'"),
        ('type="Float64"', 'type="Int32"', "points must be three Float32 or Float64 each"),
        ('Name="offsets"', 'Name="offset"', "the array 'offsets' is missing"),
        ('format="ascii">0 1 2', 'format="appended" offset="0">0 1 2', "line 8: .*'connectivity': .* cannot be f"),
        ('format="ascii">0 1 2', 'format="binary">0 1 2', "line 8: the array 'connectivity': it "),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_words(old: str, new: str, match: str) -> None:
    assert old in PLAIN
    refused(vtu, PLAIN.replace(old, new, 1).encode(), match)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32"])
def test_other_encodings_of_text_are_refused(encoding: str) -> None:
    refused(vtu, PLAIN.replace('version="1.0"?', f'version="1.0" encoding="{encoding}"?').encode(encoding), "XML")


def _with_points(body: bytes, count: int) -> bytes:
    text = PLAIN.replace('Points="4"', f'Points="{count}"').replace(
        '"LittleEndian"', '"LittleEndian" compressor="vtkZLibDataCompressor"'
    )
    first, rest = text.split('format="ascii">\n', 1)
    return first.encode() + b'format="binary">' + body + rest[rest.index("</DataArray>") :].encode()


def _header(*numbers: int) -> bytes:
    return base64.b64encode(np.array(numbers, dtype="<u4").tobytes())


def test_sizes_that_lie_are_refused_without_memory() -> None:
    bomb = zlib.compress(bytes(50_000_000), 9)
    points = 50_000_000 // 24 + 1
    refused(
        vtu, _with_points(_header(1, 96, 0, len(bomb)) + base64.b64encode(bomb), 4), "does not decompress to the 96"
    )
    refused(
        vtu,
        _with_points(_header(1, 24 * 10**6, 0, 99) + base64.b64encode(bytes(99)), 10**6),
        "cannot be in a file|cannot come",
    )
    refused(vtu, _with_points(_header(4 * 10**9, 24, 0, 99), 4), "it has 96000000000 bytes instead of 96")
    refused(vtu, _with_points(_header(4, 24, 0, 9, 9, 9, 4 * 10**9), 4), "cannot come from|cut off")
    refused(vtu, _with_points(_header(1, 96, 0, 30) + base64.b64encode(bytes(30)), 4), "block 0 cannot be decompressed")
    refused(vtu, _with_points(b"AAAA", 4), "cut off")
    refused(vtu, _with_points(b"!!!!" * 20, 4), "not in base64")
    refused(vtu, _with_points(_header(1, 96, 0, 30), points), "it has 96 bytes|write the file without compression")


APPENDED = PLAIN.replace(
    """format="ascii">
0 0 0 1 0 0 1 1 0 <!-- 7 7 7 --> 0 1 0
""",
    "OFFSET>",
).replace(
    "</VTKFile>",
    '<AppendedData encoding="base64">_'
    + base64.b64encode(np.array([96], "<u4").tobytes() + np.arange(12.0).tobytes()).decode()
    + base64.b64encode(np.array([16], "<u4").tobytes() + np.arange(4, dtype="<i4").tobytes()).decode()
    + "</AppendedData></VTKFile>",
)
FIELD = '<PointData><DataArray type="{}" Name="f" {}/></PointData><Cells>'


def appended(points: str, kind: str, field: str) -> bytes:
    """A file whose points, and a field of them, are appended, with these attributes."""
    return (
        APPENDED.replace("OFFSET", f'format="appended" {points}').replace("<Cells>", FIELD.format(kind, field)).encode()
    )


def test_offsets_are_found_where_they_are_written() -> None:
    at = len(base64.b64encode(bytes(100)))
    for more in (f'offset="{at}"', f"Name2=' offset=\"7\"' offset = '{at}'", f'xoffset="1" offset=" {at} "'):
        parsed = read(vtu, appended('offset="0"', "Int32", f'format="appended" {more}'))
        assert parsed.point_data["f"].tolist() == [0, 1, 2, 3]
        check_splice(vtu, appended('offset="0"', "Int32", f'format="appended" {more}'))
    refused(vtu, appended('offset="0"', "Int32", f'format="appended" offset="&#49;{at}"'), "'f': .* cannot be found")
    kept = appended('offset="0"', "String", 'format="appended" offset="none"')  # no numbers, so nobody asks where it is
    assert "f" not in read(vtu, kept).point_data
    check_splice(vtu, kept)


def test_points_that_share_their_bytes_are_refused() -> None:
    for kind, offset in (("Int32", 0), ("String", 4), ("String", 135)):
        shared = appended('offset="0"', kind, f'format="appended" offset="{offset}"')
        refused(vtu, shared, "the array 'f': it (shares bytes with points|has 96 bytes)")
    refused(
        vtu, appended('offset="0"', "Float64", 'NumberOfComponents="3" format="appended" offset="0"'), "shares bytes"
    )
    empty = appended('offset="0"', "String", 'NumberOfTuples="0" format="appended" offset="0"')
    check_splice(vtu, empty)


def test_appended_data_may_stand_in_front_of_the_grid() -> None:
    data = appended('offset="0"', "Int32", f'format="appended" offset="{len(base64.b64encode(bytes(100)))}"')
    data = data.replace(b'byte_order="LittleEndian"', b'byte_order="LittleEndian" compressor="vtkZLibDataCompressor"')
    points, field = (
        base64.b64encode(np.array([1, len(part), 0, len(packed)], "<u4").tobytes()) + base64.b64encode(packed)
        for part in (np.zeros(12).tobytes(), np.arange(4, dtype="<i4").tobytes())
        for packed in [zlib.compress(part)]
    )
    head, rest = data.split(b"<UnstructuredGrid>")
    grid = rest[: rest.index(b"<AppendedData")].replace(b'offset="136"', b'offset="%d"' % len(points))
    block = b'<AppendedData encoding="base64">_' + points + field + b"</AppendedData>"
    for file in (head + b"<UnstructuredGrid>" + grid + block + b"</VTKFile>",
                 head + block + b"<UnstructuredGrid>" + grid + b"</VTKFile>"):  # fmt: skip
        assert read(vtu, file).point_data["f"].tolist() == [0, 1, 2, 3]
        check_splice(vtu, file)


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(1, 6)), max_size=6), st.integers(0, 30), st.integers(0, 30))
def test_what_is_visible_is_not_hidden(spans: list[tuple[int, int]], one: int, two: int) -> None:
    start, stop = sorted((one, two))
    hidden = sorted((first, first + size) for first, size in spans if first >= start)
    seen = {at for part in Document(b"", hidden=hidden).visible(start, stop) for at in range(*part)}
    assert seen == {at for at in range(start, stop) if not any(first <= at < end for first, end in hidden)}


def test_blocks_keep_their_bytes_where_nothing_changed() -> None:
    numbers = np.random.default_rng(0).random(3000)
    for header, in_base64 in (("<u4", False), (">u8", True)):
        parts = [numbers[k : k + 400].tobytes() for k in range(0, 3000, 400)]
        packed = [zlib.compress(part, level) for part, level in zip(parts, (1, 5, 6, 9) * 2, strict=True)]
        head = np.array([8, 3200, 1600, *map(len, packed)], dtype=header).tobytes()
        encoding = Encoding(header, COMPRESSORS["vtkZLibDataCompressor"], in_base64)
        data = base64.b64encode(head) + base64.b64encode(b"".join(packed)) if in_base64 else head + b"".join(packed)
        found, payload = decode(memoryview(data), encoding, 24000)
        assert payload == numbers.tobytes()
        assert found.written(payload, payload) == data
        assert found.length == len(data)
        other = np.where(np.arange(3000) == 450, 7.0, numbers)
        again, now = decode(memoryview(found.written(payload, other.tobytes())), encoding, 24000)
        assert now == other.tobytes()
        assert [a == b for a, b in zip(again.blocks, found.blocks, strict=True)] == [True, False] + [True] * 6
        assert again.blocks[1][:2] == found.blocks[1][:2]  # compressed as hard as before


@pytest.mark.parametrize("packer", ["LZMA", "LZ4"])
def test_other_compressors(packer: str, tmp_path: Path) -> None:
    """As VTK writes them, and VTK reads what is written anew."""
    written = {name: data for name, data in vtu_variants(grid_of(mixed_mesh()), packer) if "compress True" in name}
    assert len(written) == 16
    for name, data in written.items():
        if not name.startswith("ascii"):
            assert f'compressor="vtk{packer}DataCompressor"'.encode() in data
            out = check_splice(vtu, data)
            points, _ = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), out, tmp_path / "out.vtu")
            assert np.array_equal(points, moved_points(read(vtu, data)))


@given(st.sampled_from(sorted(COMPRESSORS)), st.binary(max_size=300), st.integers(0, 40), st.integers(0, 255))
@settings(max_examples=300)
def test_blocks_come_back_and_damage_is_refused(name: str, part: bytes, at: int, byte: int) -> None:
    compressor = COMPRESSORS[name]
    block = compressor.pack(part, zlib.compress(b"1", 9))
    assert compressor.unpacked(block, 0, len(part)) == part
    for size in (len(part) - 1, len(part) + 1):
        with pytest.raises(FormatError, match=r"^block 7 (cannot be decompressed|does not decompress)"):
            compressor.unpacked(block, 7, max(size, 0) or 5)
    damaged_block = bytes(block[:at]) + bytes([byte]) + bytes(block[at + 1 :])
    for other in (block[:-1], damaged_block, part):
        with contextlib.suppress(FormatError):
            compressor.unpacked(other, 0, len(part))


def test_many_equal_numbers_are_no_bomb() -> None:
    """The most that each compressor can pack into a block is less than what is taken for one."""
    for compressor in COMPRESSORS.values():
        size = 1 << 24
        block = compressor.pack(bytes(size), zlib.compress(b"1", 9))
        assert size < compressor.most * len(block)
        assert compressor.unpacked(block, 0, size) == bytes(size)


def test_a_compressor_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lz4", None)
    data = PLAIN.replace('byte_order="LittleEndian"', 'byte_order="LittleEndian" compressor="vtkLZ4DataCompressor"')
    with pytest.raises(MissingExtraError, match=r"lz4, which is not installed: pip install 'gmsnet\[lz4\]'"):
        read(vtu, data.encode())


@given(st.data())
@settings(max_examples=200)
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    if not _ORIGINALS:
        _ORIGINALS.extend([PLAIN.encode(), *variants(False, 2).values()])
    original = data.draw(st.sampled_from(range(len(_ORIGINALS))))
    read_or_refuse(vtu, {".vtu": data.draw(damaged(_ORIGINALS[original]))})


_ORIGINALS: list[bytes] = []


def test_conversion_keeps_cells_regions_and_data() -> None:
    for mesh in (mixed_mesh(), triangle_grid(3), triangle_grid(3, 3)):
        back, lost = check_conversion(vtu, mesh)
        assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in back.cells] == [
            (b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells
        ]
        assert np.array_equal(back.points[:, : mesh.points.shape[1]], mesh.points)
        for name, values in mesh.point_data.items():
            assert np.array_equal(back.point_data[name], values)
        assert bool(lost) == bool(mesh.region_names)


def test_names_of_data_are_escaped(tmp_path: Path) -> None:
    mesh = triangle_grid(2)
    named = Mesh(mesh.points, mesh.cells, point_data={'a<"&\n é': np.arange(9), "text": np.array(["x"] * 9)})
    written = vtu.write(named)
    assert [line for line in written.lost if "'text'" in line]
    assert list(read(vtu, contents(written)[".vtu"]).point_data) == ['a<"&? é']
    _, grid = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), contents(written)[".vtu"], tmp_path / "a.vtu")
    assert grid.GetNumberOfCells() == 12


def test_cells_that_vtk_does_not_have_are_refused() -> None:
    mesh = Mesh(np.random.default_rng(0).random((10, 3)), (CellBlock("triangle10", np.arange(10)[None], np.zeros(1)),))
    with pytest.raises(FormatError, match="cannot hold cells of type 'triangle10'"):
        vtu.write(mesh)


def test_a_real_file(tmp_path: Path) -> None:
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("GMSNET_MESHES does not name the folder of real meshes")
    data = (Path(folder) / "quad_append_raw_compress.vtu").read_bytes()
    parsed = read(vtu, data)
    assert (len(parsed.points), [(b.kind, len(b.nodes)) for b in parsed.cells]) == (16, [("quad", 9)])
    assert list(parsed.point_data) == ["DistanceToCenter", "Polynomial"]
    assert parsed.single
    out = check_splice(vtu, data)
    points, _ = points_by_vtk(vtk.vtkXMLUnstructuredGridReader(), out, tmp_path / "out.vtu")
    assert np.array_equal(points, moved_points(parsed).astype(np.float32))


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".ply", ".msh", ".stl"])
def test_named_groups_of_nodes_are_not_lost_in_silence(suffix: str) -> None:
    mesh = triangle_grid(2)
    grouped = Mesh(mesh.points, mesh.cells[:1], node_sets={"corner": np.array([0])})
    writer = {".vtu": vtu, ".vtk": vtk_format, ".ply": ply, ".msh": gmsh, ".stl": stl}[suffix]
    assert [text for text in writer.write(grouped).lost if "node sets: 'corner'" in text]
