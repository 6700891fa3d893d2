"""SU2 meshes (``.su2``): one zone, in the plane or in space, with named markers.

The file is a list of ``KEY= value`` lines, some of which announce how many rows follow. Rows of points and cells may
end with an index. Lines of keywords that do not concern the mesh (AOA, the boxes of free-form deformation) are kept.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, distinct, numbered
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import TextSlots
from gmsnet.io.su2_markers import COPIED, Marker, check_transformation, send
from gmsnet.io.text import Rows, Starts, Text, quoted
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "SU2"
suffixes: tuple[str, ...] = (".su2",)

FLAT = {1: "vertex", 3: "line", 5: "triangle", 9: "quad"}
CODES = FLAT | {10: "tetra", 12: "hexahedron", 13: "wedge", 14: "pyramid"}
ELEMENTS = {2: FLAT, 3: CODES}  # of NDIME dimensions
MARKED = {2: {1: "vertex", 3: "line"}, 3: FLAT}
SIZES = {code: nodes_of(kind) for code, kind in CODES.items()}
COUNTS = {"NDIME": "dimensions", "NZONE": "zones", "NPOIN": "points", "NELEM": "elements", "NMARK": "markers",
          "MARKER_ELEMS": "marker elements", "NPERIODIC": "periodic transformations"}  # fmt: skip
COMMENT = b"%"
MOST_KEYWORDS = 100_000  # each costs time; a mesh has two for each marker
_LINE_END = re.compile(rb"[\r\n]")
REQUIRED = ("NDIME", "NPOIN", "NELEM", "NMARK")
ROWS = ("NPOIN", "NELEM", "MARKER_ELEMS")


@dataclass(frozen=True)
class Section:
    """A keyword with the tokens of its value and the rows that follow, up to the next keyword."""

    key: str
    at: int
    value: Starts
    rows: Rows


@dataclass
class Contents:
    """What the sections of a file add up to. others: keywords that do not concern the mesh, each once."""

    counts: dict[str, int] = field(default_factory=dict)
    points: Rows | None = None
    elements: Rows | None = None
    markers: list[Marker] = field(default_factory=list)
    periodic: int = 0
    others: dict[str, None] = field(default_factory=dict)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Markers become cells of fewer dimensions whose region is named; cells of the domain have region 0."""
    text = Text(files[".su2"], COMMENT)
    found = _collect(text)
    if not found.markers and text.data[len(text.data) - 1 :] in (b"\n", b"\r"):  # else the file may be cut off
        found.counts.setdefault("NMARK", 0)  # Gmsh leaves it out where there is no physical group
    missing = [key for key in REQUIRED if key not in found.counts]
    if missing or found.points is None or found.elements is None:
        raise FormatError(f"{', '.join(missing)} missing: the file is cut off or no SU2 mesh")
    if found.counts["NMARK"] != len(found.markers):
        raise FormatError(f"NMARK announces {found.counts['NMARK']} markers, but the file has {len(found.markers)}")

    if (announced := found.counts.get("NPERIODIC", found.periodic)) != found.periodic:
        raise FormatError(f"NPERIODIC announces {announced} transformations, but the file has {found.periodic}")

    dimension = found.counts["NDIME"]
    points, ends = text.spans(starts := _points(text, found.points, dimension))
    cells = _cells(text, found.elements, len(points), 0, ELEMENTS[dimension])
    numbers = numbered([marker.tag for marker in found.markers])
    names = {(dimension - 1, numbers[marker.tag]): marker.tag for marker in found.markers if marker.sent is None}
    for marker in found.markers:
        if marker.rows is None:
            last = "MARKER_ELEMS" if marker.count is None else f"{marker.count} rows behind a SEND_TO"
            raise FormatError(f"the marker {marker.tag[:24]!r} has no {last}: the file is cut off")
        kinds = {1: "vertex"} if marker.sent is not None else MARKED[dimension]
        blocks = _cells(text, marker.rows, len(points), numbers[marker.tag], kinds, 1 + (marker.sent is not None))
        names |= {(b.cell.dimension, numbers[marker.tag]): marker.tag for b in blocks}
        cells += blocks
    unread = [f"the keyword {key}" for key in found.others]
    return Parsed(points, cells, TextSlots(starts, ends), names, unread=unread)


