"""Odd names of files, names for the same file, links and pipes."""

from __future__ import annotations

import os
import stat
import subprocess
import threading
from pathlib import Path

import pytest
from support.folder import SMOOTH, names

import gmsnet
from gmsnet.cli import main
from gmsnet.errors import InputError
from gmsnet.io import read, write
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.progress import COMPILING


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return gmsnet.random_mesh(300, seed=0)


NAMES = [
    "mesh größer 网格 🙂.su2", "with  spaces .su2", "two\nlines.su2", "tab\tand\r.su2", "-q.su2", "--in-place.su2",
    "a'b\"c`$(touch x);&|.su2", "[red]%s{}.su2", "*.su2", "~.su2", "#.su2", "x" * 246 + ".su2",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES, ids=[f"{name[:20]!a}" for name in NAMES])
def test_odd_names(name: str, mesh: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    write(mesh, tmp_path / "in" / name)
    monkeypatch.chdir(tmp_path / "in")
    assert main(["smooth", "--quiet", "--", name, f"../out/{name}"]) == 0
    assert names(tmp_path / "out") == [name]
    assert (read(tmp_path / "out" / name).points == gmsnet.smooth(mesh).points).all()
    assert names(tmp_path) == ["in", "out"]


def test_an_odd_name_in_a_message_stays_on_its_line(tmp_path: Path) -> None:
    done = subprocess.run(
        [*SMOOTH, "two\nlines.su2", "out.su2"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == "gmsnet: error: two lines.su2: there is no such file\n"


def test_a_name_that_is_no_text(mesh: Mesh, tmp_path: Path) -> None:
    """File names are bytes, of any encoding."""
    name = os.fsencode(tmp_path) + b"/\xff\xfe.su2"
    write(mesh, os.fsdecode(name))
    done = subprocess.run([*SMOOTH, name, name + b".su2"], capture_output=True, check=False)
    assert (done.returncode, done.stderr.replace(f"gmsnet: {COMPILING}\n".encode(), b"")) == (0, b"")
    assert rb"\udcff\udcfe.su2" in done.stdout
    assert sorted(os.listdir(os.fsencode(tmp_path))) == [b"\xff\xfe.su2", b"\xff\xfe.su2.su2"]


def test_a_name_that_is_too_long(mesh: Mesh, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written: file name too long"):
        write(mesh, tmp_path / ("x" * 300 + ".su2"))
    with pytest.raises(InputError, match=r"no such file"):
        read(tmp_path / ("x" * 300 + ".su2"))
    assert names(tmp_path) == []


@pytest.mark.parametrize("path", [None, 3, [], b"\x00", ""])
def test_what_is_no_path_is_refused(path: object, mesh: Mesh) -> None:
    with pytest.raises(InputError):
        write(mesh, path)
    with pytest.raises(InputError):
        read(path)


def test_names_with_a_null_character_are_refused(mesh: Mesh, tmp_path: Path) -> None:
    for path in ("a\0b.su2", f"{tmp_path}/a\0b.su2"):
        with pytest.raises(InputError, match="null character"):
            write(mesh, path)
        with pytest.raises(InputError, match="null character"):
            read(path)


def test_another_name_of_a_file_keeps_the_old_mesh(mesh: Mesh, tmp_path: Path) -> None:
    """The output is a new file that takes over the name: a hard link goes on showing what was there before."""
    write(mesh, tmp_path / "one.su2")
    os.link(tmp_path / "one.su2", tmp_path / "two.su2")
    before = (tmp_path / "two.su2").read_bytes()
    write(mesh.with_points(2.0 * mesh.points), tmp_path / "one.su2")
    assert (tmp_path / "two.su2").read_bytes() == before
    assert (read(tmp_path / "one.su2").points == 2.0 * mesh.points).all()


def test_a_link_to_a_pipe_or_to_itself(mesh: Mesh, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link.su2").symlink_to("pipe")
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append((tmp_path / "pipe").read_bytes()))
    reader.start()
    write(mesh, tmp_path / "link.su2", format="su2")
    reader.join()
    write(mesh, tmp_path / "file.su2")
    assert got == [(tmp_path / "file.su2").read_bytes()]
    assert stat.S_ISFIFO((tmp_path / "link.su2").stat().st_mode)
    (tmp_path / "loop.su2").symlink_to("loop.su2")
    with pytest.raises(InputError, match=r"loop\.su2: this link leads back to itself"):
        write(mesh, tmp_path / "loop.su2")
    with pytest.raises(InputError, match=r"loop\.su2: there is no such file"):
        read(tmp_path / "loop.su2")
    assert (tmp_path / "loop.su2").is_symlink()


@pytest.mark.parametrize("other", ["./square.su2", "sub/../square.su2", "//{dir}/square.su2", "linked/square.su2"])
def test_the_input_by_another_way(other: str, mesh: Mesh, tmp_path: Path) -> None:
    write(mesh, tmp_path / "square.su2")
    (tmp_path / "sub").mkdir()
    (tmp_path / "linked").symlink_to(".")
    before = (tmp_path / "square.su2").read_bytes()
    output = other.replace("{dir}", str(tmp_path))
    done = subprocess.run([*SMOOTH, "square.su2", output], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "is the input square.su2 itself: name another output, or use --in-place" in done.stderr
    assert (tmp_path / "square.su2").read_bytes() == before
