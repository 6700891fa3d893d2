"""Binary PLY, of which each rank reads some faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import organic_surface, random_mesh, recombine
from gmsnet.io import ply_ranges
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard

ORDERS = {"<": "little", ">": "big"}
NAMES = {"f4": "float", "f8": "double", "i4": "int", "u1": "uchar", "i2": "short"}


def save(
    path: Path,
    mesh: Mesh,
    order: str = "<",
    kind: str = "f4",
    *,
    length: str = "u1",
    extra: str = "",
    behind: bytes = b"",
) -> Path:
    """extra: name of a property of faces, the numbers of which tell whether they are triangles."""
    points = np.zeros(len(mesh.points), [("before", "u1"), ("xyz", order + kind, 3), ("after", order + "i2")])
    points["xyz"][:, : mesh.points.shape[1]] = mesh.points
    points["after"] = np.arange(len(points))
    faces = b""
    for block in mesh.cells:
        if block.dimension == 2:
            width = block.nodes.shape[1]
            rows = np.zeros(len(block.nodes), [("length", order + length), ("nodes", order + "i4", width),
                                               *([("extra", order + "i2")] if extra else [])])  # fmt: skip
            rows["length"], rows["nodes"] = width, block.nodes
            if extra:
                rows["extra"] = 5 + (np.arange(len(rows)) > len(rows) // 2)
            faces += rows.tobytes()
    lines = [block.nodes for block in mesh.cells if block.kind == "line"]
    head = ["ply", f"format binary_{ORDERS[order]}_endian 1.0", "comment of ours", f"element vertex {len(points)}"]
    head += ["property uchar before", *(f"property {NAMES[kind]} {axis}" for axis in "xyz"), "property short after"]
    head += [f"element face {sum(len(b.nodes) for b in mesh.cells if b.dimension == 2)}"]
    head += [f"property list {NAMES[length]} int vertex_indices", *([f"property short {extra}"] if extra else [])]
    if lines:
        head += [f"element edge {len(lines[0])}", "property int vertex1", "property int vertex2"]
        behind = lines[0].astype(order + "i4").tobytes() + behind
    path.write_bytes("\n".join([*head, "end_header\n"]).encode() + points.tobytes() + faces + behind)
    return path


def surface() -> Mesh:
    return organic_surface(300).mesh


def plane() -> Mesh:
    """Triangles, quads, and lines of its boundary."""
    return recombine(random_mesh(300, seed=3))


def in_turns() -> Mesh:
    """Runs of triangles and quads by turns, of all lengths."""
    of = {block.kind: block.nodes for block in plane().cells}
    blocks, at = [], {"triangle": 0, "quad": 0}
    for k in range(40):
        kind = "triangle" if k % 2 else "quad"
        some = of[kind][at[kind] : at[kind] + 1 + k % 7]
        at[kind] += len(some)
        blocks += [CellBlock(kind, some, np.zeros(len(some), dtype=np.int64))] if len(some) else []
    blocks += [CellBlock(kind, of[kind][at[kind] :], np.zeros(len(of[kind]) - at[kind], dtype=np.int64)) for kind in at]
    return Mesh(plane().points, tuple(blocks))


SAVED = {
    "surface": lambda path: save(path, surface()),
    "big-endian, double": lambda path: save(path, surface(), ">", "f8", length="i4"),
    "plane": lambda path: save(path, plane(), kind="f8", behind=b"\n"),
    "regions": lambda path: save(path, surface(), extra="material"),
    "data": lambda path: save(path, in_turns(), extra="heat"),
    "in turns": lambda path: save(path, in_turns(), ">"),
}


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", SAVED)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(SAVED[kind](tmp_path / "a.ply"), "ply", ranks)


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
@pytest.mark.parametrize("kind", SAVED)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(SAVED[kind](tmp_path / "a.ply"), "ply", ranks, method)


def test_runs_are_found_whatever_is_looked_at_at_once(tmp_path: Path, monkeypatch) -> None:
    path = SAVED["data"](tmp_path / "a.ply")
    for first, most in ((1, 1), (2, 100), (3, 1000)):
        monkeypatch.setattr(ply_ranges, "_FIRST_LOOK", first)
        monkeypatch.setattr(ply_ranges, "AT_ONCE", most)
        assert_read_alike(path, "ply", 2)


def test_what_only_a_reader_of_the_whole_can_tell(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    gmsnet.write(plane(), path)
    assert path.read_bytes().startswith(b"ply\nformat ascii")
    assert planned_format(str(path), "ply") == ""
    assert planned_format(str(save(path, plane(), behind=b"more")), "ply") == ""
    assert planned_format(str(save(path, in_turns(), extra="material")), "ply") == ""
    whole = save(path, plane()).read_bytes()
    for cut in (len(whole) - 1, len(whole) - 5000, 300):
        path.write_bytes(whole[:cut])
        assert planned_format(str(path), "ply") == ""
    for old, new in (
        (b"float y", b"double y"),
        (b"vertex_indices", b"corners"),
        (b"uchar before", b"list uchar uchar before"),
    ):
        path.write_bytes(whole.replace(old, new, 1))
        assert planned_format(str(path), "ply") == ""


def test_too_many_runs_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    rows = 1 + MOST_BLOCKS
    points = np.array([[x, y] for y in range(3) for x in range(rows + 1)], dtype=np.float64)
    wide = rows + 1
    quads = [[x, x + 1, wide + x + 1, wide + x] for x in range(rows)]
    triangles = [[wide + x, wide + x + 1, 2 * wide + x + 1] for x in range(rows)]
    zero = np.zeros(1, dtype=np.int64)
    blocks = [CellBlock(kind, np.array([row]), zero) for pair in zip(quads, triangles, strict=True)
              for kind, row in zip(("quad", "triangle"), pair, strict=True)]  # fmt: skip
    assert planned_format(str(save(tmp_path / "a.ply", Mesh(points, tuple(blocks)))), "ply") == ""


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = save(tmp_path / "a.ply", surface())
    path.write_bytes(path.read_bytes()[:-4] + np.int32(10**6).tobytes())
    before = saved(tmp_path)
    assert "a cell names the node 1000000, but the nodes are 0 to" in heard(3, path, "ply")[0]
    assert saved(tmp_path) == before
