"""Under mpiexec: the command line, and what happens where a rank ends."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import random_volume

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
MPIEXEC = shutil.which("mpiexec") or shutil.which("mpiexec", path=os.path.dirname(sys.executable))
pytestmark = pytest.mark.skipif(MPIEXEC is None, reason="mpiexec is not installed")

LIMIT = 300  # seconds: ranks that wait for each other end then


def mpiexec(ranks, *command, cwd):
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    environment |= {"PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe", "OMP_NUM_THREADS": "1"}
    environment["OMPI_MCA_mpi_yield_when_idle"] = "1"  # ranks that wait leave the cores to other tests
    return subprocess.run(
        [MPIEXEC, "-n", str(ranks), sys.executable, *command],
        cwd=cwd, env=environment, timeout=LIMIT, capture_output=True, text=True,
    )  # fmt: skip


def smooth(ranks, *arguments, cwd):
    return mpiexec(ranks, "-m", "gmsnet", "smooth", *arguments, cwd=cwd)


SEVERAL = """
import json, sys
from gmsnet.cli import main
sys.exit(max([main(arguments) for arguments in json.loads(sys.argv[1])]))
"""


def smooth_several(ranks, *runs, cwd):
    """The reports of runs one after the other by the same ranks: to start them takes longer than a run."""
    commands = json.dumps([["smooth", *run, "--json"] for run in runs])
    done = mpiexec(ranks, "-c", SEVERAL, commands, cwd=cwd)
    assert done.returncode == 0, done.stderr
    reports, text = [], done.stdout.strip()
    while text:
        report, end = json.JSONDecoder().raw_decode(text)
        reports.append(report)
        text = text[end:].lstrip()
    assert len(reports) == len(runs)  # of one rank each
    return reports


@pytest.fixture
def folder(tmp_path):
    gmsnet.write(gmsnet.random_mesh(800, seed=1), tmp_path / "in.su2")
    return tmp_path


@pytest.mark.parametrize("ranks", [2, 3])
def test_the_same_file_as_without_ranks(folder, ranks):
    methods = ("barrier", "auto", "getme")
    reports = smooth_several(ranks, *(("in.su2", f"{each}.su2", "--method", each) for each in methods), cwd=folder)
    for method, report in zip(methods, reports, strict=True):
        gmsnet.write(gmsnet.smooth(gmsnet.read(folder / "in.su2"), method).mesh, folder / "serial.su2")
        assert (folder / f"{method}.su2").read_bytes() == (folder / "serial.su2").read_bytes()
        assert report["method"] == method
        assert any("ranks: the first one" in note for note in report["notes"]) == (method == "getme")


def test_what_is_said_of_untangling_and_layers(folder):
    mesh = gmsnet.read(folder / "in.su2")
    points, middle = mesh.points.copy(), np.argmin(abs(mesh.points - mesh.points.mean(axis=0)).sum(axis=1))
    points[middle] += 0.1 * np.ptp(points)
    gmsnet.write(mesh.with_points(points), folder / "tangled.su2")
    runs = ("tangled.su2", "a.su2"), ("in.su2", "b.su2", "--fix-layers")
    for report, run in zip(smooth_several(2, *runs, cwd=folder), runs, strict=True):
        alone = gmsnet.smooth(gmsnet.read(folder / run[0]), fix_layers="--fix-layers" in run)
        for begin in ("untangling:", "fix_layers:"):
            said = [note for note in alone.notes if note.startswith(begin)]
            assert [note for note in report["notes"] if note.startswith(begin)] == said
        assert any(note.startswith(("untangling:", "fix_layers:")) for note in report["notes"])


def test_errors_are_said_once(folder):
    done = smooth(2, "missing.su2", "out.su2", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.count("gmsnet: error: missing.su2: there is no such file") == 1
    assert "Traceback" not in done.stderr
    assert not (folder / "out.su2").exists()


def test_a_rank_that_dies_ends_all_and_nothing_is_written(folder):
    script = (
        "import os, sys\n"
        "from gmsnet.distributed.halo import Halo\n"
        "after = Halo.after\n"
        "def die(self, colour, points):\n"
        "    if os.environ.get('OMPI_COMM_WORLD_RANK', os.environ.get('PMI_RANK')) == '1':\n"
        "        os.kill(os.getpid(), 9)\n"
        "    after(self, colour, points)\n"
        "Halo.after = die\n"
        "from gmsnet.cli import main\n"
        "sys.exit(main(['smooth', 'in.su2', 'out.su2', '--method', 'barrier']))\n"
    )
    before = (folder / "in.su2").read_bytes()
    done = mpiexec(2, "-c", script, cwd=folder)
    assert done.returncode != 0
    assert sorted(path.name for path in folder.iterdir()) == ["in.su2"]
    assert (folder / "in.su2").read_bytes() == before


def test_a_bug_on_one_rank_ends_all(folder):
    script = (
        "import os, sys\n"
        "import gmsnet.distributed.part as part\n"
        "def fail(*arguments):\n"
        "    raise ZeroDivisionError('on purpose')\n"
        "if os.environ.get('OMPI_COMM_WORLD_RANK', os.environ.get('PMI_RANK')) == '1':\n"
        "    part.before = fail\n"
        "from gmsnet.cli import main\n"
        "sys.exit(main(['smooth', 'in.su2', 'out.su2', '--method', 'barrier']))\n"
    )
    done = mpiexec(2, "-c", script, cwd=folder)
    assert done.returncode != 0
    assert "internal error: ZeroDivisionError: on purpose" in done.stderr
    assert not (folder / "out.su2").exists()


INTERRUPTED = """
import os, signal, sys
{imported} as module
before = module.{name}
def interrupted(*given, calls=[0]):
    calls[0] += 1
    if calls[0] == {call}:
        os.kill(os.getpid(), signal.SIGINT)
    return before(*given)
