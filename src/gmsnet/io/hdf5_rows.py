"""Data sets of HDF5 as rows of numbers, and files whose coordinates the library itself has to write again.

That is where they are compressed, in chunks, or in the header of their data set (the layout COMPACT).
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data
from gmsnet.io.hdf5 import File, Node, library, said_of, shown
from gmsnet.io.ranges import Column, Moves, put
from gmsnet.io.rows import AT_ONCE, EncodedRows, Listed, Ranges, Rows
from gmsnet.io.temporary import Temporary


@dataclass(frozen=True)
class Stored:
    """The numbers of a data set, which the library reads. path: within the file. width: how many have the same place
    along the first axis."""

    path: str
    dtype: str
    width: int

    def numbers(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """See Source."""
        begin, end = first // self.width, -(-last // self.width)
        with File.opened(file.path) as opened:
            data = opened.root.need(self.path)
            with said_of(self.path):
                found = np.asarray(data.thing[begin:end]).reshape(-1)
        return found[first - begin * self.width : last - begin * self.width]

    def where(self, number: int) -> str:
        """See Source."""
        return f"{shown(self.path)}, number {number}"


@dataclass(frozen=True)
class StoredPoints:
    """Coordinates in data sets. parts: path → columns, one behind the other, of data sets that are written together: by
    the library, unless the numbers of all stand in the file as they are."""

    parts: Sequence[Mapping[str, Sequence[Column]]]

    def contents(self, file: Ranges, moves: Moves, folder: str) -> Iterator[bytes]:
        """See Encoded."""
        with Temporary(folder) as temporary, _Stream(temporary.create(), "r+") as stream:
            for part in file.copied(0, file.size):
                stream.write(part)
            stream.raise_error()
            for columns in self.parts:
                every = [each for listed in columns.values() for each in listed]
                in_place = [(each, each.rows) for each in every if isinstance(each.rows, Rows)]
                if len(in_place) == len(every):
                    for column, rows in in_place:
                        _splice(stream, column, rows, moves)
                else:
                    _refill(stream, columns, moves)
            stream.seek(0)
            while part := stream.read(AT_ONCE):
                yield part


def stored_points(parts: Sequence[Mapping[str, Column]]) -> StoredPoints | None:
    """How coordinates in data sets (path → column) are written again; see stored_columns."""
    return stored_columns([{path: [column] for path, column in columns.items()} for columns in parts])


def stored_columns(parts: Sequence[Mapping[str, Sequence[Column]]]) -> StoredPoints | None:
    """See StoredPoints; None where all stand in the file as they are."""
    every = (column for columns in parts for listed in columns.values() for column in listed)
    in_place = all(isinstance(column.rows, Rows) for column in every)
    return None if in_place else StoredPoints(parts)


def _splice(stream: _Stream, column: Column, rows: Rows, moves: Moves) -> None:
    """Numbers that stand in the file as they are."""
    step = max(1, AT_ONCE // rows.stride)
    for begin in range(0, rows.rows, step):
        part = replace(rows, start=rows.start + begin * rows.stride, rows=min(step, rows.rows - begin))
        stream.seek(part.start)
        data = bytearray(stream.read(part.end - part.start))
        put(part.in_bytes(data, part.rows), moves, column.first + begin, column.axis)
        stream.seek(part.start)
        stream.write(data)
    stream.raise_error()


def _refill(stream: _Stream, columns: Mapping[str, Sequence[Column]], moves: Moves) -> None:
    """Numbers that the library writes."""
    with _written(stream) as handle:
        for path, listed in columns.items():

            def fill(begin: int, values: NDArray[Any], listed: Sequence[Column] = listed) -> bool:
                numbers = values.reshape(-1)
                return _put_some(numbers, begin * len(numbers) // len(values), listed, moves)

            _fill(handle[path], fill)


def _put_some(numbers: NDArray[Any], first: int, columns: Sequence[Column], moves: Moves) -> bool:
    """Puts moved nodes into some numbers of a data set, from number ``first`` on. Tells whether one is another now.

    columns: of the data set, one behind the other.
    """
    start, changed = 0, False
    for column in columns:
        width = column.rows.width
        end = start + column.rows.rows * width
        low, high = max(first, start), min(first + len(numbers), end)
        if low < high:
            rows = numbers[low - first : high - first].reshape(-1, width)
            changed |= put(rows, moves, column.first + (low - start) // width, column.axis)
        start = end
    return changed


def rows_of(node: Node) -> Listed | None:
    """The numbers of a data set, one in a row or several; None where they are in another file, are no numbers, or have
    more than two axes."""
    return _listed(node) if len(node.shape()) <= 2 else None


def numbers_of(node: Node) -> Listed | None:
    """The same, one in a row whatever the axes."""
    found = _listed(node)
    return None if found is None else found.cut(0, found.rows * found.width, 1, 1)


def _listed(node: Node) -> Listed | None:
    """A row has the numbers of one place along the first axis."""
    shape = node.shape()
    begin, width = 0 if 0 in shape else node.offset(), math.prod(shape[1:])
    with said_of(node.path):
        if not shape or node.thing.external or node.thing.is_virtual:
            return None
        kind = node.thing.dtype
    if not node.numeric() or not width:
        return None
    if begin is not None:
        return Rows(begin, shape[0], width * kind.itemsize, kind.str, width)
    node.file.take(node.path, math.prod(shape))
    return EncodedRows(Stored(node.path, kind.str, width), 0, shape[0], width, width)


class _Stream(io.FileIO):
    """A file that never lets an error into the library, which would not survive it: ``error`` is the first one."""

    error: BaseException | None = None

    def write(self, data: Any) -> int:
        """See FileIO. All or nothing is written."""
        view = memoryview(data).cast("B")
        try:
            at = 0
            while at < len(view) and self.error is None:
                at += super().write(view[at:])
        except BaseException as error:
            self.error = error
        return len(view)

    def raise_error(self) -> None:
        """Raises the first error there was, if there was one."""
        if self.error is not None:
            raise self.error


@contextmanager
def _written(stream: _Stream) -> Iterator[Any]:
    """A file in a stream, to be written to."""
    try:
        with library().File(stream, "r+") as handle:
            yield handle
    finally:
        stream.raise_error()


def with_values(data: Data, values: Mapping[str, NDArray[Any]]) -> bytes:
    """The file with other values in data sets (path → all its values). Parts without a change stay."""
    stream = io.BytesIO(data[:])
    with library().File(stream, "r+") as handle:
        for path, array in values.items():

            def fill(begin: int, old: NDArray[Any], array: NDArray[Any] = array) -> bool:
                new = array[begin : begin + len(old)]
                changed = bool((new != old).any())
                old[...] = new
                return changed

            _fill(handle[path], fill)
    return stream.getvalue()


def _fill(data: Any, fill: Callable[[int, NDArray[Any]], bool]) -> None:
    """Some rows of a data set after the others, in whole chunks. fill: changes rows from a first one on, and tells
    whether it has. One and the same file gets the same bytes by the same changes, in memory or not."""
    row = max(1, math.prod(data.shape[1:]) * data.dtype.itemsize)
    chunk = data.chunks[0] if data.chunks else 1
    step = chunk * max(1, AT_ONCE // (row * chunk))
    for begin in range(0, data.shape[0], step):
        values = data[begin : begin + step]
        if fill(begin, values):
            data[begin : begin + step] = values
