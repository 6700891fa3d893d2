"""Meshes in several files of VTK (.pvtu, .pvtp, .vtm): one mesh, written back piece by piece."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from support.contracts import contents
from support.damage import FEW, cells_of, damaged, read_or_refuse, regions_of, triangle_grid
from support.pieces import BLOCKS, index, piece, ring, save_pieces, strips

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.generate import random_mesh
from gmsnet.io import vtk_pieces, vtu
from gmsnet.io.formats import FORMATS
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PVTU = FORMATS["pvtu"].load()


@pytest.fixture(scope="module")
def whole() -> Mesh:
    mesh = random_mesh(300, seed=3)
    return Mesh(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), mesh.cells)


def saved(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def rows(points: np.ndarray) -> list[tuple[float, ...]]:
    return sorted(map(tuple, points.tolist()))


@pytest.mark.parametrize("ids", [False, True])
@pytest.mark.parametrize("ghosts", [False, True])
def test_pieces_are_one_mesh(whole: Mesh, ghosts: bool, ids: bool, tmp_path: Path) -> None:
    path = save_pieces(whole, tmp_path, 4, ghosts, ids)
    mesh = gmsnet.read(path)
    assert rows(mesh.points) == rows(whole.points)
    corners = whole.points[whole.cells[0].nodes].reshape(-1, 9)
    assert rows(mesh.points[mesh.cells[0].nodes].reshape(-1, 9)) == rows(corners)
    order = np.concatenate(strips(whole, 4))
    assert mesh.cell_data["cell"][0].tolist() == (order * 0.5).tolist()
    place = {point: k * 0.25 for k, point in enumerate(map(tuple, whole.points.tolist()))}
    assert mesh.point_data["height"].tolist() == [place[point] for point in map(tuple, mesh.points.tolist())]
    assert gmsnet.quality(mesh).qhat == gmsnet.quality(whole).qhat


@pytest.mark.parametrize("ghosts", [False, True])
def test_smoothed_pieces_agree_where_they_meet(whole: Mesh, ghosts: bool, tmp_path: Path) -> None:
    mesh = gmsnet.read(save_pieces(whole, tmp_path, 4, ghosts))
    before = saved(tmp_path)
    result = gmsnet.smooth(mesh)
    free = gmsnet.smooth(whole)
    assert result.moved.sum() == free.moved.sum()
    assert gmsnet.write(result.mesh, tmp_path / "b.pvtu") == []
    after = saved(tmp_path)
    assert {name: after[name] for name in before} == before
    assert after["b.pvtu"] == before["a.pvtu"].replace(b"a/a_", b"b/a_")
    assert sorted(after) == sorted([*before, "b.pvtu", *(f"b/a_{k}.vtu" for k in range(4))])
    new = {
        tuple(old): tuple(point) for old, point in zip(mesh.points.tolist(), result.mesh.points.tolist(), strict=True)
    }
    for k in range(4):
        old, now = (gmsnet.read(tmp_path / folder / f"a_{k}.vtu") for folder in "ab")
        assert [new[point] for point in map(tuple, old.points.tolist())] == list(map(tuple, now.points.tolist()))
        assert [block.nodes.tolist() for block in now.cells] == [block.nodes.tolist() for block in old.cells]
    again = gmsnet.read(tmp_path / "b.pvtu")
    assert again.points.tolist() == result.mesh.points.tolist()
    assert gmsnet.write(again.with_points(mesh.points), tmp_path / "c.pvtu") == []
    assert {name: saved(tmp_path)[f"c/{name[2:]}"] for name in before if name[1] == "/"} == {
        name: data for name, data in before.items() if name[1] == "/"
    }


def test_in_place_and_in_another_folder(whole: Mesh, tmp_path: Path) -> None:
    path = save_pieces(whole, tmp_path)
    before = saved(tmp_path)
    mesh = gmsnet.read(path)
    points = mesh.points.copy()
    points[:, 0] *= 1.5
    (tmp_path / "out").mkdir()
    gmsnet.write(mesh.with_points(points), tmp_path / "out" / "a.pvtu")
    assert (tmp_path / "out" / "a.pvtu").read_bytes() == before["a.pvtu"]
    assert {name: data for name, data in saved(tmp_path).items() if not name.startswith("out")} == before
    gmsnet.write(mesh.with_points(points), path)
    assert saved(tmp_path / "out") == {name: data for name, data in saved(tmp_path).items() if name[:3] != "out"}
    assert gmsnet.read(path).points.tolist() == points.tolist()


def test_all_or_nothing(whole: Mesh, tmp_path: Path) -> None:
    mesh = gmsnet.read(save_pieces(whole, tmp_path))
    (tmp_path / "b" / "a_2.vtu").mkdir(parents=True)
    before = saved(tmp_path)
    with pytest.raises(InputError, match=r"a_2\.vtu: this is a folder"):
        gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / "b.pvtu")
    assert saved(tmp_path) == before
    (tmp_path / "c").write_text("in the way")
    with pytest.raises(InputError, match="this folder, for the files that the output names, cannot be made"):
        gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / "c.pvtu")
    assert saved(tmp_path) == {**before, "c": b"in the way"}
    piece_of = tmp_path / "a" / "a_1.vtu"
    piece_of.write_bytes(piece_of.read_bytes() + b" ")
    before = saved(tmp_path)
    with pytest.raises(InputError, match=r"a_1\.vtu: others have changed this file"):
        gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / "a.pvtu")
    assert saved(tmp_path) == before
    with pytest.raises(InputError, match=r"nowhere does not exist"):
        gmsnet.write(mesh, tmp_path / "nowhere" / "d.pvtu")
    with pytest.raises(InputError, match="cannot be written to a stream"):
        gmsnet.write(mesh, "-", "pvtu")


def test_a_failure_leaves_no_folder(whole: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = gmsnet.read(save_pieces(whole, tmp_path))

    def full(*_: object) -> None:
        raise InputError("no room")

    monkeypatch.setattr("gmsnet.io.output.replace_files", full)
    with pytest.raises(InputError, match="no room"):
        gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / "b.pvtu")
    assert not (tmp_path / "b").exists()


def _vtu(mesh: Mesh) -> bytes:
    return contents(vtu.write(mesh))[".vtu"]


def files_of(parts: Mapping[str, Mesh | bytes]) -> dict[str, bytes]:
    pieces = {path: part if isinstance(part, bytes) else _vtu(part) for path, part in parts.items()}
    return {".pvtu": index(list(parts)).encode(), **pieces}


def in_turn(parts: Iterable[Mesh]) -> list[bytes]:
    """A .pvtu file and its pieces, called by their numbers."""
    return list(files_of({f"{k}.vtu": part for k, part in enumerate(parts)}).values())


def with_ghosts() -> list[Mesh]:
    """Two pieces, each with the cells of the other one as ghosts, and with ids of points."""
    mesh = triangle_grid(2, 3)
    return [piece(mesh, own, ring(mesh, own), ids=True) for own in strips(mesh, 2)]


SQUARES = {
    name: Mesh(
        np.array([[x, 0.0, 0.0], [x + 1, 0, 0], [x + 1, 1, 0], [x, 1, 0]]),
        (CellBlock("quad", np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=np.int64)),),
    )
    for x, name in enumerate(["l.vtu", "r.vtu"])
}


def test_a_crack_stays_open_and_held(tmp_path: Path) -> None:
    """A part has two points at one place, and so has the other: none is taken for the same node as another one."""
    left, right = SQUARES.values()
    points = np.concatenate([left.points, [[1.0, 1.0, 0.0], [2.0, 3.0, 0.0], [0.0, 3.0, 0.0]]])
    blocks = (*left.cells, CellBlock("triangle", np.array([[4, 5, 6]]), np.zeros(1, dtype=np.int64)))
    parsed = PVTU.read(files_of({"l.vtu": Mesh(points, blocks), "r.vtu": right}))
    assert len(parsed.points) == 10  # only (1, 0) is one node
    assert sorted(tuple(parsed.points[k]) for (k,) in cells_of(parsed, "vertex")) == [(1.0, 1.0, 0.0)] * 3
    assert parsed.region_names[0, 1] == "coincident points and ghost cells"


def test_ids_tell_the_sides_of_a_crack_apart() -> None:
    left, right = SQUARES.values()
    numbered = [
        Mesh(mesh.points, mesh.cells, point_data={"GlobalPointIds": np.array(ids)})
        for mesh, ids in ((left, [0, 1, 2, 3]), (right, [1, 4, 5, 9]))
    ]
    parsed = PVTU.read(files_of(dict(zip(SQUARES, numbered, strict=True))))
    assert len(parsed.points) == 7
    assert cells_of(parsed, "quad") == [[0, 1, 2, 3], [1, 4, 5, 6]]
    named = files_of(dict(zip(SQUARES, numbered, strict=True)))
    for path in SQUARES:
        named[path] = named[path].replace(b"GlobalPointIds", b"mine").replace(
            b"<PointData>", b'<PointData GlobalIds="mine">')  # fmt: skip
    assert len(PVTU.read(named).points) == 7
    assert len(PVTU.read({**named, "l.vtu": _vtu(left)}).points) == 6  # one of them has no ids: places count alone


def test_unused_points_are_nobody_else() -> None:
    left, right = SQUARES.values()
    loose = Mesh(np.concatenate([left.points, [[2.0, 0.0, 0.0]]]), left.cells)
    parsed = PVTU.read(files_of({"l.vtu": loose, "r.vtu": right}))
    assert len(parsed.points) == 7
    assert not cells_of(parsed, "vertex")


def test_ghost_cells_that_no_piece_owns_are_held(whole: Mesh) -> None:
    first, second, third = strips(whole, 3)
    files = files_of({"0.vtu": piece(whole, first), "1.vtu": piece(whole, second, ring(whole, second))})
    parsed = PVTU.read(files)
    assert len(cells_of(parsed, "triangle")) == len(first) + len(second)
    nodes = whole.cells[0].nodes
    lone = ring(whole, second)
    lone = lone[np.isin(lone, third)]
    held = sorted(map(tuple, parsed.points[np.ravel(cells_of(parsed, "vertex"))].tolist()))
    assert held == rows(whole.points[np.unique(nodes[lone])])


def test_a_piece_by_itself_does_not_move_what_others_move(whole: Mesh, tmp_path: Path) -> None:
    own = strips(whole, 3)[1]
    part = piece(whole, own, ring(whole, own))
    gmsnet.write(part, tmp_path / "a.vtu")
    mesh = gmsnet.read(tmp_path / "a.vtu")
    shared = np.unique(mesh.cells[0].nodes[mesh.cell_data["vtkGhostType"][0] == 1])
    assert mesh.markers["ghost cells"].tolist() == shared.tolist()
    assert not gmsnet.smooth(mesh).moved[shared].any()


def test_empty_pieces(whole: Mesh) -> None:
    empty = b"""<VTKFile type="UnstructuredGrid"><UnstructuredGrid>
        <Piece NumberOfPoints="0" NumberOfCells="0"/></UnstructuredGrid></VTKFile>"""
    bare = b"""<VTKFile type="UnstructuredGrid"><UnstructuredGrid/></VTKFile>"""
    left, right = SQUARES.values()
    parsed = PVTU.read(files_of({"0.vtu": empty, "l.vtu": left, "1.vtu": bare, "r.vtu": right}))
    assert len(parsed.points) == 6
    assert sorted(parsed.shares) == ["l.vtu", "r.vtu"]
    with pytest.raises(FormatError, match="no piece has cells"):
        PVTU.read(files_of({"0.vtu": empty, "1.vtu": bare}))


def test_blocks_become_regions_with_their_names() -> None:
    left, right = SQUARES.values()
    blocks = """<Block index="0" name="solids"><DataSet index="0" name="steel" file="l.vtu"/>
        <DataSet index="1" name="none"/></Block>
        <Block index="1" name="air"><Piece index="0"><DataSet index="0" file="r.vtu"/></Piece></Block>"""
    files = {".vtm": BLOCKS.format(blocks=blocks).encode(), "l.vtu": _vtu(left), "r.vtu": _vtu(right)}
    # without the cell field "region" that the writer adds, all of zeros
    parsed = vtk_pieces.vtm.read(files)
    assert regions_of(parsed, "quad") == [1, 2]
    assert parsed.region_names == {(2, 1): "steel", (2, 2): "air"}
    assert len(parsed.points) == 6
    own = triangle_grid(dim=3)
    parsed = vtk_pieces.vtm.read({**files, "l.vtu": _vtu(own)})
    assert set(regions_of(parsed, "triangle")) == {3, 7}


def test_fields_of_some_pieces_are_named(whole: Mesh) -> None:
    left, right = SQUARES.values()
    more = Mesh(left.points, left.cells, point_data={"t": np.arange(4.0)})
    parsed = PVTU.read(files_of({"l.vtu": more, "r.vtu": right}))
    assert not parsed.point_data
    assert list(parsed.unread) == ["the division into 2 files", "the point data 't'"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("../l.vtu", "must lie in the folder of this file or below"),
        ("/tmp/l.vtu", "must lie in the folder of this file or below"),
        ("C:\\l.vtu", "must lie in the folder of this file or below"),
        ("", "must lie in the folder of this file or below"),
        ("./r.vtu", "is named twice"),
        ("l" * 300 + ".vtu", "longer than 250 characters"),
        ("l.vti", r"is neither \.vtu nor \.vtp"),
    ],
)
def test_names_that_are_not_followed(path: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.pvtu").write_text(index(["r.vtu", path]))
    (tmp_path / "r.vtu").write_bytes(_vtu(SQUARES["r.vtu"]))
    with pytest.raises(FormatError, match=rf"a\.pvtu: line 7: Piece: .*{message}"):
        gmsnet.read(tmp_path / "a.pvtu")


def test_errors(tmp_path: Path) -> None:
    (tmp_path / "a.pvtu").write_text(index(["l.vtu", "r.vtu"]))
    (tmp_path / "l.vtu").write_bytes(_vtu(SQUARES["l.vtu"]))
    with pytest.raises(InputError, match=r"a\.pvtu: the file that it names cannot be read: .*r\.vtu: there is no such"):
        gmsnet.read(tmp_path / "a.pvtu")
    (tmp_path / "r.vtu").write_bytes(_vtu(SQUARES["r.vtu"])[:-100])
    with pytest.raises(FormatError, match=r"a\.pvtu: r\.vtu: line \d+: the XML is not well formed"):
        gmsnet.read(tmp_path / "a.pvtu")
    (tmp_path / "a.pvtu").write_text(index([]))
    with pytest.raises(FormatError, match=r"a\.pvtu: no file with cells is named in it"):
        gmsnet.read(tmp_path / "a.pvtu")
    (tmp_path / "a.vtm").write_text(index(["l.vtu"]))
    with pytest.raises(FormatError, match="looks like PVTU, not VTM"):
        gmsnet.read(tmp_path / "a.vtm")


def test_names_with_entities(tmp_path: Path) -> None:
    (tmp_path / "a.pvtu").write_text(index(["p &amp; q/l.vtu"]).replace('Source="', 'note=\'Source="x"\'  Source = "'))
    (tmp_path / "p & q").mkdir()
    (tmp_path / "p & q" / "l.vtu").write_bytes(_vtu(triangle_grid(dim=3)))
    mesh = gmsnet.read(tmp_path / "a.pvtu")
    gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / 'a"b & c.pvtu')
    assert b'Source = "a&quot;b &amp; c/l.vtu"' in (tmp_path / 'a"b & c.pvtu').read_bytes()
    assert gmsnet.read(tmp_path / 'a"b & c.pvtu').points.tolist() == (mesh.points * 2.0).tolist()


FILES = files_of(SQUARES)


@FEW
@given(data=damaged(FILES[".pvtu"]))
def test_damaged_index(data: bytes) -> None:
    from gmsnet.io.vtk_links import links

    try:
        named = links(data)
    except FormatError:
        return
    assert not any(path.startswith("/") or ".." in path.split("/") for path in named)
    if set(named) <= set(FILES):
        read_or_refuse(PVTU, {**FILES, ".pvtu": data})


@FEW
@given(data=damaged(FILES["r.vtu"]))
def test_damaged_piece(data: bytes) -> None:
    read_or_refuse(PVTU, {**FILES, "r.vtu": data})


@pytest.mark.parametrize("generated", [False, True])
def test_files_of_vtk(whole: Mesh, generated: bool, tmp_path: Path) -> None:
    """VTK cuts a mesh, with ghost cells or without, writes it appended and compressed, and reads the result."""
    pyvista = pytest.importorskip("pyvista")
    vtk = pytest.importorskip("vtkmodules.all")
    grid = pyvista.UnstructuredGrid({5: whole.cells[0].nodes}, whole.points)
    cut = vtk.vtkRedistributeDataSetFilter()
    cut.SetInputDataObject(grid)
    cut.SetNumberOfPartitions(4)
    cut.PreservePartitionsInOutputOn()
    if generated:
        more = vtk.vtkGhostCellsGenerator()
        more.SetInputConnection(cut.GetOutputPort())
        more.SetNumberOfGhostLayers(1)
        more.BuildIfRequiredOff()
        cut = more
    cut.Update()
    parts = [cut.GetOutput().GetPartition(k) for k in range(cut.GetOutput().GetNumberOfPartitions())]
    (tmp_path / "p").mkdir()
    for k, part in enumerate(parts):
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetInputData(part)
        writer.SetFileName(str(tmp_path / "p" / f"{k}.vtu"))
        assert writer.Write()
    (tmp_path / "a.pvtu").write_text(index([f"p/{k}.vtu" for k in range(len(parts))]))
    assert any(part.GetCellData().HasArray("vtkGhostType") for part in parts) == generated
    mesh = gmsnet.read(tmp_path / "a.pvtu")
    assert rows(mesh.points) == rows(whole.points)
    result = gmsnet.smooth(mesh)
    gmsnet.write(result.mesh, tmp_path / "b.pvtu")
    read = pyvista.read(tmp_path / "b.pvtu")
    own = read.extract_cells(np.flatnonzero(read.cell_data.get("vtkGhostType", np.zeros(read.n_cells)) == 0))
    assert own.n_cells == len(whole.cells[0].nodes)
    assert rows(np.unique(own.points, axis=0)) == rows(result.mesh.points)


def test_blocks_of_pyvista(tmp_path: Path) -> None:
    """A volume with its surface beside it, which then is a marker."""
    pyvista = pytest.importorskip("pyvista")
    from gmsnet.generate import random_volume

    volume = random_volume(300, seed=1)
    grid = pyvista.UnstructuredGrid({10: volume.cells[0].nodes}, volume.points)
    pyvista.MultiBlock({"inside": grid, "wall": grid.extract_surface(algorithm=None)}).save(tmp_path / "a.vtm")
    mesh = gmsnet.read(tmp_path / "a.vtm")
    assert sorted(mesh.markers) == ["inside", "wall"]
    assert len(mesh.points) == len(volume.points)
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    gmsnet.write(result.mesh, tmp_path / "b.vtm")
    back = pyvista.read(tmp_path / "b.vtm")
    assert rows(back["inside"].points) == rows(result.mesh.points)
    assert set(rows(back["wall"].points)) <= set(rows(back["inside"].points))


def nested_blocks(folder: Path) -> None:
    """a.vtm names a block of pieces and a block of blocks, each in a folder of its own."""
    left, right = SQUARES.values()
    for name in ("solid", "fluid/parts"):
        (folder / name).mkdir(parents=True)
    (folder / "solid/s.pvtu").write_text(index(["s_0.vtu"]))
    (folder / "solid/s_0.vtu").write_bytes(_vtu(left))
    (folder / "fluid/f.vtm").write_text(BLOCKS.format(blocks='<DataSet index="0" file="parts/air.vtu"/>'))
    (folder / "fluid/parts/air.vtu").write_bytes(_vtu(right))
    named = (
        '<DataSet name="steel" file="solid/s.pvtu"/><Block name="all"><DataSet name="air" file="fluid/f.vtm"/></Block>'
    )
    (folder / "a.vtm").write_text(BLOCKS.format(blocks=named))


def test_blocks_that_name_pieces_and_blocks(tmp_path: Path) -> None:
    nested_blocks(tmp_path)
    mesh = gmsnet.read(tmp_path / "a.vtm")
    assert len(mesh.points) == 6
    assert dict(mesh.region_names) == {(2, 1): "steel", (2, 2): "air"}
    before = {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.*")}
    gmsnet.write(mesh, tmp_path / "a.vtm")
    assert {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.*")} == before
    new = mesh.points * 2.0
    gmsnet.write(mesh.with_points(new), tmp_path / "b.vtm")
    assert sorted(str(path.relative_to(tmp_path)) for path in (tmp_path / "b").rglob("*.*")) == [
        "b/fluid/f.vtm", "b/fluid/parts/air.vtu", "b/solid/s.pvtu", "b/solid/s_0.vtu",
    ]  # fmt: skip
    assert gmsnet.read(tmp_path / "b.vtm").points.tolist() == new.tolist()
    assert {path: (tmp_path / path).read_bytes() for path in before} == before
    gmsnet.write(mesh.with_points(new), tmp_path / "a.vtm")
    assert gmsnet.read(tmp_path / "a.vtm").points.tolist() == new.tolist()
    assert (tmp_path / "solid/s.pvtu").read_bytes() == before[Path("solid/s.pvtu")]


def test_errors_of_nested_blocks(tmp_path: Path) -> None:
    nested_blocks(tmp_path)
    inner = tmp_path / "fluid/f.vtm"
    for path, message in (
        ("../solid/s_0.vtu", r"a\.vtm: fluid/f\.vtm: line 4: DataSet: .* must lie in the folder of this file or below"),
        ("f.vtm", r"a\.vtm: fluid/f\.vtm: 'fluid/f\.vtm' is named twice, or names itself"),
        ("none.vtu", r"a\.vtm: the file that it names cannot be read: .*none\.vtu: there is no such file"),
    ):
        inner.write_text(BLOCKS.format(blocks=f'<DataSet index="0" file="{path}"/>'))
        with pytest.raises(InputError, match=message):
            gmsnet.read(tmp_path / "a.vtm")
    inner.write_text(BLOCKS.format(blocks='<DataSet index="0" file="parts/air.vtu"/>'))
    (tmp_path / "solid/s.pvtu").write_text(index(["s_0.vtm"]))
    with pytest.raises(FormatError, match=r"a\.vtm: solid/s\.pvtu: line 6: Piece: .* is neither \.vtu nor \.vtp"):
        gmsnet.read(tmp_path / "a.vtm")
