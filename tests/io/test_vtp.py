"""VTP: polygons, lines and vertices in VTK's XML, in each encoding that VTK writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import vtp

PLAIN = b"""<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
<PolyData>
<Piece NumberOfPoints="5" NumberOfVerts="1" NumberOfLines="1" NumberOfStrips="0" NumberOfPolys="2">
<CellData><DataArray type="Int32" Name="material" format="ascii">9 8 1 2</DataArray></CellData>
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">
0 0 0  1 0 0  1 1 0  0 1 0  2 0.5 0
</DataArray></Points>
<Verts><DataArray type="Int64" Name="connectivity" format="ascii">3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">1</DataArray></Verts>
<Lines><DataArray type="Int64" Name="connectivity" format="ascii">0 1 4</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray></Lines>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 1 4 2</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4 7</DataArray></Polys>
</Piece>
</PolyData>
</VTKFile>
"""


def test_a_plain_file() -> None:
    parsed = read(vtp, PLAIN)
    assert cells_of(parsed, "vertex") == [[3]]
    assert cells_of(parsed, "line") == [[0, 1], [1, 4]]
    assert cells_of(parsed, "quad") == [[0, 1, 2, 3]]
    assert cells_of(parsed, "triangle") == [[1, 4, 2]]
    assert [regions_of(parsed, kind) for kind in ("vertex", "line", "quad", "triangle")] == [[9], [8, 8], [1], [2]]
    check_splice(vtp, PLAIN)


def test_errors() -> None:
    refused(vtp, PLAIN.replace(b"1 4 2<", b"1 4 5<"), r"line 13: a cell names the node 5")
    refused(vtp, PLAIN.replace(b"PolyData", b"ImageData"), "write it as PolyData")
    refused(vtp, PLAIN.replace(b'Strips="0"', b'Strips="1"'), "'connectivity' is missing among the Strips")


@given(data=damaged(PLAIN))
def test_damage(data: bytes) -> None:
    read_or_refuse(vtp, {".vtp": data})


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended"])
@pytest.mark.parametrize("zlib", [False, True])
@pytest.mark.parametrize("single", [False, True])
def test_files_of_vtk(mode: str, zlib: bool, single: bool, tmp_path: Path) -> None:
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersSources import vtkSphereSource

    source = vtkSphereSource()
    source.SetOutputPointsPrecision(0 if single else 1)
    source.Update()
    writer = xml.vtkXMLPolyDataWriter()
    writer.SetInputData(source.GetOutput())
    writer.SetFileName(str(tmp_path / "a.vtp"))
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary,
     "appended": writer.SetDataModeToAppended}[mode]()  # fmt: skip
    if zlib:
        writer.SetCompressorTypeToZLib()
    else:
        writer.SetCompressorTypeToNone()
    assert writer.Write()
    check_splice(vtp, (tmp_path / "a.vtp").read_bytes())
    mesh = gmsnet.read(tmp_path / "a.vtp")
    assert len(cells_of(mesh, "triangle")) == source.GetOutput().GetNumberOfPolys()
    new = (mesh.points * 1.25).astype(np.float32 if single else np.float64).astype(np.float64)
    gmsnet.write(mesh.with_points(new), tmp_path / "b.vtp")
    reader = xml.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "b.vtp"))
    reader.Update()
    assert vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).tolist() == new.tolist()


def test_a_file_without_a_piece_is_told() -> None:
    end = PLAIN.index(b"<Piece"), PLAIN.index(b"</Piece>") + len(b"</Piece>")
    with pytest.raises(FormatError, match=r"^the file has no Piece of PolyData$"):
        vtp.read({".vtp": PLAIN[: end[0]] + PLAIN[end[1] :]})
