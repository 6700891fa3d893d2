"""STL files (``.stl``), binary and text: triangles that each write their own three corners.

Corners with exactly equal coordinates are one node. A binary file is told by its size, 84 + 50 n bytes for n
triangles, whatever it begins with; a text file has one or more solids, which are its regions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, stl_ranges
from gmsnet.io.cells import distinct, joined, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_text, in_words
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import Lattice, Places
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.splice import BinarySlots, TextSlots
from gmsnet.io.stl_ranges import HEAD, RECORD
from gmsnet.io.text import Starts, Text
from gmsnet.io.words import ByteWords
from gmsnet.kernels.topology import weld as kernels
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import FaceCorners

name = "STL"
suffixes: tuple[str, ...] = (".stl",)
NORMALS = "of facets"

_VERTEX = [b"vertex", b"", b"", b""]
_FACET = [b"facet", b"normal", b"", b"", b"", b"outer", b"loop", *_VERTEX * 3, b"endloop", b"endfacet"]
_CORNERS = [8, 9, 10, 12, 13, 14, 16, 17, 18]  # where the coordinates are among the words of a facet
_NORMAL = [2, 3, 4]  # and those of its normal
_SOLID = re.compile(rb"(?i)(end)?solid\b([^\r\n]*)")
_LONG_EXPONENT = re.compile(rb"[eE][+-]?\d{7}")
EMPTY = "the file has no triangles: there is nothing to smooth"
_TOGETHER = 1 << 17  # corners that are welded at once


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Nodes are numbered in the order in which they appear first."""
    data = files[".stl"]
    count = int.from_bytes(data[80:HEAD], "little")
    if len(data) > HEAD and len(data) == HEAD + RECORD * count:
        return _binary(data, count)
    if len(data) == HEAD and not count:
        raise FormatError(EMPTY)
    if re.match(rb"(?i)\s*solid", data) and b"\0" not in data[:HEAD]:
        return _text(data)
    message = f"neither a text STL file, which starts with 'solid', nor a whole binary one: it has {len(data)} bytes"
    if len(data) >= HEAD:
        message += f", and with the {count} triangles that it announces it would have {HEAD + RECORD * count}"
    raise FormatError(message)


def _binary(data: Data, count: int) -> Parsed:
    columns = tuple(12 * corner + 4 * axis for corner in (1, 2, 3) for axis in range(3))  # behind the normal
    places = Places(Lattice(HEAD, count, RECORD, columns))
    weld = Weld(3 * count)
    for k in range(0, count, _TOGETHER):
        some = Places(Lattice(HEAD + k * RECORD, min(_TOGETHER, count - k), RECORD, columns))
        weld.add(ByteWords(data, "<").values(some, "f4").reshape(-1, 3))
    cells = [CellBlock("triangle", sealed(weld.node).reshape(-1, 3), sealed(np.zeros(count, dtype=np.int64)))]
    marks = np.ndarray((count, 2), np.uint8, data, HEAD + RECORD - 2, (RECORD, 1))
    unread = ["attributes of triangles"] * bool(marks.any())
    return Parsed(weld.points, cells, BinarySlots(places, "<f4", weld.node), single=True, unread=unread)


def plan(file: Ranges) -> Plan | None:
    """See ``stl_ranges.plan``."""
    return stl_ranges.plan(file)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    data, corners = files[".stl"], FaceCorners.of(cells)
    count = len(corners.face) // 3
    if len(data) == HEAD + RECORD * count:
        places = Places(Lattice(HEAD, count, RECORD, (0, 4, 8)))
        return [in_words(NORMALS, ByteWords(data, "<"), places, "f4", corners.face)]
    text = Text(data)
    starts, _, _ = _solids_in(text, _NORMAL)
    return [in_text(NORMALS, text, joined(starts).reshape(-1, 3), corners.face)]


