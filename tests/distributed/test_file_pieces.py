"""Files in pieces that ranks read and write: the bytes of a serial run, and all files or none."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.pieces import index, piece, ring, save_pieces

import gmsnet
from gmsnet.distributed import together as written
from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.gathered import gathered
from gmsnet.errors import InputError
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from support.comm import together


def flat(nodes=300, seed=3):
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    return Mesh(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), mesh.cells)


def saved(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def run(folder, ranks, target="b.pvtu", method="barrier"):
    options = SmoothOptions(method=method, max_sweeps=5, threads=1)
    task = FileTask(str(folder / "a.pvtu"), str(folder / target), "pvtu", options)
    return together(ranks, lambda comm: smooth_file(task, comm))


def assert_read_alike(path, ranks, kind="pvtu"):
    mesh = gmsnet.read(path)
    whole = together(ranks, lambda comm: gathered(read_pieces(str(path), kind, comm).piece, comm))[0]
    assert whole.ids.tolist() == list(range(len(mesh.points)))
    assert whole.mesh.points.tobytes() == mesh.points.tobytes()
    assert [block.kind for block in whole.mesh.cells] == [block.kind for block in mesh.cells]
    for mine, block in zip(whole.mesh.cells, mesh.cells, strict=True):
        assert mine.nodes.tolist() == block.nodes.tolist()
        assert mine.regions.tolist() == block.regions.tolist()
    assert not whole.fixed.any()
    assert dict(whole.mesh.region_names) == dict(mesh.region_names)


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("ids", [False, True])
@pytest.mark.parametrize("ghosts", [False, True])
def test_ranks_read_the_mesh_of_one_process(tmp_path, ranks, ghosts, ids):
    assert_read_alike(save_pieces(flat(), tmp_path, 4, ghosts, ids), ranks)


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_any_division_is_read_alike(tmp_path_factory, data):
    """Pieces of any cells, with ghost cells that may be nobody's, ids in some of them, doubled points, and shared
    nodes at two places."""
    mesh, folder = flat(12, data.draw(st.integers(0, 5))), tmp_path_factory.mktemp("any")
    count = len(mesh.cells[0].nodes)
    owner = np.array(data.draw(st.lists(st.integers(-1, 3), min_size=count, max_size=count)))
    names = []
    for k in range(4):
        own = np.flatnonzero(owner == k)
        if not len(own):
            continue
        ghosts = ring(mesh, own) if data.draw(st.booleans()) else None
        part = piece(mesh, own, ghosts, data.draw(st.booleans()))
        points = part.points.copy()
        if data.draw(st.booleans()):
            points[-1] = points[0]
        if data.draw(st.booleans()):
            points[points == 0.0] = -0.0
        gmsnet.write(Mesh(points, part.cells, point_data=part.point_data, cell_data=part.cell_data),
                     folder / f"{k}.vtu")  # fmt: skip
        names.append(f"{k}.vtu")
    if names:
        (folder / "a.pvtu").write_text(index(names))
        assert_read_alike(folder / "a.pvtu", data.draw(st.integers(1, 6)))


@pytest.mark.parametrize(("ranks", "pieces"), [(1, 3), (2, 4), (3, 2), (2, 1)])
@pytest.mark.parametrize("method", ["barrier", "getme"])
def test_the_bytes_of_a_serial_run(tmp_path, ranks, pieces, method):
    before = saved(save_pieces(flat(), tmp_path, pieces, True).parent)
    result = gmsnet.smooth(gmsnet.read(tmp_path / "a.pvtu"), method, max_sweeps=5)
    (tmp_path / "serial").mkdir()
    gmsnet.write(result.mesh, tmp_path / "serial" / "b.pvtu")
    run(tmp_path, ranks, method=method)
    after = saved(tmp_path)
    assert {name: after[name] for name in before} == before
    made = {name for name in after if name.startswith("b")}
    assert made == {"b.pvtu", *(f"b/a_{k}.vtu" for k in range(pieces))}
    assert {name: after[name] for name in made} == {name: after[f"serial/{name}"] for name in made}
    assert any(after[f"b/a_{k}.vtu"] != before[f"a/a_{k}.vtu"] for k in range(pieces))
    run(tmp_path, ranks, "a.pvtu", method)  # in place
    again = saved(tmp_path)
    assert [again[f"a/a_{k}.vtu"] for k in range(pieces)] == [after[f"b/a_{k}.vtu"] for k in range(pieces)]


@pytest.mark.parametrize("ranks", [1, 2, 3])
@pytest.mark.parametrize("width", [0, 2])
def test_point_data_that_hold_nodes(tmp_path, ranks, width):
    """The first copy of a node counts, as without ranks; data that a piece does not have are none."""
    mesh = flat()
    save_pieces(mesh, tmp_path, 3)
    chosen = np.random.default_rng(1).random(len(mesh.points)) < 0.3
    place = {tuple(point): k for k, point in enumerate(mesh.points.tolist())}
    for k in range(3):
        part = gmsnet.read(tmp_path / f"a/a_{k}.vtu")
        mine = chosen[[place[tuple(point)] for point in part.points.tolist()]] & (k != 1)
        values = np.column_stack([0.0 * mine, mine]) if width else mine.astype(np.int32)
        fields = {**part.point_data, "fixed": values}
        gmsnet.write(Mesh(part.points, part.cells, point_data=fields, cell_data=part.cell_data),
                     tmp_path / f"a/a_{k}.vtu")  # fmt: skip
    whole = gmsnet.read(tmp_path / "a.pvtu")
    result = gmsnet.smooth(whole, "barrier", max_sweeps=5)
    assert "fixed by the user" in result.held
    (tmp_path / "serial").mkdir()
    gmsnet.write(result.mesh, tmp_path / "serial" / "b.pvtu")
    run(tmp_path, ranks)
    after = saved(tmp_path)
    for k in range(3):
        assert after[f"b/a_{k}.vtu"] == after[f"serial/b/a_{k}.vtu"]


def test_in_place_the_file_that_names_the_others_keeps_their_names(tmp_path):
    path = save_pieces(flat(), tmp_path, 2)
    path.write_text(path.read_text().replace('"a/a_', '"./a/a_'))
    before = saved(tmp_path)
    run(tmp_path, 2, "a.pvtu")
    after = saved(tmp_path)
    assert {name for name in after if after[name] != before[name]} == {"a/a_0.vtu", "a/a_1.vtu"}


def test_more_ranks_than_nodes(tmp_path):
    mesh = flat(12)
    save_pieces(mesh, tmp_path, 2)
    assert_read_alike(tmp_path / "a.pvtu", len(mesh.points) + 3)


@pytest.mark.parametrize("wrong", ["a_1.vtu: .*line", "a_1.vtu: there is no such file"])
def test_a_truncated_or_missing_piece_is_named_on_all_ranks(tmp_path, wrong):
    save_pieces(flat(), tmp_path)
    bad = tmp_path / "a" / "a_1.vtu"
    bad.write_bytes(bad.read_bytes()[:500])
    if "no such" in wrong:
        bad.unlink()
    before, heard = saved(tmp_path), []

    def one(comm):
        with pytest.raises(InputError) as raised:
            read_pieces(str(tmp_path / "a.pvtu"), "pvtu", comm)
        heard.append(str(raised.value))

    together(3, one)
    assert len(heard) == 3
    assert len(set(heard)) == 1
    assert re.search(wrong, heard[0])
    assert saved(tmp_path) == before


@pytest.mark.parametrize("error", [InputError("the disk is full"), ZeroDivisionError("on purpose"), MemoryError()])
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("target", ["a.pvtu", "b.pvtu"])
def test_a_failure_of_one_rank_leaves_all_files(tmp_path, monkeypatch, error, late, target):
    save_pieces(flat(), tmp_path)
    before, heard = saved(tmp_path), []
    replace_files = written.replace_files

    def failing(files, stamps, agree):
        if not any(path.endswith("a_1.vtu") for path in files):
            return replace_files(files, stamps, agree)

        def broken():
            yield b"half of it"
            raise error

        last = [*files][-1] if late else next(iter(files))
        return replace_files({**files, last: broken()}, stamps, agree)

    monkeypatch.setattr(written, "replace_files", failing)

    def one(comm):
        with pytest.raises(InputError) as raised:
            smooth_file(FileTask(str(tmp_path / "a.pvtu"), str(tmp_path / target), "pvtu",
                                 SmoothOptions(method="barrier", max_sweeps=1, threads=1)), comm)  # fmt: skip
        heard.append(str(raised.value))

    together(3, one)
    assert len(set(heard)) == 1
    assert len(heard) == 3
    assert saved(tmp_path) == before
    assert not (tmp_path / "b").exists()