module.{name} = interrupted
from gmsnet.cli import main
sys.exit(main(['smooth', '{file}', 'out{end}', '--method', 'barrier']))
"""


@pytest.mark.parametrize(("file", "imported", "name", "call"), [
    ("in.lb8.ugrid", "import gmsnet.distributed.file_ranges", "asked", 1),  # as they read
    ("in.lb8.ugrid", "import gmsnet.distributed.part", "before", 1),
    ("in.su2", "import gmsnet.distributed.part", "before", 1),
])  # fmt: skip
def test_ctrl_c_on_all_ranks_ends_all_with_one_message(folder, file, imported, name, call):
    """As launchers hand it on."""
    gmsnet.write(random_volume(300, seed=1), folder / "in.lb8.ugrid")
    script = INTERRUPTED.format(imported=imported, name=name, call=call, file=file, end=file[2:])
    done = mpiexec(3, "-c", script, cwd=folder)
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    assert done.stderr.count("gmsnet: interrupted") == 1, done.stderr
    assert sorted(path.name for path in folder.iterdir() if path.name.endswith(".tmp")) == []


def test_ctrl_c_in_a_sweep_writes_the_best_mesh_so_far(folder):
    """As without ranks."""
    script = INTERRUPTED.format(
        imported="from gmsnet.distributed.halo import Halo", name="after", call=30, file="in.su2", end=".su2"
    )
    done = mpiexec(3, "-c", script, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "interrupted" in done.stdout
    assert "Traceback" not in done.stderr
    assert (gmsnet.read(folder / "out.su2").points != gmsnet.read(folder / "in.su2").points).any()


def test_messages_and_bytes_are_those_of_the_shared_nodes(folder):
    """After each colour, one message to each neighbour that has a node of this colour, of its coordinates alone."""
    script = (
        "import numpy as np, gmsnet, gmsnet.distributed\n"
        "from gmsnet.distributed.library import mpi\n"
        "comm = mpi().COMM_WORLD\n"
        "mesh = gmsnet.read('in.su2')\n"
        "cells = mesh.cells[0].nodes\n"
        "mine = cells[(mesh.points[cells[:, 0], 0] > 0.5) == comm.rank]\n"
        "ids, local = np.unique(mine, return_inverse=True)\n"
        "given = mesh.points[ids], local.reshape(-1, 3)\n"
        "result = gmsnet.distributed.smooth(given, ids, 'barrier', preserve='none', max_sweeps=3, threads=1)\n"
        "print(comm.rank, result.sweeps, result.messages, result.bytes, len(ids), flush=True)\n"
    )
    done = mpiexec(2, "-c", script, cwd=folder)
    assert done.returncode == 0, done.stderr
    rows = np.array([[int(word) for word in line.split()] for line in done.stdout.splitlines()])
    assert sorted(rows[:, 0]) == [0, 1]
    shared = rows[:, 4].sum() - len(gmsnet.read(folder / "in.su2").points)
    assert (rows[:, 1] == 3).all()
    assert (rows[:, 2] <= 3 * 12).all()
    assert (rows[:, 3] % (3 * 16) == 0).all()
    assert 0 < rows[:, 3].max() <= 3 * 16 * 4 * shared