def _sections(text: Text) -> Iterator[Section]:
    """The file cut at its keywords. Only lines with a keyword hold an equals sign, but for comments."""
    heads: list[tuple[int, int, int]] = []  # first byte of the line, its equals sign, the byte behind it
    data, end = text.data, 0
    while (at := data.find(b"=", end)) >= 0:
        start = 1 + max(data.rfind(b"\n", end, at), data.rfind(b"\r", end, at), end - 1)
        line_end = _LINE_END.search(data, at)
        end = line_end.start() if line_end else len(data)
        if data.find(COMMENT, start, at) < 0:
            heads.append((start, at, end))
            if len(heads) > MOST_KEYWORDS:
                text.fail(start, f"there are more than {MOST_KEYWORDS} keywords: this is no mesh")
    first = text.until(heads[0][0] if heads else len(data)).rows(0)
    if len(first):
        text.fail(first.where(0), f"a keyword such as NDIME= was expected, found {text.word(first.starts[0])}")
    for k, (start, equals, end) in enumerate(heads):
        stop = heads[k + 1][0] if k + 1 < len(heads) else len(data)
        key = data[start:equals].strip()
        if not key.replace(b"_", b"").isalnum():
            text.fail(start, f"a keyword was expected before '=', found {quoted(key)}")
        value = text.until(end).rows(equals + 1).starts
        yield Section(key.decode(), equals, value, text.until(stop).rows(end))


def _collect(text: Text) -> Contents:
    found = Contents()
    for section in _sections(text):
        key, at, value, rows = section.key, section.at, section.value, section.rows
        if key == "SEND_RECV":
            text.fail(at, "SEND_RECV: this is one part of a partitioned mesh; smooth the mesh before it is partitioned")
        if key == "MARKER_TAG":
            if not len(value):
                text.fail(at, "MARKER_TAG has no name")
            found.markers.append(Marker(b" ".join(map(text.token, value)).decode("utf-8", "backslashreplace")))
        elif key not in COUNTS or key == "NPERIODIC":
            found.others[key] = None
        if key in COUNTS:
            _count(text, section, found)
        elif key == "SEND_TO":
            send(text, at, value, rows, found.markers)
        elif key == "PERIODIC_INDEX":
            found.periodic += 1
            check_transformation(text, at, rows)
        elif len(rows) and not key.startswith("FFD_"):
            text.fail(
                rows.where(0),
                f"{len(rows)} rows follow the keyword {quoted(key.encode())}, which is not known to have any",
            )
    return found


def _count(text: Text, section: Section, found: Contents) -> None:
    """A keyword with a number, and its rows if it is one that has them."""
    key, at, rows = section.key, section.at, section.rows
    if not 1 <= len(section.value) <= 1 + (key == "NPOIN"):  # NPOIN may have the number without ghost points behind
        text.fail(at, f"one number was expected after {key}=, found {len(section.value)} words")
    count = text.count(section.value[0], COUNTS[key])
    if key == "NDIME" and count not in ELEMENTS:
        text.fail(at, f"NDIME= {count}: a mesh has 2 dimensions, or 3")
    if key == "NZONE" and count != 1:
        text.fail(at, f"NZONE= {count}: a file with several zones cannot be read; split it into one file a zone")
    if key != "MARKER_ELEMS":
        if key in found.counts:
            text.fail(at, f"{key} is given twice")
        found.counts[key] = count
    copied = key == "MARKER_ELEMS" and found.markers and found.markers[-1].tag == COPIED
    wanted = count * (key in ROWS)
    if len(rows) != wanted and (len(rows) or not copied):  # those of nodes that are copied stand behind SEND_TO
        text.fail(at, f"{key}= {count} is followed by {len(rows)} rows instead of {wanted}: is the file cut off?")
    if key == "NPOIN":
        found.points = rows
    elif key == "NELEM":
        found.elements = rows
    elif key == "MARKER_ELEMS":
        if not found.markers or found.markers[-1].count is not None:
            text.fail(at, "MARKER_ELEMS without a MARKER_TAG before it")
        found.markers[-1].count = count
        if len(rows) == count:
            found.markers[-1].rows = rows


def _points(text: Text, rows: Rows, dimension: int) -> Starts:
    """The tokens (points × dimension) of the coordinates; up to two indices may follow them."""
    lengths = rows.lengths
    bad = np.flatnonzero((lengths < dimension) | (lengths > dimension + 2))
    if bad.size:
        where, wanted = rows.where(int(bad[0])), {2: "two", 3: "three"}[dimension]
        text.fail(where, f"{wanted} coordinates and an index were expected, found {lengths[bad[0]]} numbers")
    _whole(text, rows, lengths > dimension)
    first = rows.first[:-1]
    for _, part in rows.parts():
        text.integers(part.starts[part.first[:-1][part.lengths > dimension] + dimension])
    text.integers(rows.starts[first[lengths > dimension + 1] + dimension + 1])
    return rows.columns(0, dimension)


