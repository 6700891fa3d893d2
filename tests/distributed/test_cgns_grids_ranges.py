"""CGNS files of structured zones, of which each rank makes and reads some of the cells."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.io import cgns_elements

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard
from support import binary_meshes as made

SIZES = (5, 4, 6)


def save_grids(
    path: Path, zones: int = 1, axes: int = 3, left_handed: tuple[int, ...] = (), packed: tuple[int, ...] = (),
    single: tuple[int, ...] = (), listed: tuple[int, ...] = (),
) -> Path:  # fmt: skip
    """Grids side by side, with the same points between them, thrown a little inside. left_handed, packed, single:
    zones that are so. listed: zones whose cells are listed as quads or hexahedra."""
    random = np.random.default_rng(1)
    with h5py.File(path, "w") as file:
        base = made._node(file, "Base", "CGNSBase_t", np.array([axes, axes], np.int32))
        for zone in range(zones):
            points = np.stack(np.meshgrid(*map(np.arange, SIZES[:axes]), indexing="ij"), axis=-1).astype(float)
            inside = (slice(1, -1),) * axes
            points[inside] += random.uniform(-0.25, 0.25, points[inside].shape)
            points[..., 0] += zone * (SIZES[0] - 1)
            points = points.astype(np.float32).astype(float)
            points = points[..., [1, 0, 2][:axes]] if zone in left_handed else points
            points = points.transpose(*range(axes)[::-1], axes)  # i varies the fastest
            sizes = [list(SIZES[:axes]), [size - 1 for size in SIZES[:axes]], [0] * axes]
            kind = "Unstructured" if zone in listed else "Structured"
            if zone in listed:
                sizes = [[points[..., 0].size], [int(np.prod(sizes[1]))], [0]]
            home = made._node(base, f"Zone{zone}", "Zone_t", np.array(sizes, np.int32))
            made._node(home, "ZoneType", "ZoneType_t", made._letters(kind))
            place = made._node(home, "GridCoordinates", "GridCoordinates_t")
            for axis in range(axes):
                values = points[..., axis].astype("f4" if zone in single else "f8")
                how = {"chunks": (2, 3, 2)[:axes], "compression": "gzip"} if zone in packed and axis != 1 else {}
                found = made._node(place, f"Coordinate{'XYZ'[axis]}", "DataArray_t")
                found.create_dataset(" data", data=values, **how)
            if zone in listed:
                cells = cgns_elements.GridCells(SIZES[:axes], corners(axes))
                made._elements(home, [("cells", 7 if axes == 2 else 17, cells.between(0, cells.rows), cells.rows)])
    return path


def corners(axes: int) -> tuple[int, ...]:
    around = (0, 1, SIZES[0] + 1, SIZES[0])
    return around if axes == 2 else (*around, *(SIZES[0] * SIZES[1] + corner for corner in around))


FILES = {
    "a plane": {"axes": 2}, "planes": {"axes": 2, "zones": 3, "packed": (1,), "single": (2,)},
    "planes and cells": {"axes": 2, "zones": 2, "listed": (0,)}, "a block": {}, "left-handed": {"left_handed": (0,)},
    "packed": {"packed": (0,)}, "single": {"single": (0,)}, "blocks": {"zones": 3, "packed": (0,), "single": (1,)},
    "blocks and cells": {"zones": 3, "listed": (1,), "packed": (1, 2)},
}  # fmt: skip


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", FILES)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(cgns_elements, "AT_ONCE", 30)
    assert_read_alike(save_grids(tmp_path / "a.cgns", **FILES[kind]), "cgns", ranks)


@pytest.mark.parametrize(("kind", "ranks", "method"), [
    ("a plane", 2, "auto"), ("planes", 3, "barrier"), ("planes and cells", 2, "laplacian"), ("a block", 3, "auto"),
    ("left-handed", 2, "barrier"), ("packed", 2, "barrier"), ("single", 1, "barrier"), ("blocks", 2, "laplacian"),
    ("blocks and cells", 3, "barrier"),
])  # fmt: skip
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(save_grids(tmp_path / "a.cgns", **FILES[kind]), "cgns", ranks, method)


@pytest.mark.parametrize(("packed", "left_handed"), [(False, True), (True, False)])
def test_points_of_a_grid_in_one_list(packed: bool, left_handed: bool, tmp_path: Path) -> None:
    path = tmp_path / "a.cgns"
    path.write_bytes(made.cgns_structured(packed, left_handed))
    assert_read_alike(path, "cgns", 3)
    assert_bytes_of_one_process(path, "cgns", 3, "barrier")


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = save_grids(tmp_path / "a.cgns", zones=2, axes=2)
    with h5py.File(path, "a") as file:
        values = file["Base/Zone1/GridCoordinates/CoordinateY/ data"]
        values[1, 2], at = np.nan, values.id.get_offset() + 8 * (SIZES[0] + 2)
    before = saved(tmp_path)
    node = SIZES[0] * SIZES[1] + SIZES[0] + 2
    assert f"byte {at}: a coordinate of node {node} (counted from 0) is not finite" in heard(3, path, "cgns")[0]
    assert saved(tmp_path) == before


@pytest.mark.parametrize("sizes", [[[5, 4, 7], [4, 3, 6], [0, 0, 0]], [[120], [60], [0]], [[1, 4, 30], [0, 3, 29]]])
def test_what_is_no_grid_is_for_the_reader_of_the_whole(sizes: list[list[int]], tmp_path: Path) -> None:
    path = save_grids(tmp_path / "a.cgns")
    with h5py.File(path, "a") as file:
        del file["Base/Zone0/ data"]
        file["Base/Zone0/ data"] = np.array(sizes)
    assert planned_format(str(path), "cgns") == ""


def test_a_grid_of_three_axes_in_a_plane_is_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = save_grids(tmp_path / "a.cgns")
    with h5py.File(path, "a") as file:
        del file["Base/Zone0/GridCoordinates/CoordinateZ"]
    assert planned_format(str(path), "cgns") == ""


def test_zones_that_share_coordinates_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    """It refuses them."""
    path = save_grids(tmp_path / "a.cgns", zones=2, listed=(0, 1))
    with h5py.File(path, "a") as file:
        one, other = (file[f"Base/Zone{k}/GridCoordinates"] for k in range(2))
        del other["CoordinateY"]
        other["CoordinateY"] = one["CoordinateY"]
    assert planned_format(str(path), "cgns") == ""
    with pytest.raises(gmsnet.InputError, match="share an array of coordinates"):
        gmsnet.read(path)
