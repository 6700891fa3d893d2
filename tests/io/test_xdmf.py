"""XDMF: numbers inside the XML or in an HDF5 file beside it, which gets its own name where it is written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import binary_meshes as made
from support.contracts import check_splice, read, refused
from support.damage import cells_of, check_cuts, regions_of

import gmsnet
from gmsnet.errors import FormatError, InputError
from gmsnet.io import xdmf

PLAIN = made.xdmf()


def test_numbers_inside() -> None:
    parsed = read(xdmf, PLAIN)
    assert parsed.points.tolist() == made.POINTS.tolist()
    assert cells_of(parsed, "triangle") == made.TRIANGLES.tolist()
    assert cells_of(parsed, "quad") == made.QUADS.tolist()
    assert regions_of(parsed, "triangle") == [1, 1, 1, 1, 2, 2]
    out = check_splice(xdmf, PLAIN)
    assert b"<!-- the cells -->" in out
    check_cuts(xdmf, {".xdmf": PLAIN}, ".xdmf", lambda data: False)


def _pair(folder: Path, packed: bool = False) -> Path:
    (folder / "a.xdmf").write_bytes(made.xdmf(inside=False))
    (folder / "mesh.h5").write_bytes(made.xdmf_h5(packed))
    return folder / "a.xdmf"


@pytest.mark.parametrize("packed", [False, True])
def test_numbers_in_another_file(packed: bool, tmp_path: Path) -> None:
    path = _pair(tmp_path, packed)
    mesh = gmsnet.read(path)
    assert mesh.points.tolist() == made.POINTS.tolist()
    new = mesh.points.copy()
    new[6:] += 0.0625
    out = tmp_path / "b & c.xmf"
    assert gmsnet.write(mesh.with_points(new), out) == []
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.xdmf", "b & c.h5", "b & c.xmf", "mesh.h5"]
    assert out.read_bytes() == path.read_bytes().replace(b"mesh.h5", b"b &amp; c.h5")
    assert (tmp_path / "mesh.h5").read_bytes() == made.xdmf_h5(packed)
    assert gmsnet.read(out).points.tolist() == new.tolist()
    assert gmsnet.read(path).points.tolist() == made.POINTS.tolist()


def test_the_file_itself_written_over(tmp_path: Path) -> None:
    (tmp_path / "mesh.xdmf").write_bytes(made.xdmf(inside=False))
    (tmp_path / "mesh.h5").write_bytes(made.xdmf_h5())
    mesh = gmsnet.read(tmp_path / "mesh.xdmf")
    new = mesh.points * 1.5
    gmsnet.write(mesh.with_points(new), tmp_path / "mesh.xdmf")
    assert (tmp_path / "mesh.xdmf").read_bytes() == made.xdmf(inside=False)
    assert gmsnet.read(tmp_path / "mesh.xdmf").points.tolist() == new.tolist()


def test_the_numbers_of_what_was_read_are_not_written_over(tmp_path: Path) -> None:
    path = _pair(tmp_path)
    mesh = gmsnet.read(path)
    with pytest.raises(InputError, match=r"mesh\.h5: holds the numbers of the mesh that was read"):
        gmsnet.write(mesh.with_points(mesh.points * 2.0), tmp_path / "mesh.xdmf")
    assert (tmp_path / "mesh.h5").read_bytes() == made.xdmf_h5()
    assert not (tmp_path / "mesh.xdmf").exists()


def test_other_libraries_read_the_pair(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    text = made.xdmf(inside=False).decode()
    path = tmp_path / "a.xdmf"
    path.write_text("\n".join(line for line in text.split("\n") if "DOCTYPE" not in line and "<!--" not in line))
    (tmp_path / "mesh.h5").write_bytes(made.xdmf_h5())
    mesh = gmsnet.read(path)
    new = mesh.points * 1.25
    gmsnet.write(mesh.with_points(new), tmp_path / "b.xdmf")
    assert meshio.read(tmp_path / "b.xdmf").points.tolist() == new.tolist()


def test_errors(tmp_path: Path) -> None:
    refused(xdmf, PLAIN.replace(b'"XY"', b'"VXVYVZ"'), "a geometry 'VXVYVZ' of 1 items is not read")
    refused(xdmf, PLAIN.replace(b'Dimensions="8 2"', b'Dimensions="9 2"'), "line 4: DataItem: 16 numbers do not fit")
    refused(xdmf, PLAIN.replace(b'Type="Mixed"', b'Type="3DCoRectMesh"'), "line 14: Topology: cells of type '3dcorect")
    refused(xdmf, PLAIN.replace(b"5 1 7 3 4", b"5 1 7 3 8"), "names the node 8, but the nodes are 0 to 7")
    declarations = ('<!ENTITY a "b">', '<!ENTITY % a "b"> %a;', '<!ENTITY a SYSTEM "file:///dev/zero">',
                    "<!ELEMENT Xdmf ANY>", "<!ATTLIST Xdmf a CDATA #IMPLIED>", '<!NOTATION a SYSTEM "b">')  # fmt: skip
    for declared in declarations:
        refused(xdmf, PLAIN.replace(b"[]", f"[{declared}]".encode()), "line 2: a DOCTYPE with declarations")
    refused(xdmf, made.xdmf(inside=False), "an HDF5 file and the path in it were expected")
    path = _pair(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"mesh.h5:/cells", b"other.h5:/cells"))
    with pytest.raises(FormatError, match=r"a\.xdmf: the items name 2 HDF5 files"):
        gmsnet.read(path)
    path.write_bytes(made.xdmf(inside=False).replace(b"mesh.h5", b"../mesh.h5"))
    with pytest.raises(FormatError, match="must name a file beside this one"):
        gmsnet.read(path)
    (tmp_path / "mesh.h5").unlink()
    path.write_bytes(made.xdmf(inside=False))
    with pytest.raises(InputError, match=r"mesh\.h5: there is no such file"):
        gmsnet.read(path)


def test_a_pair_cannot_go_to_a_stream(tmp_path: Path) -> None:
    mesh = gmsnet.read(_pair(tmp_path))
    with pytest.raises(InputError, match="cannot be written to a stream"):
        gmsnet.write(mesh, "-", "xdmf")


def test_single_types_of_cells() -> None:
    cells = " ".join(map(str, made.TRIANGLES.ravel().tolist()))
    old = " ".join(map(str, made.xdmf_topology().tolist()))
    text = PLAIN.replace(b"Mixed", b"Triangle").replace(old.encode(), cells.encode())
    text = (
        text.replace(b'"23"', b'"6 3"').replace(b'"29"', b'"6 3"').replace(b'"7"', b'"6"').replace(b" 2 2 2<", b" 2 2<")
    )
    parsed = read(xdmf, text)
    assert cells_of(parsed, "triangle") == made.TRIANGLES.tolist()
    assert np.array_equal(parsed.points, made.POINTS)


INCLUDE = '<ns0:include xmlns:ns0="http://www.w3.org/2001/XInclude" xpointer="xpointer(//Grid/Geometry)"/>'
TAGS = """<Grid Name="{name}">{include}<Topology TopologyType="{kind}" NumberOfElements="2" NodesPerElement="{width}">
<DataItem Dimensions="2 {width}" NumberType="Int" Format="XML">{cells}</DataItem></Topology><Attribute Name="{name}"
Center="Cell"><DataItem Dimensions="2 1" Format="XML" NumberType="Int">{values}</DataItem></Attribute>
</Grid></Domain>"""

FACETS = ("facets", "PolyLine", 2, "6 1 4 6", "8 9")
CELLS = ("materials", "Triangle", 3, "7 2 3 6 0 1", "5 4")


def tagged(name: str, kind: str, width: int, cells: str, values: str) -> bytes:
    triangles = " ".join(map(str, made.TRIANGLES.ravel().tolist()))
    plain = PLAIN.decode().replace("Mixed", "Triangle").replace(" ".join(map(str, made.xdmf_topology())), triangles)
    plain = plain.replace('Dimensions="29"', 'Dimensions="6 3"')
    head, _, rest = plain.partition("<Attribute")
    plain = head + rest.partition("</Attribute>")[2]
    more = TAGS.format(name=name, include=INCLUDE, kind=kind, width=width, cells=cells, values=values)
    return plain.replace("</Domain>", more).encode()


def test_tags_of_other_grids_as_dolfinx_writes_them() -> None:
    """Facets become markers, which hold their nodes; tags of cells become their regions, whatever their order."""
    parsed = read(xdmf, tagged(*FACETS))
    assert cells_of(parsed, "line") == [[6, 1], [4, 6]]
    assert regions_of(parsed, "line") == [8, 9]
    assert parsed.unread == []
    parsed = read(xdmf, tagged(*CELLS))
    assert regions_of(parsed, "triangle") == [4, 0, 0, 0, 0, 5]
    check_splice(xdmf, tagged(*FACETS))
    assert read(xdmf, tagged("odd", "Triangle", 3, "7 2 3 6 0 2", "5 4")).unread == ["1 other grids"]
