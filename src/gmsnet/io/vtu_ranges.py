"""How the numbers of a VTU file lie whose arrays are appended as they are: neither compressed nor in base64."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.vtk_runs import Field, tables_of, told_by
from gmsnet.io.vtu_reader import TYPES, Reader
from gmsnet.io.vtu_xml import DataArray

MOST = 1 << 20  # bytes before the appended data, of files that are planned; others have thousands of arrays
END = b"</AppendedData></VTKFile>"
_BEGIN, _TAIL = re.compile(rb"<AppendedData[^>]*>\s*_"), re.compile(rb"</AppendedData\s*>\s*</VTKFile\s*>\s*\Z")


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; None for other encodings, and for grids as in ``vtkhdf.plan``."""
    head = bytes(file.read(0, min(file.size, MOST)))
    found = _BEGIN.search(head)
    tail = bytes(file.read(max(0, file.size - len(END) * 4), min(file.size, len(END) * 4)))
    ending = _TAIL.search(tail)
    if found is None or ending is None:
        return None
    reader = Reader(head[: found.end()] + END)
    appended = reader.document.appended
    if appended is None or appended[0] != "raw" or reader.compressed or len(reader.document.pieces) != 1:
        return None
    points, cells = reader.count("NumberOfPoints"), reader.count("NumberOfCells")
    arrays = _arrays(file, reader, found.end(), file.size - len(tail) + ending.start())
    if arrays is None or not cells:
        return None
    fields = {key: [_field(arrays, each, reader) for each in reader.section(key)] for key in ("PointData", "CellData")}
    place, listed = reader.section("Points"), {a.attributes.get("Name", ""): a for a in reader.section("Cells")}
    if len(place) != 1 or not {"connectivity", "offsets", "types"} <= listed.keys() or reader.width(place[0], 3) != 3:
        return None
    at = arrays[place[0].tag]
    nodes, ends, types = (arrays[listed[key].tag] for key in ("connectivity", "offsets", "types"))
    whole = all(array.dtype[1] in "iu" for array in (nodes, ends, types)) and at.dtype[1:] in ("f4", "f8")
    told = told_by(file, fields["PointData"], fields["CellData"], (points, cells))
    if told is None or not whole or (at.rows, ends.rows, types.rows) != (3 * points, cells, cells):
        return None

    def offsets(first: int, last: int) -> NDArray[Any]:
        """With the beginning of the first cell, which the file has not."""
        found = ends.of(file, max(first - 1, 0), last - 1)[:, 0].astype(np.int64)
        return found if first else np.append(0, found)

    def some(first: int, last: int) -> NDArray[Any]:
        return types.of(file, first, last)[:, 0]

    tables = tables_of(some, cells, nodes.rows, nodes, offsets, told.regions)
    if not tables:
        return None
    size = int(at.dtype[2:])
    column = Column(Rows(at.start, points, 3 * size, at.dtype, 3))
    return Plan([column], [[table] for table in tables], size == 4, fixed=told.fixed)


def _field(arrays: Mapping[tuple[int, int], Rows], array: DataArray, reader: Reader) -> Field:
    rows, width = arrays.get(array.tag), reader.width(array, 1)
    if rows is not None and width > 1:
        rows = rows.cut(0, rows.rows // width, width, width)
    return Field(array.attributes.get("Name", ""), rows)


def _arrays(file: Ranges, reader: Reader, begin: int, end: int) -> dict[tuple[int, int], Rows] | None:
    """All arrays, by their tags; None where one is not appended, or lies over others, or over the end."""
    width, found, spans = np.dtype(reader.header).itemsize, dict[tuple[int, int], Rows](), list[tuple[int, int]]()
    for array in reader.document.arrays:
        kind = TYPES.get(array.attributes.get("type", ""))
        if array.offset is None or begin + array.offset[0] + width > end:
            return None
        first = begin + array.offset[0] + width
        size = int(np.frombuffer(file.read(first - width, width), dtype=reader.header)[0])
        spans.append((first - width, first + size))
        if kind is not None:
            found[array.tag] = Rows(first, size // int(kind[1:]), int(kind[1:]), reader.order + kind)
        elif _is_needed(array):
            return None
    spans = sorted(spans)
    apart = all(one[1] <= other[0] for one, other in zip(spans, [*spans[1:], (end, end)], strict=True))
    return found if apart else None


def _is_needed(array: DataArray) -> bool:
    return array.section in ("Points", "Cells")
