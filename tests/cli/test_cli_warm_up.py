"""gmsnet warm-up: what it has compiled no later run compiles."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import gmsnet
from gmsnet.generate import disturb, random_mesh
from gmsnet.run import warm_up
from gmsnet.run.progress import COMPILING


def test_each_kind_is_told(run, monkeypatch):
    used = []
    monkeypatch.setattr(warm_up, "_use", used.append)
    done = run("warm-up", "--cells", "quad", "--cells", "tetra", "--cells", "quad")
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines() == ["quad: nothing to compile", "tetra: nothing to compile"]
    assert used == ["quad", "tetra"]
    assert run("warm-up", "-q").out == ""
    assert used[2:] == list(warm_up.KINDS)


def test_unknown_kinds_are_told_before_anything_is_compiled(run, monkeypatch):
    monkeypatch.setattr(warm_up, "_use", None)
    done = run("warm-up", "--cells", "triangle", "--cells", "hexagon")
    assert (done.code, done.out) == (2, "")
    known = "triangle, quad, tetra, hexahedron, surface, second-order"
    assert f"unknown kind of cells 'hexagon': known are {known}" in done.err


@pytest.mark.long
def test_a_first_run_compiles_nothing_then(tmp_path):
    environment = {**os.environ, "GMSNET_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)  # which this process has set by its own GMSNET_CACHE

    def run(*arguments):
        command = [sys.executable, "-m", "gmsnet", *map(str, arguments)]
        return subprocess.run(command, env=environment, capture_output=True, text=True)

    assert "triangle: compiled in" in run("warm-up", "--cells", "triangle").stdout
    mesh = random_mesh(400, seed=9)
    gmsnet.write(mesh, tmp_path / "random.su2")
    gmsnet.write(disturb(mesh, range(300), 0.8, seed=2, keep_valid=False), tmp_path / "tangled.vtk")
    for name, *options in (("random.su2",), ("random.su2", "--slide", "all"), ("tangled.vtk", "--preserve", "none")):
        done = run("smooth", tmp_path / name, "--dry-run", *options)
        assert done.returncode in (0, 1)  # the tangled one may keep an inverted cell at its boundary
        assert COMPILING not in done.stderr
