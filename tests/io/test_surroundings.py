"""Locale, time zone, clock, variables for threads, a missing home: no byte of a result depends on them."""

from __future__ import annotations

import locale
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.io import read, write
from gmsnet.mesh.mesh import Mesh


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return gmsnet.random_mesh(300, seed=0)


SAME = """
import gmsnet, hashlib, sys
mesh = gmsnet.read(sys.argv[1])
result = gmsnet.smooth(mesh, max_sweeps=5)
gmsnet.write(result.mesh, sys.argv[2])
gmsnet.write(result.mesh, sys.argv[3])
"""


def german() -> str | None:
    """A locale with decimal commas that this system has."""
    listed = subprocess.run(["locale", "-a"], capture_output=True, text=True, check=False).stdout.split()
    return next((name for name in listed if name.startswith(("de_", "fr_", "it_", "es_"))), None)


@pytest.mark.parametrize(
    "changes",
    [
        {"LC_ALL": "C"},
        {"LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8"},
        {"TZ": "Pacific/Kiritimati", "LANG": "tr_TR.UTF-8"},
        {"OMP_NUM_THREADS": "7", "OPENBLAS_NUM_THREADS": "7", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"},
        {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"},
        {"PYTHONHASHSEED": "12345", "PYTHONOPTIMIZE": "2"},
        {"HOME": None, "USER": None, "XDG_CACHE_HOME": None, "LOGNAME": None},
        {"HOME": "/nonexistent"},
    ],
    ids=lambda changes: " ".join(changes),
)
def test_surroundings_change_no_byte(changes: dict[str, str | None], mesh: Mesh, tmp_path: Path) -> None:
    write(mesh, tmp_path / "in.su2")
    result = gmsnet.smooth(read(tmp_path / "in.su2"), max_sweeps=5)
    write(result.mesh, tmp_path / "here.su2")
    write(result.mesh, tmp_path / "here.vtu")
    kept = {name: value for name, value in os.environ.items() if name not in changes}
    environment = {**kept, **{name: value for name, value in changes.items() if value is not None}}
    command = [sys.executable, "-c", SAME, tmp_path / "in.su2", tmp_path / "there.su2", tmp_path / "there.vtu"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    for suffix in ("su2", "vtu"):
        assert (tmp_path / f"there.{suffix}").read_bytes() == (tmp_path / f"here.{suffix}").read_bytes()


def test_a_locale_with_decimal_commas_that_is_in_use(mesh: Mesh, tmp_path: Path) -> None:
    """As a program with a window sets it: then C's own functions print and read commas."""
    name = german()
    if name is None:
        pytest.skip("this system has no locale with decimal commas")
    write(mesh, tmp_path / "before.su2")
    before = locale.setlocale(locale.LC_NUMERIC)
    locale.setlocale(locale.LC_NUMERIC, name)
    try:
        assert locale.localeconv()["decimal_point"] == ","
        write(mesh, tmp_path / "after.su2")
        assert (read(tmp_path / "after.su2").points == mesh.points).all()
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)
    assert (tmp_path / "after.su2").read_bytes() == (tmp_path / "before.su2").read_bytes()


def test_the_clock_is_in_no_file(mesh: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(mesh, tmp_path / "now.su2")
    expected = gmsnet.smooth(mesh).points
    for name in ("time", "perf_counter", "monotonic"):
        monkeypatch.setattr(time, name, lambda: -1e9)
    write(mesh, tmp_path / "then.su2")
    assert np.array_equal(gmsnet.smooth(mesh).points, expected)
    monkeypatch.undo()
    assert (tmp_path / "now.su2").read_bytes() == (tmp_path / "then.su2").read_bytes()
