"""Wavefront OBJ (``.obj``): points, faces of any size, polylines, points as cells.

The region of a cell is its material (``usemtl``) together with its group (``g``).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, polygon_kinds
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Spans, before_slash, blank, fail, gather, scan_rows, to_floats, to_ints, token, word
from gmsnet.mesh import CellBlock, Mesh

name = "OBJ"
suffixes = (".obj",)

KEYS = (b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib")
FACE, LINE, POINT = 0, 1, 2
LEAST = {b"f": 3, b"l": 2, b"p": 1}  # nodes
KINDS = ("triangle", "quad", "polygon", "line", "vertex")


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format. Polylines become lines, each ``p`` the vertices it names. The file has no counts: a file that is
    cut exactly between two lines reads without its end.
    """
    data = files[".obj"]
    text = blank(data, rb"#[^\r\n]*")
    rows = scan_rows(text, 0)
    _no_broken_lines(text, rows)
    heads = rows.column(0)
    keys = gather(text, np.stack([heads[:, 0], np.minimum(heads[:, 1], heads[:, 0] + 8)], axis=1))
    unknown = np.flatnonzero(~np.isin(keys, KEYS))
    if unknown.size:
        k = int(unknown[0])
        fail(text, rows.where(k), f"a line that starts with {word(text, heads[k])} cannot be read here")

    is_point = keys == b"v"
    spans = _coordinates(text, rows, is_point)
    points = to_floats(text, spans)
    regions, names = _regions(text, rows, keys)
    cells = _cells(text, rows, keys, np.cumsum(is_point), len(points), regions)
    used = {(b.dimension, r) for b in cells for r in np.unique(b.regions).tolist()}
    region_names = {(dim, r): names[r] for dim, r in sorted(used) if names[r]}
    return Parsed(points, cells, TextSlots(spans[..., 0], spans[..., 1], np.arange(len(points))), region_names)


def _no_broken_lines(text: bytes, rows: Rows) -> None:
    last = rows.spans[rows.first[1:] - 1]
    broken = np.frombuffer(text, np.uint8)[last[:, 1] - 1] == ord("\\")
    if broken.any():
        where = rows.where(int(np.flatnonzero(broken)[0]))
        fail(text, where, "a line that goes on in the next one (\\) cannot be read: join the two")


def _coordinates(text: bytes, rows: Rows, is_point: NDArray[np.bool_]) -> Spans:
    """(points × 3) spans; a weight, or a colour, may follow the coordinates."""
    lengths = rows.lengths[is_point] - 1
    bad = np.flatnonzero(~np.isin(lengths, (3, 4, 6, 7)))
    if bad.size:
        where = rows.where(int(np.flatnonzero(is_point)[bad[0]]))
        fail(text, where, f"three coordinates (and a weight or a colour) were expected, found {lengths[bad[0]]} words")
    first = rows.first[:-1][is_point]
    spans: Spans = rows.spans[first[:, None] + np.arange(1, 4)]
    for j in range(4, 8):  # what follows must be numbers as well, or else a line was cut or joined
        to_floats(text, rows.spans[first[lengths >= j] + j])
    return spans


def _regions(text: bytes, rows: Rows, keys: NDArray[np.bytes_]) -> tuple[NDArray[np.int64], list[str]]:
    """The region of each row (material and group that hold there) and the regions' names; 0 has none."""
    state: dict[bytes, str] = {}
    known = {("", ""): 0}
    changes = np.flatnonzero((keys == b"usemtl") | (keys == b"g"))
    numbers = [0]
    for k in changes.tolist():
        words = [token(text, span) for span in rows.row(k)]
        state[words[0]] = b" ".join(words[1:]).decode("utf-8", "backslashreplace")
        numbers.append(known.setdefault((state.get(b"usemtl", ""), state.get(b"g", "")), len(known)))
    state_of_row = np.searchsorted(changes, np.arange(len(rows)), side="right")
    regions: NDArray[np.int64] = np.array(numbers, dtype=np.int64)[state_of_row]
    return regions, [" / ".join(filter(None, pair)) for pair in known]


def _cells(
    text: bytes,
    rows: Rows,
    keys: NDArray[np.bytes_],
    points_before: NDArray[np.int64],
    count: int,
    regions: NDArray[np.int64],
) -> list[CellBlock]:
    """Faces, lines and points in the order of the file. A negative number counts back from the last point so far."""
    sizes = rows.lengths - 1
    row_type = np.full(len(rows), -1)
    for kind, key in enumerate(LEAST):
        row_type[keys == key] = kind
        short = np.flatnonzero((keys == key) & (sizes < LEAST[key]))
        if short.size:
            k = int(short[0])
            fail(text, rows.where(k), f"'{key.decode()}' takes at least {LEAST[key]} nodes, found {sizes[k]}")
    of_row = np.repeat(np.arange(len(rows)), rows.lengths)
    is_node = row_type[of_row] >= 0
    is_node[rows.first[:-1]] = False
    chosen = rows.spans[is_node]
    spans = before_slash(text, chosen)
    named = to_ints(text, spans)
    zero = np.flatnonzero(named == 0)
    if zero.size:
        fail(text, int(spans[zero[0], 0]), "a node numbered 0: nodes count from 1")
    nodes = np.where(named > 0, named - 1, named + points_before[of_row[is_node]])
    bad = np.flatnonzero((named < 0) & (nodes < 0))
    if bad.size:
        fail(text, int(spans[bad[0], 0]), f"the node {named[bad[0]]} reaches back before the first point")
    check_nodes(text, spans, nodes, count, base=1)

    flat = np.zeros(len(rows.spans), dtype=np.int64)
    flat[is_node] = nodes
    behind = rows.first[1:][of_row]  # the token behind the row
    token_type = np.where(is_node, row_type[of_row], -1)
    starts_line = (token_type == LINE) & (np.arange(len(flat)) + 1 < behind)
    first = np.concatenate(
        [rows.first[:-1][row_type == FACE] + 1, np.flatnonzero(starts_line), np.flatnonzero(token_type == POINT)]
    )
    faces, lines = int((row_type == FACE).sum()), int(starts_line.sum())
    size = np.ones(len(first), dtype=np.int64)
    size[:faces] = sizes[row_type == FACE]
    size[faces : faces + lines] = 2
    codes = np.where(np.arange(len(first)) < faces, size, -1 * size)  # lines are -2, points -1
    kinds = {**polygon_kinds(size[:faces]), -2: "line", -1: "vertex"}
    order = np.argsort(first)
    first, size, codes = first[order], size[order], codes[order]
    return cell_blocks(codes, kinds, size, flat, first, regions[of_row[first]])[0]


def write(mesh: Mesh) -> Written:
    """See Format. Regions become groups."""
    convert.check_kinds(mesh, name, KINDS)
    lines = ["v " + row for row in convert.decimals(convert.in_space(mesh))]
    group = ""
    for block in mesh.cells:
        key = {0: "p ", 1: "l ", 2: "f "}[block.dimension]
        rows = [key + row for row in convert.integers(block.nodes + 1)]
        cuts = np.flatnonzero(np.diff(block.regions)) + 1
        for part in np.split(np.arange(len(rows)), cuts):
            if len(part):
                region = int(block.regions[part[0]])
                wanted = "g " + " ".join(convert.marker_name(mesh, block.dimension, region).split())
                if wanted != group and (group or region or (block.dimension, region) in mesh.region_names):
                    lines.append(wanted)
                    group = wanted
                lines += rows[part[0] : part[-1] + 1]
    return Written({".obj": ("\n".join(lines) + "\n").encode()}, convert.lost_data(mesh, name, regions=True))
