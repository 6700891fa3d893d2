"""Temporary files: whose they are, what is left of killed processes, and several who write at once."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.io import atomic, temporary, write
from gmsnet.mesh.mesh import Mesh


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return gmsnet.random_mesh(300, seed=0)


def test_what_was_left_is_removed_and_nothing_else(mesh: Mesh, tmp_path: Path) -> None:
    left = [".gmsnet-0123456789ab.tmp", ".gmsnet-ba9876543210.tmp"]
    others = [
        ".gmsnet-0123456789ab.tmp~",
        "gmsnet-0123456789ab.tmp",
        ".gmsnet-0123456789AB.tmp",
        ".gmsnet-.tmp",
        "a.su2",
    ]
    for name in left + others:
        (tmp_path / name).write_text("left")
    (tmp_path / ".gmsnet-000000000000.tmp").mkdir()
    (tmp_path / ".gmsnet-111111111111.tmp").symlink_to(tmp_path / "a.su2")
    os.mkfifo(tmp_path / ".gmsnet-222222222222.tmp")
    no_files = [".gmsnet-000000000000.tmp", ".gmsnet-111111111111.tmp", ".gmsnet-222222222222.tmp"]
    write(mesh, tmp_path / "out.su2")
    assert names(tmp_path) == sorted([*others, *no_files, "out.su2"])
    assert (tmp_path / "a.su2").read_text() == "left"


def test_what_somebody_writes_is_not_taken_for_a_leftover(mesh: Mesh, tmp_path: Path) -> None:
    """The pieces of one file are asked for while another is written beside it."""
    seen = []

    def pieces():
        yield b"one"
        write(mesh, tmp_path / "other.su2")
        seen.append(names(tmp_path))
        yield b" two"

    atomic.replace_files({str(tmp_path / "slow.txt"): pieces()})
    assert len(seen[0]) == 2
    assert seen[0][1] == "other.su2"
    assert names(tmp_path) == ["other.su2", "slow.txt"]
    assert (tmp_path / "slow.txt").read_bytes() == b"one two"


def test_a_file_that_was_taken_for_a_leftover_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between making a file and locking it another process may look at it."""
    locked, taken = temporary._locked, []

    def late(descriptor: int) -> int | None:
        if not taken:
            taken.extend(names(tmp_path))
            temporary.remove_leftovers(str(tmp_path))
        return locked(descriptor)

    monkeypatch.setattr(temporary, "_locked", late)
    atomic.replace_files({str(tmp_path / "a"): b"whole"})
    assert len(taken) == 1
    assert names(tmp_path) == ["a"]
    assert (tmp_path / "a").read_bytes() == b"whole"


def test_without_locks_files_are_written_and_leftovers_stay(mesh: Mesh, tmp_path: Path, monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(37, "No locks available")

    (tmp_path / ".gmsnet-0123456789ab.tmp").write_text("left")
    monkeypatch.setattr(temporary.fcntl, "flock", refuse)
    write(mesh, tmp_path / "out.su2")
    assert names(tmp_path) == [".gmsnet-0123456789ab.tmp", "out.su2"]


def test_contents_reach_the_disk_before_the_name(mesh: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that after a crash of the machine the name stands for the old contents or for all of the new ones."""
    steps: list[str] = []
    sync, rename = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        status = os.fstat(descriptor)
        whole = status.st_size in sizes
        steps.append("folder" if stat.S_ISDIR(status.st_mode) else "file" if whole else "part of a file")
        sync(descriptor)

    def renamed(old: str, new: str) -> None:
        steps.append("name")
        rename(old, new)

    write(mesh, tmp_path / "expected.node")
    sizes = [path.stat().st_size for path in tmp_path.iterdir()]
    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    write(mesh, tmp_path / "out.node")
    assert steps == ["file", "file", "name", "name", "folder"]


def test_permissions_are_given_to_the_file_and_not_to_its_name(mesh: Mesh, tmp_path: Path) -> None:
    """In a folder that others may write to, the name can lead elsewhere meanwhile."""
    (tmp_path / "secret").write_text("secret")
    (tmp_path / "secret").chmod(0o600)
    (tmp_path / "out").write_text("old")
    (tmp_path / "out").chmod(0o666)

    def pieces():
        yield b"new"
        (name,) = tmp_path.glob(".gmsnet-*")
        name.unlink()
        name.symlink_to(tmp_path / "secret")

    atomic.replace_files({str(tmp_path / "out"): pieces()})
    assert stat.S_IMODE((tmp_path / "secret").stat().st_mode) == 0o600
    assert (tmp_path / "secret").read_text() == "secret"


def test_no_descriptors_are_left(mesh: Mesh, tmp_path: Path) -> None:
    def count() -> int:
        return len(os.listdir("/proc/self/fd"))

    write(mesh, tmp_path / "out.su2")
    before = count()
    for _ in range(20):
        write(mesh, tmp_path / "out.su2")
        with contextlib.suppress(InputError):
            write(mesh, tmp_path / "out.su2" / "below.su2")
    assert count() == before


WRITE_IN_TURNS = """
import sys, gmsnet
target, seed = sys.argv[1], int(sys.argv[2])
mesh = gmsnet.random_mesh(300, seed=seed)
for _ in range(40):
    gmsnet.write(mesh, target)
"""


def test_several_processes_that_write_one_file_leave_it_whole(tmp_path: Path) -> None:
    target = tmp_path / "out.su2"
    versions = []
    for seed in (1, 2, 3):
        write(gmsnet.random_mesh(300, seed=seed), target)
        versions.append(target.read_bytes())
    running = [
        subprocess.Popen([sys.executable, "-c", WRITE_IN_TURNS, str(target), str(seed)], stderr=subprocess.PIPE)
        for seed in (1, 2, 3)
    ]
    looks = 0
    while any(process.poll() is None for process in running):
        assert target.read_bytes() in versions
        looks += 1
    for process in running:
        with process:
            assert process.returncode == 0, process.stderr.read()
    assert looks > 0
    assert names(tmp_path) == ["out.su2"]
