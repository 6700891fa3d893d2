"""SU2 meshes in space: all kinds of volumes, markers of faces, damage, conversion."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import check_splice, contents
from support.damage import cells_of, check_cuts, damaged, read_or_refuse, regions_of

from gmsnet import io
from gmsnet.errors import FormatError
from gmsnet.io import su2
from gmsnet.mesh.mesh import Mesh

VOLUMES = b"""NDIME= 3
NELEM= 4
12 0 1 2 3 4 5 6 7 0
13 1 8 2 5 9 6 1
14 4 5 6 7 10 2
10 0 3 1 11 3 % a tetrahedron
NPOIN= 12
0 -0.0 0 0
1 0 0 1
1 1 0 2
0 1 0 3
0 0 +1 4
1 0 1 5
1 1 1 6
0 1 1.0 7
2 .5 0 8
2 0.5 1 9
5e-1 0.5 1.75 10
0.4 0.4 -1 11
NMARK= 4
MARKER_TAG= wall
MARKER_ELEMS= 2
9 0 4 7 3
5 1 8 2
MARKER_TAG= edge
MARKER_ELEMS= 1
3 0 4
MARKER_TAG= probe
MARKER_ELEMS= 1
1 10
MARKER_TAG= far field
MARKER_ELEMS= 0
"""
KNOWLES = Path(os.environ.get("GMSNET_MESHES", "")) / "MixElemsKnowles.su2"


def test_a_file_in_space() -> None:
    parsed = su2.read({".su2": VOLUMES})
    assert parsed.points.shape == (12, 3)
    assert parsed.points[10].tolist() == [0.5, 0.5, 1.75]
    assert [block.kind for block in parsed.cells] == [
        "hexahedron", "wedge", "pyramid", "tetra", "quad", "triangle", "line", "vertex",
    ]  # fmt: skip
    assert cells_of(parsed, "wedge") == [[1, 8, 2, 5, 9, 6]]
    assert cells_of(parsed, "tetra") == [[0, 3, 1, 11]]
    assert cells_of(parsed, "quad") == [[0, 4, 7, 3]]
    assert regions_of(parsed, "triangle") == regions_of(parsed, "quad") == [1]
    assert parsed.region_names == {(2, 1): "wall", (1, 2): "edge", (2, 2): "edge", (0, 3): "probe", (2, 3): "probe",
                                   (2, 4): "far field"}  # fmt: skip


def test_only_coordinates_change() -> None:
    check_splice(su2, VOLUMES)
    check_splice(su2, VOLUMES.replace(b"\n", b"\r\n"), 1)


def test_a_cut_file_is_refused_or_the_same() -> None:
    bare = VOLUMES[: VOLUMES.index(b"NMARK=")]  # a whole file without markers
    check_cuts(su2, {".su2": VOLUMES}, ".su2", lambda left: left == bare)


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(su2, {".su2": data.draw(damaged(VOLUMES))})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"NDIME= 3", b"NDIME= 2", r"line 15: an integer was expected, found '1.0'"),
        (b"10 0 3 1 11 3", b"10 0 3 1 12 3", r"line 6: a cell names the node 12, but the nodes are 0 to 11"),
        (b"10 0 3 1 11 3", b"10 0 3 1", r"line 6: a tetra has 4 nodes, found 3 numbers"),
        (
            b"10 0 3 1 11 3",
            b"11 0 3 1 11 3",
            r"line 6: a cell of type 11 cannot be read here; known are .*10 \(tetra\)",
        ),
        (b"5 1 8 2\n", b"10 1 8 2 0\n", r"line 24: a cell of type 10 cannot be read here; known are .*9 \(quad\)"),
        (b"1 1 0 2\n", b"1 1\n", r"line 10: three coordinates and an index were expected, found 2 numbers"),
        (b"1 1 0 2\n", b"1 1 0 2 2 2\n", r"line 10: three coordinates and an index were expected, found 6 numbers"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in VOLUMES
    with pytest.raises(FormatError, match=message):
        su2.read({".su2": VOLUMES.replace(old, new, 1)})


def test_conversion_keeps_cells_and_markers() -> None:
    parsed = su2.read({".su2": VOLUMES})
    mesh = Mesh(parsed.points, tuple(parsed.cells), parsed.region_names)
    written = su2.write(mesh)
    assert written.lost == []
    again = su2.read(contents(written))
    assert again.points.tobytes() == mesh.points.tobytes()
    for block in mesh.cells:
        assert cells_of(again, block.kind) == block.nodes.tolist()
    names = {again.region_names[2, r] for r in regions_of(again, "quad") + regions_of(again, "triangle")}
    assert names == {"wall"}
    regions = replace(mesh, cells=tuple(replace(b, regions=b.nodes[:, 0] + 4) for b in mesh.cells))
    assert su2.write(regions).lost[0] == "SU2 cannot hold cell regions: 3 regions were merged"


@pytest.mark.skipif(not KNOWLES.is_file(), reason="GMSNET_MESHES does not name the folder of real meshes")
def test_a_real_file(tmp_path: Path) -> None:
    mesh = io.read(KNOWLES)
    counts = [("hexahedron", 3680), ("wedge", 4128), ("pyramid", 3936), ("quad", 80), ("quad", 80)]
    assert [(block.kind, len(block.nodes)) for block in mesh.cells] == counts
    assert io.write(mesh, tmp_path / "same.su2") == []
    assert (tmp_path / "same.su2").read_bytes() == KNOWLES.read_bytes()
    assert io.write(replace(mesh, source=None), tmp_path / "made.su2") == []
    again = io.read(tmp_path / "made.su2")
    assert again.points.tobytes() == mesh.points.tobytes()
    assert facts_of(again) == facts_of(mesh)


def facts_of(mesh: Mesh) -> list[object]:
    return [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells] + sorted(mesh.region_names.items())
