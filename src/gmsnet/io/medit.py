"""Medit meshes in text (``.mesh``), in two and three dimensions.

The file is one stream of words: a keyword, how many entries follow, the entries. The reference that ends a cell is
its region. The binary twin ``.meshb`` is not read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import check_nodes
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Spans, blank, fail, scan, to_count, to_floats, to_ints, token, word
from gmsnet.mesh import NODES, CellBlock, Mesh

name = "Medit"
suffixes = (".mesh",)

REFERENCE = "medit:ref"  # the point data that keeps the references of the vertices

KINDS = {
    "Edges": "line", "Triangles": "triangle", "Quadrilaterals": "quad", "Tetrahedra": "tetra",
    "Hexahedra": "hexahedron", "Prisms": "wedge", "Pyramids": "pyramid", "EdgesP2": "line3",
    "TrianglesP2": "triangle6", "QuadrilateralsQ2": "quad9", "TetrahedraP2": "tetra10",
}  # fmt: skip
# Nodes that must stay where they are become vertex cells: region and, as its name, the keyword.
HELD = {"Corners": 1, "RequiredVertices": 2, "RequiredTriangles": 3, "RequiredQuadrilaterals": 4}
# Entries that say nothing about where a free node may go: how many numbers each has (with the dimension added once).
SKIPPED = {
    "Ridges": 1, "RequiredEdges": 1, "NormalAtVertices": 2, "TangentAtVertices": 2, "NormalAtTriangleVertices": 3,
    "NormalAtQuadrilateralVertices": 3, "TangentAtEdges": 3, "VertexOnGeometricVertex": 2, "VertexOnGeometricEdge": 3,
    "VertexOnGeometricTriangle": 4, "VertexOnGeometricQuadrilateral": 4, "EdgeOnGeometricEdge": 2,
    "TriangleOnGeometricTriangle": 2, "TriangleOnGeometricQuadrilateral": 2,
    "QuadrilateralOnGeometricTriangle": 2, "QuadrilateralOnGeometricQuadrilateral": 2,
    "SubDomainFromMesh": 4, "SubDomainFromGeom": 4,
}  # fmt: skip
SKIPPED_VECTORS = ("Normals", "Tangents")
SKIPPED_VALUES = ("AngleOfCornerBound",)  # one number, no count
_WORD = re.compile(rb"\S")


class Entries(NamedTuple):
    """What follows a keyword: spans (n × width × 2) and numbers (n × width)."""

    key: str
    spans: Spans
    numbers: NDArray[np.int64]


class _Stream:
    """The words of the file, one section after another."""

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.at = 0

    def take(self, count: int) -> Spans:
        """The spans (count, 2) of the next words."""
        spans = scan(self.text, self.at, count)
        self.at = int(spans[-1, 1]) if count else self.at
        return spans

    def count(self, what: str) -> int:
        return to_count(self.text, self.take(1)[0], what)

    def keywords(self) -> Iterator[tuple[str, int]]:
        """Each keyword and where it stands, up to End or the end of the file."""
        while _WORD.search(self.text, self.at):
            span = self.take(1)[0]
            key = token(self.text, span)
            if not key[:1].isalpha():
                fail(self.text, int(span[0]), f"a keyword was expected, found {word(self.text, span)}")
            if key == b"End":
                return
            yield key.decode("ascii", "backslashreplace"), int(span[0])


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format. Corners and required vertices become vertex cells, as do the nodes of required faces."""
    data = files[".mesh"]
    text = blank(data, rb"#[^\r\n]*")
    stream, seen = _Stream(text), dict[str, int]()
    spans, references = np.empty((0, 0, 2), dtype=np.int64), np.empty(0, dtype=np.int64)
    points = np.empty((0, 2))
    entries: list[Entries] = []
    dimension = 0
    for key, at in stream.keywords():
        if key in seen:
            fail(text, at, f"{key} is given twice")
        seen[key] = at
        if key == "MeshVersionFormatted":
            version = stream.count("the version")
            if version not in (1, 2, 3, 4):
                fail(text, at, f"MeshVersionFormatted {version}: known are 1 to 4")
        elif key == "Dimension":
            dimension = stream.count("dimensions")
            if dimension not in (2, 3):
                fail(text, at, f"Dimension {dimension}: a mesh has 2 or 3")
        elif key in SKIPPED_VALUES:
            to_floats(text, stream.take(1))
        elif not dimension:
            fail(text, at, f"Dimension is missing before {key[:24]}")
        elif key == "Vertices":
            rows = stream.take(stream.count("vertices") * (dimension + 1)).reshape(-1, dimension + 1, 2)
            spans = rows[:, :dimension]
            points, references = to_floats(text, spans), to_ints(text, rows[:, dimension])
        elif key in KINDS or key in HELD:
            width = NODES[KINDS[key]] + 1 if key in KINDS else 1
            rows = stream.take(stream.count(key) * width).reshape(-1, width, 2)
            entries.append(Entries(key, rows, to_ints(text, rows)))
        elif key in SKIPPED or key in SKIPPED_VECTORS:
            width = SKIPPED.get(key, dimension)
            to_floats(text, stream.take(stream.count(key) * width))
        elif key == "BoundingBox":
            to_floats(text, stream.take(2 * dimension))
        else:
            fail(text, at, f"unknown keyword {key[:24]!r}")
    if "Vertices" not in seen:
        raise FormatError("Vertices are missing: the file is cut off or no Medit mesh")

    cells, names = _cells(text, entries, len(points))
    point_data = {REFERENCE: references} if references.any() else {}
    slots = TextSlots(spans[..., 0], spans[..., 1], np.arange(len(points)))
    return Parsed(points, cells, slots, names, point_data)


