"""Binary Gmsh files in one piece, of which each rank reads some of the cells."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, random_volume, recombine
from gmsnet.io import gmsh_ranges
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import images

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed
from support import gmsh_partitioned, gmsh_variants
from support.comm import together
from support.gmsh_binary import save, wild
from support.gmsh_variants import VARIANTS

from gmsnet.distributed.tags import nodes_of

FORMS = [(version, order, wildly) for version in ("2.2", "4.1") for order in "<>" for wildly in (False, True)]


def in_regions(mesh: Mesh) -> Mesh:
    """With two regions in each block, whose cells lie apart, and a block of none."""
    blocks = [
        CellBlock(block.kind, block.nodes, (np.arange(len(block.nodes)) % 7 == 2) * 4 + 3) for block in mesh.cells
    ]
    first = blocks[0]
    return Mesh(mesh.points, (*blocks, CellBlock(first.kind, first.nodes[:0], first.regions[:0])))


MESHES = {
    "triangles": lambda: random_mesh(300, seed=1),
    "quads and triangles": lambda: in_regions(recombine(random_mesh(300, seed=3))),
    "tetrahedra": lambda: random_volume(200, seed=1),
    "all volumes": mixed,
}


def saved_as(kind: str, form: tuple[str, str, bool], path: Path) -> Path:
    mesh, (version, order, wildly) = MESHES[kind](), form
    path.write_bytes(save(mesh, version, order, wild(len(mesh.points)) if wildly else None, shared=order == ">"))
    return path


@pytest.mark.parametrize("ranks", [1, 3, 7])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", MESHES)
def test_ranks_read_the_mesh_of_one_process(kind: str, form, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(saved_as(kind, form, tmp_path / "a.msh"), "gmsh", ranks)


@pytest.mark.parametrize("ranks", [1, 2, 9])
@pytest.mark.parametrize("variant", [name for name in VARIANTS if "text" not in name])
def test_every_variant(variant: str, ranks: int, tmp_path: Path) -> None:
    (tmp_path / "a.msh").write_bytes(VARIANTS[variant])
    assert_read_alike(tmp_path / "a.msh", "gmsh", ranks)


RUNS = [
    ("triangles", FORMS[0], 2, "auto"),
    ("triangles", FORMS[7], 3, "barrier"),
    ("quads and triangles", FORMS[4], 3, "auto"),
    ("quads and triangles", FORMS[3], 1, "barrier"),
    ("tetrahedra", FORMS[1], 3, "auto"),
    ("tetrahedra", FORMS[6], 2, "laplacian"),
    ("all volumes", FORMS[5], 3, "barrier"),
    ("all volumes", FORMS[2], 5, "auto"),
]


@pytest.mark.parametrize(("kind", "form", "ranks", "method"), RUNS)
def test_the_bytes_of_a_serial_run(kind: str, form, ranks: int, method: str, tmp_path: Path) -> None:
    assert_bytes_of_one_process(saved_as(kind, form, tmp_path / "a.msh"), "gmsh", ranks, method)


@pytest.mark.parametrize("case", gmsh_partitioned.GROUPS)
def test_partitions_in_one_file(case: str, tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_bytes(gmsh_partitioned.new("<", case))
    assert_read_alike(path, "gmsh", 3)
    path.write_bytes(gmsh_partitioned.old("<", case))  # of which the cells themselves tell what lies between
    assert planned_format(str(path), "gmsh") == ""


def test_which_files_are_shared(tmp_path: Path, monkeypatch) -> None:
    path, target = tmp_path / "a.msh", str(tmp_path / "b.msh")

    def shared(data: bytes) -> str:
        path.write_bytes(data)
        return shared_format(str(path), target)

    new, old = VARIANTS["4.1 little"], VARIANTS["2.2 little"]
    assert shared(new) == shared(old) == "gmsh"
    more = b"$NodeData\n1\n" + b"$EndNode" * 1000 + b"\n$EndNodeData\n"
    assert shared(new + more) == "gmsh"
    assert shared(new + more[:-4]) == ""
    assert shared(new + b"$Periodic\n" + bytes(8) + b"\n$EndPeriodic\n") == "gmsh"
    assert shared(new + b"$Periodic\n" + bytes(9) + b"\n$EndPeriodic\n") == ""
    assert shared(VARIANTS["4.1 text"]) == shared(VARIANTS["2.2 text"]) == ""
    assert shared(b"(0 a mesh of Fluent)") == ""
    assert [shared(data[:end]) for data in (new, old) for end in range(0, len(data) - 10, 37)].count("") > 30
    monkeypatch.setattr(gmsh_ranges, "MOST", 2)
    assert shared(new) == shared(old) == ""


def periodic(data: bytes, version: str, order: str, images: np.ndarray) -> bytes:
    """A file with a curve and a surface that are images of others, and one image of a node that is not there."""
    parts = [images[::2], np.concatenate([images[1::2], [[10**6, images[0, 0]]]])]
    if version == "2.2":
        rows = ["".join(f"{one} {other}\n" for one, other in part.tolist()) for part in parts]
        affine = f"Affine{' 1' * 16}\n"
        text = "".join(f"{k + 1} {k + 2} 1\n{affine * k}{len(part)}\n{row}"
                       for k, (part, row) in enumerate(zip(parts, rows, strict=True)))  # fmt: skip
        return data + f"$Periodic\n2\n{text}$EndPeriodic\n".encode()
    long, short = f"{order}u8", f"{order}i4"
    body = [np.array([2], long).tobytes()]
    for k, part in enumerate(parts):
        body += [np.array([k + 1, k + 2, 1], short).tobytes(), np.array([16 * k], long).tobytes()]
        body += [np.ones(16 * k, f"{order}f8").tobytes(), np.array([len(part)], long).tobytes()]
        body.append(part.astype(long).tobytes())
    return data + b"$Periodic\n" + b"".join(body) + b"\n$EndPeriodic\n"


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("form", FORMS)
def test_periodic_boundaries(form, ranks: int, tmp_path: Path) -> None:
    """Here nodes from anywhere have images, so that it shows that they are held."""
    path, (version, order, wildly) = saved_as("tetrahedra", form, tmp_path / "a.msh"), form
    count = len(MESHES["tetrahedra"]().points)
    tags = wild(count) if wildly else np.arange(1, count + 1)
    chosen = np.random.default_rng(2).permutation(count)[:60].reshape(-1, 2)
    path.write_bytes(periodic(path.read_bytes(), version, order, tags[chosen]))
    assert_read_alike(path, "gmsh", ranks)
    mesh = gmsnet.read(path)
    assert np.flatnonzero(images(mesh)).tolist() == np.unique(chosen).tolist()
    pieces = together(ranks, lambda comm: read_ranges(str(path), "gmsh", comm).piece)
    for piece in pieces:
        assert piece.fixed.tolist() == images(mesh)[piece.ids].tolist()
    assert_bytes_of_one_process(path, "gmsh", ranks, "barrier")
    assert not (gmsnet.read(path).points != mesh.points)[chosen].any()


@pytest.mark.parametrize("variant", ["2.2 little", "2.2 big", "4.1 little", "4.1 big"])
def test_a_file_cut_anywhere_is_for_the_reader_of_the_whole(variant: str, tmp_path: Path) -> None:
    path, data = tmp_path / "a.msh", VARIANTS[variant]
    for end in range(len(data) - 1):
        path.write_bytes(data[:end])
        assert planned_format(str(path), "gmsh") == ""


@pytest.mark.parametrize("wildly", [False, True])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_damage_is_named_on_all_ranks(version: str, wildly: bool, tmp_path: Path) -> None:
    mesh = random_volume(200, seed=1)
    tags, path = wild(len(mesh.points)) if wildly else np.arange(1, len(mesh.points) + 1), tmp_path / "a.msh"
    data, size = save(mesh, version, "<", tags), 4 if version == "2.2" else 8
    kind = f"<i{size}"
    end = data.index(b"\n$EndElements")
    path.write_bytes(data[: end - size] + np.array([9**9], kind).tobytes() + data[end:])
    before = saved(tmp_path)
    byte = end - mesh.cells[-1].nodes.shape[1] * size
    assert re.search(
        rf"a.msh: byte {byte}: a cell names the node {9**9}, which the file has not", heard(3, path, "gmsh")[0]
    )
    assert saved(tmp_path) == before
    if wildly:
        tags[-1] = tags[0]
        path.write_bytes(save(mesh, version, "<", tags))
        said = heard(3, path, "gmsh")[0]
        assert re.search(rf"byte \d+: the node {tags[0]} is given twice", said)
        at = int(re.findall(r"byte (\d+)", said)[0])
        assert np.frombuffer(path.read_bytes(), kind, 1, at)[0] == tags[0]
    data = save(mesh, version, "<").replace(mesh.points[5].tobytes(), np.full(3, np.nan).tobytes())
    path.write_bytes(data)
    at = data.index(np.full(3, np.nan).tobytes())
    assert f"byte {at}: a coordinate of node 5 (counted from 0) is not finite" in heard(3, path, "gmsh")[0]


@given(tags=st.lists(st.integers(-50, 50), min_size=1, max_size=40), named=st.lists(st.integers(-60, 60), max_size=30),
       ranks=st.integers(1, 5), low=st.none() | st.integers(-5, 5))  # fmt: skip
def test_nodes_by_tags(tags: list[int], named: list[int], ranks: int, low: int | None) -> None:
    """The slow twin is a dictionary."""
    if low is not None:
        tags = list(range(low, low + len(tags)))
    place = {tag: node for node, tag in reversed(list(enumerate(tags)))}
    cuts = [len(tags) * rank // ranks for rank in range(ranks + 1)]
    values = np.array(tags)

    def one(comm):
        first, last = cuts[comm.rank : comm.rank + 2]
        mine = np.unique(np.array(named[comm.rank :: ranks], dtype=np.int64))
        return mine, *nodes_of(comm, values[first:last], first, len(tags), mine)

    found = together(ranks, one)
    twice = sorted(node for _, _, nodes in found for node in nodes.tolist())
    assert twice == sorted(node for node, tag in enumerate(tags) if place[tag] != node)
    if not twice:
        for mine, nodes, _ in found:
            assert nodes.tolist() == [place.get(tag, -1) for tag in mine.tolist()]


@pytest.mark.parametrize("form", [FORMS[0], FORMS[5]])
def test_no_rank_has_all_nodes(form, tmp_path: Path) -> None:
    from gmsnet.distributed.file_ranges import read_ranges

    mesh, path = random_volume(2000, seed=2), tmp_path / "a.msh"
    path.write_bytes(save(mesh, form[0], form[1], wild(len(mesh.points)) if form[2] else None))
    pieces = together(4, lambda comm: read_ranges(str(path), "gmsh", comm).piece)
    assert max(len(piece.ids) for piece in pieces) < 0.5 * len(mesh.points)
    assert gmsnet.read(path).points.tobytes() == mesh.points.tobytes()


def test_cells_that_may_be_listed_once_for_each_group_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_bytes(gmsh_variants.old("<"))
    assert planned_format(str(path), "gmsh") == "gmsh"
    path.write_bytes(gmsh_variants.old("<", again=[(2, 4, *gmsh_variants.TRIANGLES[0][2:])]))
    assert planned_format(str(path), "gmsh") == ""
