"""CGNS files of one unstructured zone, of which each rank reads some of the cells."""

from __future__ import annotations

import io
from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.cells.table import nodes_of
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, random_volume, recombine
from gmsnet.io import typed_rows
from gmsnet.io.cgns_elements import CGNS_ORDERS, KINDS
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed
from support import binary_meshes as made

CODES = {name: code for code, name in KINDS.items()}
MESHES = {
    "triangles": lambda: random_mesh(300, seed=1),
    "quads and triangles": lambda: recombine(random_mesh(300, seed=3)),
    "tetrahedra": lambda: random_volume(200, seed=1),
    "all volumes": mixed,
}


def in_one(sections: list[tuple[int, int, np.ndarray]]) -> list[tuple[int, int, np.ndarray]]:
    """All sections but the last as one of all kinds of elements, which alternate."""
    *some, last = sections
    rows = [(code, *row) for code, _, nodes in some for row in (nodes + 1).tolist()]
    order = np.random.default_rng(1).permutation(len(rows))
    listed = np.array([number for k in order for number in rows[k]]) - 1  # as all numbers, one is added again
    return [(20, 1, listed), last]


def save(
    mesh: Mesh, path: Path, kinds: tuple[str, ...] = ("f8", "f8", "f8"), whole: str = "i4", mixed: bool = False,
    **how: object,
) -> Path:  # fmt: skip
    """Sections in another order in the file than their numbers tell; an empty one is among them. mixed: see in_one."""
    with h5py.File(path, "w") as file:

        def node(parent, name, label, values=None, **how):
            found = parent.create_group(name)
            found.attrs["label"] = np.bytes_(label)
            if values is not None:
                found.create_dataset(" data", data=values, **how)
            return found

        zone = node(node(file, "Base", "CGNSBase_t", np.array([3, 3], "i4")), "Zone", "Zone_t")
        grid = node(zone, "GridCoordinates", "GridCoordinates_t")
        for axis, kind in zip("XYZ"[: mesh.points.shape[1]], kinds, strict=False):
            node(grid, f"Coordinate{axis}", "DataArray_t", mesh.points[:, "XYZ".index(axis)].astype(kind), **how)
        first, sections = 1, []
        for block in [*mesh.cells[:1], None, *mesh.cells[1:]]:
            nodes = mesh.cells[0].nodes[:0] if block is None else block.nodes
            kind = mesh.cells[0].kind if block is None else block.kind
            order = CGNS_ORDERS.get(kind)
            sections.append((CODES[kind], first, nodes if order is None else nodes[:, np.argsort(order)]))
            first += len(nodes)
        if mixed:
            sections = in_one(sections)
        for number, (code, begin, nodes) in reversed(list(enumerate(sections))):
            section = node(zone, f"Part{number}", "Elements_t", np.array([code, 0], "i4"))
            last = first - len(sections[-1][2]) - 1 if code == 20 else begin + len(nodes) - 1
            node(section, "ElementRange", "IndexRange_t", np.array([begin, last], whole))
            node(section, "ElementConnectivity", "DataArray_t", (nodes + 1).ravel().astype(whole), **how)
    return path


@pytest.mark.parametrize("ranks", [1, 2, 7])
@pytest.mark.parametrize("whole", ["<i4", ">i8"])
@pytest.mark.parametrize("kind", MESHES)
def test_ranks_read_the_mesh_of_one_process(kind: str, whole: str, ranks: int, tmp_path: Path) -> None:
    kinds = {1: ("<f8", "<f8", "<f8"), 2: (">f4", "<f4", "<f4"), 7: ("<f4", ">f8", "<f8")}[ranks]
    assert_read_alike(save(MESHES[kind](), tmp_path / "a.cgns", kinds, whole), "cgns", ranks)


