"""Binary files of which a process reads and writes ranges only, as ranks do that share one: how their numbers lie.

A format that can tell so without reading the numbers has a function ``plan(file) -> Plan | None``. What a rank makes of
a plan is the mesh that the format's reader makes of the whole file.
"""

from __future__ import annotations

import contextlib
import itertools
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import FileIO
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, InputError
from gmsnet.io.atomic import reason
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.contents import refuse_unless_regular
from gmsnet.io.stamps import Stamp

AT_ONCE = 1 << 22  # bytes that are copied together


class Ranges:
    """A file as it is now. It is open only while some of it is read."""

    path: str
    stamp: Stamp
    size: int

    def __init__(self, path: str) -> None:
        refuse_unless_regular(path)
        self.path = path
        with self._opened() as file:
            self.stamp = Stamp.of(os.fstat(file.fileno()))
        self.size = self.stamp.size

    def read(self, begin: int, count: int) -> bytearray:
        """``count`` bytes from ``begin`` on.

        Raises FormatError where the file ends before, and InputError where others have changed it since.
        """
        found, at = bytearray(count), 0
        with self._opened() as file:
            file.seek(begin)
            while at < count and (some := file.readinto(memoryview(found)[at:])):
                at += some
            self._check(file)
        if at < count:
            raise FormatError(f"byte {begin + at}: the file ends, is it cut off?")
        return found

    def check(self) -> None:
        """Raises InputError where others have changed the file since."""
        with self._opened() as file:
            self._check(file)

    @contextlib.contextmanager
    def _opened(self) -> Iterator[FileIO]:
        try:
            with open(self.path, "rb", buffering=0) as file:
                yield file
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read: {reason(error)}") from None

    def _check(self, file: FileIO) -> None:
        if Stamp.of(os.fstat(file.fileno())) != self.stamp:
            raise InputError(f"{self.path}: the file changed while it was read: read it again once it is finished")


