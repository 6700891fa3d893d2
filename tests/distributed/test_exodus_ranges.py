"""Exodus II files, of which each rank reads some of the elements and of the sides that side sets name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file

import gmsnet
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, random_volume, recombine
from gmsnet.io import exodus_ranges, rows
from gmsnet.io.exodus_elements import SIDES
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed
from support import binary_meshes as made

TYPES = {"triangle": "TRI3", "quad": "QUAD4", "tetra": "TETRA", "pyramid": "PYRAMID5", "wedge": "WEDGE",
         "hexahedron": "HEX8", "line": "BEAM2"}  # fmt: skip
MESHES = {
    "triangles": lambda: random_mesh(300, seed=1),
    "quads and triangles": lambda: recombine(random_mesh(300, seed=3)),
    "tetrahedra": lambda: random_volume(200, seed=1),
    "all volumes": lambda: Mesh(mixed().points, mixed().cells[2:]),
}


def variables(mesh: Mesh, kind: str, whole: bool, sets: bool) -> dict[str, tuple[np.ndarray, str]]:
    """Name → values and type of elements. Side sets name elements in a wild order, some of them in several sets."""
    random, points = np.random.default_rng(1), mesh.points.astype(kind)
    found = {"coord": (points.T, "")} if whole else {f"coord{'xyz'[k]}": (x, "") for k, x in enumerate(points.T)}
    sides = np.concatenate([np.full(len(block.nodes), len(SIDES.get(block.kind, "ab"))) for block in mesh.cells])
    for k, block in enumerate(mesh.cells, 1):
        found[f"connect{k}"] = (block.nodes.astype("i4") + 1, TYPES[block.kind])
    found["eb_prop1"] = (np.arange(len(mesh.cells), dtype="i4") * 10 + 10, "")
    for k in (1, 2):
        some = random.choice(len(sides), min(12, len(sides) // 8), replace=False)
        found[f"elem_ss{k}"] = (some.astype("i4") + 1, "")
        found[f"side_ss{k}"] = (random.integers(0, sides[some]).astype("i4") + 1, "")
    if sets:
        found["node_ns1"] = (np.array([3, 5], "i4"), "")
    return found


def save(
    mesh: Mesh, path: Path, classic: bool = True, kind: str = "f8", whole: bool = False, sets: bool = False, **how: Any
) -> Path:
    listed = variables(mesh, kind, whole, sets)
    if not classic:
        with h5py.File(path, "w") as file:
            for name, (values, of) in listed.items():
                made_of = file.create_dataset(name, data=values, **(how if name[:5] == "coord" else {}))
                made_of.attrs["elem_type"] = np.bytes_(of)
        return path
    with netcdf_file(path, "w", version=2) as file:
        for name, (values, of) in listed.items():
            sizes = tuple(f"{name}_{k}" for k in range(values.ndim))
            for size, length in zip(sizes, values.shape, strict=True):
                file.createDimension(size, length)
            variable = file.createVariable(name, values.dtype, sizes)
            variable[:] = values
            variable.elem_type = of
    return path


FORMS = {
    "classic": {}, "classic, in one": {"whole": True}, "classic, single": {"kind": "f4"}, "HDF5": {"classic": False},
    "HDF5, in one, single": {"classic": False, "whole": True, "kind": "f4"},
    "HDF5, packed": {"classic": False, "chunks": (19,), "compression": "gzip"},
}  # fmt: skip


@pytest.mark.parametrize("ranks", [1, 2, 3])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", MESHES)
def test_ranks_read_the_mesh_of_one_process(kind: str, form: str, ranks: int, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(exodus_ranges, "AT_ONCE", 7 * ranks)
    monkeypatch.setattr(rows, "HEAD", 300 * ranks)
    assert_read_alike(save(MESHES[kind](), tmp_path / "a.e", **FORMS[form]), "exodus", ranks)
    assert len(gmsnet.read(tmp_path / "a.e").cells) > len(MESHES[kind]().cells)


@pytest.mark.parametrize(("kind", "form", "ranks", "method"), [
    ("triangles", "classic", 2, "barrier"), ("quads and triangles", "HDF5, packed", 3, "barrier"),
    ("tetrahedra", "HDF5, in one, single", 2, "laplacian"), ("all volumes", "classic, in one", 3, "barrier"),
    ("all volumes", "HDF5, packed", 1, "barrier"), ("all volumes", "classic, single", 2, "barrier"),
])  # fmt: skip
def test_the_bytes_of_a_serial_run(kind: str, form: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(save(MESHES[kind](), tmp_path / "a.e", **FORMS[form]), "exodus", ranks, method)


@pytest.mark.parametrize("data", [
    made.exodus3(), made.exodus3(1), made.exodus3(whole=True), made.exodus4(), made.exodus4(True)
])  # fmt: skip
def test_which_files_are_shared(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.exo"
    path.write_bytes(data)
    assert_read_alike(path, "exodus", 3)
    assert shared_format(str(path), str(tmp_path / "b.e")) == "exodus"
    assert shared_format(str(path), str(tmp_path / "b.e"), named=True) == ""  # it has a list of nodes
    for end in range(0, len(data) - 1, 97):
        path.write_bytes(data[:end])
        try:
            gmsnet.read(path)
        except gmsnet.InputError:
            assert planned_format(str(path), "exodus") == ""


def test_coordinates_of_all_axes_in_chunks_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = save(random_mesh(50, seed=1), tmp_path / "a.e", classic=False, whole=True, chunks=(2, 19))
    assert planned_format(str(path), "exodus") == ""
    assert len(gmsnet.read(path).points)


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = save(random_volume(200, seed=1), tmp_path / "a.e")
    tetrahedra = next(block.nodes for block in gmsnet.read(path).cells if block.kind == "tetra")
    data, listed = path.read_bytes(), (tetrahedra + 1).astype(">i4")
    at = data.index(listed.tobytes()) + 16 * 5
    path.write_bytes(data[:at] + np.array([10**6], ">i4").tobytes() + data[at + 4 :])
    before = saved(tmp_path)
    assert f"byte {at}: a cell names the node 999999, but the nodes are 0 to" in heard(3, path, "exodus")[0]
    assert saved(tmp_path) == before
