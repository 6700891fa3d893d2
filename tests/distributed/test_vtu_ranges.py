"""VTU files whose arrays are encoded, of which each rank reads the parts that its share of the cells touches."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.planned import planned_format
from gmsnet.io import vtu_skeleton, vtu_sources
from gmsnet.io.vtu_compressors import COMPRESSORS
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard, mixed, save_vtu
from distributed.test_vtk_ranges import with_data
from support.comm import together
from support.vtk_variants import grid_of, vtu_variants


def encoded(mesh: Mesh, single: bool = False) -> dict[str, bytes]:
    """What VTK writes, but for texts."""
    return {name: data for name, data in vtu_variants(grid_of(mesh, single)) if not name.startswith("ascii")}


WHOLE, SINGLE = encoded(with_data(mixed())), encoded(mixed(), single=True)


@pytest.mark.parametrize("name", WHOLE)
def test_ranks_read_the_mesh_of_one_process(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    for data, ranks in ((WHOLE[name], 3), (SINGLE[name], 4)):
        path.write_bytes(data)
        assert_read_alike(path, "vtu", ranks)


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("name", [name for name in WHOLE if "header 32, order 1" in name or "64, order 0" in name])
def test_the_bytes_of_a_serial_run(name: str, ranks: int, tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    path.write_bytes((SINGLE if ranks == 2 else WHOLE)[name])
    assert_bytes_of_one_process(path, "vtu", ranks, "barrier")


@pytest.mark.parametrize("at_once", [24, 200, 1000])
def test_the_bytes_do_not_depend_on_how_much_is_read_at_once(at_once: int, tmp_path: Path, monkeypatch) -> None:
    """Though blocks of 192 bytes end within a point of three numbers where these have four bytes."""
    monkeypatch.setattr(vtu_sources, "AT_ONCE", at_once)
    monkeypatch.setattr(vtu_skeleton, "AT_ONCE", 7 * at_once)
    for name, data in SINGLE.items():
        if "header 64, order 0" in name:
            (tmp_path / "a.vtu").write_bytes(data)
            assert_bytes_of_one_process(tmp_path / "a.vtu", "vtu", 3, "laplacian")


@pytest.mark.parametrize("compression", [None, "zlib", "lzma"])
@pytest.mark.parametrize("ranks", [1, 3])
def test_as_meshio_writes_it(compression: str | None, ranks: int, tmp_path: Path) -> None:
    """Inline, with the header and the numbers in one where they are not compressed."""
    mesh, path = mixed(), tmp_path / "a.vtu"
    cells = [(block.kind, block.nodes) for block in mesh.cells]
    meshio.vtu.write(str(path), meshio.Mesh(mesh.points, cells), binary=True, compression=compression)
    assert_read_alike(path, "vtu", ranks)
    assert_bytes_of_one_process(path, "vtu", ranks, "barrier")


def appended_in_one(path: Path) -> Path:
    """Appended arrays in base64, header and numbers in one, of raw ones; points are not the last."""
    data = save_vtu(mixed(), path).read_bytes()
    head, tail = re.search(rb"_", data[data.index(b"<AppendedData") :]), data.index(b"\n</AppendedData>")
    begin = data.index(b"<AppendedData") + head.end()
    text, body, letters = data[:begin].decode(), data[begin:tail], b""
    offsets = sorted(int(found) for found in re.findall(r'offset="(\d+)"', text))
    for at, end in zip(offsets, [*offsets[1:], None], strict=True):
        size = int(np.frombuffer(body[at : at + 8], "<u8")[0])
        text = text.replace(f'offset="{at}"', f'offset="new {len(letters)}"')
        letters += base64.b64encode(body[at : at + 8 + size])
        assert end is None or end == at + 8 + size
    text = text.replace('"new ', '"').replace('encoding="raw"', 'encoding="base64"')
    path.write_bytes(text.encode() + letters + data[tail:])
    return path


def test_appended_in_one(tmp_path: Path) -> None:
    path = appended_in_one(tmp_path / "a.vtu")
    assert_read_alike(path, "vtu", 3)
    assert_bytes_of_one_process(path, "vtu", 3, "barrier")


def test_what_stands_beside_the_letters(tmp_path: Path) -> None:
    """Comments, elements within arrays, and white space stay where they are."""
    path = tmp_path / "a.vtu"
    for name in ("binary, header 32, order 1, compress True", "binary, header 64, order 1, compress False"):
        data = re.sub(rb"(<DataArray[^>]*format=\"binary\"[^>]*>)", rb"\1<!-- a > b -->\n<InformationKey name='L2'/>\t",
                      WHOLE[name])  # fmt: skip
        path.write_bytes(data.replace(b"</DataArray>", b"  <InformationKey name='more'>1</InformationKey></DataArray>"))
        assert_bytes_of_one_process(path, "vtu", 3, "barrier")
        assert path.read_bytes().count(b"<!-- a > b -->\n<InformationKey name='L2'/>\t") == data.count(b"a > b")


@pytest.mark.parametrize("change", [
    lambda data: data.replace(b"vtkZLibDataCompressor", b"vtkLZ4DataCompressor"),
    lambda data: re.sub(rb"(connectivity\"[^>]*>\s*\w{300})", rb"\1\n", data),  # letters in two lines
    lambda data: re.sub(rb"(<Points>\s*<DataArray[^>]*>\s*)\w", rb"\1-", data),
    lambda data: data.replace(b'NumberOfCells="', b'NumberOfCells="1'),
    lambda data: data.replace(b'NumberOfPoints="', b'NumberOfPoints="1'),
    lambda data: re.sub(rb"(Name=\"heat\"[^>]*>\s*)[\w=+/]*", rb"\1AAAA", data),
    lambda data: data[:-30],
])  # fmt: skip
@pytest.mark.parametrize("compress", [True, False])
def test_what_does_not_fit_is_for_the_reader_of_the_whole(change, compress: bool, tmp_path: Path) -> None:
    path, data = tmp_path / "a.vtu", WHOLE[f"binary, header 64, order 1, compress {compress}"]
    path.write_bytes(data)
    assert planned_format(str(path), "vtu") == "vtu"
    path.write_bytes(change(data))
    if path.read_bytes() != data:
        assert planned_format(str(path), "vtu") == ""


@pytest.mark.parametrize("name", [name for name in WHOLE if "header 32, order 1" in name])
def test_a_file_cut_anywhere_is_for_the_reader_of_the_whole(name: str, tmp_path: Path) -> None:
    path, data = tmp_path / "a.vtu", WHOLE[name]
    for end in range(0, len(data) - 1, 293):
        path.write_bytes(data[:end])
        assert planned_format(str(path), "vtu") == ""


@pytest.mark.parametrize("mode", ["raw", "binary"])
def test_damage_is_named_on_all_ranks(mode: str, tmp_path: Path) -> None:
    path, data = tmp_path / "a.vtu", WHOLE[f"{mode}, header 32, order 1, compress True"]
    path.write_bytes(data)
    mesh = gmsnet.read(path)
    found: list[int] = []

    def damaged(at: int) -> bool:
        path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        if planned_format(str(path), "vtu"):
            try:
                gmsnet.read(path)
            except gmsnet.InputError as error:
                found.append(at)
                return "block" in str(error) or "base64" in str(error)
        return False

    for at in range(len(data) * 2 // 3, len(data), 97):
        if damaged(at) and len(found) < 4:
            before = saved(tmp_path)
            assert re.search(r"a.vtu: (the array at byte|byte) \d+", heard(3, path, "vtu")[0])
            assert saved(tmp_path) == before
    assert len(found) >= 4
    assert len(mesh.points)


def test_many_tags_are_for_the_reader_of_the_whole(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(vtu_skeleton, "MOST", 500)
    path = tmp_path / "a.vtu"
    path.write_bytes(WHOLE["binary, header 32, order 1, compress True"])
    assert planned_format(str(path), "vtu") == ""


def full(part, block):
    raise OSError(28, "No space left on device")


def test_a_failure_leaves_the_file(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "a.vtu"
    path.write_bytes(WHOLE["raw, header 32, order 1, compress True"])
    packer = COMPRESSORS["vtkZLibDataCompressor"]._replace(pack=full)
    monkeypatch.setitem(COMPRESSORS, "vtkZLibDataCompressor", packer)
    before = saved(tmp_path)
    assert heard(3, path, "vtu")[0] == f"{path}: cannot be written: no space left on device"
    assert saved(tmp_path) == before


def test_a_file_in_which_nothing_moves(tmp_path: Path) -> None:
    """It keeps all its bytes."""
    mesh = replace(mixed(), point_data={"fixed": np.ones(len(mixed().points))})
    for name, data in encoded(mesh).items():
        if "header 64, order 1" in name:
            path, target = tmp_path / "a.vtu", tmp_path / "b.vtu"
            path.write_bytes(data)
            options = SmoothOptions(method="barrier", max_sweeps=2, threads=1)
            task = FileTask(str(path), str(target), "vtu", options)
            together(2, lambda comm, task=task: smooth_file(task, comm))
            assert target.read_bytes() == data
