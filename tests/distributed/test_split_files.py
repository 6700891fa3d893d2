"""Meshes in files that no file lists, read and written by ranks: split Gmsh files and decomposed cases of OpenFOAM."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.decomposed import Case, block, plane, strips
from support.foam import in_binary, in_text, merged
from support.foam_processors import save
from support.gmsh_split import save_split

import gmsnet
from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.errors import InputError
from gmsnet.generate import random_volume
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import assert_read_alike, saved
from support.comm import together

SAVED = {  # what is written into a folder, and what stands for it
    "split": lambda folder, parts: save_split(random_volume(300, seed=2), folder, parts),
    "split with ghosts": lambda folder, parts: save_split(random_volume(300, seed=2), folder, parts, ghosts=True),
    "split, 2.2": lambda folder, parts: save_split(_flat(), folder, parts, version="2.2", order="<"),
    "decomposed": lambda folder, parts: save(block().parts([[], *strips(block(), parts - 1)]), folder / "a"),
    "decomposed, binary": lambda folder, parts: save(
        block().parts(strips(block(), parts), in_binary, ids=False), folder / "a"
    ),
    "decomposed, polyhedra": lambda folder, parts: save(polyhedral().parts(strips(polyhedral(), parts)), folder / "a"),
    "decomposed plane": lambda folder, parts: save(plane().parts(strips(plane(), parts), in_text), folder / "a"),
}


def polyhedral() -> Case:
    """Some pairs of cells are polyhedra of 12 and of 10 points."""
    case = block()
    return case._replace(cells=merged(case.cells, 5))


def _flat() -> Mesh:
    mesh = gmsnet.random_mesh(300, seed=3)
    return Mesh(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), mesh.cells)


def format_of(kind: str) -> str:
    return "split" if kind.startswith("split") else "decomposed"


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", SAVED)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(SAVED[kind](tmp_path, 4), ranks, format_of(kind))


@pytest.mark.parametrize(("ranks", "method"), [(1, "barrier"), (2, "auto"), (3, "laplacian"), (5, "barrier")])
@pytest.mark.parametrize("kind", SAVED)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    (tmp_path / "serial").mkdir()
    (tmp_path / "ranks").mkdir()
    one, other = SAVED[kind](tmp_path / "serial", 3), SAVED[kind](tmp_path / "ranks", 3)
    before = saved(tmp_path / "serial")
    options = SmoothOptions(method=method, max_sweeps=4, threads=1)
    gmsnet.write(gmsnet.smooth(gmsnet.read(one), method, max_sweeps=4).mesh, one)
    task = FileTask(str(other), str(other), format_of(kind), options)
    together(ranks, lambda comm: smooth_file(task, comm))
    after = saved(tmp_path / "serial")
    assert after == saved(tmp_path / "ranks")
    assert after != before


def test_another_name_and_another_case(tmp_path: Path) -> None:
    path = SAVED["split"](tmp_path, 3)
    options = SmoothOptions(method="barrier", max_sweeps=2, threads=1)
    together(2, lambda comm: smooth_file(FileTask(str(path), str(tmp_path / "b.msh"), "split", options), comm))
    result = gmsnet.smooth(gmsnet.read(path), "barrier", max_sweeps=2)
    assert gmsnet.read(tmp_path / "b.msh").points.tobytes() == result.mesh.points.tobytes()
    case, copy = SAVED["decomposed"](tmp_path, 3), save(block().parts([[], *strips(block(), 2)]), tmp_path / "copy")
    before = saved(case)
    together(2, lambda comm: smooth_file(FileTask(str(case), str(copy), "decomposed", options), comm))
    assert saved(case) == before != saved(copy)


@pytest.mark.parametrize(
    ("kind", "change", "said"),
    [
        ("split", lambda f: (f / "a_2.msh").unlink(), "a_2.msh: is missing among the parts"),
        ("split", lambda f: (f / "a_3.msh").unlink(), "is of a mesh of 3 partitions, and there are 2 files"),
        ("split", lambda f: (f / "a_2.msh").write_bytes(b"$MeshFormat\n4.1 0 8\n"), "a.msh: part 2: "),
        ("decomposed", lambda f: (f / "a/processor1/constant/polyMesh/faces").unlink(), "faces: there is no such file"),
        ("decomposed", lambda f: _edit(f / "a/processor2/constant/polyMesh/boundary"), "a: processor2 has other patch"),
    ],
)
def test_damage_is_named_on_all_ranks(kind: str, change, said: str, tmp_path: Path) -> None:
    path = SAVED[kind](tmp_path, 3)
    change(tmp_path)
    before, heard = saved(tmp_path), []

    def one(comm):
        with pytest.raises(InputError) as raised:
            read_pieces(str(path), format_of(kind), comm)
        heard.append(str(raised.value))

    together(3, one)
    assert len(heard) == 3
    assert len(set(heard)) == 1
    assert re.search(said, heard[0])
    assert saved(tmp_path) == before


def _edit(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"inlet", b"outlet"))
