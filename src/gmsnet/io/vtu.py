"""Unstructured grids in VTK's XML (``.vtu``): arrays as text, base64 or raw, inline or appended, compressed or not.

Only the array of the points is ever written again, in its own encoding; where it gets longer or shorter, the offsets
of the arrays behind it follow.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NoReturn
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, vtk_cells
from gmsnet.io.document import Parsed, Written
from gmsnet.io.mapped import Data
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import Lattice, Places
from gmsnet.io.splice import BinarySlots, EncodedSlots, Slots
from gmsnet.io.text import Text, fail
from gmsnet.io.vtu_arrays import MOST_INFLATED, Encoded, Encoding, decode
from gmsnet.io.vtu_xml import DataArray, Document, parse
from gmsnet.io.words import TextWords, typed
from gmsnet.mesh import Mesh

name = "VTU"
suffixes = (".vtu",)

TYPES = {f"{word}{8 * size}": f"{code}{size}" for word, code in (("Int", "i"), ("UInt", "u")) for size in (1, 2, 4, 8)}
TYPES |= {"Float32": "f4", "Float64": "f8"}
NAMES = {kind: called for called, kind in TYPES.items()}
_IS_BLANK = np.isin(np.arange(256), list(b" \t\r\n"))


@dataclass(frozen=True)
class Numbers:
    """The values of an array, and where they stand: as words of a text or encoded."""

    values: NDArray[Any]
    words: TextWords | None
    encoded: Encoded | None
    start: int


class _Reader:
    """Decodes the arrays of one file. budget: how many bytes may still be unpacked."""

    def __init__(self, data: Data) -> None:
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

    def numbers(self, array: DataArray, count: int) -> Numbers:
        """The ``count`` numbers of an array. Raises FormatError where there are fewer or more."""
        kind = TYPES.get(array.attributes.get("type", ""))
        if kind is None:
            self.fail(array, f"numbers of type {array.attributes.get('type', '')[:24]!r} are not supported")
        how = array.attributes.get("format", "ascii")
        if how == "ascii":
            words = self.words(array, count)
            return Numbers(typed(words.values(words.take(count, kind), kind, finite=False), kind), words, None, 0)
        start, stored, in_base64 = self._stored(array, how)
        self.budget -= count * int(kind[1])
        if count * int(kind[1]) > MOST_INFLATED * len(self.data) or self.budget < 0:
            self.fail(array, f"{count} numbers cannot be in a file of {len(self.data)} bytes")
        if not count:
            return Numbers(np.empty(0, dtype=kind), None, None, start)
        try:
            found, payload = decode(stored, Encoding(self.header, self.compressed, in_base64), count * int(kind[1]))
        except FormatError as error:
            self.fail(array, str(error))
        if how == "binary" and found.length != len(stored):
            self.fail(array, "more follows behind its last number")
        return Numbers(np.frombuffer(payload, dtype=self.order + kind).astype(kind), None, found, start)

    def words(self, array: DataArray, count: int) -> TextWords:
        """The numbers of an array that is text. Raises FormatError where there are not ``count``."""
        text = Text(self.data, stop=array.body[1], ends=b"<")
        parts = self.document.visible(*array.body)
        found = [text.until(stop).tokens(start)[0] for start, stop in parts]
        starts = found[0] if len(found) == 1 else np.concatenate(found)
        if len(starts) < count:
            text.fail(array.body[1], f"expected {count - len(starts)} more numbers, the section ends")
        if len(starts) > count:
            text.fail(int(starts[count]), f"more than the expected {count} numbers")
        return TextWords(text, starts)

    def _stored(self, array: DataArray, how: str) -> tuple[int, memoryview, bool]:
        """Where an encoded array begins, the bytes from there on, and whether they are base64."""
        if how == "binary":
            parts = [memoryview(self.data)[slice(*span)] for span in self.document.visible(*array.body)]
            words = [part[slice(*span)] for part in parts if (span := _one_word(part))]
            if len(words) < len(parts):
                words = [memoryview(word) for part in parts for word in bytes(part).split()]
            return array.body[0], words[0] if len(words) == 1 else memoryview(b"".join(words)), True
        offset = array.attributes.get("offset", "").strip()
        if how != "appended" or self.document.appended is None or not re.fullmatch(r"\d{1,18}", offset, re.ASCII):
            self.fail(array, f"its format is {how[:24]!r} with the offset {offset[:24]!r}, which cannot be found")
        encoding, start, stop = self.document.appended
        if start + int(offset) > stop:
            self.fail(array, f"its offset {offset} lies behind the end of the file")
        return start + int(offset), memoryview(self.data)[start + int(offset) : stop], encoding == "base64"


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    reader = _Reader(files[".vtu"])
    point_count, cell_count = reader.count("NumberOfPoints"), reader.count("NumberOfCells")
    places = reader.section("Points")
    if len(places) != 1:
        raise FormatError(f"the Piece has {len(places)} arrays of Points instead of one")
    place = places[0]
    if place.attributes.get("type") not in ("Float32", "Float64") or reader.width(place, 3) != 3:
        reader.fail(place, "points must be three Float32 or Float64 each")
    points, slots = _points(reader, place, point_count)
    cells = {a.attributes.get("Name", ""): a for a in reader.section("Cells")}
    missing = [key for key in ("connectivity", "offsets", "types") if key not in cells]
    if missing:
        raise FormatError(f"the array {missing[0]!r} is missing among the Cells")
    codes = reader.numbers(cells["types"], cell_count).values.astype(np.int64, copy=False)
    ends = reader.numbers(cells["offsets"], cell_count).values.astype(np.int64, copy=False)
    sizes = np.diff(ends, prepend=0)
    if (sizes < 0).any():
        reader.fail(cells["offsets"], "the offsets do not rise")
    nodes = reader.numbers(cells["connectivity"], int(ends[-1]) if len(ends) else 0)

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
    single = place.attributes["type"] == "Float32"
    return vtk_cells.parsed(
        points, slots, single, codes, sizes, nodes.values.astype(np.int64, copy=False), fields[0], fields[1], blame
    )


def _points(reader: _Reader, place: DataArray, count: int) -> tuple[NDArray[np.float64], Slots]:
    """The points, and the places of their coordinates in whatever form they are stored."""
    name = TYPES[place.attributes["type"]]
    if place.attributes.get("format", "ascii") == "ascii":
        words = reader.words(place, 3 * count)
        return words.coordinates(words.take(3 * count, name), name)
    found = reader.numbers(place, 3 * count)
    if not np.isfinite(found.values).all():
        reader.fail(place, "a coordinate is not a finite number")
    points = found.values.astype(np.float64, copy=False).reshape(-1, 3)
    kind, encoded = reader.order + name, found.encoded
    if encoded is None:  # no points, nothing to write
        return points, BinarySlots(Places(), kind)
    encoding, size = encoded.encoding, np.dtype(kind).itemsize
    if not encoding.compressed and not encoding.base64:
        lattice = Lattice(found.start + encoding.width, count, 3 * size, (0, size, 2 * size))
        return points, BinarySlots(Places(lattice), kind)
    document = replace(reader.document, data=b"")  # the file itself is handed over with each call
    return points, EncodedSlots(partial(_rewritten, document, place, found.start, encoded, kind))


def _rewritten(
    document: Document, place: DataArray, start: int, encoded: Encoded, kind: str, data: Data,
    old: NDArray[np.float64], new: NDArray[np.float64],
) -> list[Piece]:  # fmt: skip
    """The file with other points in an array that is encoded."""
    numbers = old.astype(kind)
    before, changed = numbers.tobytes(), old != new
    if not changed.any():
        return [memoryview(data)]
    numbers[changed] = new[changed]
    return _replaced(data, document, place, start, encoded, encoded.written(before, numbers.tobytes()))


def _replaced(data: Data, document: Document, place: DataArray, start: int, old: Encoded, new: bytes) -> list[Piece]:
    """The file with another encoded array of points, and with the offsets of the arrays behind it corrected."""
    whole = memoryview(data)
    if place.attributes.get("format") == "binary":
        first, stop = place.body
        return [whole[:first], *_refilled(whole[first:stop], document, first, stop, new), whole[stop:]]
    longer = len(new) - old.length
    assert document.appended is not None
    pieces: list[Piece] = []
    at = 0
    for array in sorted(document.arrays, key=lambda array: array.tag):
        offset = array.attributes.get("offset", "").strip()
        if array.attributes.get("format") == "appended" and document.appended[1] + int(offset) > start and longer:
            tag = data[slice(*array.tag)]
            match = re.search(rb"\soffset\s*=\s*[\"']\s*(\d+)", tag)
            assert match is not None  # the parser has found it in the same tag
            pieces += [whole[at : array.tag[0] + match.start(1)], b"%d" % (int(offset) + longer)]
            at = array.tag[0] + match.end(1)
    return [*pieces, whole[at:start], new, whole[start + old.length :]]


def _refilled(body: memoryview, document: Document, first: int, stop: int, new: bytes) -> list[Piece]:
    """What an array contains, between these bytes of the file, with other base64."""
    parts, word = document.visible(first, stop), _one_word(body)
    if len(parts) == 1 and word:
        return [body[: word[0]], new, body[word[1] :]]
    filled = np.zeros(len(body), dtype=bool)
    old = np.frombuffer(body, dtype=np.uint8).copy()
    for start, end in parts:
        filled[start - first : end - first] = ~_IS_BLANK[old[start - first : end - first]]
    if np.count_nonzero(filled) == len(new):
        old[filled] = np.frombuffer(new, dtype=np.uint8)
        return [old.tobytes()]
    at = int(np.argmax(filled))
    return [body[:at], new, old[at:][~filled[at:]].tobytes()]


def _one_word(text: memoryview) -> tuple[int, int] | None:
    """Where the one word of a text begins and ends; None if it has more, or none."""
    visible = np.frombuffer(text, dtype=np.uint8) > ord(" ")
    first, end = int(np.argmax(visible)), len(text) - int(np.argmax(visible[::-1]))
    return (first, end) if np.count_nonzero(visible) == end - first > 0 else None


def write(mesh: Mesh) -> Written:
    """See Format. Arrays inline as text, points in double precision."""
    convert.check_kinds(mesh, name, vtk_cells.CODES)
    point_fields, cell_fields, lost = vtk_cells.fields_out(mesh, name)
    return Written({".vtu": Pieces(lambda: _text(mesh, point_fields, cell_fields))}, lost)


def _text(mesh: Mesh, point_fields: vtk_cells.Fields, cell_fields: vtk_cells.Fields) -> Iterator[Piece]:
    cells = sum(len(block.nodes) for block in mesh.cells)
    yield (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{cells}">\n'
    ).encode()
    sections: dict[str, vtk_cells.Fields] = {"PointData": point_fields, "CellData": cell_fields}
    sections["Points"] = [("Points", convert.in_space(mesh))]
    for section, fields in sections.items():
        yield f"<{section}>\n".encode()
        for called, array in fields:
            shown = quoteattr("".join(c if c.isprintable() else "?" for c in called))
            head = f'<DataArray type="{NAMES[array.dtype.str[1:]]}" Name={shown} NumberOfComponents="{array.shape[1]}" '
            yield f'{head}format="ascii">\n'.encode()
            yield from vtk_cells.rows_text(array)
            yield b"</DataArray>\n"
        yield f"</{section}>\n".encode()
    yield b"<Cells>\n"
    for called, kind, column in (
        ("connectivity", "Int64", (block.nodes[some] for block, some in vtk_cells.parts(mesh))),
        ("offsets", "Int64", _offsets(mesh)),
        ("types", "UInt8", vtk_cells.codes(mesh)),
    ):
        yield f'<DataArray type="{kind}" Name="{called}" format="ascii">\n'.encode()
        yield from vtk_cells.lines_text(column)
        yield b"</DataArray>\n"
    yield b"</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"


def _offsets(mesh: Mesh) -> Iterator[NDArray[np.int64]]:
    """How many nodes the cells have up to each, some at a time."""
    end = 0
    for block, some in vtk_cells.parts(mesh):
        count, size = block.nodes[some].shape
        yield end + size * np.arange(1, count + 1)
        end += size * count
