"""SU2 meshes (``.su2``): one zone in the plane, with named markers.

The file is a list of ``KEY= value`` lines, some of which announce how many rows follow. Rows of points and cells may
end with an index. Lines of keywords that do not concern the mesh (AOA, the boxes of free-form deformation) are kept.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import cell_blocks, check_nodes, numbered
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Spans, blank, fail, scan_rows, to_count, to_floats, to_ints, token, word
from gmsnet.mesh import CellBlock, Mesh

name = "SU2"
suffixes = (".su2",)

CODES = {1: "vertex", 3: "line", 5: "triangle", 9: "quad"}
SIZES = {1: 1, 3: 2, 5: 3, 9: 4}
COUNTS = {"NDIME": "dimensions", "NZONE": "zones", "NPOIN": "points", "NELEM": "elements", "NMARK": "markers",
          "MARKER_ELEMS": "marker elements"}  # fmt: skip
_LINE_END = re.compile(rb"[\r\n]")
REQUIRED = ("NDIME", "NPOIN", "NELEM", "NMARK")  # SU2 wants all four; without NMARK a cut could not be seen
ROWS = ("NPOIN", "NELEM", "MARKER_ELEMS")


@dataclass(frozen=True)
class Section:
    """A keyword with the tokens of its value and the rows that follow, up to the next keyword."""

    key: str
    at: int
    value: Spans
    rows: Rows


@dataclass
class Contents:
    """What the sections of a file add up to."""

    counts: dict[str, int] = field(default_factory=dict)
    points: Rows | None = None
    elements: Rows | None = None
    markers: list[tuple[str, Rows | None]] = field(default_factory=list)


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format. Markers become line (or vertex) cells whose region is named; cells of the domain have region 0."""
    data = files[".su2"]
    text = blank(data, rb"%[^\r\n]*")
    found = _collect(text)
    missing = [key for key in REQUIRED if key not in found.counts]
    if missing or found.points is None or found.elements is None:
        hint = " (a mesh without markers says NMARK= 0)" if missing == ["NMARK"] else ""
        raise FormatError(f"{', '.join(missing)} missing: the file is cut off or no SU2 mesh{hint}")
    if found.counts["NMARK"] != len(found.markers):
        raise FormatError(f"NMARK announces {found.counts['NMARK']} markers, but the file has {len(found.markers)}")

    spans = _points(text, found.points)
    points = to_floats(text, spans)
    cells = _cells(text, found.elements, len(points), 0, CODES)
    numbers = numbered([tag for tag, _ in found.markers])
    names = {(1, number): tag for tag, number in numbers.items()}
    for tag, rows in found.markers:
        if rows is None:
            raise FormatError(f"the marker {tag!r} has no MARKER_ELEMS: the file is cut off")
        blocks = _cells(text, rows, len(points), numbers[tag], {1: "vertex", 3: "line"})
        names |= {(b.dimension, numbers[tag]): tag for b in blocks}
        cells += blocks
    slots = TextSlots(spans[..., 0], spans[..., 1], np.arange(len(points)))
    return Parsed(points, cells, slots, names)


def _sections(text: bytes) -> Iterator[Section]:
    """The file cut at its keywords. Only lines with a keyword hold an equals sign."""
    heads: list[tuple[int, int, int]] = []  # first byte of the line, its equals sign, the byte behind it
    end, at = 0, text.find(b"=")
    while at >= 0:
        start = 1 + max(text.rfind(b"\n", end, at), text.rfind(b"\r", end, at), end - 1)
        line_end = _LINE_END.search(text, at)
        end = line_end.start() if line_end else len(text)
        heads.append((start, at, end))
        at = text.find(b"=", end)
    first = scan_rows(text, 0, stop=heads[0][0] if heads else None)
    if len(first):
        fail(text, first.where(0), f"a keyword such as NDIME= was expected, found {word(text, first.row(0)[0])}")
    for k, (start, equals, end) in enumerate(heads):
        stop = heads[k + 1][0] if k + 1 < len(heads) else len(text)
        key = text[start:equals].strip()
        if not key.replace(b"_", b"").isalnum():
            fail(
                text,
                start,
                f"a keyword was expected before '=', found {key[:24].decode('ascii', 'backslashreplace')!r}",
            )
        value = scan_rows(text, equals + 1, stop=end).spans
        yield Section(key.decode(), equals, value, scan_rows(text, end, stop=stop))


def _collect(text: bytes) -> Contents:
    found = Contents()
    for section in _sections(text):
        key, at, value, rows = section.key, section.at, section.value, section.rows
        if key == "SEND_RECV":
            fail(
                text, at, "SEND_RECV: this is one part of a partitioned mesh; smooth the mesh before it is partitioned"
            )
        if key == "MARKER_TAG":
            if not len(value):
                fail(text, at, "MARKER_TAG has no name")
            found.markers.append((b" ".join(token(text, s) for s in value).decode("utf-8", "backslashreplace"), None))
        if key in COUNTS:
            _count(text, section, found)
        elif len(rows) and not key.startswith("FFD_"):
            fail(text, rows.where(0), f"{len(rows)} rows follow the keyword {key}, which is not known to have any")
    return found


