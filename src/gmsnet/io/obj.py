"""Wavefront OBJ (``.obj``): points, faces of any size, polylines, points as cells.

The region of a cell is its material (``usemtl``) together with its group (``g``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, distinct, polygon_kinds
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_text
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import ranges
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Starts, Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "OBJ"
suffixes: tuple[str, ...] = (".obj",)

KEYS = (b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib")
POINT, NORMAL, GROUP, MATERIAL = (KEYS.index(key) for key in (b"v", b"vn", b"g", b"usemtl"))
LEAST = {KEYS.index(b"f"): 3, KEYS.index(b"l"): 2, KEYS.index(b"p"): 1}  # nodes
FACE, LINE, DOT = LEAST
OTHERS = {b"vt": "texture (vt)", b"vn": "normals (vn)", b"vp": "parameters (vp)", b"o": "objects (o)",
          b"s": "smoothing groups (s)", b"mtllib": "the library of its materials (mtllib)"}  # fmt: skip
_BACKSLASH = re.compile(rb"\\(?=[\s#]|\Z)")  # at the end of a word
KINDS = ("triangle", "quad", "polygon", "line", "vertex")


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Polylines become lines, each ``p`` the vertices it names. The file has no counts: a file that is
    cut exactly between two lines reads without its end.
    """
    text = Text(files[".obj"], b"#")
    rows = text.rows(0)
    _no_broken_lines(text, rows)
    keys = _keys(text, rows)
    starts = _coordinates(text, rows, keys == POINT)
    points, ends = text.spans(starts)
    regions, names = _regions(text, rows, keys)
    cells = _cells(text, rows, keys, len(points), regions)
    used = {(b.cell.dimension, r) for b in cells for r in distinct(b.regions)}
    region_names = {(dim, r): names[r] for dim, r in sorted(used) if names[r]}
    return Parsed(points, cells, TextSlots(starts, ends), region_names, unread=_unread(rows, keys))


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``. A normal is that of all corners of faces that name it."""
    text = Text(files[".obj"], b"#")
    rows = text.rows(0)
    keys = _keys(text, rows)
    first, faces = rows.first[:-1].astype(np.int64), keys == FACE
    chosen = keys == NORMAL
    if not chosen.any():
        return []
    if (short := np.flatnonzero(chosen & (rows.lengths != 4))).size:
        text.fail(rows.where(int(short[0])), f"'vn' takes three numbers, found {rows.lengths[short[0]] - 1}")
    starts = rows.starts[first[chosen][:, None] + np.arange(1, 4)]
    corners = rows.starts[ranges(first[faces] + 1, rows.lengths[faces].astype(np.int64) - 1)]
    named = _third(text, corners)
    before = np.repeat(np.cumsum(chosen)[faces], rows.lengths[faces] - 1)
    row = np.where(named > 0, named - 1, np.where(named < 0, before + named, -1))
    if (bad := np.flatnonzero((row >= len(starts)) | ((named < 0) & (row < 0)))).size:
        text.fail(int(corners[bad[0]]), f"the normal {named[bad[0]]} is named, but there are {len(starts)}")
    return [in_text("vn", text, starts, row)]


def _third(text: Text, starts: Starts) -> NDArray[np.int64]:
    """(n,) the third of the integers that slashes separate in each token, 0 where there is none."""
    slashes = np.append(np.flatnonzero(text.raw == ord("/")), [len(text.raw)] * 2)
    blanks = np.append(np.flatnonzero(text.raw <= ord(" ")), len(text.raw))
    second = slashes[np.minimum(np.searchsorted(slashes, starts) + 1, len(slashes) - 1)]
    found = np.zeros(len(starts), dtype=np.int64)
    inside = second + 1 < blanks[np.searchsorted(blanks, starts)]
    found[inside] = text.integers(second[inside] + 1)
    return found


def _unread(rows: Rows, keys: NDArray[np.int8]) -> list[str]:
    """What the file holds besides, in words."""
    found = set(distinct(keys))
    unread = [words for key, words in OTHERS.items() if KEYS.index(key) in found]
    return unread + ["weights or colours of points"] * bool((rows.lengths[keys == POINT] > 4).any())


def _no_broken_lines(text: Text, rows: Rows) -> None:
    if (found := text.data.find(b"\\")) < 0:
        return
    last = rows.starts[rows.first[1:] - 1]
    ends = np.array([match.start() for match in _BACKSLASH.finditer(text.data, found)], dtype=last.dtype)
    row, first = np.unique(np.searchsorted(last, ends, side="right") - 1, return_index=True)
    for k, at in zip(row.tolist(), ends[first].tolist(), strict=True):  # only the first can end the row's last word
        if k >= 0 and text.next(int(last[k])) == (int(last[k]), at + 1):
            text.fail(rows.where(k), "a line that goes on in the next one (\\) cannot be read: join the two")


def _keys(text: Text, rows: Rows) -> NDArray[np.int8]:
    """(rows,) the number of the key of each row."""
    table = np.full(1 << 16, -1, dtype=np.int8)  # of keys of one or two letters
    for number, key in enumerate(KEYS):
        if len(key) < 3:
            table[int.from_bytes(key, "little")] = number
    keys = np.empty(len(rows), dtype=np.int8)
    for k, part in rows.parts():
        heads = part.column(0)
        first, second, third = text.letters(heads, 3)
        found = table[np.where(third > 0, 0, first + np.uint16(256) * second)]
        for row in np.flatnonzero(found < 0).tolist():
            key = text.token(heads[row])
            if key not in KEYS:
                text.fail(part.where(row), f"a line that starts with {text.word(heads[row])} cannot be read here")
            found[row] = KEYS.index(key)
        keys[k : k + len(part)] = found
    return keys


def _coordinates(text: Text, rows: Rows, is_point: NDArray[np.bool_]) -> Starts:
    """(points × 3) tokens; a weight, or a colour, may follow the coordinates."""
    lengths = rows.lengths[is_point] - 1
    bad = np.flatnonzero((lengths != 3) & ~np.isin(lengths, (4, 6, 7)))
    if bad.size:
        where = rows.where(int(np.flatnonzero(is_point)[bad[0]]))
        text.fail(where, f"three coordinates (and a weight or a colour) were expected, found {lengths[bad[0]]} words")
    first = rows.first[:-1][is_point]
    for j in range(4, 8):  # what follows must be numbers as well, or else a line was cut or joined
        text.floats(rows.starts[first[lengths >= j] + j])
    return np.stack([rows.starts[first + j] for j in range(1, 4)], axis=1)


def _regions(text: Text, rows: Rows, keys: NDArray[np.int8]) -> tuple[NDArray[np.int64], list[str]]:
    """The region of each row (material and group that hold there) and the regions' names; 0 has none."""
    state: dict[bytes, str] = {}
    known = {("", ""): 0}
    changes = np.flatnonzero((keys == MATERIAL) | (keys == GROUP))
    numbers = [0]
    for k in changes.tolist():
        words = list(map(text.token, rows.row(k)))
        state[words[0]] = b" ".join(words[1:]).decode("utf-8", "backslashreplace")
        numbers.append(known.setdefault((state.get(b"usemtl", ""), state.get(b"g", "")), len(known)))
    regions = np.repeat(np.array(numbers, dtype=np.int64), np.diff([0, *changes.tolist(), len(rows)]))
    return regions, [" / ".join(filter(None, pair)) for pair in known]


