"""Whole files: formats, messages, links, pipes, permissions, and nothing half-written."""

from __future__ import annotations

import io
import os
import stat
import sys
import threading
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.damage import cells_of, triangle_grid

from gmsnet.errors import FormatError, InputError
from gmsnet.io import FORMATS, atomic, read, streams, write
from gmsnet.io.formats import sniff
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

TEXT_FORMATS = ("su2", "medit", "triangle", "obj", "off")


@pytest.fixture
def su2(tmp_path: Path) -> Path:
    path = tmp_path / "grid.su2"
    write(triangle_grid(), path)
    return path


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def nudged(mesh: Mesh) -> Mesh:
    points = mesh.points.copy()
    points[12, :2] += (0.03125, -0.0625)
    return mesh.with_points(points)


@pytest.mark.parametrize("key", FORMATS)
def test_the_table_agrees_with_the_modules(key: str) -> None:
    module = import_module(f"gmsnet.io.{FORMATS[key].within or key}")
    module = getattr(module, key) if FORMATS[key].within else module
    assert FORMATS[key].load() is module
    assert (module.name, module.suffixes) == (FORMATS[key].title, FORMATS[key].suffixes)


@pytest.mark.parametrize("key", TEXT_FORMATS)
def test_read_write_and_splice(key: str, tmp_path: Path) -> None:
    suffixes = FORMATS[key].suffixes
    path, out = (tmp_path / f"{stem}{suffixes[0]}" for stem in ("in", "out"))
    write(triangle_grid(), path)
    mesh = read(path)
    assert mesh.source is not None
    assert mesh.source.format == key
    assert sniff(path.read_bytes()) == (None if key == "triangle" else key)
    assert write(mesh, out) == []
    for suffix in suffixes:
        assert out.with_suffix(suffix).read_bytes() == path.with_suffix(suffix).read_bytes()
    moved = nudged(mesh)
    assert write(moved, out) == []
    old, new = path.read_bytes().split(), out.read_bytes().split()
    assert [(a, b) for a, b in zip(old, new, strict=True) if a != b] == [(b"0.5", b"0.53125"), (b"0.5", b"0.4375")]
    assert (read(out).points == moved.points).all()
    assert names(tmp_path) == sorted(f"{stem}{suffix}" for stem in ("in", "out") for suffix in suffixes)


def test_a_mesh_with_other_cells_is_converted_not_spliced(su2: Path, tmp_path: Path) -> None:
    mesh = read(su2)
    fewer = Mesh(mesh.points, (CellBlock("triangle", mesh.cells[0].nodes[:5], np.zeros(5)),), source=mesh.source)
    write(fewer, tmp_path / "out.su2")
    assert cells_of(read(tmp_path / "out.su2"), "triangle") == mesh.cells[0].nodes[:5].tolist()


def test_conversion_names_what_is_lost(su2: Path, tmp_path: Path) -> None:
    assert write(read(su2), tmp_path / "out.off") == [
        "OFF cannot hold line cells: 8 were left out (markers 'bottom_wall', 'top')"
    ]
    assert write(read(su2), tmp_path / "any.name", format="medit") == [
        "Medit numbers its regions and markers: the names 'bottom_wall' (1), 'top' (2) were left out"
    ]
    assert read(tmp_path / "any.name", format="medit").points.tolist() == read(su2).points.tolist()


@pytest.mark.parametrize("given", ["pair.node", "pair.ele"])
def test_either_file_of_a_pair_may_be_named(given: str, tmp_path: Path) -> None:
    write(triangle_grid(), tmp_path / given)
    assert names(tmp_path) == ["pair.ele", "pair.node"]
    mesh = read(tmp_path / given)
    write(nudged(mesh), tmp_path / f"two.{given[5:]}")
    assert (tmp_path / "two.ele").read_bytes() == (tmp_path / "pair.ele").read_bytes()
    (tmp_path / "pair.node").unlink()
    with pytest.raises(InputError, match=r"pair\.node: there is no such file"):
        read(tmp_path / "pair.ele")


def test_names_in_capitals(tmp_path: Path) -> None:
    for name in ("A.SU2", "B.NODE"):
        write(triangle_grid(), tmp_path / name)
        assert len(read(tmp_path / name).points) == 25
    assert names(tmp_path) == ["A.SU2", "B.ELE", "B.NODE"]


