"""Binary files of which a process reads and writes ranges only, as ranks do that share one: how their numbers lie.

A format that can tell so without reading the numbers has a function ``plan(file) -> Plan | None``. What a rank makes of
a plan is the mesh that the format's reader makes of the whole file.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.cells import MOST_BLOCKS, distinct
from gmsnet.io.face_ranges import FaceLists
from gmsnet.io.pieces import Piece
from gmsnet.io.rows import AT_ONCE, AnyRows, Listed, Ranges, Rows, share
from gmsnet.io.vtk_ghosts import marked


class Column(NamedTuple):
    """Coordinates of nodes that follow each other. first: the node of the first row. axis: of the first number of a
    row, those of the next axes follow it."""

    rows: Listed
    first: int = 0
    axis: int = 0


Moves = Callable[[int, int], Iterable[tuple[NDArray[np.int64], NDArray[np.float64]]]]


class Encoded(Protocol):
    """How a file is written again whose coordinates do not stand in it as they are."""

    def contents(self, file: Ranges, moves: Moves, folder: str) -> Iterator[Piece]:
        """The file. moves: of nodes from one to another those that have moved, ascending, and where they are, in parts.
        folder: for what does not fit into memory."""
        ...


class Table(NamedTuple):
    """Cells of one kind. nodes: of each, counted from ``base``. order: see Kind. region: of all of them, where
    ``regions`` does not tell that of each. counts: numbers of nodes that the file tells of each, if it does. zone: the
    first of the nodes that are meant, and how many these are, where not all are. ghosts: numbers of each, with bits of
    which one tells that it is a copy of a cell elsewhere, whose nodes are to be held."""

    kind: str
    nodes: AnyRows
    base: int
    order: tuple[int, ...] | None = None
    region: int = 0
    regions: AnyRows | None = None
    counts: AnyRows | None = None
    zone: tuple[int, int] | None = None
    ghosts: Sequence[tuple[AnyRows, int]] = ()


NO_IMAGES = np.empty((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Plan:
    """points: the coordinates of all nodes, in the order of the file. blocks: of the mesh, each of one table or several
    of one kind. single: see Mesh. tags: those of all nodes, where cells name these by tags. fixed: numbers of all
    nodes; those that are not 0 are to be held. encoded: where the rows of some points are not bytes of the file.
    images: (n, 2) tags of nodes and of those that they are images of; these are to be held, too. zones: (k + 1,) first
    nodes of zones; those of different zones that are at one place are one node. None where there is but one. names: of
    regions and markers, see Mesh; None where only a reader of the whole can tell. beside: the name of the file in the
    same folder that holds all numbers, where this one only tells of them."""

    points: Sequence[Column]
    blocks: Sequence[Sequence[Table]]
    single: bool
    tags: Sequence[Rows] = ()
    fixed: AnyRows | None = None
    encoded: Encoded | None = None
    images: NDArray[np.int64] = field(default_factory=lambda: NO_IMAGES)
    zones: Sequence[int] = ()
    names: Mapping[tuple[int, int], str] | None = field(default_factory=dict)
    beside: str = ""
    faces: FaceLists | None = None
    companions: Mapping[str, Ranges] = field(default_factory=dict)

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
                raise FormatError(
                    f"{rows.where(row)}: a coordinate of node {start + row} (counted from 0) is not finite"
                )
            found[start + begin - first : start + end - first, axis : axis + rows.width] = some
        return found

    def tags_of(self, file: Ranges, first: int, last: int) -> NDArray[np.int64]:
        """(last − first,) the tags of some nodes."""
        parts, before = [np.empty(0, dtype=np.int64)], 0
        for rows in self.tags:
            parts.append(rows.of(file, max(first - before, 0), min(last - before, rows.rows))[:, 0].astype(np.int64))
            before += rows.rows
        return np.concatenate(parts)

    def where_tag(self, node: int) -> str:
        """Where the tag of a node stands."""
        for rows in self.tags:
            if node < rows.rows:
                return rows.where(node)
            node -= rows.rows
        raise IndexError(node)

    def where_cell(self, block: int, number: int) -> str:
        """Where the nodes of a cell of a block stand."""
        for table in self.blocks[block]:
            if number < table.nodes.rows:
                return table.nodes.where(number)
            number -= table.nodes.rows
        raise IndexError(number)

    def cells(self, file: Ranges, block: int, rank: int, ranks: int) -> tuple[NDArray[np.int64], ...]:
        """Nodes (n, k), regions (n,) and numbers (n,) of the cells of a block that are the share of one of so many.

        Nodes are told by their tags where they have any. Raises FormatError where a cell names one that is not there,
        and where it has another number of nodes than its kind.
        """
        first, last = self._share(block, rank, ranks)
        nodes = [np.empty((0, self.blocks[block][0].nodes.width), dtype=np.int64)]
        regions = [np.empty(0, dtype=np.int64)]
        for table, begin, end in self._parts(block, first, last):
            self._check_counts(file, table, begin, end)
            listed = table.nodes.of(file, begin, end).astype(np.int64) - table.base
            if not self.tags:
                self._check(listed, table, begin)
            if table.zone is not None:
                listed += table.zone[0]
            nodes.append(listed if table.order is None else listed[:, table.order])
            own = None if table.regions is None else table.regions.of(file, begin, end)
            alike = np.full(end - begin, table.region, dtype=np.int64)
            regions.append(alike if own is None else own[:, 0].astype(np.int64))
        return np.concatenate(nodes), np.concatenate(regions), np.arange(first, last)

    def ghosts(self, file: Ranges, block: int, rank: int, ranks: int) -> NDArray[np.bool_]:
        """(n,) which of these cells are copies of cells elsewhere."""
        found = [np.empty(0, dtype=np.bool_)]
        for table, begin, end in self._parts(block, *self._share(block, rank, ranks)):
            marks = np.zeros(end - begin, dtype=np.bool_)
            for rows, bits in table.ghosts:
                marks |= marked(rows.of(file, begin, end)[:, 0], bits)
            found.append(marks)
        return np.concatenate(found)

    def _share(self, block: int, rank: int, ranks: int) -> tuple[int, int]:
        """The first cell of a block that is the share of one of so many, and the one behind the last."""
        total = sum(table.nodes.rows for table in self.blocks[block])
        return share(total, rank, ranks)

    def _parts(self, block: int, first: int, last: int) -> Iterator[tuple[Table, int, int]]:
        """The tables in which some cells of a block are, each with its first one and the one behind the last."""
        before = 0
        for table in self.blocks[block]:
            begin, end = max(first - before, 0), min(last - before, table.nodes.rows)
            if begin < end:
                yield table, begin, end
            before += table.nodes.rows

    def _check_counts(self, file: Ranges, table: Table, first: int, last: int) -> None:
        if table.counts is None:
            return
        counts, width = table.counts.of(file, first, last)[:, 0], table.nodes.width
        if (counts != width).any():
            row = int(np.argmax(counts != width))
            raise FormatError(f"{table.counts.where(first + row)}: a {table.kind} with {counts[row]} nodes instead of "
                              f"{width}")  # fmt: skip

    def _check(self, nodes: NDArray[np.int64], table: Table, first: int) -> None:
        count = self.nodes if table.zone is None else table.zone[1]
        wrong = (nodes < 0) | (nodes >= count)
        if wrong.any():
            row = int(np.argmax(wrong.any(axis=1)))
            raise FormatError(f"{table.nodes.where(first + row)}: a cell names the node {nodes[row][wrong[row]][0]}, "
                              f"but the nodes are 0 to {count - 1} (counted from 0)")  # fmt: skip


def put(values: NDArray[Any], moves: Moves, first: int, axis: int) -> bool:
    """Puts moved nodes into rows (n, axes) of coordinates, of which row 0 is that of node ``first`` and has its
    coordinates from ``axis`` on. Tells whether a number is another one now."""
    changed = False
    for ids, places in moves(first, first + len(values)):
        here, new = ids - first, places[:, axis : axis + values.shape[1]]
        old = values[here].astype(np.float64)
        changed |= bool((new != old).any())
        values[here] = np.where(new != old, new, old)
    return changed


def distinct_of(file: Ranges, rows: AnyRows) -> set[int]:
    """The whole numbers that occur, some looked at at a time."""
    parts = (rows.of(file, at, min(at + AT_ONCE, rows.rows)) for at in range(0, rows.rows, AT_ONCE))
    return {number for part in parts for number in distinct(part[:, 0])}


def blocks_of(tables: Sequence[Table]) -> list[list[Table]]:
    """Tables of cells in the order of a file, as blocks that a reader makes of them (see ``cells.cell_blocks``)."""
    filled = [table for table in tables if table.nodes.rows]
    runs = [list(run) for _, run in itertools.groupby(filled, key=lambda table: table.kind)]
    if len(runs) <= MOST_BLOCKS:
        return runs
    return [[table for table in filled if table.kind == kind] for kind in dict.fromkeys(each.kind for each in filled)]
