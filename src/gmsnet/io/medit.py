"""Medit meshes in text (``.mesh``), in two and three dimensions.

The file is one stream of words: a keyword, how many entries follow, the entries. The reference that ends a cell is
its region. The binary twin ``.meshb`` is not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import check_nodes, distinct, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.medit_orders import BY_GMSH, ORDERINGS, WIDER, as_written, lattice, order_of
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Starts, Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "Medit"
suffixes: tuple[str, ...] = (".mesh",)

REFERENCE = "medit:ref"  # the point data that keeps the references of the vertices

KINDS = {
    "Edges": "line", "Triangles": "triangle", "Quadrilaterals": "quad", "Tetrahedra": "tetra",
    "Hexahedra": "hexahedron", "Prisms": "wedge", "Pyramids": "pyramid", "EdgesP2": "line3",
    "TrianglesP2": "triangle6", "QuadrilateralsQ2": "quad9", "TetrahedraP2": "tetra10", "HexahedraQ2": "hexahedron27",
    "PrismsP2": "wedge18", "PyramidsP2": "pyramid14",
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


class Entries(NamedTuple):
    """What follows a keyword: tokens (n × width), and the numbers of nodes (or faces) and references of each entry.

    kind: of cells; "" of others.
    """

    key: str
    kind: str
    starts: Starts
    nodes: NDArray[np.int64]
    references: NDArray[np.int64]


class _Stream:
    """The words of the file, one section after another."""

    def __init__(self, text: Text) -> None:
        self.text = text
        self.at = 0

    def take(self, count: int) -> Starts:
        """The next words."""
        starts, self.at = self.text.tokens(self.at, count)
        return starts

    def count(self, what: str) -> int:
        return self.text.count(self.take(1)[0], what)

    def cells(self, key: str) -> tuple[str, Starts]:
        """The kind of the cells that follow a keyword, and their words: (n, nodes and reference).

        Gmsh does not say which of its orders cells have, so that what tells is where the next keyword stands.
        """
        kind, count, begin = KINDS[key], self.count(key), self.at
        rows = self.take(count * (nodes_of(kind) + 1))
        if count and key in WIDER and (behind := self.text.next(self.at)) and not self._is_keyword(behind[0]):
            words, _ = self.text.tokens(begin)
            for wider in WIDER[key]:
                end = count * (nodes_of(wider) + 1)
                if end < len(words) and self._is_keyword(words[end]):  # at the end of the file it may be cut off
                    self.at = begin
                    return wider, self.take(end).reshape(count, -1)
        return kind, rows.reshape(count, -1)

    def _is_keyword(self, start: int) -> bool:
        return self.text.token(start)[:1].isalpha()

    def keywords(self) -> Iterator[tuple[str, int]]:
        """Each keyword and where it stands, up to End or the end of the file."""
        while (found := self.text.next(self.at)) is not None:
            start, self.at = found
            key = self.text.token(start)
            if not key[:1].isalpha():
                self.text.fail(start, f"a keyword was expected, found {self.text.word(start)}")
            if key == b"End":
                return
            yield key.decode("ascii", "backslashreplace"), start


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Corners and required vertices become vertex cells, as do the nodes of required faces."""
    text = Text(files[".mesh"], b"#")
    stream, seen = _Stream(text), dict[str, int]()
    none = np.empty((0, 0), dtype=np.int32)
    slots, references = TextSlots(none, none), np.empty(0, dtype=np.int64)
    points = np.empty((0, 2))
    entries: list[Entries] = []
    told: dict[str, NDArray[np.int64]] = {}
    dimension = 0
    for key, at in stream.keywords():
        if key in seen:
            text.fail(at, f"{key} is given twice")
        seen[key] = at
        if key == "MeshVersionFormatted":
            version = stream.count("the version")
            if version not in (1, 2, 3, 4):
                text.fail(at, f"MeshVersionFormatted {version}: known are 1 to 4")
        elif key == "Dimension":
            dimension = stream.count("dimensions")
            if dimension not in (2, 3):
                text.fail(at, f"Dimension {dimension}: a mesh has 2 or 3")
        elif key in SKIPPED_VALUES:
            text.floats(stream.take(1))
        elif not dimension:
            text.fail(at, f"Dimension is missing before {text.word(at)}")
        elif key == "Vertices":
            rows = stream.take(stream.count("vertices") * (dimension + 1)).reshape(-1, dimension + 1)
            points, ends = text.spans(starts := np.ascontiguousarray(rows[:, :dimension]))
            slots, references = TextSlots(starts, ends), text.integers(rows[:, dimension])
        elif key in KINDS:
            kind, rows = stream.cells(key)
            nodes = text.integers(rows[:, :-1])
            nodes -= 1
            entries.append(Entries(key, kind, rows[:, :-1], nodes, text.integers(rows[:, -1])))
        elif key in HELD:
            rows = stream.take(stream.count(key)).reshape(-1, 1)
            nodes = text.integers(rows)
            nodes -= 1
            entries.append(Entries(key, "", rows, nodes, np.empty(0, dtype=np.int64)))
        elif key in ORDERINGS:
            told[ORDERINGS[key]] = _ordering(text, stream, key)
        elif key in SKIPPED or key in SKIPPED_VECTORS:
            width = SKIPPED.get(key, dimension)
            text.floats(stream.take(stream.count(key) * width))
        elif key == "BoundingBox":
            text.floats(stream.take(2 * dimension))
        else:
            text.fail(at, f"unknown keyword {text.word(at)}")
    if "Vertices" not in seen:
        raise FormatError("Vertices are missing: the file is cut off or no Medit mesh")

    cells, names = _cells(text, entries, len(points), told)
    point_data = {REFERENCE: references} if references.any() else {}
    unread = [key for key in seen if key in (*SKIPPED, *SKIPPED_VECTORS, *SKIPPED_VALUES, "BoundingBox")]
    return Parsed(points, cells, slots, names, point_data, unread=unread)


