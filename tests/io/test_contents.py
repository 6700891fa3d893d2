"""How files are read: at once and from nothing but files and open pipes; large ones into large pages of memory."""

from __future__ import annotations

import mmap
import os
import socket
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.damage import facts, triangle_grid
from support.formats import FILES

from gmsnet import io
from gmsnet.errors import InputError
from gmsnet.io import FORMATS, contents, convert, splice
from gmsnet.io.pieces import Pieces
from gmsnet.mesh.mesh import Mesh

LARGE_PAGES = sys.platform != "win32"


@pytest.fixture(autouse=True)
def every_file_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contents, "LARGE", 1)


def nudged(mesh: Mesh) -> Mesh:
    points = mesh.points.copy()
    points[12, :2] += (0.03125, -0.0625)
    return mesh.with_points(points)


@pytest.mark.parametrize("key", FILES)
def test_a_large_file_reads_and_writes_as_any_other(key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    suffix = FORMATS[key].suffixes[0]
    one, two, other = (tmp_path / f"{stem}{suffix}" for stem in ("one", "two", "other"))
    io.write(triangle_grid(), one)
    mesh = io.read(one)
    assert mesh.source is not None
    assert isinstance(mesh.source.data, mmap.mmap) == LARGE_PAGES  # type: ignore[attr-defined]
    io.write(nudged(mesh), two)
    monkeypatch.setattr(contents, "LARGE", 1 << 40)
    plain = io.read(one)
    assert isinstance(plain.source.data, bytes)  # type: ignore[union-attr]
    assert facts(mesh) == facts(plain)  # type: ignore[arg-type]
    io.write(nudged(plain), other)
    assert two.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("key", FILES)
@pytest.mark.parametrize("meanwhile", ["truncated", "rewritten", "removed"])
def test_what_happens_to_a_file_that_was_read_changes_nothing(key: str, meanwhile: str, tmp_path: Path) -> None:
    suffixes = FORMATS[key].suffixes
    path, out, expected = (tmp_path / f"{stem}{suffixes[0]}" for stem in ("a", "out", "expected"))
    io.write(triangle_grid(), path)
    mesh = nudged(io.read(path))
    io.write(mesh, expected)
    for part in (path.with_suffix(suffix) for suffix in suffixes):
        if meanwhile == "removed":
            part.unlink()
        elif meanwhile == "truncated":
            os.truncate(part, 3)
        else:
            part.write_bytes(b"%" * part.stat().st_size)
    assert io.write(mesh, out) == []
    for suffix in suffixes:
        assert out.with_suffix(suffix).read_bytes() == expected.with_suffix(suffix).read_bytes()


# A process that reads a file, of which others do something at a moment that is known.
TRUNCATES = """
import os, sys
from gmsnet.cli import main
from gmsnet.io import contents, su2
contents.LARGE = 1
path, moment, what = sys.argv[1:]
meanwhile = {"cut": lambda: os.truncate(path, 40), "grown": lambda: open(path, "ab").write(b"% more")}[what]
known, read = contents.Stamp.of, su2.read
def stamp(status):
    if moment == "before the bytes":
        contents.Stamp.of = known
        meanwhile()
    return known(status)
def parse(files):
    if moment == "before the mesh":
        meanwhile()
    return read(files)
contents.Stamp.of, su2.read = stamp, parse
sys.exit(main(["quality", path]))
"""


@pytest.mark.parametrize("what", ["cut", "grown"])
@pytest.mark.parametrize("moment", ["before the bytes", "before the mesh"])
def test_a_file_that_changes_while_it_is_read_kills_no_process(moment: str, what: str, tmp_path: Path) -> None:
    """So many bytes that a mapping would have pages behind the end that remains."""
    path = tmp_path / "a.su2"
    io.write(triangle_grid(60), path)
    assert path.stat().st_size > 1 << 17
    done = subprocess.run(
        [sys.executable, "-c", TRUNCATES, str(path), moment, what], capture_output=True, text=True, check=False
    )
    if moment == "before the mesh":
        assert (done.returncode, done.stderr) == (0, "")
        assert "7,200 triangle cells" in done.stdout
    else:
        told = f"gmsnet: error: {path}: the file changed while it was read: read it again once it is finished\n"
        assert (done.returncode, done.stderr) == (2, told)


def test_no_array_of_a_mesh_is_the_memory_of_its_file(tmp_path: Path) -> None:
    for key, entry in FILES.items():
        path = tmp_path / f"a{entry.suffixes[0]}"
        io.write(triangle_grid(), path)
        mesh = io.read(path)
        raw = np.frombuffer(mesh.source.data, dtype=np.uint8)  # type: ignore[union-attr]
        arrays = [mesh.points, *(part for block in mesh.cells for part in (block.nodes, block.regions))]
        arrays += [*mesh.point_data.values(), *(part for parts in mesh.cell_data.values() for part in parts)]
        assert not any(np.shares_memory(raw, array) for array in arrays), key


@pytest.mark.parametrize("size", [1, 4095, 4096, 70001])
def test_the_bytes_are_those_of_the_file(size: int, tmp_path: Path) -> None:
    path = tmp_path / "bytes"
    path.write_bytes(np.random.default_rng(size).bytes(size))
    data, stamp = contents.load(str(path))
    assert data[:] == path.read_bytes()
    assert stamp is not None
    assert stamp == contents.Stamp.of(path.stat())
    with pytest.raises(FileNotFoundError):
        contents.load(str(tmp_path / "no.su2"))


def test_a_file_larger_than_memory_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "hole.su2"
    path.touch()
    try:
        os.truncate(path, 1 << 43)
    except OSError:
        pytest.skip("this file system has no such files")
    with pytest.raises(InputError, match=r"hole\.su2: the file needs about 8,796 GB of memory, but only"):
        io.read(path)


DEVICES = [name for name in ("/dev/zero", "/dev/null", "/dev/full", "/dev/urandom") if os.path.exists(name)]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("format", [None, "su2", "triangle", "stl"])
def test_a_device_is_no_mesh(device: str, format: str | None) -> None:
    with pytest.raises(InputError, match=f"^{device}: this is a device, no regular file: give a file, or -"):
        io.read(device, format)


@pytest.mark.skipif(not DEVICES, reason="this system has no such devices")
@pytest.mark.parametrize("name", ["-", "/dev/stdin", "/dev/fd/0"])
def test_nor_is_it_as_standard_input(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open(DEVICES[0]) as zeros:
        monkeypatch.setattr(sys, "stdin", zeros)
        with pytest.raises(InputError, match=r"^standard input: this is a device, no mesh"):
            io.read(name, "su2")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_named_pipes_and_sockets_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe.su2")
    with pytest.raises(InputError, match=r"pipe\.su2: this is a named pipe, no regular file"):
        io.read(tmp_path / "pipe.su2")
    monkeypatch.chdir(tmp_path)  # names of sockets must be short
    with socket.socket(socket.AF_UNIX) as made:
        made.bind("socket.su2")
        with pytest.raises(InputError, match=r"socket\.su2: this is a socket, no regular file"):
            io.read("socket.su2")


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="this system does not name its descriptors")
def test_a_pipe_that_a_shell_has_opened_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.su2"
    io.write(triangle_grid(), path)
    for format in (None, "su2"):
        out, into = os.pipe()
        os.write(into, path.read_bytes())
        os.close(into)
        assert (io.read(f"/dev/fd/{out}", format).points == io.read(path).points).all()
        os.close(out)


def test_an_endless_pipe_ends_before_the_memory_does(monkeypatch: pytest.MonkeyPatch) -> None:
    class Endless:
        buffer = None

        @property
        def closed(self) -> bool:
            return False

        def read(self, count: int) -> bytes:
            return bytes(count)

        def fileno(self) -> int:
            raise contents.io.UnsupportedOperation

    stream = Endless()
    stream.buffer = stream  # type: ignore[assignment]
    monkeypatch.setattr(sys, "stdin", stream)
    monkeypatch.setattr(contents, "refuse_unless_free", small_memory)
    with pytest.raises(InputError, match=r"^standard input: its [\d,]+ bytes so far: too much"):
        io.read("-")


def small_memory(needed: int, what: str) -> None:
    if needed > 1 << 24:
        raise InputError(f"{what}: too much")


def test_small_files_are_small(tmp_path: Path) -> None:
    path = tmp_path / "list"
    path.write_bytes(b"12345")
    assert contents.small(str(path), 5, "a list") == b"12345"
    with pytest.raises(InputError, match=r"list: too large for a list, which takes at most 4 bytes"):
        contents.small(str(path), 4, "a list")


@given(st.lists(st.integers(0, 24), max_size=9), st.integers(48, 200), st.integers(1, 9), st.sampled_from(list(FILES)))
def test_files_are_written_in_pieces_of_any_size(moved: list[int], size: int, rows: int, key: str) -> None:
    module = FORMATS[key].load()
    files = {suffix: bytes(pieces) for suffix, pieces in module.write(triangle_grid()).files.items()}
    parsed = module.read(files)
    points, data = parsed.points.copy(), files[module.suffixes[0]]
    points[moved, :2] += 1 / 3
    whole = bytes(Pieces(lambda: parsed.slots.replace(data, parsed.points, points)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(splice, "_PIECE", size)
        patch.setattr(splice, "ROWS", rows)
        patch.setattr(convert, "_PIECE", size)
        pieces = [bytes(piece) for piece in parsed.slots.replace(data, parsed.points, points)]
        again = {suffix: bytes(pieces) for suffix, pieces in module.write(triangle_grid()).files.items()}
    assert b"".join(pieces) == whole
    assert again == files


@pytest.mark.parametrize("key", FILES)
def test_writing_takes_no_memory_by_the_size_of_the_file(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(splice, "_PIECE", 1 << 12)
    monkeypatch.setattr(splice, "ROWS", 1 << 7)
    path, out = (tmp_path / f"{stem}{FORMATS[key].suffixes[0]}" for stem in ("in", "out"))
    io.write(triangle_grid(80), path)
    mesh = io.read(path)
    moved = mesh.with_points(mesh.points + np.array([1 / 3, 1 / 7, 0.0])[: mesh.points.shape[1]])
    io.write(moved, out)  # which may compile kernels
    tracemalloc.start()
    try:
        io.write(moved, out)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 0.25 * path.stat().st_size
