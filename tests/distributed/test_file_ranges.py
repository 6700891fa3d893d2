"""Binary files that ranks share: each reads some of the cells, and what is written has the bytes of one process."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed import file_ranges, moved
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.gathered import gathered
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.errors import InputError
from gmsnet.generate import random_mesh, random_volume, recombine
from gmsnet.io import ugrid
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import held_by_data, images
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from support.comm import together

SIZE = 4  # cells along the edge of a block


def mixed() -> Mesh:
    """A block of hexahedra, wedges, pyramids and tetrahedra, whose inner nodes are thrown; cells in a wild order, faces
    of two surfaces, and a node that no cell has."""
    random, wide = np.random.default_rng(4), SIZE + 1
    points = np.array([[x, y, z] for z in range(wide) for y in range(wide) for x in range(wide)], dtype=np.float64)
    inner = ((points > 0) & (points < SIZE)).all(axis=1)
    points[inner] += random.uniform(-0.2, 0.2, (int(inner.sum()), 3))
    found: dict[str, list[list[int]]] = {"tetra": [], "pyramid": [], "wedge": [], "hexahedron": []}
    centres = []
    for x, y, z in np.ndindex(SIZE, SIZE, SIZE):
        a, b, c, d = (i + wide * (j + wide * z) for i, j in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)))
        e, f, g, h = (k + wide * wide for k in (a, b, c, d))
        if x == 0:  # six pyramids around its middle, of which those at the boundary are halved
            top = len(points) + len(centres)
            centres.append(points[[a, b, c, d, e, f, g, h]].mean(axis=0))
            sides = [[a, b, c, d], [e, h, g, f], [a, e, f, b], [c, g, h, d], [b, f, g, c], [a, d, h, e]]
            found["pyramid"] += [[*side, top] for side in sides[:5]]
            found["tetra"] += [[a, d, h, top], [a, h, e, top]]
        elif x == 1:
            found["wedge"] += [[a, b, c, e, f, g], [a, c, d, e, g, h]]
        else:
            found["hexahedron"].append([a, b, c, d, e, f, g, h])
    points = np.concatenate([points, centres, [[9.0, 9.0, 9.0]]])
    faces = {"triangle": [cell[:3] for cell in found["tetra"] if (points[cell[:3], 0] == 0).all()],
             "quad": [[cell[1], cell[2], cell[6], cell[5]] for cell in found["hexahedron"]
                      if (points[[cell[1], cell[2], cell[6], cell[5]], 0] == SIZE).all()]}  # fmt: skip
    blocks = [CellBlock(kind, np.array(cells), np.arange(len(cells)) % 2 + 3) for kind, cells in faces.items()]
    for kind, cells in found.items():
        rows = random.permutation(np.array(cells))
        blocks.append(CellBlock(kind, rows, np.zeros(len(rows), dtype=np.int64)))
    return Mesh(points, tuple(blocks))


def save_vtkhdf(mesh: Mesh, path: Path, kind: type = np.float64, **how: object) -> Path:
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"], root.attrs["Type"] = [1, 0], np.bytes_("UnstructuredGrid")
        nodes = np.concatenate([block.nodes.ravel() for block in mesh.cells])
        sizes = np.concatenate([np.full(len(block.nodes), block.nodes.shape[1]) for block in mesh.cells])
        for name, value in (("Points", len(mesh.points)), ("Cells", len(sizes)), ("ConnectivityIds", len(nodes))):
            root.create_dataset(f"NumberOf{name}", data=[value])
        points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
        root.create_dataset("Points", data=points.astype(kind), **how)
        root.create_dataset("Connectivity", data=nodes)
        root.create_dataset("Offsets", data=np.concatenate([[0], np.cumsum(sizes)]))
        root.create_dataset("Types", data=np.concatenate([np.full(len(b.nodes), CODES[b.kind]) for b in mesh.cells]))
    return path


CODES = {"line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}


def save_vtu(
    mesh: Mesh, path: Path, kind: type = np.float64, order: str = "<", header: str = "u8", more: str = ""
) -> Path:
    """With raw appended arrays. more: XML of further arrays of the cells, whose numbers are those of the types."""
    nodes = np.concatenate([block.nodes.ravel() for block in mesh.cells])
    sizes = np.concatenate([np.full(len(block.nodes), block.nodes.shape[1]) for block in mesh.cells])
    codes = np.concatenate([np.full(len(block.nodes), CODES[block.kind]) for block in mesh.cells])
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1]))).astype(kind)
    arrays = {
        "connectivity": nodes.astype(np.int32), "offsets": np.cumsum(sizes).astype(np.int64),
        "types": codes.astype(np.uint8), "Points": points, "more": codes.astype(np.uint8),
    }  # fmt: skip
    data, at = b"", {}
    for name, values in arrays.items():
        at[name] = len(data)
        stored = values.astype(values.dtype.newbyteorder(order)).tobytes()
        data += np.array([len(stored)], dtype=order + header).tobytes() + stored
    real = f"Float{8 * np.dtype(kind).itemsize}"
    text = f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{"LittleEndian" if order == "<" else "BigEndian"}"
 header_type="UInt{8 * int(header[1])}"><UnstructuredGrid>
<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(codes)}">
{more.format(offset=at["more"])}
<Points>
<DataArray type="{real}" Name="Points" NumberOfComponents="3" format="appended" offset="{at["Points"]}"/>
</Points>
<Cells><DataArray type="Int32" Name="connectivity" format="appended" offset="{at["connectivity"]}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{at["offsets"]}"/>
<DataArray type="UInt8" Name="types" format="appended" offset="{at["types"]}"/></Cells>
</Piece></UnstructuredGrid>
<AppendedData encoding="raw">
_"""
    path.write_bytes(text.encode() + data + b"\n</AppendedData>\n</VTKFile>\n")
    return path


