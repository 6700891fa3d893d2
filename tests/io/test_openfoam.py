"""OpenFOAM cases: text, binary and compressed; one layer between empty patches; cells from faces; damage."""

from __future__ import annotations

import gzip
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import moved_points, spliced
from support.damage import FEW, cells_of, damaged, facts, read_or_refuse, regions_of
from support.foam import FORMS, POINTS, VOLUMES, head, in_binary, in_text, layer, poly_mesh

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.io import openfoam
from gmsnet.mesh.mesh import Mesh

MESHES = os.environ.get("GMSNET_MESHES", "")


def mesh_of(files: dict[str, bytes]) -> Mesh:
    parsed = openfoam.read(files)
    return Mesh(parsed.points, tuple(parsed.cells), parsed.region_names, single=parsed.single)


def check(files: dict[str, bytes]) -> None:
    """Equal points give the same file; others read back, and nothing else changes."""
    parsed = openfoam.read(files)
    assert spliced(parsed.slots, files["points"], parsed.points, parsed.points.copy()) == files["points"]
    new = moved_points(parsed)
    out = {**files, "points": spliced(parsed.slots, files["points"], parsed.points, new)}
    again = openfoam.read(out)
    assert again.points.tolist() == new.tolist()
    assert facts(again)[1:] == facts(parsed)[1:]
    assert (
        spliced(again.slots, out["points"], new, parsed.points).split() == files["points"].split()
        or parsed.single
        or (b"format ascii" in files["points"])
    )


@pytest.mark.parametrize("form", FORMS)
def test_cells_are_made_of_faces(form: str) -> None:
    files = FORMS[form](VOLUMES)
    parsed = openfoam.read(files)
    assert parsed.single == (form == "single")
    np.testing.assert_allclose(parsed.points, POINTS, rtol=1e-6)
    for kind, nodes in (("hexahedron", range(8)), ("wedge", range(4, 10)), ("pyramid", [1, 2, 5, 6, 10]),
                        ("tetra", [5, 6, 10, 11])):  # fmt: skip
        (cell,) = cells_of(parsed, kind)
        assert sorted(cell) == sorted(nodes)
    for block in parsed.cells:  # all are wound as their kind wants it
        for simplex in block.cell.simplices if block.dimension == 3 else ():
            a, b, c, d = parsed.points[block.nodes[0][list(simplex)]]
            assert np.linalg.det([b - a, c - a, d - a]) > 0
    assert dict(parsed.region_names) == {(2, 1): "walls"}
    assert len(cells_of(parsed, "triangle")) + len(cells_of(parsed, "quad")) == len(VOLUMES["faces"]) - 3  # type: ignore[arg-type]
    check(files)


REMARKS = (b" // (9 9 9) 8", b" /* (1 2)\n 3 */")


@pytest.mark.parametrize("remark", REMARKS)
@pytest.mark.parametrize("name", ["points", "faces", "owner", "neighbour"])
def test_comments_may_stand_in_lists(name: str, remark: bytes) -> None:
    files = in_text(VOLUMES)
    data = files[name]
    begin = data.index(b"\n(\n") + 2
    told = data[:begin] + data[begin:].replace(b"\n", remark + b"\n")
    assert told.count(remark) > 4
    assert facts(openfoam.read({**files, name: told})) == facts(openfoam.read(files))
    check({**files, name: told})


@pytest.mark.parametrize("form", FORMS)
def test_one_layer_is_a_plane(form: str, tmp_path: Path) -> None:
    case = save(FORMS[form](layer()), tmp_path / "case")
    mesh = gmsnet.read(case)
    assert len(mesh.points) == 16
    assert {b.kind: len(b.nodes) for b in mesh.cells if b.dimension == 2} == {"quad": 5, "triangle": 8}
    assert {key: len(nodes) for key, nodes in mesh.markers.items()} == {"inlet": 4, "rest": 10}
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    assert gmsnet.write(result.mesh, case) == []
    again = openfoam.coordinates(data := (tmp_path / "case/constant/polyMesh/points").read_bytes(),
                                 openfoam.head_of(data, "points"), "points")[0]  # fmt: skip
    assert again[:16, :2].tolist() == again[16:, :2].tolist() == result.mesh.points[:, :2].tolist()
    assert set(again[:16, 2]) == {0.0}
    assert set(again[16:, 2]) == {0.5}
    check(FORMS[form](layer()))


def test_what_is_no_layer_is_held() -> None:
    lists = layer(split=False)
    lists["points"][20][0] += 0.05  # type: ignore[index]
    parsed = openfoam.read(in_text(lists))
    assert [b.kind for b in parsed.cells if b.dimension == 3] == ["hexahedron"]
    result = gmsnet.smooth(Mesh(parsed.points, tuple(parsed.cells)))
    assert not result.moved.any()
    assert sum(map(len, result.held.values())) == len(parsed.points)


