"""How the numbers of a binary legacy VTK file lie, of which ranks read ranges: unstructured grids."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.places import Lattice
from gmsnet.io.range_words import RangeWords, rows_of
from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.vtk_fields import attribute, field_arrays, keyword
from gmsnet.io.vtk_runs import Field, tables_of, told_by
from gmsnet.io.vtk_stream import Array, Line, Stream, opened

_HEAD = 4096  # bytes, in which a file begins
_LINES = 1 << 16  # bytes that a line has at most, with METADATA before it


class RangeStream(Stream):
    """A binary file that is not in memory."""

    file: Ranges

    def __init__(self, file: Ranges, at: int) -> None:
        super().__init__(b"", at, True)
        self.file = file

    def _ahead(self) -> Stream:
        data = self.file.read(self.at, max(0, min(_LINES, self.file.size - self.at)))
        return Stream(bytes(data), 0, True)

    def line(self, skip_metadata: bool = True) -> Line:
        """See Stream."""
        ahead, begin = self._ahead(), self.at
        found = ahead.line(skip_metadata)
        self.at += ahead.at
        if not found.words and self.at < self.file.size:
            self.fail(begin, "a line or METADATA of very many bytes")
        return Line(begin + found.start, found.words)

    def next_is(self, keyword: bytes) -> bool:
        """See Stream."""
        return self._ahead().next_is(keyword)

    def bytes(self) -> RangeWords:
        """See Stream."""
        return RangeWords(self.file, ">", self.at)

    def skip_strings(self, count: int) -> None:
        """See Stream."""
        for _ in range(count):
            ahead = Stream(bytes(self.file.read(self.at, min(8, self.file.size - self.at))), 0, True)
            self.at += ahead.length_of_string()
        if self.at > self.file.size:
            self.fail(self.file.size, "a string goes beyond the end of the file")


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; None for texts and polygonal data, and for grids as in ``vtkhdf.plan``.

    Raises FormatError for a file that is damaged.
    """
    head, polygonal = opened(bytes(file.read(0, min(file.size, _HEAD))))
    if polygonal or not head.binary:
        return None
    stream = RangeStream(file, head.at)
    arrays, counts = dict[str, Rows](), dict[str, int]()
    fields: dict[str, list[Field]] = {}
    others, seen = list[str](), set[str]()
    while (line := stream.line()).words:
        if line.key in seen:
            return None
        if line.key in ("POINTS", "CELLS", "CELL_TYPES", "POINT_DATA", "CELL_DATA"):
            seen.add(line.key)
        if line.key == "POINTS":
            text, kind = stream.expect(line, "POINTS count type")
            arrays["POINTS"] = _rows(stream.array(line, 3 * stream.count(line, text), kind), 3)
        elif line.key == "CELLS":
            count, size = (stream.count(line, text) for text in stream.expect(line, "CELLS count size"))
            if stream.next_is(b"OFFSETS"):
                for key, length in (("OFFSETS", count), ("CONNECTIVITY", size)):
                    part = keyword(stream, key)
                    arrays[key] = _rows(stream.array(part, length, stream.expect(part, f"{key} type")[0]))
            else:
                arrays["CELLS"], counts["CELLS"] = _rows(stream.array(line, size, "int")), count
        elif line.key == "CELL_TYPES":
            (text,) = stream.expect(line, "CELL_TYPES count")
            arrays["CELL_TYPES"] = _rows(stream.array(line, stream.count(line, text), "int"))
        elif line.key in ("POINT_DATA", "CELL_DATA"):
            (text,) = stream.expect(line, f"{line.key} count")
            counts[line.key], fields[line.key] = stream.count(line, text), []
        elif fields:
            place = list(fields)[-1]
            found = attribute(stream, line, counts[place], others, _placed)
            fields[place] += [Field(name, rows) for name, rows in found]
        elif line.key == "FIELD":
            field_arrays(stream, line, None, others, _placed)
        else:
            return None
    return _plan(file, arrays, counts, fields)


def _rows(array: Array, width: int = 1) -> Rows:
    """Where numbers stand, so many in a row."""
    (lattice,) = array.at.lattices
    size = np.dtype(array.kind).itemsize * width
    columns = range(0, size, size // width)
    return rows_of(Lattice(lattice.start, lattice.rows // width, size, columns), f">{array.kind}")


def _placed(stream: Stream, line: Line, rows: int, width: int, kind: str) -> Rows | None:
    if kind.lower() == "bit":
        stream.array(line, (rows * width + 7) // 8, "unsigned_char")
        return None
    return _rows(stream.array(line, rows * width, kind), max(width, 1))


def _plan(file: Ranges, arrays: dict[str, Rows], counts: dict[str, int], fields: dict[str, list[Field]]) -> Plan | None:
    if not {"POINTS", "CELL_TYPES"} <= arrays.keys() or not {"CELLS", "CONNECTIVITY"} & arrays.keys():
        return None
    points, types, offsets = arrays["POINTS"], arrays["CELL_TYPES"], arrays.get("OFFSETS")
    nodes, cells = arrays["CELLS" if offsets is None else "CONNECTIVITY"], types.rows
    listed = counts["CELLS"] if offsets is None else offsets.rows - 1
    wrong = counts.get("POINT_DATA", points.rows) != points.rows or counts.get("CELL_DATA", cells) != cells
    if wrong or points.dtype not in (">f4", ">f8") or not cells or listed != cells:
        return None

    def begins(first: int, last: int) -> NDArray[Any]:
        assert offsets is not None
        return offsets.of(file, first, last)[:, 0]

    told = told_by(file, fields.get("POINT_DATA", []), fields.get("CELL_DATA", []), (points.rows, cells))
    if told is None or nodes.dtype[1] not in "iu" or (offsets is not None and offsets.dtype[1] not in "iu"):
        return None
    tables = tables_of(file, types, nodes, None if offsets is None else begins, told.without_ghosts)
    blocks = [[table] for table in tables]
    return Plan([Column(points)], blocks, points.dtype == ">f4", fixed=told.fixed) if tables else None
