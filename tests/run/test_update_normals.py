"""``update_normals``: normals in files are those of the new surface, and nothing else of the file changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import normals as plain
from support.surface_meshes import surface_mesh, wavy
from support.volumes import cube, mesh_of
from support.vtk_variants import grid_of, legacy_variants, polydata_of, vtu_variants

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.generate import random_mesh
from gmsnet.mesh.normals import FaceCorners, corner_normals, names_normals

EXACT, SINGLE = 1e-7, 2e-7


def sheet(kind="triangle", side=8):
    """A bent sheet in single precision, and its normals of faces and points."""
    mesh = wavy(side=side, kind=kind)
    points = mesh.points.astype(np.float32).astype(np.float64)
    mesh = surface_mesh(points, {block.kind: block.nodes for block in mesh.cells})
    faces = plain.faces_of(mesh)
    return mesh, plain.normals_of_faces(faces, points), plain.normals_of_points(faces, points)


def updated(path, tmp_path, **options):
    """The result of a file with new normals, the file with them, and the one without."""
    result = gmsnet.smooth(gmsnet.read(path), threads=1, update_normals=True, **options)
    assert result.moved.sum() > 5
    new, old = tmp_path / f"new{path.suffix}", tmp_path / f"old{path.suffix}"
    assert gmsnet.write(result.mesh, new) == []
    assert gmsnet.write(gmsnet.read(path).with_points(result.points), old) == []
    assert np.array_equal(gmsnet.read(new).points, gmsnet.read(old).points)
    return result, new, old


def check(found, before, after, moved, within):
    """New normals where nodes around have moved, the old ones elsewhere. moved: (R,) bool."""
    assert 0 < moved.sum() < len(moved)
    assert np.array_equal(found[~moved], before[~moved])
    assert abs(found[moved] - after[moved]).max() < within
    assert abs(before[moved] - after[moved]).max() > 0.01


def around(mesh, moved):
    """(F,) and (N,) whether faces, and points by their faces, have other normals."""
    faces = plain.faces_of(mesh)
    of_faces = np.array([moved[face].any() for face in faces])
    of_points = np.zeros(len(moved), dtype=bool)
    for face, other in zip(faces, of_faces, strict=True):
        of_points[face] |= other
    return of_faces, of_points


@pytest.mark.parametrize("binary", [False, True])
def test_facets_of_stl(binary, tmp_path):
    mesh, of_faces, _ = sheet()
    path, before = tmp_path / "a.stl", of_faces.copy()
    before[3] = 0.0  # none
    before[5] *= -1.0  # the other side
    if binary:
        before = before.astype(np.float32).astype(float)
        path.write_bytes(plain.binary_stl(mesh, before))
    else:
        path.write_text(plain.text_stl(mesh, before))
    result, new, old = updated(path, tmp_path)
    read = gmsnet.read(path)
    moved, _ = around(read, result.moved)
    after = plain.normals_of_faces(plain.faces_of(read), result.points)
    after[5] *= -1.0
    moved[3] = False
    found = plain.binary_normals(new) if binary else plain.numbers_behind(new, "facet", "normal")
    check(found, before, after, moved, SINGLE if binary else EXACT)
    if binary:
        assert len(new.read_bytes()) == len(old.read_bytes())
        assert {
            data[k + 48 : k + 50] for data in (new.read_bytes(), old.read_bytes()) for k in range(84, len(data), 50)
        } == {b"\7\0"}
    else:
        assert [line for line in new.read_text().splitlines() if "normal" not in line] == [
            line for line in old.read_text().splitlines() if "normal" not in line
        ]
    assert any("normals (of facets) are computed anew" in note for note in result.notes)


@pytest.mark.parametrize("smooth", [False, True])
def test_normals_of_obj(smooth, tmp_path):
    mesh, of_faces, of_points = sheet("mixed")
    path, before = tmp_path / "a.obj", of_points if smooth else of_faces
    path.write_text(plain.obj(mesh, before, smooth))
    result, new, old = updated(path, tmp_path)
    moved = around(mesh, result.moved)[int(smooth)]
    after = (plain.normals_of_points if smooth else plain.normals_of_faces)(plain.faces_of(mesh), result.points)
    check(plain.numbers_behind(new, "vn"), before, after, moved, EXACT)
    others = [[line for line in each.read_text().splitlines() if not line.startswith("vn ")] for each in (new, old)]
    assert others[0] == others[1]


def test_a_normal_that_faces_share_is_that_of_them_all(tmp_path):
    mesh, _, _ = sheet()
    path = tmp_path / "a.obj"
    faces = plain.faces_of(mesh)
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in mesh.points.tolist()) + "vn 0 0 1\nvn 0 0 1\n"
    path.write_text(text + "".join("f " + " ".join(f"{n + 1}//1" for n in face) + "\n" for face in faces))
    result, new, _ = updated(path, tmp_path)
    one, other = plain.numbers_behind(new, "vn")
    after = plain.normals_of_faces(faces, result.points).sum(axis=0)
    assert abs(one - after / np.linalg.norm(after)).max() < EXACT  # the angles of a triangle are 180 degrees
    assert other.tolist() == [0.0, 0.0, 1.0]  # none names it


def test_normals_of_off(tmp_path):
    mesh, _, before = sheet("mixed")
    path = tmp_path / "a.off"
    path.write_text(plain.off(mesh, before))
    result, new, old = updated(path, tmp_path)
    after = plain.normals_of_points(plain.faces_of(mesh), result.points)
    lines = [[line.split() for line in each.read_text().splitlines()] for each in (new, old)]
    rows = slice(2, 2 + len(mesh.points))
    check(
        np.array([line[3:6] for line in lines[0][rows]], dtype=float),
        before,
        after,
        around(mesh, result.moved)[1],
        EXACT,
    )
    assert [line[:3] + line[6:] for line in lines[0]] == [line[:3] + line[6:] for line in lines[1]]


def test_normals_of_medit(tmp_path):
    mesh, _, before = sheet()
    path, k = tmp_path / "a.mesh", plain.faces_of(mesh)[0][1]
    own = np.array([0.0, 0.6, 0.8])
    path.write_text(plain.medit(mesh, before, own))
    result, new, _ = updated(path, tmp_path)
    faces = plain.faces_of(mesh)
    text = new.read_text().splitlines()
    at = text.index("Normals") + 2
    found = np.array([line.split() for line in text[at : at + len(before) + 1]], dtype=float)
    moved = around(mesh, result.moved)[1]
    after = plain.normals_of_points(faces, result.points)
    others = np.arange(len(before)) != k  # the first triangle is not among those of its second corner
    check(found[:-1][others], before[others], after[others], moved[others], EXACT)
    first = plain.normals_of_faces(faces[:1], result.points)[0] if result.moved[faces[0]].any() else own
    assert abs(found[-1] - first).max() < EXACT


def test_normals_of_ply(tmp_path):
    mesh, _, before = sheet()
    before = before.astype(np.float32).astype(float)
    for name, data in plain.ply_variants(mesh, before):
        path = tmp_path / "a.ply"
        path.write_bytes(data)
        result, new, old = updated(path, tmp_path)
        after = plain.normals_of_points(plain.faces_of(mesh), result.points)
        moved = around(mesh, result.moved)[1]
        for read in (gmsnet.read(new), result.mesh):
            found = np.column_stack([read.point_data[axis] for axis in ("nx", "ny", "nz")]).astype(float)
            check(found, before, after, moved, SINGLE), name
            assert [read.point_data[f"c{axis}"][0] for axis in "xyz"] == [1, 2, 3]
        assert name[:5] == "ascii" or len(new.read_bytes()) == len(old.read_bytes())
        assert any("normals (nx, ny, nz) are computed anew" in note for note in result.notes)


@pytest.mark.parametrize("kind", ["vtu", "vtp", "vtk", "vtk polydata"])
def test_normals_of_vtk(kind, tmp_path):
    pytest.importorskip("vtk")
    mesh, of_faces, of_points = sheet("mixed")
    cuts = np.cumsum([len(block.nodes) for block in mesh.cells])[:-1]
    stress = np.ones((len(mesh.points), 3))
    mesh = replace(
        mesh,
        point_data={"Normals": of_points, "NormalStress": stress},
        cell_data={"cell_normals": tuple(np.split(of_faces, cuts))},
    )
    if kind == "vtu":
        variants = list(vtu_variants(grid_of(mesh)))[::3]
    elif kind == "vtp":
        variants = [("vtp", vtp_of(polydata_of(mesh), mode)) for mode in (0, 1, 2)]
    else:
        variants = list(legacy_variants(polydata_of(mesh) if "poly" in kind else grid_of(mesh), tmp_path))
    assert len(variants) >= 3
    for name, data in variants:
        path = tmp_path / f"a.{kind[:3]}"
        path.write_bytes(data)
        result, new, _ = updated(path, tmp_path)
        read, faces = gmsnet.read(new), plain.faces_of(mesh)
        points = plain.normals_of_points(faces, result.points)
        by_face, by_point = around(mesh, result.moved)
        start = gmsnet.read(path)
        for each in (read, result.mesh):
            check(each.point_data["Normals"], start.point_data["Normals"], points, by_point, 1e-6), name
            found, old = (np.concatenate(one.cell_data["cell_normals"]) for one in (each, start))
            check(found, old, plain.normals_of_faces(faces, result.points), by_face, 1e-6)
            assert (each.point_data["NormalStress"] == 1.0).all()


@pytest.mark.parametrize("kind", ["vtu", "vtp"])
def test_no_numbers_among_normals_of_vtk_stay(kind, tmp_path):
    pytest.importorskip("vtk")
    mesh, _, before = sheet()
    before = before.copy()
    before[::3] = np.nan
    mesh = replace(mesh, point_data={"Normals": before})
    if kind == "vtu":
        variants = [data for _, data in vtu_variants(grid_of(mesh))][::5]
    else:
        variants = [vtp_of(polydata_of(mesh), mode) for mode in (0, 1, 2)]
    for data in variants:
        path = tmp_path / f"a.{kind}"
        path.write_bytes(data)
        result, new, _ = updated(path, tmp_path)
        found = gmsnet.read(new).point_data["Normals"]
        assert np.isnan(found[::3]).all()
        kept, after = ~np.isnan(before[:, 0]), plain.normals_of_points(plain.faces_of(mesh), result.points)
        moved = around(mesh, result.moved)[1]
        check(found[kept], gmsnet.read(path).point_data["Normals"][kept], after[kept], moved[kept], 1e-6)


def vtp_of(poly, mode):
    import vtk

    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetDataMode(mode)
    writer.SetInputData(poly)
    writer.WriteToOutputStringOn()
    assert writer.Write()
    text = writer.GetOutputString()
    return text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape")


def test_what_is_converted_has_new_normals_too(tmp_path):
    mesh, _, before = sheet()
    path = tmp_path / "a.ply"
    path.write_bytes(next(data for name, data in plain.ply_variants(mesh, before) if name == "ascii double double"))
    result, _, _ = updated(path, tmp_path)
    gmsnet.write(result.mesh, tmp_path / "a.vtu")
    read = gmsnet.read(tmp_path / "a.vtu")
    for axis in ("nx", "ny", "nz"):
        assert np.array_equal(read.point_data[axis], result.mesh.point_data[axis])


def test_formats_whose_normals_are_not_found_say_so(tmp_path):
    pytest.importorskip("meshio")
    mesh, _, before = sheet()
    gmsnet.write(replace(mesh, point_data={"Normals": before}), tmp_path / "a.vtk")
    import meshio

    meshio.write(tmp_path / "a.xdmf", meshio.read(tmp_path / "a.vtk"), data_format="XML")
    result = gmsnet.smooth(gmsnet.read(tmp_path / "a.xdmf"), update_normals=True)
    lost = gmsnet.write(result.mesh, tmp_path / "b.xdmf")
    assert len(lost) == 1
    assert "normals (Normals) stay as they are in XDMF files" in lost[0]
    assert np.array_equal(gmsnet.read(tmp_path / "b.xdmf").point_data["Normals"], before)
    gmsnet.write(result.mesh, tmp_path / "b.vtu")
    moved = around(mesh, result.moved)[1]
    after = plain.normals_of_points(plain.faces_of(mesh), result.points)
    check(gmsnet.read(tmp_path / "b.vtu").point_data["Normals"], before, after, moved, EXACT)


def test_a_mesh_without_normals_is_told(tmp_path):
    mesh, _, _ = sheet()
    result = gmsnet.smooth(mesh, update_normals=True)
    said = "update_normals: the mesh and its file have no normals that are known, or all are 0"
    assert said in result.notes
    path = tmp_path / "a.stl"
    path.write_bytes(plain.binary_stl(mesh, np.zeros_like(plain.normals_of_faces(plain.faces_of(mesh), mesh.points))))
    result, new, old = updated(path, tmp_path)
    assert said in result.notes
    assert new.read_bytes() == old.read_bytes()


@pytest.mark.parametrize("kind", ["plane", "volume"])
def test_what_is_no_surface_is_told(kind):
    """So that many files can be smoothed in one call, of which some are flat."""
    mesh = random_mesh(50, seed=0) if kind == "plane" else mesh_of(*cube(30))
    result, plain_one = gmsnet.smooth(mesh, update_normals=True), gmsnet.smooth(mesh)
    assert "update_normals: this mesh is no surface in space, so normals stay" in result.notes
    assert np.array_equal(result.points, plain_one.points)


def test_what_cannot_be_is_refused(tmp_path):
    mesh, _, before = sheet()
    with pytest.raises(InputError, match="update_normals is of files and of meshes"):
        gmsnet.smooth((mesh.points, plain.faces_of(mesh)), update_normals=True)
    with pytest.raises(InputError, match="update_normals must be True or False"):
        gmsnet.smooth(mesh, update_normals=1)
    path = tmp_path / "a.obj"
    text = plain.obj(mesh, before, True)
    for old, new, said in (
        ("vn ", "vn x ", r"line \d+: 'vn' takes three numbers, found 4"),
        ("//5 ", f"//{len(before) + 1} ", f"the normal {len(before) + 1} is named, but there are"),
    ):
        path.write_text(text.replace(old, new, 1))
        assert path.read_text() != text
        with pytest.raises(FormatError, match=r"a\.obj: its normals: .*" + said):
            gmsnet.smooth(gmsnet.read(path), update_normals=True)


def test_no_numbers_and_no_area_stay(tmp_path):
    mesh, of_faces, _ = sheet()
    before = of_faces.copy()
    before[:5] = np.nan
    path = tmp_path / "a.stl"
    path.write_bytes(plain.binary_stl(mesh, before))
    result, new, _ = updated(path, tmp_path)
    assert np.isnan(plain.binary_normals(new)[:5]).all()
    path.write_text(plain.text_stl(mesh, before))
    result, new, _ = updated(path, tmp_path)
    assert np.isnan(plain.numbers_behind(new, "facet", "normal")[:5]).all()
    assert result.moved.any()


def test_names():
    yes = ["Normals", "normal", "point_normals", "Cell Normals", "facet-normals", "nx"]
    no = ["NormalStress", "normal_force", "abnormal", "normals2", "n", "x"]
    assert [name for name in [*yes, *no] if names_normals(name)] == yes


def test_corners_follow_their_blocks():
    mesh, of_faces, _ = sheet("mixed")
    corners = FaceCorners.of(mesh.cells)
    assert corners.node.tolist() == [node for face in plain.faces_of(mesh) for node in face]
    assert np.array_equal(corners.face, corners.cell)
    total = np.zeros_like(of_faces)
    np.add.at(total, corners.face, corner_normals(mesh.cells, mesh.points))
    total /= np.linalg.norm(total, axis=1)[:, None]
    assert abs(total - of_faces).max() < 1e-14
