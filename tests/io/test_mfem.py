"""MFEM meshes: what is read, the splice, damage; the suffix that they share with Medit."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
from gmsnet.io import mfem

MESHES = os.environ.get("GMSNET_MESHES", "")
PLAIN = b"""MFEM mesh v1.0

#
# MFEM Geometry Types
#
dimension
2

elements
3
1 2 0 1 4
1 2 1 2 4
3 3 0 4 3 5

boundary
2
7 1 0 1
8 1 1 2

vertices
6
2
0 0
1 0
1 1
0 1
.5 .5
-1 .5
"""


def test_a_plain_file() -> None:
    parsed = read(mfem, PLAIN)
    assert cells_of(parsed, "triangle") == [[0, 1, 4], [1, 2, 4]]
    assert cells_of(parsed, "quad") == [[0, 4, 3, 5]]
    assert regions_of(parsed, "quad") == [3]
    assert regions_of(parsed, "line") == [7, 8]
    check_splice(mfem, PLAIN)
    later = PLAIN.replace(b"v1.0", b"v1.2").replace(b"vertices", b'attribute_sets\n1\n"all" 2 1 3\n\nvertices')
    assert read(mfem, later + b"mfem_mesh_end\n").unread == ["attribute sets"]


def test_errors() -> None:
    refused(mfem, PLAIN.replace(b"3 3 0 4 3 5", b"3 3 0 4 3 6"), "line 13: a cell names the node 6")
    refused(mfem, PLAIN.replace(b"3 3 0 4 3 5", b"3 9 0 4 3 5"), "line 13: cells of the type 9 are not known")
    refused(mfem, PLAIN.replace(b"3 3 0 4 3 5", b"3 2 0 4 3 5"), "line 13: a triangle has 3 nodes")
    refused(mfem, PLAIN[: PLAIN.index(b"2\n0 0\n")] + b"\nnodes\nFiniteElementSpace\n", "nodes of a curved mesh")
    refused(mfem, PLAIN[:-20], "the file ends")


@given(data=damaged(PLAIN))
def test_damage(data: bytes) -> None:
    read_or_refuse(mfem, {".mesh": data})


def test_the_contents_tell_it_from_medit(tmp_path: Path) -> None:
    path, out = tmp_path / "a.mesh", tmp_path / "b.mesh"
    path.write_bytes(PLAIN)
    mesh = gmsnet.read(path)
    new = mesh.points + 0.25
    assert gmsnet.write(mesh.with_points(new), out) == []
    assert out.read_bytes().startswith(b"MFEM mesh v1.0")
    assert gmsnet.read(out).points.tolist() == new.tolist()
    gmsnet.write(mesh, tmp_path / "c.mesh", "medit")
    assert (tmp_path / "c.mesh").read_bytes().startswith(b"MeshVersionFormatted")
    assert cells_of(gmsnet.read(tmp_path / "c.mesh"), "quad") == cells_of(mesh, "quad")


@pytest.mark.skipif(not MESHES, reason="needs GMSNET_MESHES")
def test_a_real_file(tmp_path: Path) -> None:
    path = Path(MESHES) / "formats" / "cylinder-hex.mesh"
    mesh = gmsnet.read(path)
    assert (len(cells_of(mesh, "hexahedron")), len(cells_of(mesh, "quad"))) == (252, 204)
    gmsnet.write(mesh, tmp_path / "a.mesh")
    assert (tmp_path / "a.mesh").read_bytes() == path.read_bytes()
    check_splice(mfem, path.read_bytes())