def test_other_planes_and_polygons() -> None:
    lists = layer()
    lists["points"] = [[x, z, y] for x, y, z in lists["points"]]  # type: ignore[attr-defined]
    parsed = openfoam.read(files := in_text(lists))
    assert parsed.points.tolist() == openfoam.read(in_text(layer())).points.tolist()
    new = parsed.points + np.array([0.0, 0.25])
    moved = spliced(parsed.slots, files["points"], parsed.points, new)
    again = openfoam.coordinates(moved, openfoam.head_of(moved, "points"), "points")[0]
    assert again.tolist() == [[x, y, z + 0.25] for x, y, z in lists["points"]]  # type: ignore[attr-defined]
    two = layer(2, 1, split=False)
    merged = [[0, 1, 2, 5, 4, 3][::-1], [6, 7, 8, 11, 10, 9]]
    merged += [[p, q, q + 6, p + 6] for p, q in ((0, 1), (1, 2), (2, 5), (5, 4), (4, 3), (3, 0))]
    lists = poly_mesh(two["points"], [merged], lambda face: "sides" if len(face) == 6 else "rest")
    assert len(cells_of(openfoam.read(in_text(lists)), "polygon")) == 1


def test_other_cells_are_polyhedra_and_held() -> None:
    prism = [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9]] + [[k, (k + 1) % 5, 5 + (k + 1) % 5, 5 + k] for k in range(5)]
    angle = 2 * np.pi * np.arange(5) / 5
    points = [[np.cos(a), np.sin(a), z] for z in (0.0, 1.0) for a in angle]
    parsed = openfoam.read(in_text(poly_mesh(points, [prism])))
    assert cells_of(parsed, "polyhedron") == [list(range(10))]
    assert len(cells_of(parsed, "polygon")) == 2


def test_zones_are_regions_and_hold() -> None:
    files = in_text(VOLUMES)
    zone = "{}\n{{\n type cellZone;\ncellLabels List<label> {};\n}}\n"
    zone = f"2\n(\n{zone.format('porous', '2(1 2)')}{zone.format('empty', '0()')})\n"
    files["cellZones"] = (head("regIOobject", "cellZones") + zone).encode()
    face = "1\n(\nfan\n{\n type faceZone;\nfaceLabels List<label> 1{0};\nflipMap List<bool> 1{0};\n}\n)\n"
    files["faceZones"] = (head("regIOobject", "faceZones") + face).encode()
    parsed = openfoam.read(files)
    assert [regions_of(parsed, kind) for kind in ("hexahedron", "wedge", "pyramid", "tetra")] == [[0], [1], [1], [0]]
    assert dict(parsed.region_names)[3, 1] == "porous"
    assert sorted(cells_of(parsed, "vertex")) == [[k] for k in sorted(VOLUMES["faces"][0])]  # type: ignore[index]
    files["cellZones"] = files["cellZones"].replace(b"(1 2)", b"(1 9)")
    with pytest.raises(FormatError, match="cellZones: a zone names 9, but there are 4 of these"):
        openfoam.read(files)


@FEW
@given(st.sampled_from(["points", "faces", "owner", "neighbour", "boundary"]), st.sampled_from(["text", "binary"]))
def test_a_cut_is_refused(name: str, form: str) -> None:
    files = FORMS[form](layer(2, 2))
    whole = facts(openfoam.read(files))
    last = files[name].rindex(b")")
    for cut in range(len(files[name])):
        parsed = read_or_refuse(openfoam, {**files, name: files[name][:cut]})
        assert parsed is None or (cut > last and facts(parsed) == whole), f"{name} cut at {cut}"


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    files = FORMS[data.draw(st.sampled_from(sorted(FORMS)))](data.draw(st.sampled_from([VOLUMES, layer(2, 2)])))
    name = data.draw(st.sampled_from(sorted(files)))
    read_or_refuse(openfoam, {**files, name: data.draw(damaged(files[name]))})


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("points", b"FoamFile", b"Foam", r"points: 'FoamFile \{…\}' is missing"),
        ("points", b"ascii", b"coded", r"points: the header says .* only ascii and binary"),
        ("points", b"12\n(", b"13\n(", r"expected 3 more numbers|was expected behind the 39 numbers"),
        ("points", b"12\n(", b"11\n(", r"points: \)\) was expected behind the last point"),
        ("points", b"(1.0 0.0 0.0)", b"(1.0 x 0.0)", r"a number was expected, found 'x'"),
        ("faces", b"4(1 2 6 5)", b"4(1 2 6)", r"line \d+: faces: a face does not have as many points as it says"),
        ("faces", b"4(1 2 6 5)", b"4(1 2 6 12)", r"faces: a face names the point 12, but the points are 0 to 11"),
        ("faces", b"faceList", b"faceLists", r""),
        ("owner", b"(\n0\n", b"(\n0\n0\n", r"owner: \) was expected behind the 17 numbers"),
        ("owner", b"(\n0\n", b"(\n-1\n", r"owner: a face names the cell"),
        ("boundary", b"nFaces 14", b"nFaces 13", r"boundary: 1 of 1 patches have 13 of 14 faces"),
        ("boundary", b"startFace 3", b"startFace 4", r"boundary: the patch 'walls' begins at face 4, not 3"),
        ("boundary", b"nFaces 14;", b"", r"boundary: the patch 'walls' has no nFaces"),
    ],
)
def test_what_is_wrong_is_named(name: str, old: bytes, new: bytes, message: str) -> None:
    files = in_text(VOLUMES)
    assert old in files[name]
    files[name] = files[name].replace(old, new, 1)
    if not message:  # another class of text is no harm
        openfoam.read(files)
        return
    with pytest.raises(FormatError, match=message):
        openfoam.read(files)