def _count(text: bytes, section: Section, found: Contents) -> None:
    """A keyword with a number, and its rows if it is one that has them."""
    key, at, rows = section.key, section.at, section.rows
    if not 1 <= len(section.value) <= 1 + (key == "NPOIN"):  # NPOIN may have the number without ghost points behind
        fail(text, at, f"one number was expected after {key}=, found {len(section.value)} words")
    count = to_count(text, section.value[0], COUNTS[key])
    if key == "NDIME" and count != 2:
        fail(text, at, f"NDIME= {count}: only meshes in the plane (NDIME= 2) can be smoothed")
    if key == "NZONE" and count != 1:
        fail(text, at, f"NZONE= {count}: a file with several zones cannot be read; split it into one file a zone")
    if key != "MARKER_ELEMS":
        if key in found.counts:
            fail(text, at, f"{key} is given twice")
        found.counts[key] = count
    if len(rows) != count * (key in ROWS):
        wanted = count * (key in ROWS)
        fail(text, at, f"{key}= {count} is followed by {len(rows)} rows instead of {wanted}: is the file cut off?")
    if key == "NPOIN":
        found.points = rows
    elif key == "NELEM":
        found.elements = rows
    elif key == "MARKER_ELEMS":
        if not found.markers or found.markers[-1][1] is not None:
            fail(text, at, "MARKER_ELEMS without a MARKER_TAG before it")
        found.markers[-1] = found.markers[-1][0], rows


def _points(text: bytes, rows: Rows) -> Spans:
    """The spans (points × 2) of the coordinates; up to two indices may follow them."""
    lengths = rows.lengths
    bad = np.flatnonzero((lengths < 2) | (lengths > 4))
    if bad.size:
        where = rows.where(int(bad[0]))
        fail(text, where, f"two coordinates and an index were expected, found {lengths[bad[0]]} numbers")
    _whole(text, rows, lengths > 2)
    extra = rows.first[:-1][lengths > 2] + 2
    to_ints(text, rows.spans[np.concatenate([extra, rows.first[:-1][lengths > 3] + 3])])
    return np.stack([rows.column(0), rows.column(1)], axis=1)


def _cells(text: bytes, rows: Rows, count: int, region: int, kinds: Mapping[int, str]) -> list[CellBlock]:
    """Rows of a type, its nodes and perhaps an index."""
    values = to_ints(text, rows.spans)
    codes = values[rows.first[:-1]]
    sizes = np.zeros(len(rows), dtype=np.int64)
    for code in kinds:
        sizes[codes == code] = SIZES[code]
    if not sizes.all():
        k = int(np.flatnonzero(sizes == 0)[0])
        known = ", ".join(f"{code} ({kind})" for code, kind in kinds.items())
        fail(text, rows.where(k), f"a cell of type {codes[k]} cannot be read here; known are {known}")
    extra = rows.lengths - 1 - sizes
    bad = np.flatnonzero((extra < 0) | (extra > 1))
    if bad.size:
        k = int(bad[0])
        fail(text, rows.where(k), f"a {kinds[int(codes[k])]} has {sizes[k]} nodes, found {rows.lengths[k] - 1} numbers")
    _whole(text, rows, extra > 0)
    first = rows.first[:-1] + 1
    is_node = np.ones(len(values), dtype=bool)
    is_node[rows.first[:-1]] = False
    is_node[rows.first[1:][extra > 0] - 1] = False
    check_nodes(text, rows.spans[is_node], values[is_node], count)
    return cell_blocks(codes, kinds, sizes, values, first, np.full(len(rows), region))[0]


def _whole(text: bytes, rows: Rows, indexed: NDArray[np.bool_]) -> None:
    """Where the file ends within a row that lacks its index, a number may be cut in two."""
    if len(rows) and rows.end == len(text) and not indexed[-1] and indexed.any():
        fail(text, rows.end, "the last row lacks its index: the file is cut off")


def write(mesh: Mesh) -> Written:
    """See Format. Lines and vertices become markers."""
    convert.check_kinds(mesh, name, CODES.values())
    points, lost = convert.in_plane(mesh, name)
    code = {kind: number for number, kind in CODES.items()}
    markers: dict[str, list[str]] = {}
    elements: list[str] = []
    for block in mesh.cells:
        rows = convert.integers(np.column_stack([np.full(len(block.nodes), code[block.kind]), block.nodes]))
        if block.dimension == 2:
            elements += rows
            continue
        for region in np.unique(block.regions).tolist():
            tag = _tag(convert.marker_name(mesh, block.dimension, region))
            markers.setdefault(tag, []).extend(rows[k] for k in np.flatnonzero(block.regions == region).tolist())
    lines = ["NDIME= 2", f"NELEM= {len(elements)}"]
    lines += [f"{row} {k}" for k, row in enumerate(elements)]
    lines += [f"NPOIN= {len(points)}"]
    lines += [f"{row} {k}" for k, row in enumerate(convert.decimals(points))]
    lines += [f"NMARK= {len(markers)}"]
    for tag, rows in markers.items():
        lines += [f"MARKER_TAG= {tag}", f"MARKER_ELEMS= {len(rows)}", *rows]
    lost += convert.lost_regions(mesh, name) + convert.lost_data(mesh, name)
    return Written({".su2": ("\n".join(lines) + "\n").encode()}, lost)


def _tag(marker: str) -> str:
    """A marker's name as SU2 can hold it: one word without the signs that mean something else."""
    return "_".join(marker.replace("%", " ").replace("=", " ").split()) or "marker"
