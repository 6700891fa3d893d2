"""A mesh is written over the file that it was read from, but not over what others put there."""

from __future__ import annotations

import copy
import os
import pickle
from pathlib import Path

import pytest
from support.damage import triangle_grid

from gmsnet.errors import InputError
from gmsnet.io import read, write
from gmsnet.mesh.mesh import Mesh


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write(triangle_grid(), tmp_path / "a.su2")
    return tmp_path / "a.su2"


def nudged(mesh: Mesh, by: float = 0.03125) -> Mesh:
    points = mesh.points.copy()
    points[12, :2] += by
    return mesh.with_points(points)


def test_a_mesh_is_written_over_its_file_as_often_as_one_likes(path: Path) -> None:
    mesh = read(path)
    for by in (0.0, 0.03125, 0.0625):
        assert write(nudged(mesh, by), path) == []
        assert (read(path).points == nudged(mesh, by).points).all()


@pytest.mark.parametrize("relative", [False, True])
def test_not_over_what_others_wrote(path: Path, relative: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    mesh = nudged(read("a.su2" if relative else path))
    write(nudged(triangle_grid(), 0.125), path)
    theirs = path.read_bytes()
    for name in (path, "a.su2", "./a.su2"):
        with pytest.raises(InputError, match=r"a\.su2: others have changed this file since it was read"):
            write(mesh, name)
    assert path.read_bytes() == theirs
    assert [each.name for each in path.parent.iterdir()] == ["a.su2"]
    assert write(mesh, path.with_name("b.su2")) == []


def test_of_two_meshes_of_one_file_the_second_is_refused(path: Path) -> None:
    one, two = read(path), read(path)
    write(nudged(one), path)
    with pytest.raises(InputError, match="others have changed this file"):
        write(nudged(two), path)
    write(nudged(one, 0.0625), path)


def test_the_same_size_and_another_time(path: Path) -> None:
    mesh = read(path)
    status = path.stat()
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns + 1))
    with pytest.raises(InputError, match="others have changed this file"):
        write(mesh, path)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    write(mesh, path)


def test_copies_know_it_too(path: Path) -> None:
    for copied in (lambda mesh: pickle.loads(pickle.dumps(mesh)), copy.deepcopy):
        mesh = copied(read(path))
        write(nudged(mesh), path)
        write(triangle_grid(), path)
        with pytest.raises(InputError, match="others have changed this file"):
            write(nudged(mesh), path)


def test_a_conversion_knows_it_too(path: Path) -> None:
    mesh = read(path)
    named = Mesh(mesh.points, mesh.cells, {}, source=mesh.source)  # other names: not the file that was read
    path.write_bytes(b"theirs")
    with pytest.raises(InputError, match="others have changed this file"):
        write(named, path)
    assert path.read_bytes() == b"theirs"


def test_what_was_made_in_memory_overwrites_what_it_likes(path: Path) -> None:
    path.write_bytes(b"theirs")
    write(triangle_grid(), path)
    other = path.with_name("other.su2")
    mesh = read(path)
    other.write_bytes(b"theirs")
    write(mesh, other)
    other.write_bytes(b"theirs")
    write(mesh, other)
    assert other.read_bytes() == path.read_bytes()
