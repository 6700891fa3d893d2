"""Object File Format (``.off``): points and faces of any size, with or without colours, normals and texture."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, polygon_kinds
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, blank, fail, scan_rows, to_count, to_floats, to_ints, token, word
from gmsnet.mesh import CellBlock, Mesh

name = "OFF"
suffixes = (".off",)

_HEADER = re.compile(rb"(ST)?(C)?(N)?OFF")


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format. What follows the coordinates (normals, colours, texture) and the corners (colours) is kept."""
    data = files[".off"]
    text = blank(data, rb"#[^\r\n]*")
    head = scan_rows(text, 0, 1)
    if not _HEADER.fullmatch(token(text, head.spans[0])):
        fail(text, head.where(0), f"an OFF file must start with OFF, found {word(text, head.spans[0])}")
    counts, end = head.spans[1:], head.end
    if len(counts) and token(text, counts[0]) == b"BINARY":
        fail(text, head.where(0), "binary OFF cannot be read: save it as text")
    if not len(counts):
        line = scan_rows(text, end, 1)
        counts, end = line.spans, line.end
    if not 2 <= len(counts) <= 3:
        fail(text, end, f"the numbers of points, faces and edges were expected, found {len(counts)} words")
    number, faces = to_count(text, counts[0], "points"), to_count(text, counts[1], "faces")
    to_ints(text, counts)

    rows = scan_rows(text, end, number)
    odd = np.flatnonzero((rows.lengths < 3) | (rows.lengths != rows.lengths[:1]))
    if odd.size:
        found, usual = rows.lengths[odd[0]], max(3, int(rows.lengths[0]))
        fail(text, rows.where(int(odd[0])), f"a point takes {usual} numbers here, found {found} words")
    spans = np.stack([rows.column(j) for j in range(3)], axis=1)
    points = to_floats(text, spans)
    end = rows.end if len(rows) else end
    cell_rows = scan_rows(text, end, faces)
    cells = _faces(text, cell_rows, number)
    rest = scan_rows(text, cell_rows.end if len(cell_rows) else end)
    if len(rest):
        fail(text, rest.where(0), f"the file goes on behind the {number} points and {faces} faces that it announces")
    return Parsed(points, cells, TextSlots(spans[..., 0], spans[..., 1], np.arange(number)))


def _faces(text: bytes, rows: Rows, count: int) -> list[CellBlock]:
    sizes = to_ints(text, rows.column(0))
    bad = np.flatnonzero((sizes < 1) | (rows.lengths <= sizes))
    if bad.size:
        k = int(bad[0])
        fail(text, rows.where(k), f"a face with {sizes[k]} corners has {rows.lengths[k] - 1} numbers behind")
    place = np.arange(len(rows.spans)) - np.repeat(rows.first[:-1], rows.lengths)
    is_node = (place >= 1) & (place <= np.repeat(sizes, rows.lengths))
    to_floats(text, rows.spans[place > np.repeat(sizes, rows.lengths)])  # colours
    nodes = np.zeros(len(rows.spans), dtype=np.int64)
    nodes[is_node] = to_ints(text, rows.spans[is_node])
    check_nodes(text, rows.spans[is_node], nodes[is_node], count)
    kinds = {**polygon_kinds(sizes), 1: "vertex", 2: "line"}
    return cell_blocks(sizes, kinds, sizes, nodes, rows.first[:-1] + 1, np.zeros(len(rows), dtype=np.int64))[0]


def write(mesh: Mesh) -> Written:
    """See Format."""
    convert.check_kinds(mesh, name, ("triangle", "quad", "polygon", "line", "vertex"))
    faces = [block for block in mesh.cells if block.dimension == 2]
    if not any(len(block.nodes) for block in faces):
        raise FormatError("OFF holds faces only, and this mesh has none")
    rows = [f"{b.nodes.shape[1]} {row}" for b in faces for row in convert.integers(b.nodes)]
    lines = ["OFF", f"{len(mesh.points)} {len(rows)} 0", *convert.decimals(convert.in_space(mesh)), *rows]
    lost = convert.lost_cells(mesh, name, (0, 1)) + convert.lost_regions(mesh, name) + convert.lost_data(mesh, name)
    return Written({".off": ("\n".join(lines) + "\n").encode()}, lost)
