"""gmsnet warm-up: what it has compiled no later run compiles."""

from __future__ import annotations

import json
import subprocess
import sys

import numba
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
    monkeypatch.setattr(warm_up, "_use", lambda _: numba.njit(lambda x: x + 1)(1))
    assert run("warm-up", "--cells", "triangle").out.startswith("triangle: compiled in 0.")


def test_unknown_kinds_are_told_before_anything_is_compiled(run, monkeypatch):
    monkeypatch.setattr(warm_up, "_use", None)
    done = run("warm-up", "--cells", "triangle", "--cells", "hexagon")
    assert (done.code, done.out) == (2, "")
    known = "triangle, quad, tetra, hexahedron, surface, second-order"
    assert f"unknown kind of cells 'hexagon': known are {known}" in done.err


NOTED = """
import json, sys
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher
from gmsnet.cli import main

wanted, compile = set(), Dispatcher.compile

def noted(self, signature):
    if not isinstance(self._cache, NullCache):
        wanted.add(f"{self.py_func.__module__}.{self.py_func.__qualname__}{signature}")
    return compile(self, signature)

Dispatcher.compile = noted
codes = [main(arguments) for arguments in json.loads(sys.argv[1])]
print(json.dumps([codes, sorted(wanted)]))
"""


def kernels_of(*commands):
    """Exit codes of commands in one new process, which kernels it took from the cache or compiled, and its errors."""
    given = json.dumps([list(map(str, command)) for command in commands])
    done = subprocess.run([sys.executable, "-c", NOTED, given], capture_output=True, text=True)
    codes, wanted = json.loads(done.stdout.splitlines()[-1])
    return codes, set(wanted), done.stderr


@pytest.mark.long
def test_a_first_run_compiles_nothing_then(tmp_path):
    """What it wants has been wanted before: in a cache that other tests share, that it compiles nothing says less."""
    mesh = random_mesh(400, seed=9)
    gmsnet.write(mesh, tmp_path / "random.su2")
    gmsnet.write(disturb(mesh, range(300), 0.8, seed=2, keep_valid=False), tmp_path / "tangled.vtk")
    runs = ("random.su2",), ("random.su2", "--slide", "all"), ("tangled.vtk", "--preserve", "none")
    codes, ahead, _ = kernels_of(("warm-up", "--cells", "triangle", "--quiet"))
    assert codes == [0]
    assert len(ahead) > 60
    codes, wanted, said = kernels_of(*(("smooth", tmp_path / name, "--dry-run", *options) for name, *options in runs))
    assert codes in ([0, 0, 0], [0, 0, 1])  # the tangled one may keep an inverted cell at its boundary
    assert len(wanted) > 30
    assert wanted - ahead == set()
    assert COMPILING not in said
