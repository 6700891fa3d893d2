"""HDF5 files in chunks, compressed, or with numbers in headers, of which each rank reads some cells."""

from __future__ import annotations

import resource
import signal
from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_volume
from gmsnet.io import hdf5_rows

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_cgns_ranges import save
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed, save_vtkhdf

HOW = {
    "chunks": {"chunks": (13,)},
    "gzip": {"chunks": (13,), "compression": "gzip", "shuffle": True},
    "one chunk": {"chunks": (4096,), "maxshape": (None,), "compression": "lzf", "fletcher32": True},
    "may grow": {"chunks": (50,), "maxshape": (None,)},
}


def packed(path: Path, how: str) -> Path:
    """The same file with all lists of numbers in chunks."""
    found: list[tuple[str, np.ndarray, dict[str, object]]] = []

    def look(name: str, thing: h5py.Dataset | h5py.Group) -> None:
        if isinstance(thing, h5py.Dataset) and thing.size > 10:
            found.append((name, thing[()], dict(thing.attrs)))

    with h5py.File(path) as file:
        file.visititems(look)
    with h5py.File(path, "a") as file:
        for name, values, _ in found:
            options = dict(HOW[how])
            for key in options.keys() & {"chunks", "maxshape"}:
                options[key] = (*options[key], *values.shape[1:])
            del file[name]
            file.create_dataset(name, data=values, **options)
    return path


def in_headers(path: Path, names: list[str]) -> Path:
    """The same file with some data sets in their headers."""
    with h5py.File(path, "a") as file:
        for name in names:
            values = file[name][()]
            del file[name]
            layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            layout.set_layout(h5py.h5d.COMPACT)
            layout.set_obj_track_times(False)  # else the library writes the time of day into the header
            space, kind = h5py.h5s.create_simple(values.shape), h5py.h5t.py_create(values.dtype)
            made = h5py.h5d.create(file.id, name.encode(), kind, space, layout)
            h5py.Dataset(made)[...] = values
            assert made.get_offset() is None
    return path


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("how", HOW)
def test_vtkhdf(how: str, ranks: int, tmp_path: Path) -> None:
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf", np.float32 if ranks == 2 else np.float64), how)
    assert_read_alike(path, "vtkhdf", ranks)
    assert_bytes_of_one_process(path, "vtkhdf", ranks, "barrier")


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("how", HOW)
def test_cgns(how: str, ranks: int, tmp_path: Path) -> None:
    path = packed(save(mixed(), tmp_path / "a.cgns", ("f8", "f4", ">f8"), mixed=ranks > 2), how)
    assert_read_alike(path, "cgns", ranks)
    assert_bytes_of_one_process(path, "cgns", ranks, "laplacian")


@pytest.mark.parametrize("names", [["Part0/ElementConnectivity"], ["GridCoordinates/CoordinateY"]])
def test_numbers_in_headers(names: list[str], tmp_path: Path) -> None:
    """As the CGNS library writes short arrays. Coordinates that stand in the file as they are may lie beside them."""
    path = save(random_volume(200, seed=1), tmp_path / "a.cgns")
    in_headers(path, [f"Base/Zone/{name}/ data" for name in names])
    assert_read_alike(path, "cgns", 3)
    assert_bytes_of_one_process(path, "cgns", 3, "barrier")


def test_many_parts(tmp_path: Path, monkeypatch) -> None:
    """What is written does not depend on how much is written at once by whom."""
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), "gzip")
    monkeypatch.setattr(hdf5_rows, "AT_ONCE", 1000)
    assert_bytes_of_one_process(path, "vtkhdf", 3, "barrier")


def test_parts_without_a_change_stay(tmp_path: Path) -> None:
    """The bytes of a chunk in which no node has moved are those that another program has packed."""
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), "gzip")
    mesh = gmsnet.read(path)
    points = mesh.points.copy()
    points[20] += 0.01
    gmsnet.write(mesh.with_points(points), tmp_path / "b.vtkhdf")
    with h5py.File(path) as old, h5py.File(tmp_path / "b.vtkhdf") as new:
        chunks = [[data.id.read_direct_chunk((13 * k, 0))[1] for k in range(4)]
                  for data in (old["VTKHDF/Points"], new["VTKHDF/Points"])]  # fmt: skip
        assert np.array_equal(new["VTKHDF/Points"][()], points)
    assert [one == other for one, other in zip(*chunks, strict=True)] == [True, False, True, True]


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), "gzip")
    with h5py.File(path, "a") as file:
        data = file["VTKHDF/Connectivity"]
        data[30] = 10**6
    before = saved(tmp_path)
    assert "/VTKHDF/Connectivity, number 30: a cell names the node 1000000, but" in heard(3, path, "vtkhdf")[0]
    with h5py.File(path, "a") as file:
        file["VTKHDF/Connectivity"][30] = 0
        file["VTKHDF/Points"][7] = np.nan
    before = saved(tmp_path)
    assert "/VTKHDF/Points, number 21: a coordinate of node 7 (counted from 0)" in heard(3, path, "vtkhdf")[0]
    assert saved(tmp_path) == before


def test_chunks_that_cannot_be_unpacked_are_named_on_all_ranks(tmp_path: Path) -> None:
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), "gzip")
    with h5py.File(path) as file:
        chunk = file["VTKHDF/Points"].id.get_chunk_info(2)
    data = path.read_bytes()
    path.write_bytes(data[: chunk.byte_offset] + bytes(20) + data[chunk.byte_offset + 20 :])
    assert planned_format(str(path), "vtkhdf") == "vtkhdf"
    before = saved(tmp_path)
    assert "/VTKHDF/Points: the HDF5 file is damaged" in heard(3, path, "vtkhdf")[0]
    assert saved(tmp_path) == before


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_full_disk(share: float, tmp_path: Path) -> None:
    """Wherever the disk is full, the old file is whole, and nothing else stays."""
    path = packed(save_vtkhdf(mixed(), tmp_path / "a.vtkhdf"), "gzip")
    before, limit = saved(tmp_path), resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * path.stat().st_size), limit[1]))
    try:
        said = heard(2, path, "vtkhdf")[0]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert said == f"{path}: cannot be written: file too large"
    assert saved(tmp_path) == before