def save_ugrid(mesh: Mesh, path: Path) -> Path:
    gmsnet.write(mesh, path)
    return path


SAVED = {
    **{form: lambda folder, form=form: save_ugrid(mixed(), folder / f"a.{form}.ugrid") for form in ugrid.FORMS},
    "b8, and more": lambda folder: _longer(save_ugrid(mixed(), folder / "a.b8.ugrid")),
    "faces": lambda folder: save_ugrid(_in_space(random_mesh(300, seed=1)), folder / "a.lb8.ugrid"),
    "vtu": lambda folder: save_vtu(mixed(), folder / "a.vtu"),
    "vtu, single": lambda folder: save_vtu(_in_runs(), folder / "a.vtu", np.float32, header="u4"),
    "vtu, big-endian": lambda folder: save_vtu(random_volume(200, seed=1), folder / "a.vtu", order=">"),
    "vtkhdf": lambda folder: save_vtkhdf(random_volume(200, seed=1), folder / "a.vtkhdf"),
    "vtkhdf, single": lambda folder: save_vtkhdf(_in_runs(), folder / "a.vtkhdf", np.float32),
}


def _longer(path: Path) -> Path:
    path.write_bytes(path.read_bytes() + b"what follows")
    return path


def _in_space(mesh: Mesh) -> Mesh:
    return Mesh(np.column_stack([mesh.points, np.full(len(mesh.points), 0.5)]), mesh.cells)


def _in_runs() -> Mesh:
    """Triangles, quads and triangles again."""
    whole = recombine(random_mesh(300, seed=3))
    of = {block.kind: block.nodes for block in whole.cells}
    triangles, quads = of["triangle"], of["quad"]
    some = len(triangles) // 2
    parts = (("triangle", triangles[:some]), ("quad", quads), ("triangle", triangles[some:]))
    return Mesh(
        whole.points, tuple(CellBlock(kind, nodes, np.zeros(len(nodes), dtype=np.int64)) for kind, nodes in parts)
    )


def format_of(kind: str) -> str:
    return next((key for key in ("vtkhdf", "vtu") if kind.startswith(key)), "ugrid")


def assert_read_alike(path: Path, format: str, ranks: int) -> None:
    mesh = gmsnet.read(path)
    assert planned_format(str(path), format) == format
    whole = together(ranks, lambda comm: gathered(read_ranges(str(path), format, comm).piece, comm))[0]
    assert whole.ids.tolist() == list(range(len(mesh.points)))
    assert whole.mesh.points.tobytes() == mesh.points.tobytes()
    assert whole.mesh.single == mesh.single
    assert whole.mesh.markers.keys() == mesh.markers.keys() or mesh.node_sets
    held = images(mesh)
    if "fixed" in mesh.point_data:
        held |= held_by_data(mesh.point_data["fixed"])
    assert whole.fixed.tolist() == held.tolist()
    assert [block.kind for block in whole.mesh.cells] == [block.kind for block in mesh.cells]
    for mine, block in zip(whole.mesh.cells, mesh.cells, strict=True):
        assert mine.nodes.tolist() == block.nodes.tolist()
        assert mine.regions.tolist() == block.regions.tolist()


