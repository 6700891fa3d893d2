"""How the numbers of a VTU file lie whose arrays are appended, or stand inline in base64; compressed or not."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import EncodedRows, Listed, Ranges
from gmsnet.io.vtk_runs import Field, tables_of, told_by
from gmsnet.io.vtu_arrays import Encoding
from gmsnet.io.vtu_reader import ANYWAY, PER_BYTE, TYPES, Reader, one_word
from gmsnet.io.vtu_skeleton import MOST, Skeleton, skeleton
from gmsnet.io.vtu_sources import Blocks, Plain, VtuPoints, rows_at
from gmsnet.io.vtu_xml import DataArray

END = b"</AppendedData></VTKFile>"
_BEGIN, _TAIL = re.compile(rb"<AppendedData[^>]*>\s*_"), re.compile(rb"</AppendedData\s*>\s*</VTKFile\s*>\s*\Z")


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; None where they are text, and for grids as in ``vtkhdf.plan``."""
    text, stop = _opened(file)
    if text is None:
        return None
    reader = Reader(text.text)
    if len(reader.document.pieces) != 1:
        return None
    points, cells = reader.count("NumberOfPoints"), reader.count("NumberOfCells")
    arrays = _arrays(file, reader, text, stop)
    if arrays is None or not cells:
        return None
    fields = [_fields(arrays, reader, *each) for each in (("PointData", points), ("CellData", cells))]
    place, listed = reader.section("Points"), {a.attributes.get("Name", ""): a for a in reader.section("Cells")}
    if len(place) != 1 or not {"connectivity", "offsets", "types"} <= listed.keys() or reader.width(place[0], 3) != 3:
        return None
    at = arrays[place[0].tag]
    nodes, ends, types = (arrays[listed[key].tag] for key in ("connectivity", "offsets", "types"))
    whole = all(array.dtype[1] in "iu" for array in (nodes, ends, types)) and at.dtype[1:] in ("f4", "f8")
    told = None if None in fields else told_by(file, fields[0] or (), fields[1] or (), (points, cells))
    if told is None or not whole or (at.rows, ends.rows, types.rows) != (3 * points, cells, cells):
        return None

    def offsets(first: int, last: int) -> NDArray[Any]:
        """With the beginning of the first cell, which the file has not."""
        found = ends.of(file, max(first - 1, 0), last - 1)[:, 0].astype(np.int64)
        return found if first else np.append(0, found)

    tables = tables_of(file, types, nodes, offsets, told)
    if not tables:
        return None
    column = Column(at.cut(0, points, 3, 3))
    encoded = _encoded(at, reader)
    return Plan([column], [[table] for table in tables], at.dtype[1:] == "f4", (), told.fixed, encoded)


def _opened(file: Ranges) -> tuple[Skeleton | None, int]:
    """The XML of a file, and where its appended data end."""
    found = _BEGIN.search(file.read(0, min(file.size, MOST)))
    if found is None:
        return skeleton(file), file.size
    tail = file.read(max(0, file.size - len(END) * 4), min(file.size, len(END) * 4))
    ending = _TAIL.search(tail)
    if ending is None:
        return None, 0
    return Skeleton(bytes(file.read(0, found.end())) + END), file.size - len(tail) + ending.start()


def _encoded(rows: Listed, reader: Reader) -> VtuPoints | None:
    """How points are written again that do not stand in the file as they are."""
    if not isinstance(rows, EncodedRows):
        return None
    assert isinstance(rows.source, Plain | Blocks)
    begin, appended = rows.source.begin, reader.document.appended
    offsets = [array.offset for array in reader.document.arrays if array.offset is not None]
    return VtuPoints(rows.source, tuple(each for each in offsets if appended and appended[1] + each[0] > begin))


def _fields(arrays: Mapping[tuple[int, int], Listed], reader: Reader, section: str, count: int) -> list[Field] | None:
    """The data of points or cells, of which there are so many; None where there are not as many numbers."""
    found = list[Field]()
    for array in reader.section(section):
        rows, width = arrays.get(array.tag), reader.width(array, 1)
        if array.attributes.get("type") not in TYPES:
            continue
        if rows is None or rows.rows != count * width:
            return None
        found.append(Field(array.attributes.get("Name", ""), rows.cut(0, count, width, width)))
    return found


def _arrays(file: Ranges, reader: Reader, text: Skeleton, stop: int) -> dict[tuple[int, int], Listed] | None:
    """All arrays, by their tags; None where one that is needed is text, or one lies over others, or over the end."""
    found, spans, numbers = dict[tuple[int, int], Listed](), list[tuple[int, int]](), 0
    appended = reader.document.appended
    for array in reader.document.arrays:
        kind, how = TYPES.get(array.attributes.get("type", "")), array.attributes.get("format", "ascii")
        there: tuple[Listed, int] | None = None
        begin, end = -1, stop
        if how == "appended" and appended is not None and array.offset is not None:
            begin, in_base64 = appended[1] + array.offset[0], appended[0] == "base64"
        elif how == "binary" and (word := _inline(reader, text, array)) is not None:
            (begin, end), in_base64 = word, True
        if 0 <= begin < end:
            encoding = Encoding(reader.header, reader.compressor, in_base64)
            there = rows_at(file, begin, end, encoding, reader.order + (kind or "u1"))
        if there is not None and how == "binary" and there[1] != end:
            return None
        if there is None and (how == "appended" or _is_needed(array)):
            return None
        if there is not None:
            spans.append((begin, there[1]))
            numbers += there[0].rows if isinstance(there[0], EncodedRows) else 0
            if kind is not None:
                found[array.tag] = there[0]
    spans = sorted(spans)
    apart = all(one[1] <= other[0] for one, other in zip(spans, [*spans[1:], (stop, stop)], strict=True))
    return found if apart and numbers <= ANYWAY + PER_BYTE * file.size else None


def _inline(reader: Reader, text: Skeleton, array: DataArray) -> tuple[int, int] | None:
    """Where the letters of an array begin in the file, and the byte behind them; None where they are several words."""
    words = list[tuple[int, int] | None]()
    for first, end in reader.document.visible(*array.body):
        if first in text.runs:
            words.append(text.runs[first])
        elif text.text[first:end].strip():
            word = one_word(memoryview(text.text)[first:end])
            words.append(None if word is None else (text.place(first + word[0]), text.place(first + word[1])))
    return words[0] if len(words) == 1 else None


def _is_needed(array: DataArray) -> bool:
    return array.section in ("Points", "Cells")
