"""Unstructured grids in VTK's XML (``.vtu``): arrays as text, base64 or raw, inline or appended, compressed or not.

Only the array of the points is ever written again, in its own encoding; where it gets longer or shorter, the offsets
of the arrays behind it follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple, NoReturn
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, vtk_cells, vtk_ghosts, vtu_ranges
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_words
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import Lattice, Places
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.splice import BinarySlots, EncodedSlots, Slots
from gmsnet.io.vtu_arrays import Encoded
from gmsnet.io.vtu_reader import TYPES, Reader, one_word
from gmsnet.io.vtu_xml import DataArray, Document
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import FaceCorners, names_normals

name = "VTU"
suffixes: tuple[str, ...] = (".vtu",)

NAMES = {kind: called for called, kind in TYPES.items()}
_IS_BLANK = np.isin(np.arange(256), list(b" \t\r\n"))


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    return vtk_ghosts.held(facts(Reader(files[".vtu"])))


def plan(file: Ranges) -> Plan | None:
    """See ``vtu_ranges.plan``."""
    return vtu_ranges.plan(file)


def facts(reader: Reader) -> Parsed:
    """The facts of a file."""
    return parsed(reader, *_cells(reader, reader.count("NumberOfCells")))


def is_empty(reader: Reader) -> bool:
    """Whether there are no cells, as in the pieces of processes that had none."""
    return not reader.document.pieces or not reader.count("NumberOfCells")


def _cells(reader: Reader, count: int) -> tuple[NDArray[np.int64], Listed]:
    """VTK's types of the cells, and their nodes."""
    cells = {a.attributes.get("Name", ""): a for a in reader.section("Cells")}
    missing = [key for key in ("connectivity", "offsets", "types") if key not in cells]
    if missing:
        raise FormatError(f"the array {missing[0]!r} is missing among the Cells")
    codes = reader.numbers(cells["types"], count).values.astype(np.int64, copy=False)
    return codes, listed(reader, cells, count)


class Listed(NamedTuple):
    """sizes: (n,) the number of nodes of each cell; nodes: of all, one after another; fail: blames one of them."""

    sizes: NDArray[np.int64]
    nodes: NDArray[np.int64]
    fail: Callable[[int, str], NoReturn]


def listed(reader: Reader, cells: Mapping[str, DataArray], count: int) -> Listed:
    """The nodes of ``count`` cells, of the arrays of one section by name."""
    ends = reader.numbers(cells["offsets"], count).values.astype(np.int64, copy=False)
    sizes = np.diff(ends, prepend=0)
    if (sizes < 0).any():
        reader.fail(cells["offsets"], "the offsets do not rise")
    nodes = reader.numbers(cells["connectivity"], int(ends[-1]) if len(ends) else 0)

    def blame(index: int, message: str) -> NoReturn:
        if nodes.words is not None:
            nodes.words.fail(index, message)
        reader.fail(cells["connectivity"], message)

    return Listed(sizes, nodes.values.astype(np.int64, copy=False), blame)


def parsed(reader: Reader, codes: NDArray[np.int64], cells: Listed) -> Parsed:
    """The facts of a file with these cells. codes: (n,) VTK's types."""
    point_count = reader.count("NumberOfPoints")
    places = reader.section("Points")
    if len(places) != 1:
        raise FormatError(f"the Piece has {len(places)} arrays of Points instead of one")
    place = places[0]
    if place.attributes.get("type") not in ("Float32", "Float64") or reader.width(place, 3) != 3:
        reader.fail(place, "points must be three Float32 or Float64 each")
    points, slots = _points(reader, place, point_count)
    fields = [
        [
            (array.attributes.get("Name", f"{section} {k}"), values if width == 1 else values.reshape(count, width))
            for k, array in enumerate(reader.section(section))
            if array.attributes.get("type") in TYPES
            for width in [reader.width(array)]
            for values in [reader.numbers(array, count * width).values]
        ]
        for section, count in (("PointData", point_count), ("CellData", len(codes)))
    ]
    reader.check_apart(place)
    single = place.attributes["type"] == "Float32"
    unread = [
        f"the {'texts' if array.section else 'field'} {array.attributes.get('Name', '')!r}"
        for array in reader.document.arrays
        if not array.section  # facts about the whole grid
        or (array.section in ("PointData", "CellData") and array.attributes.get("type") not in TYPES)
    ]
    sizes, nodes, blame = cells
    return vtk_cells.parsed(points, slots, single, codes, sizes, nodes, fields[0], fields[1], blame, unread)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    reader = Reader(files[".vtu"])
    return normals_in(reader, cells, reader.count("NumberOfCells"))


def normals_in(reader: Reader, cells: Sequence[CellBlock], count: int) -> list[Normals]:
    """The normals in a file with so many cells; none of these where lines were cut into their pieces."""
    corners, result, whole = FaceCorners.of(cells), [], sum(len(block.nodes) for block in cells)
    sections = [("PointData", reader.count("NumberOfPoints"), corners.node)]
    sections += [("CellData", count, corners.cell)] * (count == whole)
    for section, rows, row in sections:
        for array in reader.section(section):
            called, kind = array.attributes.get("Name", ""), array.attributes.get("type")
            if names_normals(called) and kind in ("Float32", "Float64") and reader.width(array) == 3:
                if array.attributes.get("format", "ascii") == "ascii":
                    words = reader.words(array, 3 * rows)
                    result.append(in_words(called, words, words.take(3 * rows, TYPES[kind]), TYPES[kind], row))
                    continue
                result.append(Normals(called, *_vectors(reader, array, rows), row))
                reader.check_apart(array)
    return result


def _points(reader: Reader, place: DataArray, count: int) -> tuple[NDArray[np.float64], Slots]:
    """The points, and the places of their coordinates in whatever form they are stored."""
    if place.attributes.get("format", "ascii") == "ascii":
        name = TYPES[place.attributes["type"]]
        words = reader.words(place, 3 * count)
        return words.coordinates(words.take(3 * count, name), name)
    points, slots = _vectors(reader, place, count)
    if not np.isfinite(points).all():
        reader.fail(place, "a coordinate is not a finite number")
    return points, slots


def _vectors(reader: Reader, place: DataArray, count: int) -> tuple[NDArray[np.float64], Slots]:
    """The vectors (count, 3) of an array that is encoded, and the places of their numbers."""
    found = reader.numbers(place, 3 * count)
    points = found.values.astype(np.float64, copy=False).reshape(-1, 3)
    kind, encoded = reader.order + TYPES[place.attributes["type"]], found.encoded
    if encoded is None:  # no points, nothing to write
        return points, BinarySlots(Places(), kind)
    encoding, size = encoded.encoding, np.dtype(kind).itemsize
    if encoding.compressor is None and not encoding.base64:
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
    changes: list[tuple[int, int, bytes]] = [(start, start + old.length, new)]
    for array in document.arrays:
        if longer and array.offset is not None and document.appended[1] + array.offset[0] > start:
            offset, first, end = array.offset
            changes.append((first, end, b"%d" % (offset + longer)))
    pieces: list[Piece] = []
    at = 0
    for first, end, what in sorted(changes):
        pieces += [whole[at:first], what]
        at = end
    return [*pieces, whole[at:]]


def _refilled(body: memoryview, document: Document, first: int, stop: int, new: bytes) -> list[Piece]:
    """What an array contains, between these bytes of the file, with other base64."""
    parts, word = document.visible(first, stop), one_word(body)
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
