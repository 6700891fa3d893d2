"""Files of each format and variant, from which the fuzzer starts: those of the tests, of VTK and of our own writers."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fuzz.promises import NEXT, PAIR
from gmsnet.errors import FormatError
from gmsnet.generate import random_mesh
from gmsnet.io.formats import FORMATS
from gmsnet.mesh.mesh import Mesh

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))  # the tests of the readers, and what they share

import test_abaqus
import test_fluent
import test_gmsh_partitions
import test_medit
import test_mfem
import test_nastran
import test_netgen
import test_obj
import test_off
import test_openfoam
import test_periodic
import test_ply
import test_stl
import test_su2
import test_su2_periodic
import test_tetgen
import test_triangle
import test_ugrid
import test_volume_files
import test_vtk
import test_vtk_pieces
import test_vtp
import test_vtu
import test_xdmf
from support import binary_meshes, decomposed, gmsh_split, gmsh_variants, pieces
from support.damage import triangle_grid
from support.vtk_variants import grid_of, legacy_variants, mixed_mesh, polydata_of, polyhedral_grid, vtu_variants
from test_su2_volumes import VOLUMES

SU2 = b"""% made up
NDIME= 2 % plane
AOA= 5.0
NELEM= 2
5 0 1 2
9 0 2 3 4
NPOIN= 5 5
0.0 0.0 0 0
1.0 0.0 1 1
1.0 1.0 2 2
0.0 1.0 3 3
-0.5 0.5 4 4
NMARK= 2
MARKER_TAG= wall
MARKER_ELEMS= 2
3 0 1 0
3 1 2 1
MARKER_TAG= points
MARKER_ELEMS= 1
1 3
FFD_NBOX= 1
FFD_TAG= box
0.0 0.0
FFD_CORNER_POINTS= 1
1.0 1.0
"""
MEDIT = b"""MeshVersionFormatted 2
Dimension 3
Vertices 4
0 0 0 1
1 0 0 1
0 1 0 2
0 0 1 3
Tetrahedra 1
1 2 3 4 9
TrianglesP2 1
1 2 3 1 2 3 4 # flat
Normals 1
0 0 1
NormalAtVertices 1
1 1
Ridges 1
1
SubDomainFromMesh 1
3 1 1 5
AngleOfCornerBound 40
BoundingBox 0 0 0 1 1 1
RequiredVertices 2
1 2
End
"""
OFF = b"# colours\nSTCNOFF 4 3 0\n0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n1 0\n2 0 1\n5 0 1 2 3 1 0.5 0.5\n"
VTK_OLD = (
    "METADATA\nINFORMATION 1\nNAME L2 LOCATION vtkDataArray\nDATA 2 0 1\n\nCELL_DATA 3\n"
    "FIELD FieldData 4\nmaterial%20id 1 3 int\n8 9 7\nMETADATA\nCOMPONENT_NAMES\na\n\n"
    "names 1 3 string\nfirst one\n\n\nbits 1 3 bit\n1 0 1\nNULL_ARRAY\n"
    "COLOR_SCALARS c 3\n0 .5 1 1 0 0 1 1 1\nLOOKUP_TABLE colours 2\n0 0 0 1 1 1 1 1\n"
    "POINT_DATA 4\nSCALARS s float 1\nLOOKUP_TABLE default\n1 nan -inf 4\nNORMALS n float\n0 0 1 0 0 1 0 0 1 0 0 1\n"
    "TEXTURE_COORDINATES t 2 float\n0 0 0 0 0 0 0 0\nTENSORS k double\n" + "0 " * 36 + "\n"
    "GLOBAL_IDS g vtkIdType\n5 6 7 8\n"
)
PARTITIONED = b"""$PartitionedEntities
2
1 9 1
1 0 1 0
5 0 5 1 2 0.5 0.5 0 1 7
21 2 21 2 1 2 0 0 0 1 1 0 1 3 1 5
$EndPartitionedEntities
"""
ABAQUS = b"""*PART, NAME=one
*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4
7, 1, 2, 3, 4
*ELEMENT, TYPE=U2
8, 1,
2, 3
9, 4, 1
*END PART
*EQUATION
2
1, 1, 1., 2, 1, -1.
*MPC
BEAM, 3, 4
*NSET, NSET=some, GENERATE
1, 9, 2
2, 3
*BOUNDARY
some, 1, 3
"""
NASTRAN = b"""GRID    1               0.      0.      0.
GRID    2               1.      0.      0.
GRID    3               0.      1.      0.
GRID    4               0.      0.      1.
GRID*   5                               5.-1            .5+0            *A
*A      0.
CTETRA  1       1       1       2       3       4       5       5       +B
+B      5       5       5       5
CQUAD8,2,1,1,2,3,4,5,,+
+,5,5
CTRIAX6 3       1       1       5       2       5       3       5
PSOLID,1,1
SPC1,1,123,1,thru,3
SPC1,1,123,4
SPC     1       1       3       0.      2       3       0.
RBE3    9               5       123     1.      123     1       2       +C
+C      3
CWELD   7       1       1       5       2
"""
ONE_CELL = b"\nCELLS 1 2\n" + bytes([0, 0, 0, 1, 0, 0, 0, 0]) + b"\nCELL_TYPES 1\n" + bytes([0, 0, 0, 1])
VTK_STRINGS = b"FIELD data 2\nnames 1 2 string\n\xc3abc\x80\x02de\nbits 1 9 bit\n\xaa\x80\n"
ENTITIES = '<FieldData><Array type="String" Name="who" format="ascii">65 0</Array></FieldData>'


def seeds() -> Iterator[tuple[str, bytes]]:
    """(key of the format, file) of every seed."""
    yield from (
        ("su2", data)
        for data in (test_su2.PLAIN, SU2, SU2.replace(b"\n", b"\r\n"), test_su2_periodic.PERIODIC, VOLUMES)
    )
    yield from (("medit", data) for data in (test_medit.PLAIN, MEDIT))
    yield from (("gmsh", data) for data in gmsh_variants.VARIANTS.values())
    yield from (
        ("gmsh", make(order, "cut")) for make in (test_gmsh_partitions.new, test_gmsh_partitions.old) for order in "<>"
    )
    yield "gmsh", gmsh_variants.new(groups={21: [3, 4], 22: [-4]})
    head, rest = gmsh_variants.new().split(b"$Entities")
    yield "gmsh", head + PARTITIONED + b"$Entities" + rest
    lines = gmsh_variants.old()
    yield "gmsh", lines.replace(b"2 3 21", b"9 3 21 1 2 3 4 5 6 7").replace(b" 2 7 11", b" 0")
    yield from (("off", data) for data in (test_off.PLAIN, OFF))
    yield "obj", test_obj.PLAIN
    yield "obj", test_obj.PLAIN.replace(b"\n", b"\r")
    yield "stl", test_stl.PLAIN
    yield "stl", test_stl.PLAIN.replace(b"0 0 5", b"0.0 +0 5e0").replace(b"1 1 5", b"1.00000000000000000001 1 5", 1)
    corners = np.array([[[0, 0, 1], [1, 0, 1], [1, 1, 1]], [[0, 0, 1], [1, 1, 1], [-0.0, 1, 1]]], dtype=np.float32)
    yield "stl", test_stl.binary_stl(corners)
    yield "triangle", PAIR.join((test_triangle.NODE, test_triangle.ELE))
    yield "triangle", PAIR.join((test_tetgen.NODE, test_tetgen.ELE))
    yield "triangle", PAIR.join((test_tetgen.NODE, b"1 10 0\n0 0 1 2 3 4 4 4 4 4 4\n"))
    yield "triangle", PAIR.join((test_triangle.NODE, b"1 6 0\n1 1 2 3 4 1 2\n"))
    for form in test_ply.ORDERS:
        for kind in ("float", "double"):
            yield "ply", test_ply.ply_file(form, kind)
            yield "ply", test_ply.ply_file(form, kind, [[0, 1, 4], [1, 2, 4]])
    yield "vtk", test_vtk.PLAIN.encode()
    yield "vtk", test_vtk.mesh_with("CELLS 3 11\n3 0 1 2 3 0 2 3 2 0 1\nCELL_TYPES 3\n5 7 4\n", VTK_OLD)
    binary = test_vtk.HEAD.format("3.0", "BINARY").encode()
    yield "vtk", binary + VTK_STRINGS + test_vtk.ONE_POINT.split(b"_GRID\n")[1] + ONE_CELL
    with tempfile.TemporaryDirectory() as folder:
        for single in (False, True):
            for grid in (grid_of(mixed_mesh(1), single), polydata_of(mixed_mesh(1), single)):
                yield from (("vtk", data) for _, data in legacy_variants(grid, Path(folder)))
        yield from (("vtk", data) for _, data in legacy_variants(polyhedral_grid()[0], Path(folder)))
    yield "vtu", test_vtu.PLAIN.encode()
    yield "vtu", test_vtu.PLAIN.replace("<Piece", ENTITIES + "<Piece").replace("Float64", "Float32").encode()
    for single in (False, True):
        yield from (("vtu", data) for _, data in vtu_variants(grid_of(mixed_mesh(1), single)))
    yield from (("vtu", data) for _, data in vtu_variants(polyhedral_grid()[0]))
    yield from (("abaqus", data) for data in (test_abaqus.PLAIN, test_abaqus.PARTS, ABAQUS))
    yield from (("nastran", data) for data in (test_nastran.PLAIN, NASTRAN))
    yield "ugrid", test_ugrid.PLAIN
    yield from (("ugrid", test_ugrid.in_form(key)) for key in test_ugrid.ugrid.FORMS)
    yield "ugrid", test_ugrid.in_form("b8") + b"more"
    for lists in (test_openfoam.VOLUMES, test_openfoam.layer(2, 2)):
        yield from (("openfoam", NEXT.join(make(lists).values())) for make in test_openfoam.FORMS.values())
    zone = "1(a{type %sZone;%sLabels List<label> 1{0};})"
    zones = [(test_openfoam.head("regIOobject", k) + zone % (k, k)).encode() for k in ("cell", "face", "point")]
    yield "openfoam", NEXT.join((*test_openfoam.in_text(test_openfoam.VOLUMES).values(), *zones))
    for version, order in test_periodic.FORMS:
        yield "gmsh", test_periodic.square(version, order)[0]
    yield "netgen", test_netgen.PLAIN.replace(b"face_colours", b"identifications\n2\n1 4 1\n2 3 1\nface_colours")
    flat = random_mesh(12, seed=1)
    flat = Mesh(np.column_stack([flat.points, np.zeros(len(flat.points))]), flat.cells)
    for version, order, ghosts in (("4.1", "", True), ("4.1", "<", False), ("2.2", "", False), ("2.2", ">", False)):
        yield "split", NEXT.join(gmsh_split.split(flat, 2, ghosts=ghosts, order=order, version=version))
    for case in (decomposed.block(2), decomposed.plane(3, 2)):
        for make in (test_openfoam.in_text, test_openfoam.in_binary):
            yield "decomposed", NEXT.join(case.parts([*decomposed.strips(case, 2), []], make).values())
    yield "fluent", test_fluent.PLAIN
    yield "fluent", test_fluent.VOLUME
    yield from (("fluent", data) for data in test_fluent.FORMS.values())
    yield "mfem", test_mfem.PLAIN
    yield "netgen", test_netgen.PLAIN
    yield "vtp", test_vtp.PLAIN
    yield "pvtu", NEXT.join(test_vtk_pieces.in_turn(test_vtk_pieces.SQUARES.values()))
    yield "pvtu", NEXT.join(test_vtk_pieces.in_turn(test_vtk_pieces.with_ghosts()))
    pair = [
        pieces.INDEX.format(pieces='<Piece Source="0.vtp"/><Piece Source="1.vtp"/>').encode(),
        *[test_vtp.PLAIN] * 2,
    ]
    yield "pvtp", NEXT.join(pair).replace(b"UnstructuredGrid", b"PolyData")
    _, *parts = test_vtk_pieces.in_turn(test_vtk_pieces.SQUARES.values())
    named = '<Block name="a"><DataSet name="b" file="0.vtu"/><Piece><DataSet file="1.vtu"/></Piece></Block>'
    yield "vtm", NEXT.join([pieces.BLOCKS.format(blocks=named).encode(), *parts])
    yield "xdmf", binary_meshes.xdmf()
    yield from (("xdmf", test_xdmf.tagged(*each)) for each in (test_xdmf.FACETS, test_xdmf.CELLS))
    for packed in (False, True):
        yield "cgns", binary_meshes.cgns(packed)
        yield "med", binary_meshes.med(packed)
        yield "vtkhdf", binary_meshes.vtkhdf(packed)
        yield "exodus", binary_meshes.exodus4(packed)
        yield "exodus", binary_meshes.exodus3(1 + packed, whole=packed)
    yield from (("cgns", make(packed)) for make in (binary_meshes.cgns_zones, binary_meshes.cgns_structured)
                for packed in (False, True))  # fmt: skip
    yield "cgns", binary_meshes.cgns(kind=np.float32, mixed=True)
    yield from _written()


def _written() -> Iterator[tuple[str, bytes]]:
    for mesh in (triangle_grid(1), triangle_grid(2, 3), mixed_mesh(1), test_volume_files.sample(1)):
        for key, entry in FORMATS.items():
            try:
                written = entry.load().write(mesh)
            except FormatError:  # cells that the format does not have
                continue
            yield key, PAIR.join(bytes(written.files[suffix]) for suffix in entry.suffixes)


def seeds_of(key: str) -> list[bytes]:
    """The seeds of one format."""
    return [data for name, data in seeds() if name == key]
