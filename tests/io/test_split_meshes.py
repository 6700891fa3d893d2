"""Meshes in several files that no file lists: Gmsh's parts, and the processors of a decomposed case of OpenFOAM."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.decomposed import Case, block, plane, strips
from support.foam import FORMS, in_text
from support.foam_processors import save
from support.gmsh_split import save_split

import gmsnet
from gmsnet.cli import main
from gmsnet.errors import FormatError, InputError
from gmsnet.generate import random_volume
from gmsnet.mesh.mesh import Mesh

CASES: dict[str, Callable[[], Case]] = {"block": block, "plane": plane}


def flat(nodes: int = 200) -> Mesh:
    mesh = gmsnet.random_mesh(nodes, seed=4)
    return Mesh(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), mesh.cells)


def solid(nodes: int = 200) -> Mesh:
    return random_volume(nodes, seed=4)


def rows(points: np.ndarray) -> list[tuple[float, ...]]:
    return sorted(map(tuple, points.tolist()))


def corners(mesh: Mesh) -> dict[str, list[tuple[float, ...]]]:
    """Kind → the corners of its cells, whatever the order of the cells."""
    found: dict[str, list[tuple[float, ...]]] = {}
    for each in mesh.cells:
        if each.dimension != 0:
            places = mesh.points[each.nodes].tolist()
            found.setdefault(each.kind, []).extend(tuple(sorted(map(tuple, cell))) for cell in places)
    return {kind: sorted(each) for kind, each in found.items()}


def saved(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def lines_that_differ(one: bytes, other: bytes) -> int:
    return sum(a != b for a, b in zip(one.splitlines(), other.splitlines(), strict=True))


@pytest.mark.parametrize("ghosts", [False, True])
@pytest.mark.parametrize(("version", "order"), [("4.1", ""), ("4.1", "<"), ("4.1", ">"), ("2.2", ""), ("2.2", "<")])
def test_parts_of_gmsh_are_one_mesh(version: str, order: str, ghosts: bool, tmp_path: Path) -> None:
    if ghosts and version == "2.2":
        pytest.skip("Gmsh writes no ghost cells in version 2.2")
    whole = solid()
    path = save_split(whole, tmp_path, 4, ghosts=ghosts, order=order, version=version)
    before = saved(tmp_path)
    mesh = gmsnet.read(path)
    assert rows(mesh.points) == rows(whole.points[np.unique(whole.cells[0].nodes)])
    assert corners(mesh)["tetra"] == corners(Mesh(whole.points, whole.cells[:1]))["tetra"]
    assert mesh.region_names == {(3, 1): "fluid"}
    assert gmsnet.write(mesh, tmp_path / "same.msh") == []
    for k in range(1, 5):
        assert (tmp_path / f"same_{k}.msh").read_bytes() == before[f"a_{k}.msh"]
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    gmsnet.write(result.mesh, path)
    again = gmsnet.read(path)
    assert again.points.tobytes() == result.mesh.points.tobytes()
    assert not path.exists()
    for k in range(1, 5):  # every copy of a node, in cells or not
        part = gmsnet.read(tmp_path / f"a_{k}.msh")
        assert set(map(tuple, part.points.tolist())) <= set(map(tuple, again.points.tolist()))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ids", [False, True])
def test_processors_are_one_mesh(name: str, form: str, ids: bool, tmp_path: Path) -> None:
    case, single = CASES[name](), form == "single"
    save({f"constant/polyMesh/{key}": data for key, data in case.whole(FORMS[form]).items()}, tmp_path / "whole")
    folder = save(case.parts(strips(case, 3), FORMS[form], ids), tmp_path / "parts")
    whole, mesh, before = gmsnet.read(tmp_path / "whole"), gmsnet.read(folder), saved(folder)
    assert rows(mesh.points) == rows(whole.points)
    assert mesh.single == single
    assert corners(mesh) == corners(whole)
    assert sorted(mesh.region_names.values()) == sorted(whole.region_names.values()) == ["inlet", "walls"]
    markers, expected = mesh.markers, whole.markers
    for marker in ("inlet", "walls"):
        assert rows(mesh.points[markers[marker]]) == rows(whole.points[expected[marker]])
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    assert "interface between regions" not in result.held
    gmsnet.write(result.mesh, folder)
    assert gmsnet.read(folder).points.tobytes() == result.mesh.points.tobytes()
    after = saved(folder)
    assert before.keys() == after.keys()
    assert {key.rpartition("/")[2] for key in after if after[key] != before[key]} == {"points"}
    assert gmsnet.quality(gmsnet.read(folder)).inverted == 0


def test_only_moved_points_are_written_and_all_copies_of_them(tmp_path: Path) -> None:
    case = block()
    folder = save(case.parts(strips(case, 3)), tmp_path / "parts")
    before, result = saved(folder), gmsnet.smooth(gmsnet.read(folder), "laplacian", max_sweeps=1)
    gmsnet.write(result.mesh, folder)
    after = saved(folder)
    changed = sum(lines_that_differ(before[key], after[key]) for key in after if key.endswith("/points"))
    size = 4  # on the planes between processors a point stands in several files
    copies = dict.fromkeys(range(len(case.points)), 0)
    for part in strips(case, 3):
        for node in {node for cell in part for face in case.cells[cell] for node in face}:
            copies[node] += 1
    place = {tuple(point): k for k, point in enumerate(case.points)}
    moved = [place[tuple(point)] for point in gmsnet.read(save(case.parts(strips(case, 3)), tmp_path / "b")).points[
        result.moved].tolist()]  # fmt: skip
    assert len(moved) == (size - 1) ** 3
    assert changed == sum(copies[node] for node in moved) > len(moved)


def test_a_processor_without_cells_and_compressed_files(tmp_path: Path) -> None:
    case = block()
    files = case.parts([[], *strips(case, 2), []])
    plain, folder = save(files, tmp_path / "plain"), tmp_path / "packed"
    for name, data in files.items():
        path = folder / f"{name}.gz"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(gzip.compress(data))
    one, other = gmsnet.read(plain), gmsnet.read(folder)
    assert one.points.tobytes() == other.points.tobytes()
    result = gmsnet.smooth(other)
    gmsnet.write(result.mesh, folder)
    assert {path.suffix for path in folder.rglob("*") if path.is_file()} == {".gz"}
    assert gmsnet.read(folder).points.tobytes() == result.mesh.points.tobytes()


def test_a_case_that_has_both_is_read_whole_unless_it_is_asked_for(tmp_path: Path, capsys) -> None:
    case = block()
    save({f"constant/polyMesh/{key}": data for key, data in case.whole().items()}, tmp_path)
    folder = save(case.parts(strips(case, 3)), tmp_path)
    before = saved(folder)
    assert main(["smooth", str(folder), "--in-place", "--format", "decomposed", "--quiet"]) == 0
    after = saved(folder)
    changed = {key for key in after if after[key] != before[key]}
    assert changed == {f"processor{k}/constant/polyMesh/points" for k in range(3)}
    assert main(["smooth", str(folder), "--in-place"]) == 0
    assert "the points of the processors stay as they are; --format decomposed moves these" in capsys.readouterr().err
    assert {key for key in saved(folder) if saved(folder)[key] != after[key]} == {"constant/polyMesh/points"}


def test_the_output_is_a_copy_of_the_case_or_another_format(tmp_path: Path, capsys) -> None:
    case = block()
    folder = save(case.parts(strips(case, 3)), tmp_path / "a")
    assert main(["smooth", str(folder), str(tmp_path / "b")]) == 2
    assert "copy the case there first" in capsys.readouterr().err
    save(case.parts(strips(case, 3)), tmp_path / "b")
    assert main(["smooth", str(folder), str(tmp_path / "b"), "--quiet"]) == 0
    assert saved(folder) != saved(tmp_path / "b")
    assert saved(folder) == case.parts(strips(case, 3))
    assert main(["smooth", str(folder), str(tmp_path / "b.vtu"), "--quiet"]) == 0
    one, other = gmsnet.read(tmp_path / "b"), gmsnet.read(tmp_path / "b.vtu")
    assert rows(one.points) == rows(other.points)
    save(case.parts(strips(case, 4)), tmp_path / "more")
    assert main(["smooth", str(folder), str(tmp_path / "more")]) == 2
    assert "more parts of this name" in capsys.readouterr().err
    assert main(["smooth", str(folder), str(folder)]) == 2
    assert "is the input" in capsys.readouterr().err
    assert main(["smooth", str(folder), "--out-dir", str(tmp_path / "out"), "--quiet"]) == 0
    assert saved(tmp_path / "out" / "a") == saved(tmp_path / "b")


def test_the_output_of_parts_of_gmsh(tmp_path: Path, capsys) -> None:
    path = save_split(flat(), tmp_path, 3)
    assert main(["smooth", str(path), str(tmp_path / "b.msh"), "--quiet"]) == 0
    one = gmsnet.read(tmp_path / "b.msh")
    assert main(["smooth", str(path), str(tmp_path / "c.msh"), "--output-format", "gmsh", "--quiet"]) == 0
    assert (tmp_path / "c.msh").exists()
    assert rows(gmsnet.read(tmp_path / "c.msh").points) == rows(one.points)
    assert main(["smooth", str(path), str(tmp_path / "c.msh")]) == 2
    assert "would hide the parts" in capsys.readouterr().err
    (tmp_path / "d_4.msh").write_bytes(b"")
    assert main(["smooth", str(path), str(tmp_path / "d.msh")]) == 2
    assert "more parts of this name" in capsys.readouterr().err
    assert main(["smooth", str(path), str(path)]) == 2
    assert "is the input" in capsys.readouterr().err
    assert main(["smooth", str(path), "--in-place", "--quiet"]) == 0
    assert gmsnet.read(path).points.tobytes() == one.points.tobytes()
    assert main(["smooth", str(tmp_path / "b.msh"), "--out-dir", str(tmp_path / "out"), "--quiet"]) == 0
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == ["b_1.msh", "b_2.msh", "b_3.msh"]


def test_a_report_and_a_picture_beside_parts(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    path, case = save_split(flat(), tmp_path, 2), block()
    folder, copy = (save(case.parts(strips(case, 2)), tmp_path / name) for name in ("case", "copy"))
    for source, target in ((path, tmp_path / "b.msh"), (folder, copy)):
        made = [str(tmp_path / f"{target.stem}{suffix}") for suffix in (".html", ".png")]
        asked = ["--report", made[0], "--plot", made[1], "--max-sweeps", "2", "--quiet"]
        assert main(["smooth", str(source), str(target), *asked]) == 0
        assert all(Path(each).stat().st_size > 1000 for each in made)


def test_a_part_by_itself_holds_what_it_shares(tmp_path: Path) -> None:
    case = block()
    folder = save(case.parts(strips(case, 2)), tmp_path)
    one = gmsnet.read(folder / "processor0")
    result = gmsnet.smooth(one)
    assert result.moved.any()
    other = set(map(tuple, gmsnet.read(folder / "processor1").points.tolist()))
    assert not {tuple(point) for point in one.points[result.moved].tolist()} & other


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda folder: (folder / "a_2.msh").unlink(), r"a_2.msh: is missing among the parts 1 to 4 of this mesh"),
        (lambda folder: (folder / "a_4.msh").unlink(), "part 1 is of a mesh of 4 partitions, and there are 3 files"),
        (lambda folder: (folder / "a_3.msh").write_bytes(b"$MeshFormat\n4.1 0 8\n"), r"a.msh: part 3: "),
        (lambda folder: [p.unlink() for p in folder.iterdir()], r"a.msh: there is no such file"),
    ],
)
def test_parts_of_gmsh_that_do_not_belong_together(change, said: str, tmp_path: Path) -> None:
    path = save_split(flat(), tmp_path, 4)
    change(tmp_path)
    with pytest.raises(InputError, match=said):
        gmsnet.read(path)


def test_numbered_files_that_are_no_parts_are_not_taken_for_such(tmp_path: Path) -> None:
    for k in (1, 2):
        gmsnet.write(flat(), tmp_path / f"a_{k}.msh")
    with pytest.raises(FormatError, match=r"a.msh: there is no such file, and its part 1 is of no partitioned mesh"):
        gmsnet.read(tmp_path / "a.msh")
    with pytest.raises(InputError, match=r"b.msh: there are no files .*b_1.msh"):
        gmsnet.read(tmp_path / "b.msh", "split")


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (lambda f: {k: d for k, d in f.items() if "processor1/" not in k},
         r"processor1/constant/polyMesh/points: is missing among the parts 0 to 2"),
        (lambda f: {k: d for k, d in f.items() if k != "processor1/constant/polyMesh/faces"}, "no such file"),
        (lambda f: {k: d.replace(b"inlet", b"outlet") if "processor2" in k else d for k, d in f.items()},
         "processor2 has other patches or zones than processor0"),
        (lambda f: {k: d[:-30] if k == "processor1/constant/polyMesh/owner" else d for k, d in f.items()},
         "processor1: line 125: .*cut off"),
        (lambda f: {k.replace("processor1", "x").replace("processor2", "y").replace("processor0", "processors3"): d
                    for k, d in f.items()}, "processors3: the collated form is not read"),
    ],
)  # fmt: skip
def test_processors_that_do_not_belong_together(files, said: str, tmp_path: Path) -> None:
    case = block()
    folder = save(files(case.parts(strips(case, 3))), tmp_path)
    with pytest.raises(InputError, match=said):
        gmsnet.read(folder)


def test_a_folder_without_parts(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no decomposed case"):
        gmsnet.read(tmp_path, "decomposed")


def test_points_of_periodic_patches_are_told_of_all_parts(tmp_path: Path) -> None:
    case = block()
    case = case._replace(patches={"walls": "wall", "inlet": "cyclic"})
    mesh = gmsnet.read(save(case.parts(strips(case, 3)), tmp_path))
    assert mesh.source.images_in(mesh).tolist() == np.flatnonzero(mesh.points[:, 0] == 0.0).tolist()  # type: ignore
    assert in_text
