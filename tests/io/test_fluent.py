"""Fluent meshes: cells are put together from faces; the splice; damage; the suffix that they share with Gmsh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
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
(12 (2 1 2 1 0))
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
    refused(fluent, PLAIN.replace(b"(10 (1", b"(3010 (1"), "line 6: binary sections are not read")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b"5 7 3 0\n"), "a face names a node that is none of 1 to 6")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b""), "23|do not make 6 faces")
    refused(fluent, PLAIN.replace(b"5 6 3 0\n", b"5 2 3 0\n"), "the faces of cell 3 do not run around it")
    refused(fluent, PLAIN.replace(b"2.0 1.0))", b"2.0))"), "line 6: 11 coordinates do not fit the nodes 1 to 6")
    refused(fluent, PLAIN[:300], "is the file cut off|is the file damaged")


@given(data=damaged(PLAIN))
def test_damage(data: bytes) -> None:
    read_or_refuse(fluent, {".msh": data})


@given(data=damaged(VOLUME))
def test_damage_of_volumes(data: bytes) -> None:
    read_or_refuse(fluent, {".msh": data})


def test_the_contents_tell_it_from_gmsh(tmp_path: Path) -> None:
    for name in ("a.msh", "a.cas"):
        path = tmp_path / name
        path.write_bytes(VOLUME)
        mesh = gmsnet.read(path)
        new = mesh.points + 0.25
        assert gmsnet.write(mesh.with_points(new), path) == []
        assert path.read_bytes().startswith(b"(2 3)")
        assert gmsnet.read(path).points.tolist() == new.tolist()


def test_meshio_reads_the_same(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    path, out = tmp_path / "a.msh", tmp_path / "b.msh"
    path.write_bytes(PLAIN)
    mesh = gmsnet.read(path)
    new = mesh.points * 1.5
    gmsnet.write(mesh.with_points(new), out)
    try:
        points = meshio.ansys.read(out).points
    except (ValueError, AssertionError, meshio.ReadError):
        pytest.skip("this release of meshio does not read these faces")
    assert points.tolist() == new.tolist()
