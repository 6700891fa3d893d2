"""The cache of compiled functions: upgrades, damaged files, other versions and processes, folders without room."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import gmsnet
from gmsnet.kernels.jit.compile import kernel

CALL = "import user, {module}; print(user.double({module}.Pair(3, 4)))"


def test_a_cache_that_names_what_is_gone_is_made_anew(tmp_path):
    (tmp_path / "before.py").write_text(
        "from typing import NamedTuple\nclass Pair(NamedTuple):\n    one: int\n    two: int\n"
    )
    (tmp_path / "user.py").write_text(
        "from gmsnet.kernels.jit.compile import kernel\n"
        "@kernel\ndef double(pair):\n    return 2 * (pair.one + pair.two)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "GMSNET_CACHE": "", "NUMBA_CACHE_DIR": ""}

    def call(module):
        code = CALL.format(module=module)
        return subprocess.run(
            [sys.executable, "-B", "-c", code], env=environment, text=True, capture_output=True, check=False
        )

    assert call("before").stdout == "14\n"
    assert list(Path(tmp_path / "__pycache__").glob("user.double*.nbi"))
    (tmp_path / "before.py").rename(tmp_path / "after.py")
    done = call("after")
    assert done.stdout == "14\n", done.stderr


def test_a_cache_is_stale_once_what_a_function_calls_has_changed(tmp_path):
    """guard.permitted calls a function of predicates.py; its own file stays as it is."""
    package = Path(gmsnet.__file__).parent
    shutil.copytree(package, tmp_path / "gmsnet", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "GMSNET_CACHE": "", "NUMBA_CACHE_DIR": ""}
    code = (
        "import numpy as np; from gmsnet.kernels.star.guard import permitted;"
        "triangle = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0]); print(permitted(triangle, triangle, 0.0, -np.inf, None))"
    )

    def call():
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, text=True, capture_output=True, check=False
        )
        return done.stdout, done.stderr

    assert call() == ("True\n", "")
    predicates = tmp_path / "gmsnet" / "kernels" / "simplex" / "predicates.py"
    turned = predicates.read_text().replace("return left - right, bound", "return right - left, bound")
    assert turned != predicates.read_text()
    predicates.write_text(turned)
    assert call() == ("False\n", "")


@pytest.fixture
def call(tmp_path):
    """Calls ``twice`` of a module for whole numbers and for floats, in a process of its own."""
    source = "from gmsnet.kernels.jit.compile import kernel\n@kernel\ndef twice(a, b):\n    return a + b\n"
    (tmp_path / "user.py").write_text(source)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path[1:]]), "NUMBA_CACHE_DIR": ""}

    def called(cache=tmp_path / "cache", changes=(), **options):
        done = subprocess.run(
            [sys.executable, "-B", "-c", "import user; print(user.twice(3, 4), user.twice(3.5, 4.25))"],
            env={**environment, "GMSNET_CACHE": str(cache), **dict(changes)},
            text=True, capture_output=True, check=False, **options,
        )  # fmt: skip
        assert done.stderr == ""
        return done.stdout

    return called


def cached(folder):
    return sorted(path for path in folder.rglob("user.twice*") if path.suffix in (".nbi", ".nbc"))


def test_a_whole_cache_is_used(call, tmp_path):
    assert call() == "7 7.75\n"
    files = cached(tmp_path)
    assert [path.suffix for path in files] == [".nbc", ".nbc", ".nbi"]
    before = [path.stat().st_mtime_ns for path in files]
    assert call() == "7 7.75\n"
    assert [path.stat().st_mtime_ns for path in files] == before


@pytest.mark.parametrize("damage", ["empty", "cut", "noise", "longer", "code", "a folder"])
def test_damaged_files_are_made_anew(call, tmp_path, damage):
    """A crash of the machine leaves such files, for nothing brings the cache to the disk."""
    draw = random.Random(damage)
    call()
    for path in cached(tmp_path):
        whole = path.read_bytes()
        path.unlink()
        if damage == "a folder":
            path.mkdir()
        else:
            path.write_bytes(
                {
                    "empty": b"", "cut": whole[: draw.randrange(len(whole))], "noise": draw.randbytes(len(whole)),
                    "longer": whole + b"\0", "code": b"cos\nsystem\n(S'echo harm'\ntR.",
                }[damage]
            )  # fmt: skip
    assert call() == "7 7.75\n"
    if damage != "a folder":
        before = [path.stat().st_mtime_ns for path in cached(tmp_path)]
        assert call() == "7 7.75\n"
        assert [path.stat().st_mtime_ns for path in cached(tmp_path)] == before, "what was made anew is used"


def increment(a):
    return a + 1


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_no_flipped_bit_gets_through(tmp_path, monkeypatch, suffix):
    """Neither in the index nor in the code; in this process, for speed."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    compiled = kernel(increment)
    assert compiled(1) == 2
    file = compiled.inside._cache._cache_file
    (key,) = file._load_index()
    assert file.load(key) is not None
    (path,) = tmp_path.rglob(f"*{suffix}")
    whole, draw = path.read_bytes(), random.Random(suffix)
    for at in {*range(50), *draw.sample(range(len(whole)), 100), *range(len(whole) - 20, len(whole))}:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << draw.randrange(8)]) + whole[at + 1 :])
        assert file.load(key) is None
    path.write_bytes(whole)
    assert file.load(key) is not None


