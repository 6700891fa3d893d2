"""Formats that meshlane reads and writes for us: what it writes is read again, and must be the same mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.damage import cells_of
from support.optional import library

import gmsnet
from gmsnet.cli import main
from gmsnet.errors import FormatError, InputError, MissingExtraError
from gmsnet.generate import block_volume, random_mesh, random_volume
from gmsnet.io import foreign
from gmsnet.mesh.mesh import Mesh


@pytest.mark.parametrize("suffix", [".xdmf", ".e", ".vol"])
def test_a_plane_mesh_is_written(suffix: str, tmp_path: Path) -> None:
    library("meshlane")
    library("h5py")
    mesh = random_mesh(60, seed=1)
    lost = gmsnet.write(mesh, tmp_path / f"a{suffix}")
    back = gmsnet.read(tmp_path / f"a{suffix}")
    assert back.points[:, :2].tolist() == mesh.points.tolist()
    assert cells_of(back, "triangle") == cells_of(mesh, "triangle")
    assert any("numbers its regions and markers" in text for text in lost)
    assert any("no regions" in text for text in lost) == (suffix == ".e")
    better = gmsnet.smooth(back).mesh
    assert gmsnet.write(better, tmp_path / f"b{suffix}") == []


@pytest.mark.parametrize("mesh", [random_volume(40, seed=1), block_volume(3)], ids=["tetra", "hexahedron"])
def test_volumes_are_written(mesh: Mesh, tmp_path: Path) -> None:
    library("meshlane")
    gmsnet.write(mesh, tmp_path / "a.xdmf")
    back = gmsnet.read(tmp_path / "a.xdmf")
    assert [block.nodes.tolist() for block in back.cells] == [block.nodes.tolist() for block in mesh.cells]


def test_what_is_written_otherwise_is_refused(tmp_path: Path) -> None:
    library("meshlane")
    library("h5py")
    with pytest.raises(FormatError, match=r"a\.med: meshlane writes other points or cells into MED"):
        gmsnet.write(random_volume(40, seed=1), tmp_path / "a.med")
    assert not list(tmp_path.iterdir())


def test_a_file_of_another_format_is_converted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    meshlane = library("meshlane")
    mesh = random_mesh(60, seed=2)
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    meshlane.write(tmp_path / "a.avs", meshlane.Mesh(points, [("triangle", mesh.cells[0].nodes)]))
    read = gmsnet.read(tmp_path / "a.avs")
    assert cells_of(read, "triangle") == cells_of(mesh, "triangle")
    assert main(["smooth", str(tmp_path / "a.avs"), str(tmp_path / "b.vtu")]) == 0
    assert "lost in conversion: what meshlane does not read of a file of AVS UCD: left out" in capsys.readouterr().out
    with pytest.raises(InputError, match=r"the suffix '\.avs' is unknown"):
        gmsnet.write(read, tmp_path / "c.avs")
    with pytest.raises(InputError, match="AVS UCD files are only converted"):
        read.source.splice(read.points)


@pytest.mark.parametrize("data", [b"", b"x", b"1 2 3\n", bytes(range(256))])
@pytest.mark.parametrize("suffix", foreign.READ)
def test_no_file_makes_a_traceback(suffix: str, data: bytes, tmp_path: Path) -> None:
    library("meshlane")
    (tmp_path / f"a{suffix}").write_bytes(data)
    with pytest.raises(FormatError, match=r"meshlane (cannot read|finds no)"):
        gmsnet.read(tmp_path / f"a{suffix}")


def test_without_meshlane(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "meshlane", None)
    (tmp_path / "a.avs").write_text("x")
    with pytest.raises(MissingExtraError, match=r"a\.avs: a file of AVS UCD needs meshlane.*gmsnet\[convert\]"):
        gmsnet.read(tmp_path / "a.avs")
    with pytest.raises(MissingExtraError, match="writing XDMF needs meshlane"):
        gmsnet.write(random_mesh(30, seed=1), tmp_path / "a.xdmf")