def assert_bytes_of_one_process(path: Path, format: str, ranks: int, method: str) -> None:
    """Into another file, and in place."""
    before, end = path.read_bytes(), path.name.removeprefix("a")
    serial, shared = path.with_name(f"serial{end}"), path.with_name(f"shared{end}")
    gmsnet.write(gmsnet.smooth(gmsnet.read(path), method, max_sweeps=4).mesh, serial)
    options = SmoothOptions(method=method, max_sweeps=4, threads=1)
    for target in (shared, path):
        task = FileTask(str(path), str(target), format, options)
        together(ranks, lambda comm, task=task: smooth_file(task, comm))
        assert target.read_bytes() == serial.read_bytes() != before


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", SAVED)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(SAVED[kind](tmp_path), format_of(kind), ranks)


@pytest.mark.parametrize(("ranks", "method"), [(1, "barrier"), (2, "auto"), (3, "laplacian"), (5, "barrier")])
@pytest.mark.parametrize(
    "kind", ["lb8", "r4", "b8, and more", "faces", "vtu", "vtu, single", "vtu, big-endian", "vtkhdf", "vtkhdf, single"]
)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(SAVED[kind](tmp_path), format_of(kind), ranks, method)


def test_each_rank_has_cells_that_lie_together(tmp_path: Path) -> None:
    """Though a file lists them in a wild order; and no rank has all the nodes."""
    mesh = random_volume(2000, seed=2)
    rows = np.random.default_rng(0).permutation(len(mesh.cells[0].nodes))
    wild = Mesh(mesh.points, (CellBlock("tetra", mesh.cells[0].nodes[rows], np.zeros(len(rows), dtype=np.int64)),))
    path = save_ugrid(wild, tmp_path / "a.lb8.ugrid")
    pieces = together(4, lambda comm: read_ranges(str(path), "ugrid", comm).piece)
    assert sum(len(piece.blocks[0].nodes) for piece in pieces) == len(rows)
    for piece in pieces:
        assert len(piece.blocks[0].nodes) < 0.4 * len(rows)
        assert len(piece.ids) < 0.5 * len(mesh.points)


def test_more_ranks_than_cells(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    block = CellBlock("tetra", np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=np.int64))
    path = save_ugrid(Mesh(points, (block,)), tmp_path / "a.b8.ugrid")
    pieces = together(6, lambda comm: read_ranges(str(path), "ugrid", comm).piece)
    assert sum(len(piece.blocks[0].nodes) for piece in pieces) == 1
    assert np.unique(np.concatenate([piece.ids for piece in pieces])).tolist() == [0, 1, 2, 3]


def test_which_files_are_shared(tmp_path: Path) -> None:
    path = str(save_ugrid(mixed(), tmp_path / "a.lb8.ugrid"))
    assert shared_format(path, str(tmp_path / "b.lb8.ugrid")) == "ugrid"
    assert shared_format(path, path) == "ugrid"
    for target in ("b.b8.ugrid", "b.ugrid", "b.lb8.ugrid.gz", "b.vtu"):
        assert shared_format(path, str(tmp_path / target)) == ""
    text = str(save_ugrid(mixed(), tmp_path / "a.ugrid"))
    assert shared_format(text, str(tmp_path / "b.ugrid")) == ""
    assert shared_format(str(tmp_path / "none.lb8.ugrid"), str(tmp_path / "b.lb8.ugrid")) == ""


@pytest.mark.parametrize(
    ("name", "kind", "shared"),
    [
        ("PointData/fixed", np.float64, "vtkhdf"),
        ("CellData/material", np.int32, "vtkhdf"),
        ("CellData/material", np.float32, ""),
        ("CellData/vtkGhostType", np.uint8, "vtkhdf"),
    ],
)
def test_fields_that_mean_more(name: str, kind: type, shared: str, tmp_path: Path) -> None:
    """Those that only a reader of them all understands are for such a one."""
    mesh = random_mesh(50, seed=1)
    path = save_vtkhdf(mesh, tmp_path / "a.vtkhdf")
    rows = len(mesh.points) if name.startswith("Point") else sum(len(block.nodes) for block in mesh.cells)
    with h5py.File(path, "a") as file:
        file["VTKHDF"].create_dataset(name, data=np.zeros(rows, dtype=kind))
    assert planned_format(str(path), "vtkhdf") == shared
    with h5py.File(path, "a") as file:
        del file["VTKHDF"][name]
        file["VTKHDF"].create_dataset(name, data=np.zeros(rows + 1, dtype=kind))
    assert planned_format(str(path), "vtkhdf") == ""