def _cells(
    text: Text, rows: Rows, count: int, region: int, kinds: Mapping[int, str], most_extra: int = 1
) -> list[CellBlock]:
    """Rows of a type, its nodes and up to ``most_extra`` other numbers, such as an index."""
    codes, sizes = np.empty(len(rows), dtype=np.int8), np.zeros(len(rows), dtype=np.int8)
    nodes, found = np.empty(len(rows.starts) - len(rows), dtype=np.int64), 0
    for k, part in rows.parts():
        values = text.integers(part.starts)
        code, size = values[part.first[:-1]], sizes[k : k + len(part)]
        for known in kinds:
            size[code == known] = SIZES[known]
        if not size.all():
            bad = int(np.argmin(size))
            words = ", ".join(f"{number} ({kind})" for number, kind in kinds.items())
            text.fail(part.where(bad), f"a cell of type {code[bad]} cannot be read here; known are {words}")
        codes[k : k + len(part)] = code
        extra = part.lengths - 1 - size
        if (wrong := (extra < 0) | (extra > most_extra)).any():
            bad = int(np.argmax(wrong))
            told = f"a {kinds[int(code[bad])]} has {size[bad]} nodes, found {part.lengths[bad] - 1} numbers"
            text.fail(part.where(bad), told)
        named = part.inner(values, 1, size)
        check_nodes(text, part.inner(part.starts, 1, size), named, count)
        nodes[found : found + len(named)] = named
        found += len(named)
    _whole(text, rows, rows.lengths > 1 + sizes)
    return cell_blocks(codes, kinds, sizes, nodes[:found], np.full(len(rows), region))[0]


def _whole(text: Text, rows: Rows, indexed: NDArray[np.bool_]) -> None:
    """Where the file ends within a row that lacks its index, a number may be cut in two."""
    if len(rows) and rows.end == len(text.data) and not indexed[-1] and indexed.any():
        text.fail(rows.end, "the last row lacks its index: the file is cut off")


def write(mesh: Mesh) -> Written:
    """See Format. Cells of fewer dimensions than the mesh become markers."""
    convert.check_kinds(mesh, name, CODES.values())
    dimension = 3 if mesh.has_volumes else 2
    points, lost = (convert.in_space(mesh), []) if mesh.has_volumes else convert.in_plane(mesh, name)
    lost = lost + convert.lost_regions(mesh, name, dimension) + convert.lost_data(mesh, name)
    return Written({".su2": Pieces(lambda: _text(mesh, points, dimension))}, lost)


def _text(mesh: Mesh, points: NDArray[np.float64], dimension: int) -> Iterator[Piece]:
    code = {kind: number for number, kind in CODES.items()}
    elements = [block for block in mesh.cells if block.dimension == dimension]
    yield b"NDIME= %d\nNELEM= %d\n" % (dimension, sum(len(block.nodes) for block in elements))
    index = 0
    for block in elements:
        numbers = np.arange(index, index := index + len(block.nodes))
        row = b"%d " % code[block.kind] + convert.row_of(block.nodes.shape[1] + 1)
        yield from convert.rows(row, block.nodes, numbers)
    yield b"NPOIN= %d\n" % len(points)
    yield from convert.rows(convert.row_of(dimension + 1), points, np.arange(len(points)))
    markers: dict[str, list[tuple[int, NDArray[np.int64]]]] = {}
    for block in mesh.cells:
        if block.cell.dimension < dimension:
            for region in distinct(block.regions):
                tag = _tag(convert.marker_name(mesh, block.cell.dimension, region))
                markers.setdefault(tag, []).append((code[block.kind], block.nodes[block.regions == region]))
    yield b"NMARK= %d\n" % len(markers)
    for tag, parts in markers.items():
        yield f"MARKER_TAG= {tag}\nMARKER_ELEMS= {sum(len(nodes) for _, nodes in parts)}\n".encode()
        for number, nodes in parts:
            yield from convert.rows(b"%d " % number + convert.row_of(nodes.shape[1]), nodes)


def _tag(marker: str) -> str:
    """A marker's name as SU2 can hold it: one word without the signs that mean something else."""
    tag = "_".join(marker.replace("%", " ").replace("=", " ").split()) or "marker"
    return tag.lower() if tag == COPIED else tag  # which would have to say where its nodes are copied to