class _Cells(NamedTuple):
    """Cells one after another: the row that names each, its number of nodes (below zero of lines and points), and the
    nodes of all.
    """

    row: NDArray[np.int64]
    code: NDArray[np.int32]
    nodes: NDArray[np.int64]


def _cells(text: Text, rows: Rows, keys: NDArray[np.int8], count: int, regions: NDArray[np.int64]) -> list[CellBlock]:
    """Faces, lines and points in the order of the file."""
    none, points = np.empty(0, dtype=np.int64), 0
    codes, nodes, region = [none.astype(np.int32)], [none], [none]
    for k, part in rows.parts():
        key = keys[k : k + len(part)]
        before = points + np.cumsum(key == POINT)  # points so far
        points = int(before[-1])
        parts = [_cells_of(text, part, np.flatnonzero(key == kind), kind, before, count) for kind in LEAST]
        cells = _in_order([cells for cells in parts if len(cells.row)] or parts[:1])
        codes.append(cells.code)
        nodes.append(cells.nodes)
        region.append(regions[cells.row + k])
    code = np.concatenate(codes)
    kinds = {**polygon_kinds(code[code > 0]), -2: "line", -1: "vertex"}
    return cell_blocks(code, kinds, np.abs(code), np.concatenate(nodes), np.concatenate(region))[0]