def _ordering(text: Text, stream: _Stream, key: str) -> NDArray[np.int64]:
    """(nodes, axes) where the nodes of a kind of cell lie, in the order of the file."""
    kind = KINDS[ORDERINGS[key]]
    count, axes = lattice(ORDERINGS[key], kind).shape
    if (found := stream.count("the nodes of a cell")) != count:
        text.fail(int(stream.take(1)[0]), f"{key} lists {found} nodes, and these cells have {count}")
    starts = stream.take(count * axes)
    told = text.integers(starts).reshape(count, axes)
    try:
        order_of(ORDERINGS[key], kind, told)
    except ValueError:
        text.fail(int(starts[0]), f"{key} does not name each node of the cell once")
    return told


def _cells(
    text: Text, entries: list[Entries], count: int, told: Mapping[str, NDArray[np.int64]]
) -> tuple[list[CellBlock], dict[tuple[int, int], str]]:
    """The cells, then the vertices that are held, with the names of these. ``told``: the orders that the file tells."""
    cells: list[CellBlock] = []
    names: dict[tuple[int, int], str] = {}
    faces: dict[str, NDArray[np.int64]] = {}
    for key, kind, starts, nodes, references in entries:
        if kind:
            check_nodes(text, starts, nodes, count, base=1)
            order = order_of(key, kind, told.get(key)) if key in ORDERINGS.values() else None
            order = BY_GMSH.get(kind) if kind in WIDER.get(key, ()) else order
            faces[key] = nodes if order is None else np.ascontiguousarray(nodes[:, order])
            cells.append(CellBlock(kind, sealed(faces[key]), sealed(references)))
    for key, _, starts, nodes, _ in entries:
        if key in HELD:
            if key.endswith("Vertices") or key == "Corners":
                check_nodes(text, starts, nodes, count, base=1)
            else:
                of = faces.get(key.removeprefix("Required"), np.empty((0, 1), dtype=np.int64))
                _check_faces(text, key, starts, nodes, len(of))
                nodes = np.unique(of[nodes.ravel()]).reshape(-1, 1)
            cells.append(CellBlock("vertex", nodes, np.full(len(nodes), HELD[key])))
            names[0, HELD[key]] = key
    return cells, names


def _check_faces(text: Text, key: str, starts: Starts, faces: NDArray[np.int64], count: int) -> None:
    bad = np.flatnonzero(((faces < 0) | (faces >= count)).ravel())
    if bad.size:
        number = int(faces.ravel()[bad[0]]) + 1
        text.fail(int(starts.reshape(-1)[bad[0]]), f"{key} names the face {number}, but there are {count}")


def write(mesh: Mesh) -> Written:
    """See Format. Regions and markers become references."""
    convert.check_kinds(mesh, name, [*KINDS.values(), "vertex"])
    sections, lost_vertices = _sections(mesh)
    lost = convert.lost_names(mesh, name, (1, 2, 3)) + convert.lost_data(mesh, name, kept=(REFERENCE,), regions=True)
    if lost_vertices:
        lost.append(f"{name} has no markers of vertices: {lost_vertices} of them became RequiredVertices")
    return Written({".mesh": Pieces(lambda: _text(mesh, sections))}, lost)


_Sections = dict[str, list[tuple[NDArray[np.int64], ...]]]  # keyword → columns of numbers


def _sections(mesh: Mesh) -> tuple[_Sections, int]:
    """The cells by keyword, and the number of markers of vertices that have none of their own."""
    names = {kind: key for key, kind in KINDS.items()}
    sections: _Sections = {}
    lost = 0
    for block in mesh.cells:
        if block.kind != "vertex":
            key = names[block.kind]
            sections.setdefault(key, []).append((as_written(key, block.nodes), block.regions))
            continue
        for region in distinct(block.regions):
            key = convert.marker_name(mesh, 0, region)
            kept = key if key in ("Corners", "RequiredVertices") else "RequiredVertices"
            lost += kept != key
            sections.setdefault(kept, []).append((block.nodes[block.regions == region],))
    return sections, lost


def _text(mesh: Mesh, sections: _Sections) -> Iterator[Piece]:
    count, dimension = mesh.points.shape
    yield b"MeshVersionFormatted 2\nDimension %d\nVertices\n%d\n" % (dimension, count)
    references = mesh.point_data.get(REFERENCE, np.zeros(count, dtype=np.int64))
    yield from convert.rows(convert.row_of(dimension + 1), mesh.points, references)
    for key, parts in sections.items():
        yield b"%s\n%d\n" % (key.encode(), sum(len(nodes) for nodes, *_ in parts))
        for nodes, *regions in parts:
            yield from convert.rows(convert.row_of(nodes.shape[1] + len(regions)), nodes + 1, *regions)
    yield b"End\n"