SU2_TEXT = b"NDIME= 2\nNPOIN= 0\nNELEM= 0\nNMARK= 0\n"


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.su2", b"", r"a\.su2: the file is empty"),
        ("a.su2", b" \n\n", r"a\.su2: the file is empty"),
        ("a.su2", b"$MeshFormat\n2.2 0 8\n", r"a\.su2: this looks like Gmsh, not SU2: rename it to \.msh or pass "
                                             r"--format gmsh"),
        ("a.msh", SU2_TEXT, r"a\.msh: this looks like SU2, not Gmsh: .* --format su2"),
        ("a.vtk", b"<?xml version='1.0'?>\n<VTKFile type='UnstructuredGrid'>", r"a\.vtk: this looks like VTU"),
        ("a.off", b"ply\nformat ascii 1.0\n", r"looks like PLY"),
        ("a.off", b"solid x\nfacet normal 0 0 1\n", r"looks like STL"),
        ("a.off", b"# x\nv 0 0 0\nv 1 0 0\n", r"looks like OBJ"),
        ("a.obj", b"# x\n\n  OFF\n3 1 0\n", r"looks like OFF"),
        ("a.obj", b"MeshVersionFormatted 2", r"looks like Medit"),
        ("a.obj", b"# vtk DataFile Version 3.0\n", r"looks like VTK"),
        ("a.mesh", b"MFEM NURBS mesh v1.0\n", r"a\.mesh: this is an MFEM mesh of another kind"),
        ("a.mesh", b"\x01\0\0\0\x02\0\0\0\x03\0\0\0\x18\0\0\0", r"this is a binary Medit mesh"),
        ("a.su2", b"\x1f\x8b\x08\0\0\0", r"this is compressed with gzip"),
        ("a.su2", bytes(range(256)) * 4, r"a\.su2: byte 0: this is binary data, not SU2"),
        ("a.su2", "NDIME= 2\n".encode("utf-16"), r"a\.su2: the text is in UTF-16"),
        ("a.su2", b"hello world", r"a\.su2: line 1: a keyword such as NDIME= was expected, found 'hello'"),
        ("a.su2", SU2_TEXT, r"a\.su2: the file holds no points"),
        ("a.su2", b"NDIME= 2\nNPOIN= 1\n0 0\nNELEM= 0\nNMARK= 0\n", r"a\.su2: the file holds no cells"),
        ("a.obj", b"# nothing\n", r"a\.obj: the file holds no points"),
        ("a.su2", b"NDIME= 2\nNPOIN= 9\n", r"a\.su2: line 2: NPOIN= 9 is followed by 0 rows"),
        ("a.xyz", b"1 2 3", r"a\.xyz: the suffix '\.xyz' is unknown; known are \.su2, \.msh, .* with --format"),
        ("a", b"1 2 3", r"a: the name has no suffix; known are"),
        ("a.su2.gz", b"\x1f\x8b", r"a\.su2\.gz: the compressed data end too early: the file is cut off"),
        ("a.su2.gz", SU2_TEXT, r"a\.su2\.gz: byte 0: no gzip data begin here: leave out \.gz in the name"),
        ("a.gz", b"\x1f\x8b", r"a\.gz: the name has no suffix; known are"),
    ],
)  # fmt: skip
def test_what_is_no_mesh_is_refused_with_its_name(name: str, data: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path))
    assert "\n" not in str(caught.value)
    assert (tmp_path / name).read_bytes() == data


@pytest.mark.parametrize("key", TEXT_FORMATS)
def test_a_byte_order_mark_is_named_where_it_is_the_reason(key: str, tmp_path: Path) -> None:
    path = tmp_path / f"mesh{FORMATS[key].suffixes[0]}"
    write(triangle_grid(), path, format=key)
    contents = path.read_bytes()
    path.write_bytes(b"\xef\xbb\xbf" + contents)
    with pytest.raises(FormatError, match="byte-order mark"):
        read(path, format=key)
    path.write_bytes(b"\xef" + contents)
    with pytest.raises(FormatError) as caught:
        read(path, format=key)
    assert "byte-order mark" not in str(caught.value)


def test_a_zero_byte_is_refused_wherever_it_is(tmp_path: Path) -> None:
    data = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + b"# \n" * 3000
    for at in (40, len(data)):
        (tmp_path / "a.obj").write_bytes(data[:at] + b"# \0\n" + data[at:])
        with pytest.raises(FormatError, match=rf"a\.obj: byte {at + 2}: .* no text has a zero byte"):
            read(tmp_path / "a.obj")


def test_exponents_are_coordinates_at_first_sight_too() -> None:
    assert sniff(b"v -4.9e-324 1E5 0\nv 1 0 0\n") == "obj"


