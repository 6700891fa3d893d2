"""Coordinates in arrays of binary files, one array of them all or one for each axis: reading, and writing again.

Where the numbers stand in the file as they are, only their bytes are replaced. Else (HDF5 that is compressed, or in
chunks) the array is written again by the library, and all other arrays keep their values.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.hdf5 import Node, shown
from gmsnet.io.hdf5_rows import with_values
from gmsnet.io.pieces import Piece
from gmsnet.io.splice import EncodedSlots, Points, Share, Slots

_ROWS = 1 << 16  # that are written at once


@dataclass(frozen=True)
class Column:
    """One coordinate of all nodes: node k at the byte start + k · stride, a number of the type ``dtype``.

    node: the node of each row, where row k is not node k.
    """

    start: int
    stride: int
    dtype: str
    axis: int
    node: NDArray[np.int64] | None = None

    def of(self, data: Data | bytearray, rows: int, first: int = 0) -> NDArray[Any]:
        """(rows,) the numbers, in the memory of ``data``, whose first byte is byte ``first`` of the file."""
        return np.ndarray((rows,), self.dtype, data, self.start - first, (self.stride,))


@dataclass(frozen=True)
class ColumnSlots:
    """Columns of coordinates; no two of them share a byte (see Slots)."""

    columns: Sequence[Column]

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots."""
        at, differ = 0, old != new
        for group in self._groups():
            node = group[0].node
            count = len(new) if node is None else len(node)
            for k in range(0, count, _ROWS):
                rows = min(_ROWS, count - k)
                some = slice(k, k + rows) if node is None else node[k : k + rows]
                starts = [column.start + k * column.stride for column in group]
                stop = max(starts) + (rows - 1) * group[0].stride + np.dtype(group[0].dtype).itemsize
                yield memoryview(data)[at : min(starts)]
                block = bytearray(memoryview(data)[min(starts) : stop])
                for start, column in zip(starts, group, strict=True):
                    here = Column(start, column.stride, column.dtype, column.axis).of(block, rows, min(starts))
                    moved = differ[some, column.axis]
                    here[moved] = new[some, column.axis][moved]
                yield memoryview(block)
                at = stop
        yield memoryview(data)[at:]

    def _groups(self) -> list[list[Column]]:
        """Columns that lie side by side, in the order of the file; those one after another are groups of one."""
        groups: list[list[Column]] = []
        for column in sorted(self.columns, key=lambda column: column.start):
            if groups and column.start < groups[-1][0].start + column.stride and column.stride == groups[-1][0].stride:
                groups[-1].append(column)
            else:
                groups.append([column])
        return groups


@dataclass(frozen=True)
class SharedSlots:
    """The parts of a mesh that stand in one file, some of them encoded (see Slots)."""

    shares: Sequence[Share]

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots: one part after another."""
        for share in self.shares:
            data = b"".join(share.replace(data, old, new))
        yield memoryview(data)


def shared(shares: Sequence[Share]) -> Slots:
    """The slots of all parts of a mesh in one file. Raises FormatError where two have the same numbers."""
    columns = list[Column]()
    for share in shares:
        if not isinstance(share.slots, ColumnSlots):
            return SharedSlots(tuple(shares))
        columns += [replace(column, node=share.node) for column in share.slots.columns]
    if len({column.start for column in columns}) < len(columns):
        raise FormatError("two parts of the mesh share an array of coordinates: give each its own")
    return ColumnSlots(columns)


@dataclass(frozen=True)
class Part:
    """A data set with some of the coordinates. axes: of the mesh, one for each coordinate in it.

    by_axis: all numbers of the first axis come first, then those of the next, whatever the shape.
    """

    node: Node
    axes: tuple[int, ...]
    by_axis: bool = False

    def table(self, values: NDArray[Any]) -> NDArray[Any]:
        """(N, axes) the values, in their memory."""
        width = len(self.axes)
        return values.reshape(width, -1).T if self.by_axis else values.reshape(-1, width)


def coordinates(parts: Sequence[Part], data: Data, count: int | None = None) -> tuple[Points, Slots, bool]:
    """(points, their slots, whether they are in single precision) of the data sets of an HDF5 file.

    count: how many nodes there must be. Raises FormatError where the data sets do not fit, or a number is not finite.
    """
    tables = []
    for part in parts:
        values = part.node.array("f")
        if values.size % len(part.axes) or (count is not None and values.size != count * len(part.axes)):
            raise FormatError(f"{shown(part.node.path)}: {values.size} coordinates do not fit the number of nodes")
        if not np.isfinite(values).all():
            raise FormatError(f"{shown(part.node.path)}: a coordinate is not a finite number")
        tables.append(part.table(values))
    if len({len(table) for table in tables}) != 1:
        raise FormatError(f"{shown(parts[0].node.path)}: the axes have different numbers of coordinates")
    points = np.empty((len(tables[0]), 1 + max(axis for part in parts for axis in part.axes)))
    for part, table in zip(parts, tables, strict=True):
        points[:, list(part.axes)] = table
    columns = [column for part, table in zip(parts, tables, strict=True) for column in _columns(part, table, data)]
    single = all(table.dtype.itemsize == 4 for table in tables)
    if len(columns) == points.shape[1]:
        return points, ColumnSlots(tuple(columns)), single
    kept = tuple((part.node.path, part.axes, part.by_axis, table.dtype.str) for part, table in zip(parts, tables,
                 strict=True))  # fmt: skip
    return points, EncodedSlots(partial(_rewritten, kept)), single


def _columns(part: Part, table: NDArray[Any], data: Data) -> list[Column]:
    """The columns of a data set that stands in the file as it is; none else."""
    offset = part.node.offset()
    raw = np.ascontiguousarray(table.T if part.by_axis else table).tobytes()
    if offset is None or bytes(data[offset : offset + len(raw)]) != raw:
        return []
    size, rows, width = table.dtype.itemsize, len(table), len(part.axes)
    step, stride = (rows * size, size) if part.by_axis else (size, width * size)
    return [Column(offset + k * step, stride, table.dtype.str, axis) for k, axis in enumerate(part.axes)]


def _rewritten(
    parts: Sequence[tuple[str, tuple[int, ...], bool, str]], data: Data, old: Points, new: Points
) -> list[Piece]:
    """The file with other points in these data sets (path, axes, by_axis, type)."""
    from gmsnet.io.hdf5 import File

    file, values = File(data), {}
    for path, axes, by_axis, _ in parts:
        node = file.root.need(path)
        found = np.ascontiguousarray(node.array("f"))
        table = Part(node, axes, by_axis).table(found)
        moved = (old != new)[:, list(axes)]
        table[moved] = new[:, list(axes)][moved]
        values[path] = found
    return [with_values(data, values)]