def _text(data: Data) -> Parsed:
    text = Text(data)
    found, names, last = _solids_in(text, _CORNERS)
    if (behind := text.next(last)) is not None:
        text.fail(behind[0], "unknown words behind the last 'endsolid'")
    region = np.repeat(np.arange(1, len(found) + 1), list(map(len, found)))
    starts = joined(found).reshape(-1, 3)
    del found
    if not len(starts):
        raise FormatError(EMPTY)
    ends, weld = np.empty_like(starts), Weld(len(starts))
    for k in range(0, len(starts), _TOGETHER):
        corners, ends[k : k + _TOGETHER] = text.spans(starts[k : k + _TOGETHER])
        weld.add(corners)
    points, node = _told_apart(text, starts, ends, weld)
    cells = [CellBlock("triangle", sealed(node).reshape(-1, 3), sealed(region))]
    return Parsed(points, cells, TextSlots(starts, ends, node), names)


def _solids_in(text: Text, columns: list[int]) -> tuple[list[Starts], dict[tuple[int, int], str], int]:
    """Some of the words of all facets, an array for each solid, the names of these, and the byte behind the last."""
    names = dict[tuple[int, int], str]()
    tokens, _ = text.tokens(0)
    found: list[Starts] = []
    body, last = -1, 0  # where the facets of the open solid begin, and where the last solid ended
    for start, is_end, title, stop in _solid_lines(text, tokens):
        if is_end != (body >= 0):
            text.fail(start, "'endsolid' without 'solid'" if is_end else "the solid before has no 'endsolid'")
        if is_end:
            inside = tokens[slice(*np.searchsorted(tokens, np.array([body, start], tokens.dtype)))]
            found.append(_facets(text, inside, start, columns))
            body, last = -1, stop
        else:
            if title:
                names[2, len(found) + 1] = title
            body = stop
    if body >= 0:
        where = re.search(rb"(?i)\bendsolid\b", text.data[body:])
        if where is not None:
            text.fail(body + where.start(), "'endsolid' does not begin a line")
        text.fail(len(text.data), "'endsolid' is missing: the file is cut off")
    return found, names, last


def _solid_lines(text: Text, tokens: Starts) -> Iterator[tuple[int, bool, str, int]]:
    """The lines that begin with solid or endsolid: first byte, is it the latter, the name, the byte behind it."""
    at = 0
    for k in range(0, len(tokens), 1 << 20):
        some = tokens[k : k + (1 << 20)]
        letters = text.raw[some] | 32
        some = some[(letters == ord("s")) | (letters == ord("e"))]
        fourth = text.raw[np.minimum(some + 3, len(text.raw) - 1)] | 32
        for start in some[(fourth == ord("s")) | (fourth == ord("i"))].tolist():
            match = _SOLID.match(text.data, start)
            edge = start
            while edge > at and text.raw[edge - 1] in b" \t":
                edge -= 1
            if match and start >= at and (edge == 0 or text.raw[edge - 1] in b"\r\n"):
                at = match.end()
                yield start, match[1] is not None, match[2].strip().decode("utf-8", "replace"), at


def _facets(text: Text, tokens: Starts, stop: int, columns: list[int]) -> Starts:
    """Some words (triangles × columns) of the facets of a solid, which must be whole, out of all its tokens."""
    size = len(_FACET)
    count = len(tokens) // size
    wrong = text.until(stop).mismatch(tokens[: count * size], _FACET)
    if wrong >= 0:
        found = text.token(tokens[wrong])[:24].decode("ascii", "replace")
        text.fail(int(tokens[wrong]), f"expected {_FACET[wrong % size].decode()!r}, found {found!r}")
    if len(tokens) > count * size:
        text.fail(int(tokens[count * size]), "the facet that begins here is not complete")
    return np.stack([tokens[j::size][:count] for j in columns], axis=1)