@given(st.text("%#<!->?\n\r\t vofgs01.ASU2NDIME=", max_size=300).map(str.encode) | st.binary(max_size=100))
def test_the_look_at_the_contents_ends(data: bytes) -> None:
    for head in (b"", b"<!--x-->" * 400, b"%  \n \n" * 500, b"#  \n" * 800, b"g a\n" * 900, b"solid\n" + b"\n" * 4000):
        assert sniff(head + data) in (None, *FORMATS)


def test_what_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no\.su2: there is no such file"):
        read(tmp_path / "no.su2")
    with pytest.raises(InputError, match="this is a folder"):
        read(tmp_path)
    (tmp_path / "folder.su2").mkdir()
    with pytest.raises(InputError, match="this is a folder"):
        read(tmp_path / "folder.su2")
    with pytest.raises(InputError, match="this is a folder"):
        write(triangle_grid(), tmp_path / "folder.su2")
    with pytest.raises(InputError, match=r"unknown format 'meshb': known are su2, gmsh"):
        read(__file__, format="meshb")
    with pytest.raises(InputError, match=r"out\.xyz: the suffix '\.xyz' is unknown"):
        write(triangle_grid(), tmp_path / "out.xyz")
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist; make it first"):
        write(triangle_grid(), tmp_path / "nowhere" / "out.su2")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write everywhere")
def test_write_protection(su2: Path, tmp_path: Path) -> None:
    su2.chmod(0o444)
    with pytest.raises(InputError, match="the file is write-protected"):
        write(triangle_grid(), su2)
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match=r"the folder .* is write-protected"):
        write(triangle_grid(), tmp_path / "new.su2")
    tmp_path.chmod(0o755)


def test_write_protection_as_the_system_reports_it(su2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) != str(su2))
    with pytest.raises(InputError, match=r"grid\.su2: the file is write-protected"):
        write(triangle_grid(), su2)
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) != str(tmp_path))
    with pytest.raises(InputError, match=r"new\.su2: the folder .* is write-protected"):
        write(triangle_grid(), tmp_path / "new.su2")


def test_permissions_of_a_target_are_kept(su2: Path, tmp_path: Path) -> None:
    su2.chmod(0o640)
    write(nudged(read(su2)), su2)
    assert stat.S_IMODE(su2.stat().st_mode) == 0o640
    old = os.umask(0o027)
    try:
        write(triangle_grid(), tmp_path / "new.su2")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "new.su2").stat().st_mode) == 0o640
    assert names(tmp_path) == ["grid.su2", "new.su2"]


