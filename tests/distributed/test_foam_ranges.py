"""Binary meshes of OpenFOAM, of which each rank reads some faces: cells are put together where they belong."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.layouts import shared_format
from gmsnet.distributed.planned import planned_format
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_ranges import SIZE, assert_read_alike, heard, mixed
from support.comm import together
from support.foam import FORMS, Lists, cells_of_mesh, in_binary, in_text, layer, merged, poly_mesh, zones_in_binary
from support.foam_processors import save as save_below

SIDES = ("low", "high", "rest")


def lists_of(mesh: Mesh, pairs: int = 2) -> Lists:
    """Cells in a wild order, of which some pairs are one polyhedron each; a prism beside; and three patches."""
    cells = cells_of_mesh(mesh)
    cells = [cells[k] for k in np.random.default_rng(1).permutation(len(cells))]
    points = mesh.points.tolist()
    _with_prism(points, cells)

    def patch(face: list[int]) -> str:
        where = np.array(points)[face, 0]
        return SIDES[0 if (where == 0).all() else 1 if (where == SIZE).all() else 2]

    return poly_mesh(points, merged(cells, pairs), patch)


def _with_prism(points: list[list[float]], cells: list[list[list[int]]]) -> None:
    """A prism over pentagons beside a face at the end of the block."""
    face = next(f for cell in cells for f in cell if len(f) == 4 and all(points[k][0] == SIZE for k in f))
    ends, out = [[face[0], face[1]], [face[3], face[2]]], [0.5, 1.0, 0.5]
    for end in ends:
        one, two = (np.array(points[k]) for k in end)
        for share, far in zip((0.9, 0.5, 0.1), out, strict=True):
            end.append(len(points))
            points.append((one + share * (two - one) + [far, 0.0, 0.0]).tolist())
    low, high = ends
    cells.append([low, high[::-1], *([low[k - 1], high[k - 1], high[k], low[k]] for k in range(5))])


def save(files: dict[str, bytes], case: Path) -> Path:
    return save_below({f"constant/polyMesh/{name}": data for name, data in files.items()}, case)


def zoned(periodic: bool = False) -> dict[str, bytes]:
    lists = lists_of(mixed())
    if periodic:
        lists["boundary"] = [(n, "cyclic" if n != "rest" else t, c, s) for n, t, c, s in lists["boundary"]]  # type: ignore[attr-defined]
    files = in_binary(lists)
    files["cellZones"] = zones_in_binary("cellZones", {"one": range(3, 50, 2), "none": [], "two": range(40, 60)})
    files["faceZones"] = zones_in_binary("faceZones", {"fan": [5, 90, 6], "other": [7]})
    files["pointZones"] = zones_in_binary("pointZones", {"probe": [33, 20]})
    return files


CASES = {
    **{form: lambda form=form: FORMS[form](lists_of(mixed())) for form in FORMS if "text" not in form},
    "zones": zoned,
    "periodic": lambda: zoned(periodic=True),
}


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", CASES)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    case = save(CASES[kind](), tmp_path / "case")
    assert_read_alike(case, "openfoam", ranks)
    mesh = gmsnet.read(case)
    kinds = {block.kind for block in mesh.cells}
    assert {"tetra", "pyramid", "wedge", "hexahedron", "polyhedron", "triangle", "quad", "polygon"} <= kinds
    assert set(mesh.markers) >= {"low", "high", "rest"}
    assert set(mesh.region_names.values()) >= ({"one", "two"} if "cellZones" in CASES[kind]() else set())


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
@pytest.mark.parametrize("kind", CASES)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    """Into a case that has another mesh, and in place; nothing but the points changes."""
    case, serial = (save(CASES[kind](), tmp_path / name) for name in ("case", "serial"))
    other = save(in_binary(layer()), tmp_path / "other")
    gmsnet.write(gmsnet.smooth(gmsnet.read(serial), method, max_sweeps=4).mesh, serial)
    options = SmoothOptions(method=method, max_sweeps=4, threads=1)
    for target in (other, case):
        task = FileTask(str(case), str(target), "openfoam", options)
        together(ranks, lambda comm, task=task: smooth_file(task, comm))
        wanted, found = bytes_in(serial), bytes_in(target)
        assert found == wanted
        assert wanted["points"] != CASES[kind]()["points"]


@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("slide", [None, "all"])
def test_polyhedra_are_held_where_they_are(slide: str | None, ranks: int, tmp_path: Path) -> None:
    """No rank takes the whole for them, and all is told as by one process."""
    case = save(zoned(), tmp_path / "case")
    serial = gmsnet.smooth(gmsnet.read(case), "barrier", max_sweeps=3, slide=slide)
    options = SmoothOptions(method="barrier", max_sweeps=3, threads=1, slide=slide)
    task = FileTask(str(case), None, "openfoam", options)
    result = together(ranks, lambda comm: smooth_file(task, comm))[0]
    assert result.gathered == ""
    assert result.held == {reason: len(ids) for reason, ids in serial.held.items()}
    left_out = [note for note in serial.notes if "polyhedron" in note]
    assert left_out == ["not measured, and their nodes are held: 3 polyhedron cells"]
    assert [note for note in result.notes if "polyhedron" in note] == left_out
    assert repr(result.after) == repr(serial.after.totals)


def bytes_in(case: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (case / "constant" / "polyMesh").iterdir()}


def test_no_rank_has_the_whole(tmp_path: Path) -> None:
    case = save(in_binary(lists_of(mixed())), tmp_path / "case")
    pieces = together(4, lambda comm: read_ranges(str(case), "openfoam", comm).piece)
    cells = [sum(len(b.nodes) for b in piece.blocks if b.kind in ("tetra", "hexahedron")) for piece in pieces]
    assert max(cells) < 0.4 * sum(cells)
    assert max(len(piece.ids) for piece in pieces) < 0.7 * len(mixed().points)


def test_which_cases_are_shared(tmp_path: Path) -> None:
    binary, text = (save(make(lists_of(mixed())), tmp_path / make.__name__) for make in (in_binary, in_text))
    plane = save(in_binary(layer()), tmp_path / "plane")
    for name in ("", "constant/polyMesh", "constant/polyMesh/points"):
        assert shared_format(str(binary / name), str(text)) == "openfoam"
    assert shared_format(str(binary), str(tmp_path / "a.vtu")) == ""
    assert shared_format(str(binary), str(binary), "openfoam", "openfoam") == "openfoam"
    assert shared_format(str(binary), str(binary), "vtk") == ""
    for case in (text, plane, tmp_path / "none"):
        assert planned_format(str(case), "openfoam") == ""
    points = binary / "constant" / "polyMesh" / "points"
    points.write_bytes(points.read_bytes()[:-4])
    assert planned_format(str(binary), "openfoam") == ""


@pytest.mark.parametrize(
    ("name", "width", "row", "value", "said"),
    [
        ("owner", 1, 5, 100_000, "a face names the cell 100000"),
        ("neighbour", 1, 5, -3, "neighbour: a face names the cell -3"),
        ("faces", 1, 4, 0, r"faces: face \d+ \(counted from 0\) has -?\d+ points"),
        ("cellZones", 1, 3, 100_000, "a zone names 100000, but there are .* cells"),
        ("pointZones", 1, 1, 100_000, "a zone names 100000, but there are .* points"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_by_all(name: str, width: int, row: int, value: int, said: str, tmp_path: Path) -> None:
    case = save(zoned(), tmp_path / "case")
    path = case / "constant" / "polyMesh" / name
    data = bytearray(path.read_bytes())
    begin = data.index(b"(", data.index(b"Labels") if "Zones" in name else data.index(b"// * * //")) + 1
    data[begin + 4 * row : begin + 4 * row + 4] = value.to_bytes(4, "little", signed=True)
    path.write_bytes(data)
    before = bytes_in(case)
    told = set(heard(3, case, "openfoam"))
    assert len(told) == 1
    assert re.search(said, told.pop())
    assert bytes_in(case) == before


def test_a_file_that_changes_meanwhile_is_kept(tmp_path: Path) -> None:
    case = save(in_binary(lists_of(mixed())), tmp_path / "case")
    path = case / "constant" / "polyMesh" / "points"

    def one(comm):
        given = read_ranges(str(case), "openfoam", comm)
        comm.allgather(0)
        if comm.rank == 0:
            os.utime(path, ns=(1, 1))
        comm.allgather(0)
        with pytest.raises(gmsnet.InputError, match="changed"):
            given.write(str(case), given.piece.points + 0.1, comm)

    before = bytes_in(case)
    together(2, one)
    assert bytes_in(case) == before
