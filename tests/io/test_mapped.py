"""Large files, which are mapped into memory: the same mesh, the same bytes, and what others do to them meanwhile."""

from __future__ import annotations

import mmap
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.damage import facts, triangle_grid

from gmsnet import io
from gmsnet.io import FORMATS, convert, mapped, splice
from gmsnet.io.pieces import Pieces
from gmsnet.mesh.mesh import Mesh

pytestmark = pytest.mark.skipif(os.name != "posix", reason="files are mapped where that does not lock them")


@pytest.fixture(autouse=True)
def every_file_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mapped, "LEAST", 1)


def nudged(mesh: Mesh) -> Mesh:
    points = mesh.points.copy()
    points[12, :2] += (0.03125, -0.0625)
    return mesh.with_points(points)


@pytest.mark.parametrize("key", FORMATS)
def test_a_mapped_file_reads_and_writes_as_any_other(key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    suffix = FORMATS[key].suffixes[0]
    one, two, other = (tmp_path / f"{stem}{suffix}" for stem in ("one", "two", "other"))
    io.write(triangle_grid(), one)
    mesh = io.read(one)
    assert mesh.source is not None
    assert isinstance(mesh.source.data, mmap.mmap)  # type: ignore[attr-defined]
    io.write(nudged(mesh), two)
    monkeypatch.setattr(mapped, "LEAST", 1 << 40)
    plain = io.read(one)
    assert isinstance(plain.source.data, bytes)  # type: ignore[union-attr]
    assert facts(mesh) == facts(plain)  # type: ignore[arg-type]
    io.write(nudged(plain), other)
    assert two.read_bytes() == other.read_bytes()


def test_a_mesh_may_be_written_over_its_file(tmp_path: Path) -> None:
    path = tmp_path / "a.su2"
    io.write(triangle_grid(), path)
    for _ in range(3):
        mesh = nudged(io.read(path))
        assert io.write(mesh, path) == []
        assert (io.read(path).points == mesh.points).all()
        assert io.write(mesh, path) == []  # the file that was read lives on without a name


def test_a_file_that_was_removed_lives_on(tmp_path: Path) -> None:
    path, out = tmp_path / "a.su2", tmp_path / "b.su2"
    io.write(triangle_grid(), path)
    path.write_bytes(b"% mine\n" + path.read_bytes())
    mesh = io.read(path)
    path.unlink()
    assert io.write(nudged(mesh), out) == []
    assert out.read_bytes().startswith(b"% mine\n")


@pytest.mark.parametrize("contents", [b"", b"NDIME= 2\n", b"%" * 4000])
def test_a_file_that_has_changed_is_not_relied_on(contents: bytes, tmp_path: Path) -> None:
    path, out = tmp_path / "a.node", tmp_path / "b.node"
    io.write(triangle_grid(), path)
    for suffix in (".node", ".ele"):
        changed = path.with_suffix(suffix)
        before = changed.read_bytes()
        mesh = nudged(io.read(path))
        with changed.open("r+b") as stream:
            stream.truncate(0)
            stream.write(contents)
        os.utime(changed, ns=(1, 1))
        assert io.write(mesh, out)[-1].startswith("the file that was read has changed since")
        assert (io.read(out).points == mesh.points).all()
        changed.write_bytes(before)


def test_what_may_be_read_only_once_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.su2"
    io.write(triangle_grid(), path)
    assert isinstance(mapped.load(str(path)), mapped.Mapped)
    with pytest.raises(FileNotFoundError):
        mapped.load(str(tmp_path / "no.su2"))
    assert mapped.load(os.devnull) == b""


def test_a_file_that_cannot_be_mapped_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(19, "No such device")

    path = tmp_path / "a.su2"
    io.write(triangle_grid(), path)
    monkeypatch.setattr(mapped, "Mapped", refuse)
    assert mapped.load(str(path)) == path.read_bytes()


@given(
    st.lists(st.integers(0, 24), max_size=9), st.integers(48, 200), st.integers(1, 9), st.sampled_from(list(FORMATS))
)
def test_files_are_written_in_pieces_of_any_size(moved: list[int], size: int, rows: int, key: str) -> None:
    module = FORMATS[key].load()
    files = {suffix: bytes(pieces) for suffix, pieces in module.write(triangle_grid()).files.items()}
    parsed = module.read(files)
    points, data = parsed.points.copy(), files[module.suffixes[0]]
    points[moved, :2] += 1 / 3
    whole = bytes(Pieces(lambda: parsed.slots.replace(data, parsed.points, points)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(splice, "_PIECE", size)
        patch.setattr(splice, "_ROWS", rows)
        patch.setattr(convert, "_PIECE", size)
        pieces = [bytes(piece) for piece in parsed.slots.replace(data, parsed.points, points)]
        again = {suffix: bytes(pieces) for suffix, pieces in module.write(triangle_grid()).files.items()}
    assert b"".join(pieces) == whole
    assert again == files


@pytest.mark.parametrize("key", FORMATS)
def test_writing_takes_no_memory_by_the_size_of_the_file(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(splice, "_PIECE", 1 << 12)
    monkeypatch.setattr(splice, "_ROWS", 1 << 7)
    path, out = (tmp_path / f"{stem}{FORMATS[key].suffixes[0]}" for stem in ("in", "out"))
    io.write(triangle_grid(60), path)
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
