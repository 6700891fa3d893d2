"""Binary STL, of which each rank reads some triangles: corners at one place become one node."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import organic_surface
from gmsnet.io import stl_ranges

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard


def save(path: Path, corners: np.ndarray) -> Path:
    """Of triangles (n, 3, 3). Normals and attributes are no numbers of any use, and must stay."""
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["normal"], records["corners"] = np.random.default_rng(1).uniform(-1, 1, (len(corners), 3)), corners
    records["attribute"] = np.arange(len(corners))
    path.write_bytes(b"solid?".ljust(80) + np.uint32(len(corners)).tobytes() + records.tobytes())
    return path


def ball(path: Path) -> Path:
    mesh = organic_surface(300).mesh
    return save(path, mesh.points[mesh.cells[0].nodes])


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_ranks_read_the_mesh_of_one_process(ranks: int, tmp_path: Path) -> None:
    assert_read_alike(ball(tmp_path / "a.stl"), "stl", ranks)


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
def test_the_bytes_of_a_serial_run(ranks: int, method: str, tmp_path: Path, monkeypatch) -> None:
    """Also where triangles are written some at a time."""
    monkeypatch.setattr(stl_ranges, "_TOGETHER", 64)
    assert_bytes_of_one_process(ball(tmp_path / "a.stl"), "stl", ranks, method)


def test_triangles_of_no_area_and_zeros_of_both_signs(tmp_path: Path) -> None:
    """As of one process: corners of one triangle at one place are one node, and so are zeros of both signs."""
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[-0.0, 0, 0], [1, 1, -0.0], [0, 1, 0]]])
    flat = np.array([[[1, 0, 0], [1, 0, 0], [2, 0, 0]], [[2, 0, 0], [1, 1, 0], [1, 0, 0]]])
    assert_read_alike(save(tmp_path / "a.stl", np.concatenate([square, flat])), "stl", 3)


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = ball(tmp_path / "a.stl")
    data = bytearray(path.read_bytes())
    data[84 + 50 * 7 + 12 : 84 + 50 * 7 + 16] = np.float32("nan").tobytes()
    path.write_bytes(data)
    before = saved(tmp_path)
    assert (
        f"byte {84 + 50 * 7 + 12}: a coordinate of node 21 (counted from 0) is not finite" in heard(3, path, "stl")[0]
    )
    assert saved(tmp_path) == before


def test_texts_and_what_is_cut_off_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = ball(tmp_path / "a.stl")
    path.write_bytes(path.read_bytes()[:-1])
    assert planned_format(str(path), "stl") == ""
    gmsnet.write(organic_surface(100).mesh, path)
    assert path.read_bytes()[:6] == b"solid "
    assert planned_format(str(path), "stl") == ""