@pytest.mark.parametrize(
    ("more", "shared"),
    [
        ("", "vtu"),
        ('<CellData><DataArray type="UInt8" Name="heat" format="appended" offset="{offset}"/></CellData>', "vtu"),
        ('<CellData><DataArray type="UInt8" Name="material" format="appended" offset="{offset}"/></CellData>', "vtu"),
        (
            '<CellData><DataArray type="UInt8" Name="vtkGhostType" format="appended" offset="{offset}"/></CellData>',
            "vtu",
        ),
        ('<CellData><DataArray type="UInt8" Name="heat" format="appended" offset="3"/></CellData>', ""),
        ('<CellData><DataArray type="UInt8" Name="heat" format="ascii">1 2 3</DataArray></CellData>', ""),
        ("</Piece><Piece>", ""),
    ],
)
def test_which_grids_of_vtu_are_shared(more: str, shared: str, tmp_path: Path) -> None:
    path = save_vtu(random_volume(50, seed=1), tmp_path / "a.vtu", more=more)
    assert planned_format(str(path), "vtu") == shared
    path.write_bytes(path.read_bytes()[:-8])
    assert planned_format(str(path), "vtu") == ""


def test_text_of_vtu_is_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    gmsnet.write(random_volume(50, seed=1), tmp_path / "a.vtu")
    assert planned_format(str(tmp_path / "a.vtu"), "vtu") == ""


def heard(ranks: int, path: Path, kind: str, options: SmoothOptions | None = None) -> list[str]:
    """What all ranks say that fail to smooth a file in place."""
    found, options = list[str](), options or SmoothOptions(method="barrier", max_sweeps=2, threads=1)

    def one(comm):
        with pytest.raises(InputError) as raised:
            smooth_file(FileTask(str(path), str(path), kind, options), comm)
        found.append(str(raised.value))

    together(ranks, one)
    assert len(found) == ranks
    assert len(set(found)) == 1
    return found


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda data: data[:-8], r"a.lb8.ugrid: .*cut off"),
        (
            lambda data: data[:-4] + np.int32(10**6).tobytes(),
            r"byte \d+: a cell names the node 999999, but",
        ),
        (lambda data: data[:28] + np.float64("nan").tobytes() + data[36:], r"byte 28: a coordinate of node 0 .*finite"),
    ],
)
def test_damage_is_named_on_all_ranks(damage, said: str, tmp_path: Path) -> None:
    path = save_ugrid(mixed(), tmp_path / "a.lb8.ugrid")
    path.write_bytes(damage(path.read_bytes()))
    before = saved(tmp_path)
    assert re.search(said, heard(3, path, "ugrid")[0])
    assert saved(tmp_path) == before


def test_a_file_that_others_change_is_not_overwritten(tmp_path: Path, monkeypatch) -> None:
    path = save_ugrid(mixed(), tmp_path / "a.lb8.ugrid")
    write = file_ranges.FileRanges.write

    def changed(self, target, points, comm):
        if comm.rank == 0:
            path.write_bytes(path.read_bytes()[::-1])
        comm.allgather(None)
        write(self, target, points, comm)

    monkeypatch.setattr(file_ranges.FileRanges, "write", changed)
    before = path.read_bytes()
    assert "changed" in heard(3, path, "ugrid")[0]
    assert saved(tmp_path) == {path.name: before[::-1]}


@pytest.mark.parametrize("window", [7, 1000])
def test_the_first_rank_asks_for_few_nodes_at_a_time(window: int, tmp_path: Path, monkeypatch) -> None:
    path, shared = save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), tmp_path / "shared.vtkhdf"
    gmsnet.write(gmsnet.smooth(gmsnet.read(path), "barrier", max_sweeps=4).mesh, tmp_path / "serial.vtkhdf")
    monkeypatch.setattr(file_ranges, "AT_ONCE", 240)
    monkeypatch.setattr(moved, "WINDOW", window)
    options = SmoothOptions(method="barrier", max_sweeps=4, threads=1)
    together(3, lambda comm: smooth_file(FileTask(str(path), str(shared), "vtkhdf", options), comm))
    assert shared.read_bytes() == (tmp_path / "serial.vtkhdf").read_bytes() != path.read_bytes()


@pytest.mark.parametrize("begin", [0, 20])
def test_a_failure_leaves_the_file(begin: int, tmp_path: Path, monkeypatch) -> None:
    path = save_ugrid(mixed(), tmp_path / "a.lb8.ugrid")
    before, spliced = saved(tmp_path), file_ranges.FileRanges._spliced

    def broken(self, column, rows, first, last, moved):
        if first >= begin:
            raise InputError("the disk is broken")
        return spliced(self, column, rows, first, last, moved)

    monkeypatch.setattr(file_ranges, "AT_ONCE", 240)
    monkeypatch.setattr(file_ranges.FileRanges, "_spliced", broken)
    assert heard(3, path, "ugrid")[0] == "the disk is broken"
    assert saved(tmp_path) == before