@dataclass(frozen=True)
class Rows:
    """Rows of binary numbers: row k has ``width`` numbers of the type from the byte start + k · stride on."""

    start: int
    rows: int
    stride: int
    dtype: str
    width: int = 1

    @property
    def size(self) -> int:
        """Bytes of the numbers of a row."""
        return self.width * np.dtype(self.dtype).itemsize

    @property
    def end(self) -> int:
        """The byte behind the last row."""
        return self.start + ((self.rows - 1) * self.stride + self.size if self.rows else 0)

    def of(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """(last − first, width) the numbers of some rows."""
        if last <= first:
            return np.empty((0, self.width), dtype=self.dtype)
        count = last - first
        return self.in_bytes(file.read(self.start + first * self.stride, (count - 1) * self.stride + self.size), count)

    def in_bytes(self, data: bytearray, count: int) -> NDArray[np.generic]:
        """(count, width) the numbers of rows, the first of which begins with ``data``, in its memory."""
        return np.ndarray((count, self.width), self.dtype, data, 0, (self.stride, self.size // self.width))


class Column(NamedTuple):
    """Coordinates of nodes that follow each other. first: the node of the first row. axis: of the first number of a
    row, those of the next axes follow it."""

    rows: Rows
    first: int = 0
    axis: int = 0


class Table(NamedTuple):
    """Cells of one kind. nodes: of each, counted from ``base``. order: see Kind. region: of all of them, where
    ``regions`` does not tell that of each. counts: numbers of nodes that the file tells of each, if it does."""

    kind: str
    nodes: Rows
    base: int
    order: tuple[int, ...] | None = None
    region: int = 0
    regions: Rows | None = None
    counts: Rows | None = None


@dataclass(frozen=True)
class Plan:
    """points: the coordinates of all nodes, in the order of the file. blocks: of the mesh, each of one table or several
    of one kind. single: see Mesh. tags: those of all nodes, where cells name these by tags. fixed: numbers of all
    nodes; those that are not 0 are to be held."""

    points: Sequence[Column]
    blocks: Sequence[Sequence[Table]]
    single: bool
    tags: Sequence[Rows] = ()
    fixed: Rows | None = None

    @property
    def nodes(self) -> int:
        """How many there are."""
        return max(column.first + column.rows.rows for column in self.points)

    def places(self, file: Ranges, first: int, last: int) -> NDArray[np.float64]:
        """(last − first, axes) the points of some nodes. Raises FormatError where one is not finite."""
        found = np.zeros((last - first, max(column.axis + column.rows.width for column in self.points)))
        for rows, start, axis in self.points:
            begin, end = max(first - start, 0), min(last - start, rows.rows)
            if begin >= end:
                continue
            some = rows.of(file, begin, end)
            if not np.isfinite(some).all():
                row = begin + int(np.argmin(np.isfinite(some).all(axis=1)))
                raise FormatError(f"byte {rows.start + row * rows.stride}: a coordinate of node {start + row} (counted "
                                  "from 0) is not finite")  # fmt: skip
            found[start + begin - first : start + end - first, axis : axis + rows.width] = some
        return found

    def tags_of(self, file: Ranges, first: int, last: int) -> NDArray[np.int64]:
        """(last − first,) the tags of some nodes."""
        parts, before = [np.empty(0, dtype=np.int64)], 0
        for rows in self.tags:
            parts.append(rows.of(file, max(first - before, 0), min(last - before, rows.rows))[:, 0].astype(np.int64))
            before += rows.rows
        return np.concatenate(parts)

    def byte_of_tag(self, node: int) -> int:
        """Where the tag of a node stands."""
        for rows in self.tags:
            if node < rows.rows:
                return rows.start + node * rows.stride
            node -= rows.rows
        raise IndexError(node)

    def byte_of_cell(self, block: int, number: int) -> int:
        """Where the nodes of a cell of a block stand."""
        for table in self.blocks[block]:
            if number < table.nodes.rows:
                return table.nodes.start + number * table.nodes.stride
            number -= table.nodes.rows
        raise IndexError(number)

    def cells(self, file: Ranges, block: int, rank: int, ranks: int) -> tuple[NDArray[np.int64], ...]:
        """Nodes (n, k), regions (n,) and numbers (n,) of the cells of a block that are the share of one of so many.

        Nodes are told by their tags where they have any. Raises FormatError where a cell names one that is not there,
        and where it has another number of nodes than its kind.
        """
        tables = self.blocks[block]
        total, before = sum(table.nodes.rows for table in tables), 0
        first, last = (total * part // ranks for part in (rank, rank + 1))
        nodes, regions = [np.empty((0, tables[0].nodes.width), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
        for table in tables:
            begin, end = max(first - before, 0), min(last - before, table.nodes.rows)
            if begin < end:
                self._check_counts(file, table, begin, end)
                listed = table.nodes.of(file, begin, end).astype(np.int64) - table.base
                if not self.tags:
                    self._check(listed, block, before + begin)
                nodes.append(listed if table.order is None else listed[:, table.order])
                own = None if table.regions is None else table.regions.of(file, begin, end)
                alike = np.full(end - begin, table.region, dtype=np.int64)
                regions.append(alike if own is None else own[:, 0].astype(np.int64))
            before += table.nodes.rows
        return np.concatenate(nodes), np.concatenate(regions), np.arange(first, last)

    def _check_counts(self, file: Ranges, table: Table, first: int, last: int) -> None:
        if table.counts is None:
            return
        counts, width = table.counts.of(file, first, last)[:, 0], table.nodes.width
        if (counts != width).any():
            row = int(np.argmax(counts != width))
            raise FormatError(f"byte {table.counts.start + (first + row) * table.counts.stride}: a {table.kind} with "
                              f"{counts[row]} nodes instead of {width}")  # fmt: skip

    def _check(self, nodes: NDArray[np.int64], block: int, first: int) -> None:
        wrong = (nodes < 0) | (nodes >= self.nodes)
        if wrong.any():
            row = int(np.argmax(wrong.any(axis=1)))
            raise FormatError(
                f"byte {self.byte_of_cell(block, first + row)}: a cell names the node {nodes[row][wrong[row]][0]}, but "
                f"the nodes are 0 to {self.nodes - 1} (counted from 0)"
            )


def blocks_of(tables: Sequence[Table]) -> list[list[Table]]:
    """Tables of cells in the order of a file, as blocks that a reader makes of them (see ``cells.cell_blocks``)."""
    filled = [table for table in tables if table.nodes.rows]
    runs = [list(run) for _, run in itertools.groupby(filled, key=lambda table: table.kind)]
    if len(runs) <= MOST_BLOCKS:
        return runs
    return [[table for table in filled if table.kind == kind] for kind in dict.fromkeys(each.kind for each in filled)]