def test_code_of_another_version_that_an_index_names_is_not_run(call, tmp_path):
    """Numba writes the index first: a kill then leaves it with the code that was there before."""
    call()
    old = {path: path.read_bytes() for path in cached(tmp_path) if path.suffix == ".nbc"}
    assert len(old) == 2
    user = tmp_path / "user.py"
    user.write_text(user.read_text().replace("a + b", "a - b"))
    os.utime(user, ns=(0, 0))
    assert call() == "-1 -0.75\n"
    for path, contents in old.items():
        assert path.read_bytes() != contents
        path.write_bytes(contents)
    assert call() == "-1 -0.75\n"


def test_code_for_other_arguments_that_an_index_names_is_not_run(call, tmp_path):
    """Two processes that compile at once give the same number to the code of each."""
    call()
    one, other = (path for path in cached(tmp_path) if path.suffix == ".nbc")
    contents = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(contents)
    assert call() == "7 7.75\n"


def test_processes_that_compile_at_once(call, tmp_path):
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: call(), range(8))) == ["7 7.75\n"] * 8


def no_room():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))


def test_a_full_disk_stops_nothing(call, tmp_path):
    assert call(preexec_fn=no_room) == "7 7.75\n"
    assert cached(tmp_path) == []
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]


@pytest.mark.parametrize("folder", ["/dev/null/cache", "/proc/cache", "{file}"])
def test_a_folder_that_cannot_be_made_stops_nothing(call, tmp_path, folder):
    (tmp_path / "file").write_text("")
    shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
    assert call(cache=folder.replace("{file}", str(tmp_path / "file"))) == "7 7.75\n"


def test_a_folder_that_may_only_be_read_stops_nothing(call, tmp_path):
    """Mounted so that not even the superuser may write."""
    (tmp_path / "cache").mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(tmp_path / "cache")]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        assert call() == "7 7.75\n"
        assert list((tmp_path / "cache").iterdir()) == []
    finally:
        subprocess.run(["umount", str(tmp_path / "cache")], check=True)


def test_without_any_folder_to_write_in(call, tmp_path):
    """No GMSNET_CACHE, no home, and a package that may only be read: compiled in each process."""
    (tmp_path / "__pycache__").mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(tmp_path / "__pycache__")]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        assert call(cache="", changes={"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}) == "7 7.75\n"
    finally:
        subprocess.run(["umount", str(tmp_path / "__pycache__")], check=True)
    assert {path.name for path in tmp_path.iterdir()} == {"user.py", "__pycache__"}