def save(files: dict[str, bytes], case: Path) -> Path:
    folder = case / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return case


@pytest.mark.parametrize("way", ["", "constant/polyMesh", "constant/polyMesh/points", "case.foam"])
def test_a_case_is_found_by_each_of_its_names(way: str, tmp_path: Path) -> None:
    case = save(in_text(layer()), tmp_path / "case")
    (case / "case.foam").touch()
    mesh = gmsnet.read(case / way)
    old = {path.name: path.stat().st_mtime_ns for path in (case / "constant/polyMesh").iterdir()}
    moved = mesh.points.copy()
    moved[5, 0] += 0.125
    assert gmsnet.write(mesh.with_points(moved), case / way) == []
    assert gmsnet.read(case).points.tolist() == moved.tolist()
    new = {path.name: path.stat().st_mtime_ns for path in (case / "constant/polyMesh").iterdir()}
    assert {name for name in old if old[name] != new[name]} == {"points"}  # the others are not written


def test_compressed_files_stay_compressed(tmp_path: Path) -> None:
    case = save(in_binary(layer()), tmp_path / "case")
    folder = case / "constant/polyMesh"
    for name in ("points", "owner"):
        (folder / f"{name}.gz").write_bytes(gzip.compress((folder / name).read_bytes()))
        (folder / name).unlink()
    result = gmsnet.smooth(gmsnet.read(case))
    assert gmsnet.write(result.mesh, case) == []
    assert not (folder / "points").exists()
    assert gmsnet.read(case).points.tolist() == result.mesh.points.tolist()
    twin = save(in_text(layer()), tmp_path / "twin")
    assert gmsnet.write(gmsnet.read(case), twin) == []
    assert gmsnet.read(twin).points.tolist() == result.mesh.points.tolist()


def test_where_no_case_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is a folder"):
        gmsnet.read(tmp_path)
    with pytest.raises(InputError, match="give the folder that holds constant/polyMesh"):
        gmsnet.read(tmp_path, "openfoam")
    case = save(in_text(layer()), tmp_path / "case")
    (case / "constant/polyMesh/owner").unlink()
    with pytest.raises(InputError, match="owner: there is no such file"):
        gmsnet.read(case)
    mesh = Mesh([[0, 0], [1, 0], [0, 1]], gmsnet.read(save(in_text(layer()), tmp_path / "b")).cells[:0])
    with pytest.raises(FormatError, match="written into their own case only"):
        gmsnet.write(mesh, case)


@pytest.mark.skipif(not MESHES, reason="GMSNET_MESHES does not name a folder of meshes")
def test_a_real_case(tmp_path: Path) -> None:
    shutil.copytree(Path(MESHES) / "formats" / "cavity", tmp_path / "cavity")
    points = tmp_path / "cavity/constant/polyMesh/points"
    points.chmod(0o600)
    points.parent.chmod(0o700)
    before = points.read_bytes()
    mesh = gmsnet.read(tmp_path / "cavity")
    assert [(b.kind, len(b.nodes)) for b in mesh.cells] == [("quad", 16), ("line", 4), ("line", 12)]
    assert gmsnet.write(mesh, tmp_path / "cavity") == []
    assert points.read_bytes() == before
    bad = mesh.points.copy()
    bad[6, :2] += 0.006, -0.003
    assert gmsnet.write(mesh.with_points(bad), tmp_path / "cavity") == []
    result = gmsnet.smooth(gmsnet.read(tmp_path / "cavity"))
    assert result.after.shape.min() > result.before.shape.min()
    assert gmsnet.write(result.mesh, tmp_path / "cavity") == []
    old, new = before.splitlines(), points.read_bytes().splitlines()
    assert len(old) == len(new)
    assert sum(a != b for a, b in zip(old, new, strict=True)) == 2 * result.moved.sum()
