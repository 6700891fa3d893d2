"""Object File Format (``.off``): points and faces of any size, with or without colours, normals and texture."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, polygon_kinds
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_text
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import ranges
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import FaceCorners

name = "OFF"
suffixes: tuple[str, ...] = (".off",)

_HEADER = re.compile(rb"(ST)?(C)?(N)?OFF")


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. What follows the coordinates (normals, colours, texture) and the corners (colours) is kept."""
    text = Text(files[".off"], b"#")
    rows, end, faces, _ = _points_in(text)
    number = len(rows)
    points, ends = text.spans(starts := rows.columns(0, 3))
    cell_rows = text.rows(end, faces)
    cells = _faces(text, cell_rows, number)
    sizes = text.integers(cell_rows.column(0))
    unread = ["normals, colours or texture of points"] * bool((rows.lengths > 3).any())
    unread += ["colours of faces"] * bool((cell_rows.lengths > 1 + sizes).any())
    rest = text.rows(cell_rows.end if len(cell_rows) else end)
    if len(rest):
        text.fail(rest.where(0), f"the file goes on behind the {number} points and {faces} faces that it announces")
    return Parsed(points, cells, TextSlots(starts, ends), unread=unread)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    text = Text(files[".off"], b"#")
    rows, _, _, has_normals = _points_in(text)
    if not has_normals or (rows.lengths < 6).any():
        return []
    return [in_text("of points", text, rows.columns(3, 3), FaceCorners.of(cells).node)]


def _points_in(text: Text) -> tuple[Rows, int, int, bool]:
    """The lines of the points, the byte behind them, the number of faces, and whether normals follow the points."""
    head = text.rows(0, 1)
    if not (header := _HEADER.fullmatch(text.token(head.starts[0]))):
        text.fail(head.where(0), f"an OFF file must start with OFF, found {text.word(head.starts[0])}")
    counts, end = head.starts[1:], head.end
    if len(counts) and text.token(counts[0]) == b"BINARY":
        text.fail(head.where(0), "binary OFF cannot be read: save it as text")
    if not len(counts):
        line = text.rows(end, 1)
        counts, end = line.starts, line.end
    if not 2 <= len(counts) <= 3:
        text.fail(end, f"the numbers of points, faces and edges were expected, found {len(counts)} words")
    number, faces = text.count(counts[0], "points"), text.count(counts[1], "faces")
    text.integers(counts)

    rows = text.rows(end, number)
    odd = np.flatnonzero((rows.lengths < 3) | (rows.lengths != rows.lengths[:1]))
    if odd.size:
        found, usual = rows.lengths[odd[0]], max(3, int(rows.lengths[0]))
        text.fail(rows.where(int(odd[0])), f"a point takes {usual} numbers here, found {found} words")
    return rows, rows.end if len(rows) else end, faces, bool(header[3])


def _faces(text: Text, rows: Rows, count: int) -> list[CellBlock]:
    sizes = text.integers(rows.column(0))
    bad = np.flatnonzero((sizes < 1) | (rows.lengths <= sizes))
    if bad.size:
        k = int(bad[0])
        text.fail(rows.where(k), f"a face with {sizes[k]} corners has {rows.lengths[k] - 1} numbers behind")
    nodes, found = np.empty(int(sizes.sum()), dtype=np.int64), 0
    for k, part in rows.parts():
        size = sizes[k : k + len(part)]
        if (colours := part.lengths - 1 - size).any():
            text.floats(part.starts[ranges(part.first[:-1] + 1 + size, colours)])
        starts = part.inner(part.starts, 1, size)
        some = nodes[found : found + len(starts)]
        some[:] = text.integers(starts)
        found += len(starts)
        check_nodes(text, starts, some, count)
    kinds = {**polygon_kinds(sizes), 1: "vertex", 2: "line"}
    return cell_blocks(sizes, kinds, sizes, nodes, np.zeros(len(rows), dtype=np.int64))[0]


def write(mesh: Mesh) -> Written:
    """See Format."""
    convert.check_kinds(mesh, name, ("triangle", "quad", "polygon", "line", "vertex"))
    if not any(len(block.nodes) for block in mesh.cells if block.dimension == 2):
        raise FormatError("OFF holds faces only, and this mesh has none")
    lost = convert.lost_cells(mesh, name, (0, 1)) + convert.lost_regions(mesh, name) + convert.lost_data(mesh, name)
    return Written({".off": Pieces(lambda: _text(mesh))}, lost)


def _text(mesh: Mesh) -> Iterator[Piece]:
    faces = [block.nodes for block in mesh.cells if block.dimension == 2]
    yield b"OFF\n%d %d 0\n" % (len(mesh.points), sum(map(len, faces)))
    yield from convert.rows(b"% % %\n", convert.in_space(mesh))
    for nodes in faces:
        yield from convert.rows(b"%d " % nodes.shape[1] + convert.row_of(nodes.shape[1]), nodes)
