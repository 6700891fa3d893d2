"""Files that ranks share, with nodes that are held or slide, by ids and by the names of markers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.cli.fix import chosen, fixed_nodes
from gmsnet.distributed.chosen import holding
from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.gathered import Whole, gathered
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import PLANNED
from gmsnet.errors import InputError
from gmsnet.generate import random_mesh, random_volume
from gmsnet.mesh.selection import fixed_mask
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed import test_exodus_ranges
from distributed.test_cgns_grids_ranges import save_grids
from distributed.test_cgns_zones_ranges import save_zones
from distributed.test_file_ranges import mixed, save_ugrid, save_vtkhdf
from support import binary_meshes as made
from support.comm import together
from support.gmsh_split import save_split
from support.gmsh_variants import VARIANTS
from support.pieces import save_pieces

NAMED = [name for name in VARIANTS if "text" not in name]


def written(data: bytes, path: Path) -> Path:
    path.write_bytes(data)
    return path


FILES: dict[str, Callable[[Path], Path]] = {
    **{name: partial(lambda name, folder: written(VARIANTS[name], folder / "a.msh"), name) for name in NAMED},
    "ugrid": lambda folder: save_ugrid(mixed(), folder / "a.lb8.ugrid"),
    "surface of ugrid": lambda folder: save_ugrid(flat(), folder / "a.lb8.ugrid"),
    "grids": lambda folder: save_grids(folder / "a.cgns", zones=3, listed=(1,)),
    "zones": lambda folder: save_zones(mixed(), folder / "a.cgns", mixed=(1,)),
    "exodus": lambda folder: test_exodus_ranges.save(random_volume(100, seed=1), folder / "a.e"),
    "doubled": lambda folder: save_zones(random_mesh(100, seed=1), folder / "a.cgns", twice=40),
    "vtkhdf": lambda folder: save_vtkhdf(random_volume(100, seed=1), folder / "a.vtkhdf"),
    "split": lambda folder: save_split(random_volume(100, seed=1), folder, 3, ghosts=True),
    "pieces": lambda folder: save_pieces(flat(), folder, 3),
}  # fmt: skip


def flat() -> gmsnet.Mesh:
    mesh = random_mesh(100, seed=1)
    return gmsnet.Mesh(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), mesh.cells)


def format_of(path: Path) -> str:
    found = shared_format(str(path), str(path.with_name(f"b{path.name[1:]}")), named=True)
    assert found
    return found


def held(path: Path, given: list[str], ranks: int) -> Whole:
    """The whole mesh, with what ranks hold."""
    format = format_of(path)
    read = read_ranges if format in PLANNED else read_pieces

    def one(comm):
        choose = partial(chosen, given) if comm.rank == 0 else None
        return gathered(holding(read(str(path), format, comm).piece, choose, comm), comm)

    return together(ranks, one)[0]


@pytest.mark.parametrize("name", FILES)
def test_markers_are_those_of_one_process(name: str, tmp_path: Path) -> None:
    path = FILES[name](tmp_path)
    mesh = gmsnet.read(path)
    markers = mesh.markers
    assert bool(markers) == (name not in ("vtkhdf", "surface of ugrid", "pieces"))
    for marker in markers:
        assert np.array_equal(held(path, [marker], 3).fixed, fixed_mask(mesh, marker))
    assert held(path, [], 2).mesh.markers.keys() == markers.keys()
    with pytest.raises(InputError) as serial:
        fixed_mask(mesh, "nothing of the kind")
    with pytest.raises(InputError) as shared:
        held(path, ["nothing of the kind"], 2)
    assert str(shared.value) == str(serial.value)


@pytest.mark.parametrize("name", ["ugrid", "zones", "split", "pieces"])
def test_ids_are_those_of_one_process(name: str, tmp_path: Path) -> None:
    path = FILES[name](tmp_path)
    mesh, listed = gmsnet.read(path), tmp_path / "nodes"
    count = len(mesh.points)
    listed.write_text(f"{count - 1} 5, 17 # and more\n40")
    for given in (["3,7, 12,"], [f"@{listed}"], ["9,", f"@{listed}", f"{count - 2},"]):
        assert np.array_equal(held(path, given, 3).fixed, fixed_nodes(mesh, given))
    with pytest.raises(InputError, match=f"there is no node {count}; the mesh has the nodes 0 to {count - 1}"):
        held(path, [f"{count},"], 3)


def test_sets_of_nodes_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    """Boundary conditions of CGNS that list nodes."""
    path = written(made.cgns_zones(), tmp_path / "a.cgns")
    assert shared_format(str(path), str(tmp_path / "b.cgns")) == "cgns"
    assert shared_format(str(path), str(tmp_path / "b.cgns"), named=True) == ""


@pytest.mark.parametrize(("name", "ranks", "given", "more"), [
    ("grids", 2, ["Zone1/cells"], {"method": "barrier"}), ("ugrid", 3, ["3", "60,"], {"method": "barrier"}),
    ("doubled", 2, [], {"slide": ["all"], "method": "barrier"}),
    ("pieces", 2, [], {"slide": ["all"], "method": "barrier"}),
    ("grids", 3, [], {"slide": ["Zone0/cells", "Zone2"], "method": "barrier"}),
    ("surface of ugrid", 2, ["50,"], {"slide": ["all"], "method": "laplacian"}),
    ("split", 3, ["30,31"], {"method": "barrier"}),
    ("grids", 2, [], {"join_regions": True, "method": "barrier"}),
])  # fmt: skip
def test_the_bytes_of_a_serial_run(name: str, ranks: int, given: list[str], more, tmp_path: Path) -> None:
    path = FILES[name](tmp_path)
    if "slide" in more and name == "grids":
        path = save_grids(tmp_path / "a.cgns", zones=3, axes=2, listed=(0,))
    mesh, options = gmsnet.read(path), SmoothOptions(max_sweeps=4, threads=1, **more)
    (tmp_path / "serial").mkdir()
    serial = gmsnet.smooth(mesh, fixed=fixed_nodes(mesh, given), max_sweeps=4, threads=1, **more)
    gmsnet.write(serial.mesh, tmp_path / "serial" / path.name)
    assert serial.moved.any()
    (tmp_path / "ranks").mkdir()
    target, format = str(tmp_path / "ranks" / path.name), format_of(path)

    def one(comm, target: str | None = target):
        choose = partial(chosen, given) if given and comm.rank == 0 else None
        return smooth_file(FileTask(str(path), target, format, options, choose), comm)

    assert {result.gathered for result in together(ranks, lambda comm: one(comm, None))} == {""}
    assert not [*(tmp_path / "ranks").iterdir()]
    together(ranks, one)
    files = [each.relative_to(tmp_path / "serial") for each in (tmp_path / "serial").rglob("*") if each.is_file()]
    for each in files:
        assert (tmp_path / "ranks" / each).read_bytes() == (tmp_path / "serial" / each).read_bytes()