class Weld:
    """Nodes of corners that are added in turn. points: (nodes, 3); node: (corners,) the node of each."""

    node: NDArray[np.int64]

    def __init__(self, count: int) -> None:
        self.node = np.empty(count, dtype=np.int64)
        self._points = np.empty((count, 3))
        self._table = np.full(1 << max(4, (count // 2).bit_length()), kernels.EMPTY, dtype=np.int32)
        self._corners = self._found = 0

    @property
    def points(self) -> NDArray[np.float64]:
        """The coordinates of the nodes so far, as they are at the first corner of each."""
        return self._points[: self._found]

    def add(self, corners: NDArray[np.float64]) -> None:
        """More corners (n, 3), which are finite."""
        node, at = self.node[self._corners : self._corners + len(corners)], 0
        self._corners += len(corners)
        while True:
            at, self._found = kernels.weld(corners, at, self._found, self._points, self._table, node)
            if at == len(corners):
                return
            self._table = np.full(4 * len(self._table), kernels.EMPTY, dtype=np.int32)
            again = self.points.copy()
            kernels.weld(again, 0, 0, self._points, self._table, np.empty(len(again), dtype=np.int64))


def _told_apart(text: Text, starts: Starts, ends: Starts, weld: Weld) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and nodes, where corners are one node only if their decimals are equal, and not only as float64."""
    points, node = weld.points, weld.node
    first = np.empty(len(points), dtype=np.int64)
    first[node[::-1]] = np.arange(len(node) - 1, -1, -1)
    other = np.empty(len(node), dtype=np.int64)
    known = dict[tuple[object, ...], int]()
    for k in other[: kernels.other_spellings(text.raw, starts, ends, points, node, first, other)].tolist():
        mine, its = (tuple(_decimal(text.token(start)) for start in starts[j]) for j in (k, first[node[k]]))
        if mine != its:
            node[k] = known.setdefault((int(node[k]), *mine), len(points) + len(known))
    if known:
        _, first, node = np.unique(node, return_index=True, return_inverse=True)
        rank = np.empty(len(first), dtype=np.int64)
        rank[np.argsort(first)] = np.arange(len(first))
        node = rank[node.reshape(-1)]
        points = text.floats(starts[np.sort(first)])
    return points, node


def _decimal(text: bytes) -> object:
    """The exact value of a number; one with an absurd exponent stands for itself."""
    return text if _LONG_EXPONENT.search(text) else Decimal(text.upper().replace(b"D", b"E").decode("ascii"))


def write(mesh: Mesh) -> Written:
    """See Format. Text in double precision, a solid for each region of the triangles."""
    convert.check_kinds(mesh, name, ("vertex", "line", "triangle"))
    points = convert.in_space(mesh)
    blocks = [block for block in mesh.cells if block.kind == "triangle" and len(block.nodes)]
    if not blocks:
        raise FormatError(f"{name} cannot hold a mesh without triangles")
    nodes = joined([block.nodes for block in blocks])
    regions = joined([block.regions for block in blocks])
    known = distinct(regions)
    lost = [f"{name} has no node numbers: nodes will be counted as triangles name them"]
    lost += [*convert.lost_cells(mesh, name, (0, 1)), *convert.lost_data(mesh, name, regions=True)]
    used = np.zeros(len(points), dtype=bool)
    used[nodes] = True
    if unused := int(np.count_nonzero(~used)):
        lost.append(f"{name} cannot hold nodes without a triangle: {unused} {convert.were(unused)} left out")
    weld = Weld(len(points))
    weld.add(points[used])
    if len(weld.points) < len(points) - unused:
        lost.append(f"{name} cannot tell apart nodes at the same place: they were joined")
    if known not in ([0], list(range(1, len(known) + 1))):
        lost.append(f"{name} counts its solids from 1: region numbers remain only in the names of the solids")
    lost += convert.lost_order(mesh, name)
    return Written({".stl": Pieces(lambda: _solids(mesh, points, nodes, regions, known))}, lost)


def _solids(
    mesh: Mesh, points: NDArray[np.float64], nodes: NDArray[np.int64], regions: NDArray[np.int64], known: list[int]
) -> Iterator[Piece]:
    vertex = b"vertex % % %\n"
    facet = b"facet normal % % %\nouter loop\n" + 3 * vertex + b"endloop\nendfacet\n"
    for region in known:
        title = "mesh" if known == [0] else " ".join(convert.marker_name(mesh, 2, region).split())
        yield f"solid {title}\n".encode()
        chosen = np.flatnonzero(regions == region)
        for k in range(0, len(chosen), _TOGETHER):
            corners = points[nodes[chosen[k : k + _TOGETHER]]]
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                normals /= np.linalg.norm(normals, axis=1)[:, None]
            normals[~np.isfinite(normals).all(axis=1)] = 0
            yield from convert.rows(facet, normals, corners.reshape(-1, 9))
        yield f"endsolid {title}\n".encode()
