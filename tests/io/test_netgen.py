"""Netgen's .vol: what is read, the splice, damage; files of Netgen itself where it is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
from gmsnet.io import netgen

PLAIN = b"""# a comment
mesh3d
dimension
3
geomtype
0

# surfnr    bcnr   domin  domout      np      p1      p2      p3
surfaceelements
2
 2 5 1 0 3 1 2 3
 2 6 1 0 3 1 4 2

#  matnr      np      p1      p2      p3      p4
volumeelements
1
1 4 1 2 3 4

edgesegmentsgi2
1
 7 0 1 2 -1 -1 0 0 1 0 1 1

points
4
 0.0 0.0 0.0
 1.0 0.0 0.0
 0.0 1.0 0.0
 0.0 0.0 1.0
pointelements
1
4 3
materials
1
1 dry air
bcnames
2
5 inlet
6 wall
cd2names
1
7 edge
face_colours
1
 1 0 1 0
endmesh
"""


def test_a_plain_file() -> None:
    parsed = read(netgen, PLAIN)
    assert cells_of(parsed, "tetra") == [[0, 1, 2, 3]]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [0, 3, 1]]
    assert regions_of(parsed, "triangle") == [5, 6]
    assert cells_of(parsed, "line") == [[0, 1]]
    assert cells_of(parsed, "vertex") == [[3]]
    assert dict(parsed.region_names) == {(3, 1): "dry air", (2, 5): "inlet", (2, 6): "wall", (1, 7): "edge"}
    assert parsed.unread == ["face_colours"]
    check_splice(netgen, PLAIN)
    check_splice(netgen, PLAIN.replace(b"\n", b"\r\n"))


def test_cuts() -> None:
    whole = PLAIN.index(b"materials")
    for cut in range(PLAIN.index(b"pointelements")):
        assert read_or_refuse(netgen, {".vol": PLAIN[:cut]}) is None or cut > whole - 40


def test_errors() -> None:
    refused(netgen, PLAIN.replace(b"1 4 1 2 3 4\n", b"1 4 1 2 3 5\n"), "line 17: a cell names the node 5")
    refused(netgen, PLAIN.replace(b"1 4 1 2 3 4\n", b"1 9 1 2 3 4\n"), "line 17: volumeelements of 9 nodes")
    refused(netgen, PLAIN.replace(b"face_colours", b"curvedelements"), "curved elements are not read")
    refused(netgen, PLAIN.replace(b" 1.0 0.0 0.0", b" 1.0 0.0"), "a point has three coordinates")
    refused(netgen, PLAIN.replace(b"mesh3d", b"mesh4d"), "a Netgen mesh begins with mesh3d")
    refused(netgen, PLAIN.replace(b"cd2names", b"nonsense"), "unknown keyword 'nonsense'")


@given(data=damaged(PLAIN))
def test_damage(data: bytes) -> None:
    read_or_refuse(netgen, {".vol": data})


def test_files_of_netgen(tmp_path: Path) -> None:
    csg = pytest.importorskip("netgen.csg")
    from netgen.meshing import Mesh as NetgenMesh

    geometry = csg.CSGeometry()
    geometry.Add(csg.Sphere(csg.Pnt(0, 0, 0), 1).mat("ball"))
    made = geometry.GenerateMesh(maxh=0.6)
    for suffix, second in ((".vol", False), (".vol.gz", False), (".vol", True)):
        if second:
            made.SecondOrder()
        path, out = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
        made.Save(str(path))
        mesh = gmsnet.read(path)
        kind = "tetra10" if second else "tetra"
        assert len(cells_of(mesh, kind)) == len(made.Elements3D())
        assert mesh.points.tolist() == pytest.approx(made.Coordinates())
        assert "ball" in mesh.region_names.values()
        if second:
            block = next(b for b in mesh.cells if b.kind == "tetra10")
            for k, (a, b) in enumerate(((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)), 4):
                middle = (mesh.points[block.nodes[:, a]] + mesh.points[block.nodes[:, b]]) / 2
                assert np.abs(mesh.points[block.nodes[:, k]] - middle).max() < 0.2
        new = mesh.points * 1.25
        gmsnet.write(mesh.with_points(new), out)
        again = NetgenMesh()
        again.Load(str(out))
        assert np.array_equal(again.Coordinates(), new)
        assert len(again.Elements3D()) == len(made.Elements3D())
