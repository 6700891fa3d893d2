"""MED, of which each rank reads some cells: lists of all first nodes, then of all second ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, recombine
from gmsnet.io.med import KINDS
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed

STEP = "ENS_MAA/a/-0000000000000000001-0000000000000000001"
TYPES = {kind: name for name, kind in KINDS.items()}


def save(
    mesh: Mesh, path: Path, kind: type = np.float64, groups: Mapping[int, str] | None = None, **how: object
) -> Path:
    """One block of each kind; regions are families. groups: names of these. how: the coordinates are stored."""
    with h5py.File(path, "w") as file:
        file.create_group("ENS_MAA/a").attrs["ESP"] = mesh.points.shape[1]
        file.create_dataset(f"{STEP}/NOE/COO", data=mesh.points.T.ravel().astype(kind), **how)
        file.create_dataset(f"{STEP}/NOE/FAM", data=np.zeros(len(mesh.points), dtype=np.int32))
        for block in mesh.cells:
            file.create_dataset(f"{STEP}/MAI/{TYPES[block.kind]}/NOD", data=block.nodes.T.ravel() + 1)
            if block.regions.any():
                file.create_dataset(f"{STEP}/MAI/{TYPES[block.kind]}/FAM", data=block.regions.astype(np.int32))
        for number, text in (groups or {}).items():
            family = file.create_group(f"FAS/a/ELEME/FAM_{number}")
            family.attrs["NUM"] = number
            letters = np.frombuffer(text.encode().ljust(80, b"\0"), np.int8)
            family.create_dataset("GRO/NOM", (1,), np.dtype((np.int8, 80)))[...] = letters[None]
    return path


SAVED = {
    "volumes": lambda path: save(mixed(), path, groups={3: "wall", 4: "inlet", 9: "of no cell"}),
    "single": lambda path: save(mixed(), path, np.float32),
    "plane": lambda path: save(recombine(random_mesh(300, seed=3)), path),
    "chunks": lambda path: save(mixed(), path, chunks=(50,), compression="gzip"),
    "large chunks, single": lambda path: save(recombine(random_mesh(300, seed=3)), path, np.float32, chunks=(400,)),
}


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", SAVED)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(SAVED[kind](tmp_path / "a.med"), "med", ranks)


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
@pytest.mark.parametrize("kind", SAVED)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(SAVED[kind](tmp_path / "a.med"), "med", ranks, method)


def test_names_of_markers_are_those_of_groups(tmp_path: Path) -> None:
    path = SAVED["volumes"](tmp_path / "a.med")
    assert gmsnet.read(path).markers.keys() == {"wall", "inlet"}
    assert planned_format(str(path), "med", named=True) == "med"


def test_sets_of_nodes_by_name_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.med", groups={7: "sensor"})
    with h5py.File(path, "a") as file:
        file[f"{STEP}/NOE/FAM"][5] = 7
    assert planned_format(str(path), "med") == "med"
    assert planned_format(str(path), "med", named=True) == ""
    assert_read_alike(path, "med", 3)


@pytest.mark.parametrize("of", ["NOE/FAM", "MAI/HE8/NOD", "MAI/QU4/FAM"])
def test_lists_of_another_length_are_for_the_reader_of_the_whole(of: str, tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.med")
    with h5py.File(path, "a") as file:
        values = file[f"{STEP}/{of}"][()]
        del file[f"{STEP}/{of}"]
        file.create_dataset(f"{STEP}/{of}", data=values[:-1])
    assert planned_format(str(path), "med") == ""


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = save(mixed(), tmp_path / "a.med")
    with h5py.File(path, "a") as file:
        file[f"{STEP}/MAI/HE8/NOD"][3] = 10**6
    before = saved(tmp_path)
    assert "a cell names the node 999999, but the nodes are 0 to" in heard(3, path, "med")[0]
    assert saved(tmp_path) == before