@pytest.mark.parametrize(("kind", "kinds", "ranks", "method"), [
    ("triangles", ("f8", "f8"), 2, "auto"), ("quads and triangles", ("f4", "f4"), 3, "barrier"),
    ("tetrahedra", ("f8", "f4", "f8"), 3, "laplacian"), ("tetrahedra", (">f8", ">f8", ">f8"), 1, "barrier"),
    ("all volumes", ("f8", "f8", "f8"), 5, "auto"), ("all volumes", ("f4", "f4", "f4"), 3, "barrier"),
])  # fmt: skip
def test_the_bytes_of_a_serial_run(kind: str, kinds: tuple[str, ...], ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(save(MESHES[kind](), tmp_path / "a.cgns", kinds), "cgns", ranks, method)


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("marks", [64, 1 << 18])
@pytest.mark.parametrize("kind", ["quads and triangles", "all volumes"])
def test_sections_of_several_kinds(kind: str, marks: int, ranks: int, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(typed_rows, "AT_ONCE", marks)
    mesh = MESHES[kind]()
    for whole in ("<i4", ">i8"):
        assert_read_alike(save(mesh, tmp_path / "a.cgns", whole=whole, mixed=True), "cgns", ranks)
    assert len(gmsnet.read(tmp_path / "a.cgns").cells) == len(mesh.cells)
    assert_bytes_of_one_process(tmp_path / "a.cgns", "cgns", ranks, "barrier")


@pytest.mark.parametrize("wrong", [1, 20, 22, -1, 99])
def test_a_section_of_unknown_kinds_is_for_the_reader_of_the_whole(wrong: int, tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.cgns", mixed=True)
    assert planned_format(str(path), "cgns") == "cgns"
    with h5py.File(path, "a") as file:
        listed = file["Base/Zone/Part0/ElementConnectivity/ data"]
        sizes = {code: nodes_of(kind) for code, kind in KINDS.items()}
        second = 1 + sizes[int(listed[0])]
        listed[second] = wrong
    assert planned_format(str(path), "cgns") == ""
    with pytest.raises(gmsnet.InputError, match=r"element 1 \(counted from 0\) has a type that is not known"):
        gmsnet.read(path)


def test_damage_in_a_section_of_several_kinds_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.cgns", mixed=True)
    with h5py.File(path, "a") as file:
        listed = file["Base/Zone/Part0/ElementConnectivity/ data"]
        at = listed.id.get_offset()
        listed[2] = 10**6
    assert f"byte {at} or behind: a cell names the node 999999, but the nodes are 0 to" in heard(3, path, "cgns")[0]


def test_a_section_of_several_kinds_that_is_cut_is_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.cgns", mixed=True)
    with h5py.File(path, "a") as file:
        section = file["Base/Zone/Part0"]
        listed = section["ElementConnectivity/ data"][:]
        del section["ElementConnectivity/ data"]
        section["ElementConnectivity/ data"] = listed[:-1]
    assert planned_format(str(path), "cgns") == ""
    with pytest.raises(gmsnet.InputError, match="do not fit their types"):
        gmsnet.read(path)


@pytest.mark.parametrize(
    ("data", "shared"),
    [
        (made.cgns(), "cgns"), (made.cgns(kind=np.float32), "cgns"), (made.cgns(mixed=True), "cgns"),
        (made.cgns(joined="CellCenter"), "cgns"),
        (made.cgns(packed=True), "cgns"), (made.cgns_zones(), "cgns"), (made.cgns_zones(packed=True), "cgns"),
        (made.cgns_zones(packed=True, mixed=True), "cgns"), (made.cgns_structured(), "cgns"), (b"no HDF5", ""),
    ],
)  # fmt: skip
def test_which_files_are_shared(data: bytes, shared: str, tmp_path: Path) -> None:
    path = tmp_path / "a.cgns"
    path.write_bytes(data)
    assert planned_format(str(path), "cgns") == shared
    if shared:
        assert_read_alike(path, "cgns", 2)


@pytest.mark.parametrize(
    ("where", "values"),
    [
        ("Zone/GridCoordinates/CoordinateY/ data", np.zeros(7)),
        ("Zone/GridCoordinates/CoordinateY/ data", np.zeros(55, dtype="i4")),
        ("Zone/Part0/ElementConnectivity/ data", np.ones(100)),
        ("Zone/Part0/ElementConnectivity/ data", np.ones(100, dtype="i4")),
        ("Zone/Part0/ElementRange/ data", np.array([1, 5])),
        ("Zone/Part0/ data", np.array([22, 0])),
        ("Zone/Part0/ data", np.array([20, 0])),
    ],
)
def test_what_does_not_fit_is_for_the_reader_of_the_whole(where: str, values: np.ndarray, tmp_path: Path) -> None:
    path = save(random_volume(50, seed=1), tmp_path / "a.cgns")
    assert planned_format(str(path), "cgns") == "cgns"
    with h5py.File(path, "a") as file:
        del file[f"Base/{where}"]
        file[f"Base/{where}"] = values
    assert planned_format(str(path), "cgns") == ""


def test_a_file_cut_anywhere_is_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.cgns"
    data = made.cgns()
    for end in range(0, len(data) - 1, 97):
        path.write_bytes(data[:end])
        assert planned_format(str(path), "cgns") == ""


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    mesh = random_volume(50, seed=1)
    path = save(mesh, tmp_path / "a.cgns")
    data = path.read_bytes()
    with h5py.File(io.BytesIO(data)) as file:
        cells, places = (file[f"Base/Zone/{name}/ data"].id.get_offset()
                         for name in ("Part0/ElementConnectivity", "GridCoordinates/CoordinateY"))  # fmt: skip
    for at, wrong, said in (
        (cells, np.array([0], "<i4"), f"byte {cells}: a cell names the node -1, but"),
        (places + 8 * 3, np.array([np.nan]), f"byte {places + 8 * 3}: a coordinate of node 3 (counted from 0)"),
    ):
        path.write_bytes(data[:at] + wrong.tobytes() + data[at + wrong.nbytes :])
        before = saved(tmp_path)
        assert said in heard(3, path, "cgns")[0]
        assert saved(tmp_path) == before
    path.write_bytes(data)
    assert gmsnet.read(path).points.tobytes() == mesh.points.tobytes()