def _cells(text: bytes, entries: list[Entries], count: int) -> tuple[list[CellBlock], dict[tuple[int, int], str]]:
    """The cells, then the vertices that are held, with the names of these."""
    cells: list[CellBlock] = []
    names: dict[tuple[int, int], str] = {}
    for key, spans, numbers in entries:
        if key in KINDS:
            check_nodes(text, spans[:, :-1], numbers[:, :-1] - 1, count, base=1)
            cells.append(CellBlock(KINDS[key], numbers[:, :-1] - 1, numbers[:, -1]))
    faces = {block.kind: block.nodes for block in cells}
    for key, spans, numbers in entries:
        if key in HELD:
            nodes = numbers - 1
            if key.endswith("Vertices") or key == "Corners":
                check_nodes(text, spans, nodes, count, base=1)
            else:
                of = faces.get(KINDS[key.removeprefix("Required")], np.empty((0, 1), dtype=np.int64))
                _check_faces(text, key, spans, nodes, len(of))
                nodes = np.unique(of[nodes.ravel()]).reshape(-1, 1)
            cells.append(CellBlock("vertex", nodes, np.full(len(nodes), HELD[key])))
            names[0, HELD[key]] = key
    return cells, names


def _check_faces(text: bytes, key: str, spans: Spans, faces: NDArray[np.int64], count: int) -> None:
    bad = np.flatnonzero(((faces < 0) | (faces >= count)).ravel())
    if bad.size:
        number = int(faces.ravel()[bad[0]]) + 1
        fail(text, int(spans.reshape(-1, 2)[bad[0], 0]), f"{key} names the face {number}, but there are {count}")


def write(mesh: Mesh) -> Written:
    """See Format. Regions and markers become references."""
    convert.check_kinds(mesh, name, [*KINDS.values(), "vertex"])
    names = {kind: key for key, kind in KINDS.items()}
    points = convert.decimals(mesh.points)
    references = mesh.point_data.get(REFERENCE, np.zeros(len(points), dtype=np.int64))
    lines = ["MeshVersionFormatted 2", f"Dimension {mesh.points.shape[1]}", "Vertices", str(len(points))]
    lines += [f"{row} {reference}" for row, reference in zip(points, references.tolist(), strict=True)]
    sections: dict[str, list[str]] = {}
    lost_vertices = 0
    for block in mesh.cells:
        if block.kind != "vertex":
            rows = np.column_stack([block.nodes + 1, block.regions])
            sections.setdefault(names[block.kind], []).extend(convert.integers(rows))
            continue
        for region in np.unique(block.regions).tolist():
            key = convert.marker_name(mesh, 0, region)
            kept = key if key in ("Corners", "RequiredVertices") else "RequiredVertices"
            lost_vertices += kept != key
            rows = block.nodes[block.regions == region] + 1
            sections.setdefault(kept, []).extend(convert.integers(rows))
    for key, entries in sections.items():
        lines += [key, str(len(entries)), *entries]
    lines.append("End")
    lost = convert.lost_names(mesh, name, (1, 2, 3)) + convert.lost_data(mesh, name, kept=(REFERENCE,), regions=True)
    if lost_vertices:
        lost.append(f"{name} has no markers of vertices: {lost_vertices} of them became RequiredVertices")
    return Written({".mesh": ("\n".join(lines) + "\n").encode()}, lost)
