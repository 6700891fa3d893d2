"""Files compressed with gzip: what is in them is spliced, what is damaged is refused, what is too large too."""

from __future__ import annotations

import gzip
import resource
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.damage import damaged, triangle_grid
from support.formats import FILES

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.io.formats import FORMATS
from gmsnet.io.packed import packed, split_name, unpacked

MEMBER = gzip.compress(b"one " * 50, mtime=77)


def noisy() -> gmsnet.Mesh:
    mesh = triangle_grid(6)
    inner = (mesh.points > 0).all(axis=1) & (mesh.points < 1).all(axis=1)
    points = mesh.points.copy()
    points[inner] += np.random.default_rng(1).uniform(-0.05, 0.05, points[inner].shape)
    return mesh.with_points(points)


@pytest.mark.parametrize("key", FILES)
def test_a_packed_file_is_spliced_as_the_plain_one(key: str, tmp_path: Path) -> None:
    plain, inside = tmp_path / f"a{FORMATS[key].suffixes[0]}", [f"a{suffix}" for suffix in FORMATS[key].suffixes]
    gmsnet.write(noisy(), plain)
    for name in inside:
        (tmp_path / f"{name}.gz").write_bytes(gzip.compress((tmp_path / name).read_bytes()))
    mesh, twin = gmsnet.read(f"{plain}.gz"), gmsnet.read(plain)
    assert mesh.points.tobytes() == twin.points.tobytes()
    points = mesh.points.copy()
    points[8, :2] += 0.015625
    assert not gmsnet.write(mesh.with_points(points), tmp_path / f"b{plain.suffix}.gz")
    assert not gmsnet.write(twin.with_points(points), tmp_path / f"b{plain.suffix}")
    for name in inside:
        made = tmp_path / f"b{Path(name).suffix}"
        assert gzip.decompress(Path(f"{made}.gz").read_bytes()) == made.read_bytes()
    assert not gmsnet.write(mesh.with_points(points), f"{plain}.gz")  # over the file that was read
    assert gzip.decompress(Path(f"{plain}.gz").read_bytes()) == (tmp_path / f"b{plain.suffix}").read_bytes()


def test_the_same_contents_are_packed_into_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    made = b"".join(packed([b"some", memoryview(b" text")]))
    monkeypatch.setattr(time, "time", lambda: 1e9)
    assert made == b"".join(packed([b"some", memoryview(b" text")]))
    assert made[4:8] == bytes(4)  # no time
    assert not made[3]  # no name
    assert gzip.decompress(made) == b"some text"


@pytest.mark.parametrize(
    ("path", "parts"),
    [
        ("a.b/c.msh.gz", ("a.b/c", ".msh", ".gz")),
        ("c.MSH.GZ", ("c", ".MSH", ".GZ")),
        ("c.msh", ("c", ".msh", "")),
        ("points.gz", ("points", "", ".gz")),
        ("c", ("c", "", "")),
    ],
)
def test_names_are_split(path: str, parts: tuple[str, str, str]) -> None:
    assert split_name(path) == parts


def test_members_follow_each_other_and_zeros_may_fill_a_block() -> None:
    assert unpacked(MEMBER + gzip.compress(b"two") + bytes(100), "x") == b"one " * 50 + b"two"
    large = np.random.default_rng(0).bytes(3 << 20) + bytes(5 << 20)
    assert unpacked(gzip.compress(large) + MEMBER, "x") == large + b"one " * 50


@pytest.mark.parametrize("cut", range(len(MEMBER)))
def test_a_cut_is_seen_wherever_it_is(cut: int) -> None:
    if cut == 0:
        assert unpacked(b"", "x") == b""  # which is refused as empty, as any other file
        return
    with pytest.raises(FormatError):
        unpacked(MEMBER[:cut], "x")


@given(st.data())
def test_damage_is_refused_or_does_no_harm(data: st.DataObject) -> None:
    found = data.draw(damaged(MEMBER))
    try:
        text = unpacked(found, "x")
    except FormatError:
        return
    assert text == _reference(found)


def _reference(data: bytes) -> bytes:
    """Member by member, all at once."""
    text = b""
    while data.strip(b"\0"):
        member = zlib.decompressobj(31)
        text += member.decompress(data)
        data = member.unused_data
    return text


def test_a_bomb_is_refused_before_the_memory_is_used_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.su2.gz"
    path.write_bytes(gzip.compress(bytes(400_000_000)))
    assert path.stat().st_size < 1_000_000
    monkeypatch.setattr("gmsnet.parallel.memory.available", lambda: 300_000_000)
    with pytest.raises(InputError, match=r"a\.su2\.gz: its 3\d\d,\d{3},\d{3} bytes so far, unpacked, needs about"):
        gmsnet.read(path)


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory is that of Linux")
def test_a_bomb_under_a_limit_of_the_process(tmp_path: Path) -> None:
    path = tmp_path / "a.su2.gz"
    path.write_bytes(gzip.compress(bytes(1_000_000_000)))
    gmsnet.write(noisy(), tmp_path / "small.su2.gz")
    code = f"""
import resource, gmsnet
gmsnet.read({str(tmp_path / "small.su2.gz")!r})  # loads all that there is to load
have = int(open("/proc/self/statm").read().split()[0]) * {resource.getpagesize()}
resource.setrlimit(resource.RLIMIT_AS, (have + 200_000_000,) * 2)
try:
    gmsnet.read({str(path)!r})
except gmsnet.InputError as error:
    print(error)
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == f"{path}: there is not enough memory for this file\n"
