"""UGRID: nine forms of one mesh, damage, conversion; the form that a name says."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import check_all_cuts_refused, check_splice, contents, read
from support.damage import FEW, GAPS, NUMBERS, cells_of, check_cuts, damaged, last_word, read_or_refuse, regions_of
from test_volume_files import sample

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.io import ugrid
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

MESHES = os.environ.get("GMSNET_MESHES", "")

PLAIN = b"""8 2 1 1 1 1 1
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
1 2 5
2 6 5
1 4 3 2
7 7
9
1 2 4 5
2 1 7 4 5
1 2 4 5 6 8
1 2 3 4 5 6 7 8
"""


def mixed() -> Mesh:
    """The mesh of PLAIN."""
    parsed = read(ugrid, PLAIN)
    return Mesh(parsed.points, tuple(parsed.cells), parsed.region_names)


def in_form(key: str, mesh: Mesh | None = None) -> bytes:
    return contents(ugrid.write_as(mesh or mixed(), key))[".ugrid"]


def test_a_plain_file() -> None:
    parsed = read(ugrid, PLAIN)
    assert parsed.points.tolist()[4] == [0, 0, 1]
    assert cells_of(parsed, "triangle") == [[0, 1, 4], [1, 5, 4]]
    assert regions_of(parsed, "triangle") == [7, 7]
    assert regions_of(parsed, "quad") == [9]
    assert cells_of(parsed, "pyramid") == [[0, 1, 3, 4, 6]]  # the apex is the third in the file
    assert dict(parsed.region_names) == {(2, 7): "7", (2, 9): "9"}
    check_splice(ugrid, PLAIN)
    assert contents(ugrid.write(mixed()))[".ugrid"].split() == [
        repr(float(word)).encode() if 7 <= k < 31 else word for k, word in enumerate(PLAIN.split())
    ]


@pytest.mark.parametrize("key", ugrid.FORMS)
def test_every_form_is_the_same_mesh(key: str) -> None:
    data = in_form(key)
    parsed, plain = read(ugrid, data), mixed()
    assert (parsed.form, parsed.single) == (key, key.endswith("4"))
    assert parsed.points.tolist() == plain.points.tolist()
    assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells] == [
        (b.kind, b.nodes.tolist(), b.regions.tolist()) for b in plain.cells
    ]
    check_splice(ugrid, data)
    check_all_cuts_refused(ugrid, data, len(data))


def test_the_bytes_of_two_forms() -> None:
    head = struct.pack(">7i", 8, 2, 1, 1, 1, 1, 1)
    assert in_form("b8").startswith(head + struct.pack(">6d", 0, 0, 0, 1, 0, 0))
    little = in_form("lr4")
    assert little.startswith(struct.pack("<I7iI", 28, 8, 2, 1, 1, 1, 1, 1, 28))
    assert little[36:40] == little[-4:] == struct.pack("<I", len(little) - 44)


def test_what_follows_is_kept() -> None:
    parsed = read(ugrid, in_form("b8") + b"more")
    assert (parsed.form, parsed.unread) == ("b8", ["what follows the volumes"])
    assert read(ugrid, PLAIN + b"0 0 0\n").unread == ["what follows the volumes"]
    check_splice(ugrid, in_form("lb8") + b"more")


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, list[list[float]], list[list[int]]]:
    gap = st.sampled_from([draw(GAPS), "\n", "\r\n"])
    count = draw(st.integers(1, 6))
    points = draw(st.lists(st.tuples(*[NUMBERS] * 3), min_size=count, max_size=count))
    faces = draw(st.lists(st.tuples(*[st.integers(1, count)] * 3), min_size=1, max_size=4))
    words = [count, len(faces), 0, 0, 0, 0, 0, *(x for p in points for x in p), *(k for f in faces for k in f)]
    words += [5] * len(faces)
    text = "".join(f"{word}{draw(gap)}" for word in words)
    return text.encode(), [[float(x) for x in p] for p in points], [[k - 1 for k in f] for f in faces]


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, list[list[float]], list[list[int]]]) -> None:
    data, points, faces = case
    parsed = read(ugrid, data)
    assert parsed.points.tolist() == points
    assert cells_of(parsed, "triangle") == faces
    check_splice(ugrid, data)


@FEW
@given(spellings())
def test_a_cut_file_is_refused_or_the_same(case: tuple[bytes, list[list[float]], list[list[int]]]) -> None:
    start = last_word(case[0], rb"\A\b\B")
    check_cuts(ugrid, {".ugrid": case[0]}, ".ugrid", lambda rest: len(rest) > start)


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    key = data.draw(st.sampled_from(["", *ugrid.FORMS]))
    read_or_refuse(ugrid, {".ugrid": data.draw(damaged(in_form(key) if key else PLAIN))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(ugrid, {".ugrid": data})
    read_or_refuse(ugrid, {".ugrid": struct.pack(">7i", 1, 1, 0, 0, 0, 0, 0) + data})
    read_or_refuse(ugrid, {".ugrid": b"3 1 0 0 0 0 0 " + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"8 2 1", b"8 -2 1", r"a count is negative: -2"),
        (b"8 2 1", b"8 2 999999999", r"line \d+: expected 3999999996 numbers, found"),
        (b"8 2 1", b"8 2.5 1", r"line 1: an integer was expected, found '2.5'"),
        (b"1 1 0", b"1 x 0", r"line 4: a number was expected, found 'x'"),
        (b"2 6 5", b"2 9 5", r"line 11: a cell names the node 8, but the nodes are 0 to 7 \(counted from 0\)"),
        (b"2 6 5", b"2 0 5", r"line 11: a cell names the node -1"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(ugrid, PLAIN.replace(old, new, 1))


def test_a_binary_file_that_is_wrong_is_named() -> None:
    data = in_form("b8")
    with pytest.raises(FormatError, match="the file ends, but its counts ask for"):
        read(ugrid, data[:-1])
    with pytest.raises(FormatError, match="seven counts were expected"):
        read(ugrid, bytes([255] * 80))
    with pytest.raises(FormatError, match=r"byte 52: a coordinate is not a finite number"):
        read(ugrid, data[:52] + struct.pack(">d", np.nan) + data[60:])


def test_the_form_is_that_of_the_name(tmp_path: Path) -> None:
    mesh = mixed()
    for key in ("", "b8", "lb8", "r8", "lr4"):
        path = tmp_path / f"a{'.' * bool(key)}{key}.ugrid"
        gmsnet.write(mesh, path)
        again = gmsnet.read(path)
        for other in ("", "lb8"):
            gmsnet.write(again, tmp_path / f"b{'.' * bool(other)}{other}.ugrid.gz")
            assert gmsnet.read(tmp_path / f"b{'.' * bool(other)}{other}.ugrid.gz").source.form == other  # type: ignore[union-attr]
    (tmp_path / "c.lb8.ugrid").write_bytes(in_form("b8"))
    with pytest.raises(InputError, match=r"the contents are those of \.b8\.ugrid, but the name says \.lb8\.ugrid"):
        gmsnet.read(tmp_path / "c.lb8.ugrid")
    (tmp_path / "c.ugrid").write_bytes(in_form("b8"))
    odd = gmsnet.read(tmp_path / "c.ugrid")  # a name that says nothing: the file keeps its form
    assert gmsnet.write(odd, tmp_path / "c.ugrid") == []
    assert (tmp_path / "c.ugrid").read_bytes() == in_form("b8")
    (tmp_path / "d.b8.ugrid").write_bytes(PLAIN)
    with pytest.raises(InputError, match=r"those of text \(\.ugrid\), but the name says \.b8\.ugrid"):
        gmsnet.read(tmp_path / "d.b8.ugrid")


def test_conversion_keeps_cells_and_surfaces(tmp_path: Path) -> None:
    mesh = sample()
    lost = gmsnet.write(mesh, tmp_path / "a.lb8.ugrid")
    assert lost == [
        "UGRID cannot hold vertex cells: 1 was left out (markers 'corner')",
        "UGRID cannot hold line cells: 1 was left out (markers 'edge')",
        "UGRID cannot hold cell regions: 2 regions were merged (among them 'domain', 'upper half')",
        *[words for words in lost if words.startswith("UGRID numbers its surfaces: the name")],
        "UGRID lists cells by kind: they were put in another order",
    ]
    again = gmsnet.read(tmp_path / "a.lb8.ugrid")
    assert again.points.tobytes() == mesh.points.tobytes()
    for kind in ("tetra", "triangle"):
        assert cells_of(again, kind) == cells_of(mesh, kind)
    assert regions_of(again, "triangle") == regions_of(mesh, "triangle")
    with pytest.raises(FormatError, match="holds faces and volumes only"):
        ugrid.write(Mesh(mesh.points, (CellBlock("line", [[0, 1]], [0]),)))


def test_single_precision_is_said_and_nothing_is_inverted() -> None:
    mesh = sample()
    assert any("coordinates were rounded" in words for words in ugrid.write_as(mesh, "b4").lost)
    thin = Mesh(
        [[0, 0], [1, 0], [1, 1e-9], [2.0, 2e-9 + 1e-17]], (CellBlock("triangle", [[0, 1, 2], [0, 2, 3]], [0, 0]),)
    )
    with pytest.raises(FormatError, match="too few digits for this mesh: 1 triangle cells would be inverted or flat"):
        ugrid.write_as(thin, "lb4")
    with pytest.raises(FormatError, match="too large for single precision"):
        ugrid.write_as(mesh.with_points(mesh.points * 1e300), "b4")


@pytest.mark.skipif(not MESHES, reason="GMSNET_MESHES does not name a folder of meshes")
def test_a_real_file(tmp_path: Path) -> None:
    path = Path(MESHES) / "formats" / "box.b8.ugrid"
    mesh = gmsnet.read(path)
    assert [(b.kind, len(b.nodes)) for b in mesh.cells] == [("quad", 2166), ("hexahedron", 6859)]
    assert gmsnet.write(mesh, tmp_path / "a.b8.ugrid") == []
    assert (tmp_path / "a.b8.ugrid").read_bytes() == path.read_bytes()
    check_splice(ugrid, path.read_bytes())
    for key in ugrid.FORMS:
        assert in_form(key, mesh) == path.read_bytes() or key != "b8"
        if key.endswith("8"):
            assert read(ugrid, in_form(key, mesh)).points.tobytes() == mesh.points.tobytes()
