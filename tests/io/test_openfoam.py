"""OpenFOAM cases: text, binary and compressed; one layer between empty patches; cells from faces; damage."""

from __future__ import annotations

import gzip
import os
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import moved_points, spliced
from support.damage import FEW, cells_of, damaged, facts, read_or_refuse, regions_of

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.io import openfoam
from gmsnet.mesh.mesh import Mesh

MESHES = os.environ.get("GMSNET_MESHES", "")
Lists = dict[str, object]

# A hexahedron, a wedge on it, a pyramid beside it with a tetrahedron on one of its sides.
POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
          [0, 0.5, 1.7], [1, 0.5, 1.7], [2, 0.5, 0.5], [2, 0.5, 2]]  # fmt: skip
CELLS = [
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [0, 4, 7, 3], [1, 2, 6, 5]],
    [[4, 7, 6, 5], [4, 8, 7], [5, 6, 9], [4, 5, 9, 8], [7, 8, 9, 6]],
    [[1, 5, 6, 2], [1, 2, 10], [2, 6, 10], [6, 5, 10], [5, 1, 10]],
    [[6, 10, 5], [6, 11, 10], [10, 11, 5], [5, 11, 6]],
]  # the faces of each, seen from outside counter-clockwise


def poly_mesh(points: object, cells: list[list[list[int]]], patch_of: object = None) -> Lists:
    """The lists of a polyMesh: internal faces by owner and neighbour, then those of the patches."""
    seen: dict[tuple[int, ...], tuple[int, list[int]]] = {}
    inner, outer = [], []
    for cell, faces in enumerate(cells):
        for face in faces:
            key = tuple(sorted(face))
            if key in seen:
                owner, listed = seen.pop(key)
                inner.append((owner, cell, listed))
            else:
                seen[key] = (cell, face)
    choose = patch_of or (lambda face: "walls")
    outer = sorted((choose(face), cell, face) for cell, face in seen.values())  # type: ignore[operator]
    inner.sort()
    names = list(dict.fromkeys(name for name, _, _ in outer))
    counts = [sum(name == other for other, _, _ in outer) for name in names]
    return {
        "points": points, "faces": [face for *_, face in inner] + [face for *_, face in outer],
        "owner": [owner for owner, _, _ in inner] + [cell for _, cell, _ in outer],
        "neighbour": [other for _, other, _ in inner],
        "boundary": [(name, "empty" if name == "sides" else "wall", count, len(inner) + sum(counts[:k]))
                     for k, (name, count) in enumerate(zip(names, counts, strict=True))],
    }  # fmt: skip


def head(kind: str, name: str, form: str = "ascii", arch: str = "") -> str:
    arch = f'    arch "{arch}";\n' * bool(arch)
    entries = f"    format {form};\n    class {kind};\n{arch}    object {name};\n"
    return f"/* made up */\nFoamFile\n{{\n{entries}}}\n// * * //\n\n"


CLASSES = {"points": "vectorField", "faces": "faceList", "owner": "labelList", "neighbour": "labelList",
           "boundary": "polyBoundaryMesh"}  # fmt: skip


def in_text(lists: Lists, end: str = "\n") -> dict[str, bytes]:
    rows = {
        "points": [f"({' '.join(map(repr, map(float, p)))})" for p in lists["points"]],  # type: ignore[attr-defined]
        "faces": [f"{len(f)}({' '.join(map(str, f))})" for f in lists["faces"]],  # type: ignore[attr-defined]
        "owner": [str(k) for k in lists["owner"]], "neighbour": [str(k) for k in lists["neighbour"]],  # type: ignore[attr-defined]
        "boundary": [f"{n}\n{{\n type {t};\n inGroups List<word> 1({t});\n nFaces {c};\n startFace {s};\n}}"
                     for n, t, c, s in lists["boundary"]],  # type: ignore[attr-defined]
    }  # fmt: skip
    return {
        key: (head(CLASSES[key], key) + f"{len(each)}\n(\n" + "\n".join(each) + "\n)\n\n// *** //\n")
        .replace("\n", end)
        .encode()
        for key, each in rows.items()
    }


def in_binary(lists: Lists, label: int = 32, scalar: int = 64, order: str = "<") -> dict[str, bytes]:
    whole, real = {32: "i", 64: "q"}[label], {32: "f", 64: "d"}[scalar]
    arch = f"{'LSB' if order == '<' else 'MSB'};label={label};scalar={scalar}"

    def packed(values: list[float], code: str, count: int | None = None) -> bytes:
        raw = struct.pack(f"{order}{len(values)}{code}", *values)
        return b"%d\n(" % (len(values) if count is None else count) + raw + b")\n"

    corners = [k for face in lists["faces"] for k in face]  # type: ignore[attr-defined]
    offsets = [0, *np.cumsum([len(face) for face in lists["faces"]]).tolist()]  # type: ignore[attr-defined]
    flat = [float(x) for p in lists["points"] for x in p]  # type: ignore[attr-defined]
    bodies = {
        "points": packed(flat, real, len(flat) // 3), "faces": packed(offsets, whole) + b"\n" + packed(corners, whole),
        "owner": packed(lists["owner"], whole), "neighbour": packed(lists["neighbour"], whole),  # type: ignore[arg-type]
    }  # fmt: skip
    kinds = {**CLASSES, "faces": "faceCompactList"}
    made = {key: head(kinds[key], key, "binary", arch).encode() + body for key, body in bodies.items()}
    return {**made, "boundary": in_text(lists)["boundary"]}


VOLUMES = poly_mesh(POINTS, CELLS)


def layer(columns: int = 3, rows: int = 3, split: bool = True) -> Lists:
    """One layer of hexahedra, some of them cut into two wedges, between the empty patch ``sides``."""
    across = (columns + 1) * (rows + 1)
    points = [[x + 0.21 * (0 < x < columns and 0 < y < rows), y, z] for z in (0, 0.5) for y in range(rows + 1)
              for x in range(columns + 1)]  # fmt: skip
    cells = []
    for y in range(rows):
        for x in range(columns):
            a = y * (columns + 1) + x
            quad = [a, a + 1, a + columns + 2, a + columns + 1]
            for polygon in [quad[:3], [quad[0], quad[2], quad[3]]] if split and (x + y) % 2 else [quad]:
                sides = [
                    [p, q, q + across, p + across] for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True)
                ]
                cells.append([polygon[::-1], [k + across for k in polygon], *sides])

    def patch(face: list[int]) -> str:
        levels = {k // across for k in face}
        return "sides" if len(levels) == 1 else "inlet" if all(k % (columns + 1) == 0 for k in face) else "rest"

    return poly_mesh(points, cells, patch)


FORMS = {
    "text": in_text, "text, crlf": lambda lists: in_text(lists, "\r\n"), "binary": in_binary,
    "binary, 64": lambda lists: in_binary(lists, 64), "big endian": lambda lists: in_binary(lists, order=">"),
    "single": lambda lists: in_binary(lists, scalar=32),
}  # fmt: skip


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