def test_a_private_mesh_is_never_readable_by_others(su2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    su2.chmod(0o600)
    modes, sync = [], os.fsync

    def look(descriptor: int) -> None:
        modes.append(
            stat.S_IMODE(os.fstat(descriptor).st_mode) if stat.S_ISREG(os.fstat(descriptor).st_mode) else 0o600
        )
        sync(descriptor)

    made, open_file = [], os.open

    def opened(path: str, flags: int, mode: int = 0o777, **others: int) -> int:
        descriptor = open_file(path, flags, mode, **others)
        if flags & os.O_CREAT:
            made.append(stat.S_IMODE(os.fstat(descriptor).st_mode))
        return descriptor

    moved = nudged(read(su2))
    monkeypatch.setattr(atomic.os, "open", opened)
    monkeypatch.setattr(atomic.os, "fsync", look)
    write(moved, su2)
    assert made == [0o600]
    assert set(modes) == {0o600}
    su2.chmod(0o644)
    write(moved, su2)
    assert made == [0o600, 0o600]
    assert stat.S_IMODE(su2.stat().st_mode) == 0o644


def test_a_pipe_that_nobody_reads_is_a_broken_pipe(su2: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone(io.BytesIO):
        def write(self, data: object) -> int:
            raise BrokenPipeError(32, os.strerror(32))

    class Output:
        buffer = Gone()

    monkeypatch.setattr(sys, "stdout", Output())
    with pytest.raises(BrokenPipeError):
        write(read(su2), "-")


def test_what_is_the_standard_output(su2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(streams.is_standard_output(name) for name in streams.STANDARD_OUTPUT)
    with su2.open("rb") as file:
        status = os.fstat(file.fileno())
    monkeypatch.setattr(streams.os, "fstat", lambda descriptor: status)
    (tmp_path / "link.su2").symlink_to(su2)
    assert streams.is_standard_output(str(su2))
    assert streams.is_standard_output(str(tmp_path / "link.su2"))
    assert not streams.is_standard_output(str(tmp_path))
    assert not streams.is_standard_output(str(tmp_path / "new.su2"))
    nowhere = os.stat(os.devnull)
    monkeypatch.setattr(streams.os, "fstat", lambda descriptor: nowhere)
    assert not streams.is_standard_output(os.devnull)


def test_closed_streams_are_an_error_in_words(su2: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = read(su2)
    monkeypatch.setattr(sys, "stdin", None)
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(InputError, match="standard input: it is closed; give the name of a file"):
        read("-")
    with pytest.raises(InputError, match="standard output: it is closed; give the name of a file"):
        write(mesh, "-")


def test_a_link_is_followed(su2: Path, tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    target = tmp_path / "inner" / "real.su2"
    su2.rename(target)
    link = tmp_path / "link.su2"
    link.symlink_to(target)
    moved = nudged(read(link))
    write(moved, link)
    assert link.is_symlink()
    assert (read(target).points == moved.points).all()
    dangling = tmp_path / "dangling.su2"
    dangling.symlink_to(tmp_path / "inner" / "made.su2")
    write(moved, dangling)
    assert names(tmp_path / "inner") == ["made.su2", "real.su2"]


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt(), MemoryError()])
@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_failure_leaves_everything_as_it_was(
    failure: BaseException, step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(triangle_grid(), tmp_path / "pair.node")
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    moved = nudged(read(tmp_path / "pair.node"))
    calls: list[int] = []

    def fail(*_: object) -> None:
        calls.append(1)
        if step == "replace" or len(calls) == 2:  # the first temporary file is there already
            raise failure

    monkeypatch.setattr(atomic.os, step, fail)
    with pytest.raises(BaseException) as caught:
        write(moved, tmp_path / "pair.node")
    monkeypatch.undo()
    if isinstance(failure, OSError):
        assert isinstance(caught.value, InputError)
        assert "cannot be written: no space left on device" in str(caught.value)
    else:
        assert caught.value is failure
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_a_conversion_that_fails_leaves_the_target(su2: Path, tmp_path: Path) -> None:
    quad = Mesh(np.eye(4)[:, :2], (CellBlock("quad", [[0, 1, 2, 3]], [0]),))
    before = su2.read_bytes()
    su2.rename(tmp_path / "old.node")
    with pytest.raises(FormatError, match=r"old\.node: Triangle cannot hold cells of type 'quad'"):
        write(quad, tmp_path / "old.node")
    assert (tmp_path / "old.node").read_bytes() == before
    assert names(tmp_path) == ["old.node"]


def test_pipes_are_written_straight(su2: Path, tmp_path: Path) -> None:
    if not hasattr(os, "mkfifo"):
        pytest.skip("this system has no named pipes")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    mesh = read(su2)
    for format in (None, "su2"):
        writer = threading.Thread(target=write, args=(nudged(mesh), pipe, format))
        writer.start()
        (tmp_path / "got.su2").write_bytes(pipe.read_bytes())
        writer.join()
        assert (read(tmp_path / "got.su2").points == nudged(mesh).points).all()
    assert pipe.is_fifo()
    with pytest.raises(InputError, match="Triangle takes several files and cannot be written to a stream"):
        write(mesh, pipe, format="triangle")
    with pytest.raises(InputError, match="Triangle takes several files and cannot be read from a stream"):
        read("-", format="triangle")
    with pytest.raises(InputError, match="name the format with --format"):
        write(triangle_grid(), pipe)


class Stream:
    def __init__(self, data: bytes = b"") -> None:
        self.buffer = io.BytesIO(data)


def test_standard_input_and_output(su2: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = su2.read_bytes()
    monkeypatch.setattr(sys, "stdin", Stream(data))
    mesh = read("-", format="su2")
    monkeypatch.setattr(sys, "stdin", Stream(data))
    assert (read("-").points == mesh.points).all()
    monkeypatch.setattr(sys, "stdin", Stream(b"1 2 3"))
    with pytest.raises(InputError, match="standard input: its format cannot be seen; name it with --format"):
        read("-")
    monkeypatch.setattr(sys, "stdin", Stream(b"NDIME= 3\n"))
    with pytest.raises(FormatError, match="standard input: NPOIN, NELEM missing"):
        read("-")
    for target in ("-", "/dev/stdout"):
        monkeypatch.setattr(sys, "stdout", out := Stream())
        assert write(mesh, target) == []
        assert out.buffer.getvalue() == data
    with pytest.raises(InputError, match="standard output: name the format"):
        write(triangle_grid(), "-")


def test_a_mesh_too_large_for_memory_is_an_error_in_words(su2: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def exhausted(_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(import_module("gmsnet.io.su2"), "read", exhausted)
    with pytest.raises(InputError, match=r"grid\.su2: there is not enough memory for this mesh"):
        read(su2)
