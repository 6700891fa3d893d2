"""STL files (``.stl``), binary and text: triangles that each write their own three corners.

Corners with exactly equal coordinates are one node. A binary file is told by its size, 84 + 50 n bytes for n
triangles, whatever it begins with; a text file has one or more solids, which are its regions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import BinarySlots, TextSlots
from gmsnet.io.text import Spans, fail, gather, scan_rows, to_floats, token
from gmsnet.mesh import CellBlock, Mesh

name = "STL"
suffixes = (".stl",)

HEAD, RECORD = 84, 50  # bytes in front of the triangles of a binary file, and of each of them
_VERTEX = ["vertex", "*", "*", "*"]
_FACET = ["facet", "normal", "*", "*", "*", "outer", "loop", *_VERTEX, *_VERTEX, *_VERTEX, "endloop", "endfacet"]
_SOLID = re.compile(rb"[sS][oO][lL][iI][dD]\b")
_REST = re.compile(rb"[^\r\n]*")
_WIDE = 64  # longer numbers are compared one by one
_LONG_EXPONENT = re.compile(rb"[eE][+-]?\d{7}")
_CORNERS = [[8, 9, 10], [12, 13, 14], [16, 17, 18]]  # where the coordinates are among the words of a facet


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format. Nodes are numbered in the order in which they appear first."""
    data = files[".stl"]
    count = int.from_bytes(data[80:HEAD], "little")
    if len(data) > HEAD and len(data) == HEAD + RECORD * count:
        return _binary(data, count)
    if data.lstrip()[:5].lower() == b"solid":
        return _text(data)
    message = f"neither a text STL file, which starts with 'solid', nor a whole binary one: it has {len(data)} bytes"
    if len(data) >= HEAD:
        message += f", and with the {count} triangles that it announces it would have {HEAD + RECORD * count}"
    raise FormatError(message)


def _binary(data: bytes, count: int) -> Parsed:
    corner = 12 * np.arange(1, 4)[:, None] + 4 * np.arange(3)  # bytes within a record, behind the normal
    offsets = (HEAD + RECORD * np.arange(count, dtype=np.int64)[:, None, None] + corner).reshape(-1, 3)
    records = np.frombuffer(data, dtype=np.dtype([("numbers", "<f4", (4, 3)), ("attribute", "<u2")]), offset=HEAD)
    points = records["numbers"][:, 1:].reshape(-1, 3).astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if wrong.size:
        raise FormatError(f"byte {offsets[wrong[0], 0]}: a coordinate is not a finite number")
    node, first = _weld(np.unique(points, return_inverse=True)[1].reshape(-1, 3))
    cells = [CellBlock("triangle", node.reshape(-1, 3), np.zeros(count, dtype=np.int64))]
    return Parsed(points[first], cells, BinarySlots(offsets, "<f4", node), single=True)