def _cells_of(
    text: Text, rows: Rows, chosen: NDArray[np.int64], kind: int, before: NDArray[np.int64], count: int
) -> _Cells:
    """The cells in rows of one key. A negative number counts back from the last point so far (``before``)."""
    sizes = (rows.lengths[chosen] - 1).astype(np.int64)
    if (short := np.flatnonzero(sizes < LEAST[kind])).size:
        k = int(short[0])
        what = f"'{KEYS[kind].decode()}' takes at least {LEAST[kind]} nodes, found {sizes[k]}"
        text.fail(rows.where(int(chosen[k])), what)
    if len(chosen) == len(rows):
        starts = rows.inner(rows.starts, 1, sizes)
    else:
        starts = rows.starts[ranges(rows.first[chosen] + np.int64(1), sizes)]
    named = text.integers(starts, slash=True)
    if (zero := np.flatnonzero(named == 0)).size:
        text.fail(int(starts[zero[0]]), "a node numbered 0: nodes count from 1")
    nodes = named - (named > 0)
    if (named < 0).any():
        nodes += np.where(named < 0, np.repeat(before[chosen], sizes), 0)
        if (bad := np.flatnonzero((named < 0) & (nodes < 0))).size:
            text.fail(int(starts[bad[0]]), f"the node {named[bad[0]]} reaches back before the first point")
    check_nodes(text, starts, nodes, count, base=1)
    if kind == FACE:
        return _Cells(chosen, sizes.astype(np.int32), nodes)
    width = 2 if kind == LINE else 1  # of the pieces that a polyline, or a set of points, is cut into
    pieces = sizes - width + 1
    first = ranges(np.cumsum(sizes) - sizes, pieces)
    code = np.full(len(first), -width, dtype=np.int32)
    return _Cells(np.repeat(chosen, pieces), code, nodes[first[:, None] + np.arange(width)].reshape(-1))


def _in_order(parts: list[_Cells]) -> _Cells:
    """The cells of all parts in the order of their rows."""
    if len(parts) == 1:
        return parts[0]
    row, code, nodes = map(np.concatenate, zip(*parts, strict=True))
    order, size = np.argsort(row, kind="stable"), np.abs(code).astype(np.int64)
    first = np.cumsum(size) - size
    return _Cells(row[order], code[order], nodes[ranges(first[order], size[order])])


def write(mesh: Mesh) -> Written:
    """See Format. Regions become groups."""
    convert.check_kinds(mesh, name, KINDS)
    lost = convert.lost_data(mesh, name, regions=True)
    return Written({".obj": Pieces(lambda: _text(mesh))}, lost)


def _text(mesh: Mesh) -> Iterator[Piece]:
    yield from convert.rows(b"v % % %\n", convert.in_space(mesh))
    group = ""
    for block in mesh.cells:
        row = {0: b"p ", 1: b"l ", 2: b"f "}[block.cell.dimension] + convert.row_of(block.nodes.shape[1])
        cuts = (np.flatnonzero(np.diff(block.regions)) + 1).tolist()
        for start, end in zip([0, *cuts], [*cuts, len(block.nodes)], strict=True):
            if start < end:
                region = int(block.regions[start])
                wanted = "g " + _words(convert.marker_name(mesh, block.cell.dimension, region))
                if wanted != group and (group or region or (block.dimension, region) in mesh.region_names):
                    yield f"{wanted}\n".encode()
                    group = wanted
                yield from convert.rows(row, block.nodes[start:end] + 1)


def _words(name: str) -> str:
    """A region's name without the signs that begin a comment or join two lines."""
    return " ".join(name.replace("#", " ").replace("\\", "/").split())
