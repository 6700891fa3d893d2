"""Under mpiexec: files in pieces, each read and written by one rank, and what is left where one fails."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.decomposed import block, strips
from support.foam_processors import save
from support.gmsh_split import save_split
from support.pieces import save_pieces
from support.vtk_variants import grid_of, vtu_variants

import gmsnet
from gmsnet.generate import random_volume
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_cgns_grids_ranges import save_grids
from distributed.test_cgns_zones_ranges import save_zones
from distributed.test_file_ranges import mixed, save_vtkhdf
from distributed.test_fluent_ranges import volumes as of_fluent
from distributed.test_foam_ranges import zoned
from distributed.test_hdf5_ranges import packed
from distributed.test_mpiexec import MPIEXEC, mpiexec, smooth, smooth_several

pytestmark = pytest.mark.skipif(MPIEXEC is None, reason="mpiexec is not installed")

ON_RANK_1 = """
import os, sys, signal, resource
import gmsnet.distributed.together as together
import gmsnet.io.atomic as atomic
if os.environ.get('OMPI_COMM_WORLD_RANK', os.environ.get('PMI_RANK')) == '1':
    {what}
from gmsnet.cli import main
sys.exit(main(['smooth', 'a.pvtu', '{target}', '--method', 'barrier'] + {more}))
"""
FULL = (
    "def full(*given, write=together.replace_files):\n"
    "        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    "        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))\n"
    "        write(*given)\n"
    "    together.replace_files = full"
)
MODULES = {"vtkhdf": "hdf5_rows", "vtu": "vtu_sources"}
PACKING = "import gmsnet.io.{module} as module; module.put = lambda *given: os.kill(os.getpid(), 9)"
KILLED = "atomic._write = lambda *given: os.kill(os.getpid(), 9)"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    mesh = gmsnet.random_mesh(800, seed=1)
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    save_pieces(Mesh(points, mesh.cells), tmp_path, 3, ghosts=True, ids=True)
    return tmp_path


def saved(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(("ranks", "method"), [(2, "auto"), (3, "barrier"), (5, "getme")])
def test_the_same_files_as_without_ranks(folder, ranks, method):
    (folder / "serial").mkdir()
    gmsnet.write(gmsnet.smooth(gmsnet.read(folder / "a.pvtu"), method).mesh, folder / "serial" / "b.pvtu")
    done = smooth(ranks, "a.pvtu", "b.pvtu", "--method", method, "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    files = saved(folder)
    for name in ("b.pvtu", *(f"b/a_{k}.vtu" for k in range(3))):
        assert files[name] == files[f"serial/{name}"]
    report = json.loads(done.stdout)  # of one rank
    assert (report["method"], report["output"]) == (method, "b.pvtu")
    assert report["nodes"] == len(gmsnet.read(folder / "a.pvtu").points)


@pytest.mark.parametrize(("quality", "code"), [("0.3", 0), ("0.9", 1)])
def test_a_target(folder, quality, code):
    (folder / "serial").mkdir()
    serial = gmsnet.smooth(gmsnet.read(folder / "a.pvtu"), target_quality=float(quality))
    gmsnet.write(serial.mesh, folder / "serial" / "b.pvtu")
    done = smooth(2, "a.pvtu", "b.pvtu", "--target-quality", quality, "--json", cwd=folder)
    files, report = saved(folder), json.loads(done.stdout)
    for name in ("b.pvtu", *(f"b/a_{k}.vtu" for k in range(3))):
        assert files[name] == files[f"serial/{name}"]
    missed = int(np.count_nonzero(serial.after.shape < float(quality)))
    assert (report["missed"], report["target_met"], report["gathered"]) == (missed, code == 0, "")
    assert done.returncode == code, done.stderr
    assert ("target not met" in done.stderr) == (code == 1)
    worst = int(serial.after.cell[np.argmin(serial.after.shape)])
    assert (f"\n  cell {worst} at " in done.stderr) == (code == 1)
    least = float(serial.after.shape.min())
    gap = f"the minimum shape is {least:.4g}, {float(quality) - least:.4g} below {quality}; {missed:,} cells"
    assert (gap in done.stderr) == (code == 1)


def test_what_is_wrong_with_the_mesh_of_a_file_names_the_file(folder):
    done = smooth(2, "a.pvtu", "b.pvtu", "--target-dihedral", "10", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.startswith("gmsnet: error: a.pvtu: target_dihedral is of tetrahedra")
    assert not (folder / "b.pvtu").exists()


@pytest.mark.parametrize("target", ["a.pvtu", "b.pvtu"])
def test_a_full_disk_on_one_rank(folder, target):
    before = saved(folder)
    more = "['--in-place']" if target == "a.pvtu" else "[]"
    script = ON_RANK_1.format(what=FULL, target=target, more=more)
    done = mpiexec(2, "-c", script.replace("'a.pvtu', 'a.pvtu'", "'a.pvtu'"), cwd=folder)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("cannot be written: file too large") == 1
    assert "Traceback" not in done.stderr
    assert saved(folder) == before
    assert not (folder / "b").exists()


def test_a_rank_that_is_killed_as_it_writes(folder):
    before = saved(folder)
    done = mpiexec(2, "-c", ON_RANK_1.format(what=KILLED, target="b.pvtu", more="[]"), cwd=folder)
    assert done.returncode != 0
    after = saved(folder)
    assert {name: after[name] for name in before} == before
    assert all(name.endswith(".tmp") for name in after.keys() - before.keys())
    assert smooth(2, "a.pvtu", "b.pvtu", "--max-sweeps", "1", cwd=folder).returncode == 0
    assert sorted(saved(folder)) == sorted([*before, "b.pvtu", *(f"b/a_{k}.vtu" for k in range(3))])


def test_a_truncated_piece_is_said_once(folder):
    piece = folder / "a" / "a_2.vtu"
    piece.write_bytes(piece.read_bytes()[:500])
    before = saved(folder)
    done = smooth(2, "a.pvtu", "b.pvtu", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.count("gmsnet: error: a.pvtu: a/a_2.vtu:") == 1
    assert "Traceback" not in done.stderr
    assert saved(folder) == before


def test_a_binary_case_has_the_bytes_of_one_process(tmp_path):
    """And no rank has the whole, though zones hold nodes and a patch is named."""
    for name in ("serial", "ranks"):
        save({f"constant/polyMesh/{key}": data for key, data in zoned().items()}, tmp_path / name)
    found = gmsnet.smooth(mesh := gmsnet.read(tmp_path / "serial"), fixed=mesh.markers["low"])
    gmsnet.write(found.mesh, tmp_path / "serial")
    done = smooth(2, "ranks", "--in-place", "--fix", "low", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["gathered"] == ""
    assert saved(tmp_path / "serial") == saved(tmp_path / "ranks")


@pytest.mark.parametrize("ranks", [2, 3])
def test_a_decomposed_case_has_the_bytes_of_one_process(tmp_path, ranks):
    """As a solver leaves it: the mesh of the whole case is beside the processors."""
    case = block()
    for name in ("serial", "ranks"):
        save({f"constant/polyMesh/{key}": data for key, data in case.whole().items()}, tmp_path / name)
        save(case.parts(strips(case, 3)), tmp_path / name)
    serial = gmsnet.smooth(gmsnet.read(tmp_path / "serial", "decomposed"))
    gmsnet.write(serial.mesh, tmp_path / "serial", "decomposed")
    done = smooth(ranks, "ranks", "--in-place", "--format", "decomposed", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["nodes"] == len(case.points)
    assert saved(tmp_path / "serial") == saved(tmp_path / "ranks")


def test_split_files_have_the_bytes_of_one_process(tmp_path):
    path = save_split(random_volume(300, seed=1), tmp_path, 3, ghosts=True)
    gmsnet.write(gmsnet.smooth(gmsnet.read(path)).mesh, tmp_path / "serial.msh")
    done = smooth(2, "a.msh", "ranks.msh", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for k in (1, 2, 3):
        assert (tmp_path / f"serial_{k}.msh").read_bytes() == (tmp_path / f"ranks_{k}.msh").read_bytes()


SHARED = {
    "vtkhdf": lambda path: packed(save_vtkhdf(mixed(), path), "gzip"),
    "vtu": lambda path: path.write_bytes(dict(vtu_variants(grid_of(mixed())))[COMPRESSED]),
    "cgns": lambda path: save_zones(mixed(), path, packed=(1,)),
    "lb8.ugrid": lambda path: gmsnet.write(random_volume(800, seed=1), path),
    "cas": lambda path: path.write_bytes(of_fluent()),
}
COMPRESSED = "binary, header 32, order 1, compress True"


def test_files_that_ranks_share_have_the_bytes_of_one_process(tmp_path):
    for suffix, save_as in SHARED.items():
        save_as(tmp_path / f"a.{suffix}")
    reports = smooth_several(3, *((f"a.{suffix}", f"ranks.{suffix}") for suffix in SHARED), cwd=tmp_path)
    for suffix, report in zip(SHARED, reports, strict=True):
        gmsnet.write(gmsnet.smooth(gmsnet.read(tmp_path / f"a.{suffix}")).mesh, tmp_path / f"serial.{suffix}")
        assert (tmp_path / f"serial.{suffix}").read_bytes() == (tmp_path / f"ranks.{suffix}").read_bytes()
        assert "gathered" in report  # of all ranks
        assert "inverted" in str(report["after"])


@pytest.mark.parametrize("suffix", ["vtkhdf", "vtu"])
@pytest.mark.parametrize(("what", "code"), [(KILLED, None), (FULL, 2)])
def test_the_first_rank_fails_as_it_writes_what_was_packed(tmp_path, suffix, what, code):
    """It packs in a temporary file of its own."""
    SHARED[suffix](tmp_path / f"a.{suffix}")
    before = saved(tmp_path)
    what = what.replace("together", "file_ranges") if code else PACKING.format(module=MODULES[suffix])
    script = ON_RANK_1.replace("import gmsnet.distributed.together as", "import gmsnet.distributed.file_ranges as")
    script = script.replace("together", "file_ranges").replace("== '1'", "== '0'").replace("a.pvtu", f"a.{suffix}")
    done = mpiexec(2, "-c", script.format(what=what, target=f"b.{suffix}", more="[]"), cwd=tmp_path)
    after = saved(tmp_path)
    assert {name: after[name] for name in before} == before
    if code:
        assert done.returncode == code, done.stderr
        assert done.stderr.count(f"gmsnet: error: b.{suffix}: cannot be written: file too large") == 1
        assert after == before
    else:
        assert done.returncode not in (0, 1, 2)
        assert all(name.endswith(".tmp") for name in after.keys() - before.keys())
        assert len(after) > len(before) + 1
        assert smooth(2, f"a.{suffix}", f"b.{suffix}", "--max-sweeps", "1", cwd=tmp_path).returncode == 0
        assert sorted(saved(tmp_path)) == sorted([*before, f"b.{suffix}"])


def test_a_binary_file_that_two_ranks_share_has_the_bytes_of_one_process(tmp_path):
    SHARED["lb8.ugrid"](tmp_path / "a.lb8.ugrid")
    gmsnet.write(gmsnet.smooth(gmsnet.read(tmp_path / "a.lb8.ugrid")).mesh, tmp_path / "serial.lb8.ugrid")
    done = smooth(2, "a.lb8.ugrid", "ranks.lb8.ugrid", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "inverted" in str(json.loads(done.stdout)["after"])
    assert (tmp_path / "serial.lb8.ugrid").read_bytes() == (tmp_path / "ranks.lb8.ugrid").read_bytes()


@pytest.mark.parametrize("dry", [True, False])
def test_several_files_that_ranks_share_go_into_a_folder(tmp_path, dry):
    save_grids(tmp_path / "a.cgns", zones=2)
    gmsnet.write(mixed(), tmp_path / "b.lb8.ugrid")
    (tmp_path / "serial").mkdir()
    for name, fixed in (("a.cgns", [33]), ("b.lb8.ugrid", [33])):
        serial = gmsnet.smooth(gmsnet.read(tmp_path / name), fixed=fixed, max_sweeps=3)
        gmsnet.write(serial.mesh, tmp_path / "serial" / name)
    before = saved(tmp_path)
    more = ["--out-dir", "out", "--fix", "33,", "--max-sweeps", "3", "--json", *(["--dry-run"] * dry)]
    done = smooth(2, "a.cgns", "b.lb8.ugrid", *more, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert ["gathered" in each for each in told] == [True, True]  # of all ranks
    assert [each["output"] for each in told] == ([None, None] if dry else ["out/a.cgns", "out/b.lb8.ugrid"])
    written = {} if dry else {f"out/{name}": before[f"serial/{name}"] for name in ("a.cgns", "b.lb8.ugrid")}
    assert saved(tmp_path) == {**before, **written}


@pytest.mark.parametrize("code", [0, 1])
def test_pieces_are_measured(folder, code):
    more = () if code == 0 else ("--threshold", "0.9")
    command = ("-m", "gmsnet", "quality", "a.pvtu", "--json", *more)
    shared, alone = mpiexec(3, *command, cwd=folder), mpiexec(1, *command, cwd=folder)
    assert (shared.returncode, alone.returncode) == (code, code), shared.stderr
    assert shared.stdout == alone.stdout  # of one rank
    ours = [[line for line in done.stderr.splitlines() if line.startswith("gmsnet")] for done in (shared, alone)]
    assert ours[0] == ours[1]  # the launcher has more to say of an exit code
    assert len(ours[0]) == code
    assert json.loads(shared.stdout)["triangles"] > 1_000


def test_pieces_that_are_damaged_are_told_once(folder):
    (folder / "a" / "a_1.vtu").write_bytes((folder / "a" / "a_1.vtu").read_bytes()[:900])
    done = mpiexec(3, "-m", "gmsnet", "quality", "a.pvtu", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.count("gmsnet: error:") == 1
    assert "a_1.vtu" in done.stderr