def _text(data: bytes) -> Parsed:
    names: dict[tuple[int, int], str] = {}
    spans: list[Spans] = []
    body, last = -1, 0  # where the facets of the open solid begin, and where the last solid ended
    for start, is_end, title, stop in _solid_lines(data):
        if is_end != (body >= 0):
            fail(data, start, "'endsolid' without 'solid'" if is_end else "the solid before has no 'endsolid'")
        if is_end:
            spans.append(_facets(data, body, start))
            body, last = -1, stop
        else:
            if title:
                names[2, len(spans) + 1] = title
            body = stop
    if body >= 0:
        fail(data, len(data), "'endsolid' is missing: the file is cut off")
    if data[last:].strip():
        fail(data, last + len(data[last:]) - len(data[last:].lstrip()), "unknown words behind the last 'endsolid'")
    places = np.concatenate(spans)
    if not len(places):
        raise FormatError("the file has no triangles: there is nothing to smooth")
    places = places.reshape(-1, 3, 2)
    node, first = _weld(_exact(data, places))
    region = np.repeat(np.arange(1, len(spans) + 1), [len(part) // 9 for part in spans])
    points = to_floats(data, places[first])
    slots = TextSlots(places[..., 0], places[..., 1], node)
    return Parsed(points, [CellBlock("triangle", node.reshape(-1, 3), region)], slots, names)


def _solid_lines(data: bytes) -> Iterator[tuple[int, bool, str, int]]:
    """The lines that begin with solid or endsolid: first byte, is it the latter, the name, the byte behind it."""
    at = 0
    for match in _SOLID.finditer(data):
        start = match.start()
        is_end = data[start - 3 : start].lower() == b"end"
        start -= 3 * is_end
        edge = start
        while edge > at and data[edge - 1] in b" \t":
            edge -= 1
        if match.start() >= at and (edge == 0 or data[edge - 1] in b"\r\n"):
            rest = _REST.match(data, match.end())
            assert rest is not None  # the pattern fits everywhere
            at = rest.end()
            yield start, is_end, rest[0].strip().decode("utf-8", "replace"), at


def _facets(data: bytes, start: int, stop: int) -> Spans:
    """The spans (triangles × 9, 2) of the coordinates between two bytes, where only whole facets may stand."""
    spans = scan_rows(data, start, None, stop).spans
    size = len(_FACET)
    count = len(spans) // size
    facets = spans[: count * size].reshape(count, size, 2)
    wrong = np.zeros((count, size), dtype=bool)
    for k, expected in enumerate(_FACET):
        if expected != "*":
            wrong[:, k] = facets[:, k, 1] - facets[:, k, 0] != len(expected)
            whole = np.flatnonzero(~wrong[:, k])
            if whole.size:
                letters = gather(data, facets[whole, k]).view(np.uint8).reshape(len(whole), len(expected))
                lower = np.frombuffer(expected.encode(), dtype=np.uint8)
                wrong[whole, k] = (letters | 32 != lower).any(axis=1)  # which makes capitals small
    if wrong.any():
        k = int(np.argmax(wrong))
        found = token(data, spans[k])[:24].decode("ascii", "replace")
        fail(data, int(spans[k, 0]), f"expected {_FACET[k % size]!r}, found {found!r}")
    if len(spans) > count * size:
        fail(data, int(spans[count * size, 0]), "the facet that begins here is not complete")
    return facets[:, _CORNERS].reshape(-1, 2)


def _exact(data: bytes, places: Spans) -> NDArray[np.int64]:
    """(rows, 3) a number for each coordinate, equal exactly where the decimals are equal, and not only as float64."""
    spans = places.reshape(-1, 2)
    _, first, value = np.unique(to_floats(data, spans), return_index=True, return_inverse=True)
    value, long = value.reshape(-1), spans[:, 1] - spans[:, 0] > _WIDE
    text = np.zeros(len(spans), dtype=f"S{_WIDE}") if long.any() else gather(data, spans)
    text[~long] = gather(data, spans[~long])
    same = first[value]
    ids, new = value.copy(), dict[tuple[int, object], int]()
    for k in np.flatnonzero(
        (text != text[same]) | long | long[same]
    ).tolist():  # equal as float64, spelt in another way
        mine, other = (_decimal(token(data, spans[j])) for j in (k, same[k]))
        if mine != other:
            ids[k] = new.setdefault((int(value[k]), mine), len(first) + len(new))
    return ids.reshape(-1, 3)


def _decimal(text: bytes) -> object:
    """The exact value of a number; one with an absurd exponent stands for itself."""
    return text if _LONG_EXPONENT.search(text) else Decimal(text.upper().replace(b"D", b"E").decode("ascii"))


def _weld(ids: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(rows,) the node of each row of numbers (rows, 3), equal rows being one node, and the first row of each node."""
    key = ids[:, 0]
    for k in (1, 2):
        key = np.unique(key * (int(ids[:, k].max()) + 1) + ids[:, k], return_inverse=True)[1].reshape(-1)
    _, first, node = np.unique(key, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[node.reshape(-1)], np.sort(first)


def write(mesh: Mesh) -> Written:
    """See Format. Text in double precision, a solid for each region of the triangles."""
    convert.check_kinds(mesh, name, ("vertex", "line", "triangle"))
    points = convert.in_space(mesh)
    blocks = [block for block in mesh.cells if block.kind == "triangle" and len(block.nodes)]
    if not blocks:
        raise FormatError(f"{name} cannot hold a mesh without triangles")
    nodes = np.concatenate([block.nodes for block in blocks])
    regions = np.concatenate([block.regions for block in blocks])
    known = np.unique(regions)
    lost = [f"{name} has no node numbers: nodes will be counted as triangles name them"]
    lost += [*convert.lost_cells(mesh, name, (0, 1)), *convert.lost_data(mesh, name, regions=True)]
    if (unused := len(points) - len(np.unique(nodes))) > 0:
        lost.append(f"{name} cannot hold nodes without a triangle: {unused} {convert.were(unused)} left out")
    if len(np.unique(points[np.unique(nodes)], axis=0)) < len(np.unique(nodes)):
        lost.append(f"{name} cannot tell apart nodes at the same place: they were joined")
    if known.tolist() not in ([0], list(range(1, len(known) + 1))):
        lost.append(f"{name} counts its solids from 1: region numbers remain only in the names of the solids")
    corners = points[nodes]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[~np.isfinite(normals).all(axis=1)] = 0
    normal_text, point_text = convert.decimals(normals), convert.decimals(points)
    text = []
    for region in known.tolist():
        title = "mesh" if known.tolist() == [0] else " ".join(convert.marker_name(mesh, 2, region).split())
        text.append(f"solid {title}\n")
        for k in np.flatnonzero(regions == region).tolist():
            a, b, c = (point_text[node] for node in nodes[k].tolist())
            text.append(
                f"facet normal {normal_text[k]}\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n"
            )
        text.append(f"endsolid {title}\n")
    return Written({".stl": "".join(text).encode()}, lost)
