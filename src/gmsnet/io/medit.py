"""Medit meshes in text (``.mesh``), in two and three dimensions.

The file is one stream of words: a keyword, how many entries follow, the entries. The reference that ends a cell is
its region. The binary twin ``.meshb`` is not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import convert
from gmsnet.io.cells import check_nodes, distinct, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.medit_orders import BY_GMSH, ORDERINGS, WIDER, as_written, order_of
from gmsnet.io.medit_sections import HELD, KINDS, SKIPPED, SKIPPED_VALUES, SKIPPED_VECTORS, Contents, Entries
from gmsnet.io.normals import Normals, in_text
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.text import Starts, Text
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import FaceCorners

name = "Medit"
suffixes: tuple[str, ...] = (".mesh",)

REFERENCE = "medit:ref"  # the point data that keeps the references of the vertices


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Corners and required vertices become vertex cells, as do the nodes of required faces."""
    text = Text(files[".mesh"], b"#")
    found = Contents(text)
    cells, names = _cells(text, found.entries, len(found.points), found.told)
    point_data = {REFERENCE: found.references} if found.references.any() else {}
    unread = [key for key in found.seen if key in (*SKIPPED, *SKIPPED_VECTORS, *SKIPPED_VALUES, "BoundingBox")]
    return Parsed(found.points, cells, found.slots, names, point_data, unread=unread)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``. A normal is that of all vertices, and of all corners of faces, that name it."""
    text = Text(files[".mesh"], b"#")
    found, corners = Contents(text), FaceCorners.of(cells)
    starts = found.others.get("Normals", np.empty((0, 0), dtype=np.int32))
    if not len(starts) or found.dimension != 3:
        return []

    def named(key: str) -> NDArray[np.int64]:
        """What a section names, as numbers from 0, without what names no normal."""
        rows = text.integers(found.others.get(key, np.empty((0, SKIPPED[key]), dtype=np.int32))) - 1
        return rows[(rows[:, -1] >= 0) & (rows[:, -1] < len(starts)) & (rows[:, 0] >= 0)]

    of_node = np.full(len(found.points), -1, dtype=np.int64)
    of_nodes = named("NormalAtVertices")
    of_nodes = of_nodes[of_nodes[:, 0] < len(of_node)]
    of_node[of_nodes[:, 0]] = of_nodes[:, 1]
    row, first = of_node[corners.node], 0
    for block in cells:
        if block.dimension == 2:
            kind = {"triangle": "Triangle", "quad": "Quadrilateral"}.get(block.kind)
            size = block.corners * len(block.nodes)
            if kind:
                of_faces = named(f"NormalAt{kind}Vertices")
                of_faces = of_faces[(of_faces[:, 0] < len(block.nodes)) & np.isin(of_faces[:, 1], range(block.corners))]
                row[first + block.corners * of_faces[:, 0] + of_faces[:, 1]] = of_faces[:, 2]
            first += size
    return [in_text("Normals", text, starts, row)]


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
                nodes = sorted_unique(of[nodes.ravel()]).reshape(-1, 1)
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
