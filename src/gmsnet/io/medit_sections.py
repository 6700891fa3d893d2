"""The sections of a Medit mesh: a keyword, how many entries follow, the entries."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.medit_orders import ORDERINGS, WIDER, lattice, order_of
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Starts, Text

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
        return kind, rows.reshape(count, nodes_of(kind) + 1)

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


class Contents:
    """The sections of a file. seen: where each keyword stands; others: the words of those that say nothing of cells."""

    def __init__(self, text: Text) -> None:
        none = np.empty((0, 0), dtype=np.int32)
        self.slots, self.references, self.points = TextSlots(none, none), np.empty(0, np.int64), np.empty((0, 2))
        self.entries: list[Entries] = []
        self.told: dict[str, NDArray[np.int64]] = {}
        self.seen: dict[str, int] = {}
        self.others: dict[str, Starts] = {}
        self.dimension = 0
        stream = _Stream(text)
        for key, at in stream.keywords():
            if key in self.seen:
                text.fail(at, f"{key} is given twice")
            self.seen[key] = at
            self._take(text, stream, key, at)
        if "Vertices" not in self.seen:
            raise FormatError("Vertices are missing: the file is cut off or no Medit mesh")

    def _take(self, text: Text, stream: _Stream, key: str, at: int) -> None:
        """The section of a keyword."""
        dimension = self.dimension
        if key == "MeshVersionFormatted":
            version = stream.count("the version")
            if version not in (1, 2, 3, 4):
                text.fail(at, f"MeshVersionFormatted {version}: known are 1 to 4")
        elif key == "Dimension":
            self.dimension = stream.count("dimensions")
            if self.dimension not in (2, 3):
                text.fail(at, f"Dimension {self.dimension}: a mesh has 2 or 3")
        elif key in SKIPPED_VALUES:
            text.floats(stream.take(1))
        elif not dimension:
            text.fail(at, f"Dimension is missing before {text.word(at)}")
        elif key == "Vertices":
            rows = stream.take(stream.count("vertices") * (dimension + 1)).reshape(-1, dimension + 1)
            self.points, ends = text.spans(starts := np.ascontiguousarray(rows[:, :dimension]))
            self.slots, self.references = TextSlots(starts, ends), text.integers(rows[:, dimension])
        elif key in KINDS:
            kind, rows = stream.cells(key)
            nodes = text.integers(rows[:, :-1])
            nodes -= 1
            self.entries.append(Entries(key, kind, rows[:, :-1], nodes, text.integers(rows[:, -1])))
        elif key in HELD:
            rows = stream.take(stream.count(key)).reshape(-1, 1)
            nodes = text.integers(rows)
            nodes -= 1
            self.entries.append(Entries(key, "", rows, nodes, np.empty(0, dtype=np.int64)))
        elif key in ORDERINGS:
            self.told[ORDERINGS[key]] = _ordering(text, stream, key)
        elif key in SKIPPED or key in SKIPPED_VECTORS:
            width = SKIPPED.get(key, dimension)
            self.others[key] = stream.take(stream.count(key) * width).reshape(-1, width)
            text.floats(self.others[key])
        elif key == "BoundingBox":
            text.floats(stream.take(2 * dimension))
        else:
            text.fail(at, f"unknown keyword {text.word(at)}")


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
