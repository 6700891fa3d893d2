"""Unstructured grids in VTK's XML (``.vtu``): arrays as text, base64 or raw, inline or appended, compressed or not.

Only the array of the points is ever written again, in its own encoding; where it gets longer or shorter, the offsets
of the arrays behind it follow.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, vtk_cells
from gmsnet.io.document import Parsed, Written
from gmsnet.io.splice import BinarySlots, EncodedSlots, Slots
from gmsnet.io.text import fail, scan
from gmsnet.io.vtu_arrays import MOST_INFLATED, Encoded, Encoding, decode
from gmsnet.io.vtu_xml import DataArray, Document, parse
from gmsnet.io.words import TextWords, typed
from gmsnet.mesh import Mesh

name = "VTU"
suffixes = (".vtu",)

TYPES = {f"{word}{8 * size}": f"{code}{size}" for word, code in (("Int", "i"), ("UInt", "u")) for size in (1, 2, 4, 8)}
TYPES |= {"Float32": "f4", "Float64": "f8"}
NAMES = {kind: called for called, kind in TYPES.items()}
_BLANK = re.compile(rb"\s*")


@dataclass(frozen=True)
class Numbers:
    """The values of an array, and where they stand: as words of a text or encoded."""

    values: NDArray[Any]
    words: TextWords | None
    encoded: Encoded | None
    start: int


class _Reader:
    """Decodes the arrays of one file. budget: how many bytes may still be unpacked."""

    def __init__(self, data: bytes) -> None:
        self.data, self.document = data, parse(data)
        self.budget = MOST_INFLATED * len(data)
        root = self.document.root
        orders = {"LittleEndian": "<", "BigEndian": ">"}
        headers = {"UInt32": "u4", "UInt64": "u8"}
        compressor = root.get("compressor", "")
        if compressor not in ("", "vtkZLibDataCompressor"):
            raise FormatError(
                f"the compressor {compressor[:40]!r} is not supported: write the file with zlib or without"
            )
        order, header = root.get("byte_order", "LittleEndian"), root.get("header_type", "UInt32")
        if order not in orders or header not in headers:
            raise FormatError(f"unknown byte_order {order[:24]!r} or header_type {header[:24]!r}")
        self.order, self.header, self.compressed = orders[order], orders[order] + headers[header], bool(compressor)

    def count(self, attribute: str) -> int:
        """A number of the one piece."""
        if len(self.document.pieces) != 1:
            raise FormatError("the file has no Piece of an UnstructuredGrid")
        text = self.document.pieces[0].get(attribute, "").strip()
        if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
            raise FormatError(f"the Piece has no {attribute}, or one that is no count: {text[:24]!r}")
        return int(text)

    def section(self, section: str) -> list[DataArray]:
        """The arrays of numbers in a section."""
        return [a for a in self.document.arrays if a.section == section and a.element == "DataArray"]

    def fail(self, array: DataArray, message: str) -> NoReturn:
        """Raises FormatError with the line and the name of an array."""
        fail(self.data, array.tag[0], f"the array {array.attributes.get('Name', array.section)[:40]!r}: {message}")

    def width(self, array: DataArray, default: int = 1) -> int:
        """The number of components."""
        text = array.attributes.get("NumberOfComponents", str(default)).strip()
        if not re.fullmatch(r"\d{1,9}", text, re.ASCII):
            self.fail(array, f"NumberOfComponents is {text[:24]!r}")
        return max(1, int(text))

    def numbers(self, array: DataArray, count: int, finite: bool = False) -> Numbers:
        """The ``count`` numbers of an array. Raises FormatError where there are fewer or more."""
        kind = TYPES.get(array.attributes.get("type", ""))
        if kind is None:
            self.fail(array, f"numbers of type {array.attributes.get('type', '')[:24]!r} are not supported")
        how = array.attributes.get("format", "ascii")
        if how == "ascii":
            return self._inline_text(array, kind, count, finite)
        start, stored, in_base64 = self._stored(array, how)
        self.budget -= count * int(kind[1])
        if count * int(kind[1]) > MOST_INFLATED * len(self.data) or self.budget < 0:
            self.fail(array, f"{count} numbers cannot be in a file of {len(self.data)} bytes")
        if not count:
            return Numbers(np.empty(0, dtype=kind), None, None, start)
        try:
            found = decode(stored, Encoding(self.header, self.compressed, in_base64), count * int(kind[1]))
        except FormatError as error:
            self.fail(array, str(error))
        if how == "binary" and found.length != len(stored):
            self.fail(array, "more follows behind its last number")
        values = np.frombuffer(found.payload, dtype=self.order + kind).astype(kind)
        if finite and not np.isfinite(values).all():
            self.fail(array, "a coordinate is not a finite number")
        return Numbers(values, None, found, start)

    def _inline_text(self, array: DataArray, kind: str, count: int, finite: bool) -> Numbers:
        text, (start, stop) = self.document.text, array.body
        words = TextWords(text, scan(text, start, count, stop))
        behind = _BLANK.match(text, int(words.spans[-1, 1]) if count else start, stop)
        if behind is not None and behind.end() < stop:
            fail(self.data, behind.end(), f"more than the expected {count} numbers")
        values = words.values(words.take(count, kind), kind, finite)
        return Numbers(values if finite else typed(values, kind), words, None, start)

    def _stored(self, array: DataArray, how: str) -> tuple[int, memoryview, bool]:
        """Where an encoded array begins, the bytes from there on, and whether they are base64."""
        if how == "binary":
            start, stop = array.body
            return start, memoryview(b"".join(self.document.text[start:stop].split())), True
        offset = array.attributes.get("offset", "").strip()
        if how != "appended" or self.document.appended is None or not re.fullmatch(r"\d{1,18}", offset, re.ASCII):
            self.fail(array, f"its format is {how[:24]!r} with the offset {offset[:24]!r}, which cannot be found")
        encoding, start, stop = self.document.appended
        if start + int(offset) > stop:
            self.fail(array, f"its offset {offset} lies behind the end of the file")
        return start + int(offset), memoryview(self.data)[start + int(offset) : stop], encoding == "base64"


def read(files: Mapping[str, bytes]) -> Parsed:
    """See Format."""
    reader = _Reader(files[".vtu"])
    point_count, cell_count = reader.count("NumberOfPoints"), reader.count("NumberOfCells")
    places = reader.section("Points")
    if len(places) != 1:
        raise FormatError(f"the Piece has {len(places)} arrays of Points instead of one")
    place = places[0]
    if place.attributes.get("type") not in ("Float32", "Float64") or reader.width(place, 3) != 3:
        reader.fail(place, "points must be three Float32 or Float64 each")
    found = reader.numbers(place, 3 * point_count, finite=True)
    cells = {a.attributes.get("Name", ""): a for a in reader.section("Cells")}
    missing = [key for key in ("connectivity", "offsets", "types") if key not in cells]
    if missing:
        raise FormatError(f"the array {missing[0]!r} is missing among the Cells")
    codes = reader.numbers(cells["types"], cell_count).values.astype(np.int64)
    ends = reader.numbers(cells["offsets"], cell_count).values.astype(np.int64)
    first = np.concatenate([[0], ends])
    if (np.diff(first) < 0).any():
        reader.fail(cells["offsets"], "the offsets do not rise")
    nodes = reader.numbers(cells["connectivity"], int(first[-1]))

    def blame(index: int, message: str) -> NoReturn:
        if nodes.words is not None:
            nodes.words.fail(index, message)
        reader.fail(cells["connectivity"], message)

    fields = [
        [
            (array.attributes.get("Name", f"{section} {k}"), values if width == 1 else values.reshape(count, width))
            for k, array in enumerate(reader.section(section))
            if array.attributes.get("type") in TYPES
            for width in [reader.width(array)]
            for values in [reader.numbers(array, count * width).values]
        ]
        for section, count in (("PointData", point_count), ("CellData", cell_count))
    ]
    points = found.values.astype(np.float64).reshape(-1, 3)
    slots = _slots(reader, place, found, len(points))
    single = place.attributes["type"] == "Float32"
    return vtk_cells.parsed(
        points, slots, single, codes, first, nodes.values.astype(np.int64), fields[0], fields[1], blame
    )


def _slots(reader: _Reader, place: DataArray, found: Numbers, count: int) -> Slots:
    """The places of the coordinates, in whatever form they are stored."""
    if found.words is not None:
        return found.words.slots(np.arange(3 * count).reshape(-1, 3), "f8")
    kind = reader.order + TYPES[place.attributes["type"]]
    encoded, start, document = found.encoded, found.start, reader.document
    if encoded is None:  # no points, nothing to write
        return BinarySlots(np.empty((0, 3), dtype=np.int64), kind, np.empty(0, dtype=np.int64))
    encoding = encoded.encoding
    if not encoding.compressed and not encoding.base64:
        first = start + encoding.width
        size = np.dtype(kind).itemsize
        return BinarySlots(first + size * np.arange(3 * count).reshape(-1, 3), kind, np.arange(count))

    def rewrite(data: bytes, old: NDArray[np.float64], new: NDArray[np.float64]) -> bytes:
        numbers = np.frombuffer(encoded.payload, dtype=kind).copy().reshape(-1, 3)
        changed = old != new
        if not changed.any():
            return data
        numbers[changed] = new[changed]
        return _replace(data, document, place, start, encoded, encoded.written(numbers.tobytes()))

    return EncodedSlots(rewrite)


def _replace(data: bytes, document: Document, place: DataArray, start: int, old: Encoded, new: bytes) -> bytes:
    """The file with another encoded array of points, and with the offsets of the arrays behind it corrected."""
    if place.attributes.get("format") == "binary":
        first, stop = place.body
        return data[:first] + _refill(data[first:stop], document.text[first:stop], new) + data[stop:]
    longer = len(new) - old.length
    assert document.appended is not None
    pieces, at = [], 0
    for array in sorted(document.arrays, key=lambda array: array.tag):
        offset = array.attributes.get("offset", "").strip()
        if array.attributes.get("format") == "appended" and document.appended[1] + int(offset) > start and longer:
            tag = data[slice(*array.tag)]
            match = re.search(rb"\soffset\s*=\s*[\"']\s*(\d+)", tag)
            assert match is not None  # the parser has found it in the same tag
            pieces += [data[at : array.tag[0] + match.start(1)], b"%d" % (int(offset) + longer)]
            at = array.tag[0] + match.end(1)
    return b"".join([*pieces, data[at:start], new, data[start + old.length :]])


def _refill(body: bytes, text: bytes, new: bytes) -> bytes:
    """What an array contains, with other base64. text: the same with everything blanked out that is not base64."""
    old = np.frombuffer(body, dtype=np.uint8).copy()
    filled = ~np.isin(np.frombuffer(text, dtype=np.uint8), np.frombuffer(b" \t\r\n", dtype=np.uint8))
    if np.count_nonzero(filled) == len(new):
        old[filled] = np.frombuffer(new, dtype=np.uint8)
        return old.tobytes()
    first = int(np.argmax(filled))
    return body[:first] + new + old[first:][~filled[first:]].tobytes()


def write(mesh: Mesh) -> Written:
    """See Format. Arrays inline as text, points in double precision."""
    codes, sizes, nodes = vtk_cells.cells_out(mesh, name)
    point_fields, cell_fields, lost = vtk_cells.fields_out(mesh, name)
    points = convert.in_space(mesh)
    cells: dict[str, NDArray[Any]] = {
        "connectivity": nodes,
        "offsets": np.cumsum(sizes),
        "types": codes.astype(np.uint8),
    }
    text = [
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(codes)}">\n'
    ]
    sections: dict[str, vtk_cells.Fields] = {"PointData": point_fields, "CellData": cell_fields}
    sections["Points"] = [("Points", points)]
    for section, fields in sections.items():
        text.append(f"<{section}>\n")
        for called, array in fields:
            shown = quoteattr("".join(c if c.isprintable() else "?" for c in called))
            text += [
                f'<DataArray type="{NAMES[array.dtype.str[1:]]}" Name={shown} NumberOfComponents="{array.shape[1]}" '
            ]
            text += ['format="ascii">\n', vtk_cells.rows_text(array), "</DataArray>\n"]
        text.append(f"</{section}>\n")
    text.append("<Cells>\n")
    for called, column in cells.items():
        text.append(f'<DataArray type="{NAMES[column.dtype.str[1:]]}" Name="{called}" format="ascii">\n')
        text += [vtk_cells.lines_text(column), "</DataArray>\n"]
    text.append("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")
    return Written({".vtu": "".join(text).encode()}, lost)
