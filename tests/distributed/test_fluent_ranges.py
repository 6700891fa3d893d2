"""Fluent files with binary sections, of which each rank reads some faces: cells are put together where they belong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_quad_mesh
from gmsnet.io import fluent_ranges
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_ranges import SIZE, assert_bytes_of_one_process, assert_read_alike, heard, mixed
from support.fluent import Face, saved_faces
from support.foam import cells_of_mesh

INNER, LOW, HIGH, REST, PERIODIC = 7, 3, 9, 5, 12
NAMES = {INNER: "interior", LOW: "inlet", HIGH: "outlet", 1: "fluid", 2: "solid", 77: "of-no-face"}


def faces_of(cells: list[list[list[int]]]) -> tuple[list[Face], list[Face]]:
    """Between cells and on the boundary, in a wild order, each into its first or its second cell."""
    seen: dict[tuple[int, ...], list[tuple[int, list[int]]]] = {}
    for number, cell in enumerate(cells):
        for face in cell:
            seen.setdefault(tuple(sorted(face)), []).append((number, face))
    random = np.random.default_rng(2)
    found: tuple[list[Face], list[Face]] = ([], [])
    for k in random.permutation(len(seen)):
        (one, nodes), *others = list(seen.values())[k]
        other = others[0][0] if others else -1
        if random.random() < 0.5:
            found[not others].append((nodes, other, one))
        else:
            found[not others].append((nodes[::-1], one, other))
    return found


def volumes(kind: str = "f8", order: str = "<", cuts: tuple[int, ...] = (), periodic: bool = False) -> bytes:
    mesh = mixed()
    cells = cells_of_mesh(mesh)
    inner, outer = faces_of(cells)

    def side(face: Face) -> int:
        where = mesh.points[list(face[0]), 0]
        return LOW if (where == 0).all() else HIGH if (where == SIZE).all() else REST

    zones = {INNER: (2, inner)}
    for zone in (HIGH, LOW, REST):
        zones[zone] = (PERIODIC if periodic and zone == HIGH else 3, [face for face in outer if side(face) == zone])
    heads = {1: (0, 40), 2: (41, len(cells) - 1)}
    return saved_faces(mesh.points, zones, heads, NAMES, kind, order, cuts)


def plane(kind: str = "f8", order: str = "<", cells: str = "mixed") -> bytes:
    mesh: Mesh = random_quad_mesh(150, cells=cells, seed=1)
    rows = [row.tolist() for block in mesh.cells if block.dimension == 2 for row in block.nodes]
    edges = [[[row[k], row[(k + 1) % len(row)]] for k in range(len(row))] for row in rows]
    inner, outer = faces_of(edges)
    # Along an edge from its first node the first of its cells is on the right, as a file has them.
    zones = {INNER: (2, inner), LOW: (3, outer[:10]), REST: (4, outer[10:])}
    return saved_faces(mesh.points, zones, {1: (0, len(rows) - 1)}, NAMES, kind, order)


FILES = {
    "volumes": volumes,
    "volumes, single": lambda: volumes("f4", cuts=(50, 60)),
    "volumes, big-endian": lambda: volumes(order=">", cuts=(33,)),
    "periodic": lambda: volumes(periodic=True),
    "plane": plane,
    "plane of quads, single": lambda: plane("f4", cells="quad"),
}


def save(kind: str, path: Path) -> Path:
    path.write_bytes(FILES[kind]())
    return path


@pytest.mark.parametrize("every", [2, 1 << 14])
@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", FILES)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, every: int, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(fluent_ranges, "EVERY", every)
    path = save(kind, tmp_path / "a.cas")
    assert_read_alike(path, "fluent", ranks)
    mesh = gmsnet.read(path)
    assert {"inlet", "fluid"} <= set(mesh.markers)
    assert "of-no-face" not in mesh.markers


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
@pytest.mark.parametrize("kind", FILES)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(save(kind, tmp_path / "a.cas"), "fluent", ranks, method)


def test_the_contents_tell_it_from_gmsh(tmp_path: Path) -> None:
    path = save("volumes", tmp_path / "a.msh")
    assert planned_format(str(path), "gmsh") == "fluent"
    assert shared_format(str(path), str(tmp_path / "b.msh")) == "fluent"
    assert shared_format(str(path), str(tmp_path / "b.cas")) == ""


@pytest.mark.parametrize("window", [64, 1000])
def test_sections_are_longer_than_what_is_read_at_once(window: int, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(fluent_ranges, "WINDOW", window)
    data = volumes()
    long = b"(45 (1 wall fluid)(" + b"(a . 1) " * 500 + b"))\n"
    (tmp_path / "a.cas").write_bytes(data.replace(b"(45 (1 wall fluid)())\n", long))
    assert_read_alike(tmp_path / "a.cas", "fluent", 2)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"(45 (1 wall fluid)())", b"(3041 (1 1 1)(\0\0\0\0)End of Binary Section   3041)"),  # of unknown length
        (b"End of Binary Section   3010", b"End of Binary Section   3011"),
        (b"(2 3)", b"(2 4)"),
        (b"(3010 (64 1 ", b"(3010 (64 2 "),
        (b"(45 (1 wall fluid)())", b"(13 (20 1 1 2 3)(1 2 3 1 2))"),  # faces as text
    ],
)  # fmt: skip
def test_what_is_for_the_reader_of_the_whole(old: bytes, new: bytes, tmp_path: Path) -> None:
    data = volumes()
    assert old in data
    (tmp_path / "a.cas").write_bytes(data.replace(old, new, 1))
    assert planned_format(str(tmp_path / "a.cas"), "fluent") == ""
    (tmp_path / "a.cas").write_bytes(data[: len(data) // 2])
    assert planned_format(str(tmp_path / "a.cas"), "fluent") == ""


@pytest.mark.parametrize(
    ("value", "said"), [(-5, "a face lies at no cell"), (0, "a face lies at no cell"), (99_999, "names the cell 99998")]
)
def test_what_is_wrong_is_said_by_all(value: int, said: str, tmp_path: Path) -> None:
    """The last cells of the last face."""
    data = bytearray(volumes())
    end = data.rindex(b"\n)End of Binary Section   3013")
    data[end - 8 : end] = np.array([0, value], "<i4").tobytes()
    path = tmp_path / "a.cas"
    path.write_bytes(data)
    told = set(heard(3, path, "fluent"))
    assert len(told) == 1
    assert said in told.pop()
    assert path.read_bytes() == data


def test_edges_that_do_not_run_around_a_cell(tmp_path: Path) -> None:
    data = bytearray(plane(cells="quad"))
    end = data.rindex(b"\n)End of Binary Section   3013")
    nodes = np.frombuffer(data[end - 16 : end - 8], "<i4")
    data[end - 16 : end - 8] = nodes[::-1].tobytes()
    path = tmp_path / "a.cas"
    path.write_bytes(data)
    assert len(set(heard(2, path, "fluent"))) == 1
