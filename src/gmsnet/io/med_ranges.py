"""MED meshes of which a process reads and writes some numbers only. A list has all first nodes of cells, then all
second ones, and so on, as it has all x before all y."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS, nodes_of
from gmsnet.io.hdf5 import Node
from gmsnet.io.hdf5_rows import numbers_of, stored_columns
from gmsnet.io.ranges import Column, Plan, Table, distinct_of
from gmsnet.io.rows import Listed, Ranges


@dataclass(frozen=True)
class Apart:
    """Rows of numbers whose columns follow one another. See AnyRows. listed: the numbers, one in a row."""

    listed: Listed
    width: int

    @property
    def rows(self) -> int:
        """How many there are."""
        return self.listed.rows // self.width

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.listed.dtype

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """(last − first, width) the numbers of some rows."""
        starts = range(0, self.rows * self.width, max(self.rows, 1))
        return np.column_stack([self.listed.of(file, start + first, start + last)[:, 0] for start in starts])

    def where(self, row: int) -> str:
        """Of the first number of a row, for messages."""
        return self.listed.where(row)


def planned(
    file: Ranges, step: Node, dimension: int, kinds: Mapping[str, str], orders: Mapping[str, tuple[int, ...]],
    groups: Mapping[int, str],
) -> Plan | None:  # fmt: skip
    """How the numbers of a mesh lie; None where only a reader of the whole can say what is wrong.

    step: with its coordinates and cells. kinds: type → kind. orders: kind → order of its nodes, see
    Table. groups: names of families.
    """
    points = step.need("NOE/COO")
    columns = [*_columns(numbers_of(points), dimension)]
    listed, blocks, names = step.get("MAI"), list[list[Table]](), dict[tuple[int, int], str]()
    if not columns or listed is None:
        return None
    for node in listed.members():
        table = _table(node, kinds.get(node.name, ""), orders)
        if table is None:
            return None
        blocks.append([table])
        numbers = {0} if table.regions is None else distinct_of(file, table.regions)
        names |= {(CELLS[table.kind].dimension, number): groups[number] for number in numbers if groups.get(number)}
    families = step.get("NOE/FAM")
    sets = None if families is None else numbers_of(families)
    if families is not None and (sets is None or sets.rows != columns[0].rows.rows or sets.dtype[1] not in "iu"):
        return None
    has_sets = sets is not None and any(groups.get(number) for number in distinct_of(file, sets))
    single = columns[0].rows.dtype[1:] == "f4"
    if not blocks:
        return None
    encoded = stored_columns([{points.path: columns}])
    return Plan(columns, blocks, single, names=None if has_sets else names, encoded=encoded)


def _columns(listed: Listed | None, dimension: int) -> Iterator[Column]:
    """The coordinates along each axis; none where they do not fit the axes."""
    if listed is not None and listed.dtype[1:] in ("f4", "f8") and listed.rows % dimension == 0:
        nodes = listed.rows // dimension
        for axis in range(dimension):
            yield Column(listed.cut(axis * nodes, nodes, 1, 1), axis=axis)


def _table(node: Node, kind: str, orders: Mapping[str, tuple[int, ...]]) -> Table | None:
    """The cells of a type, and their families."""
    listed, family = numbers_of(node.need("NOD")), node.get("FAM")
    own = None if family is None else numbers_of(family)
    if not kind or listed is None or listed.dtype[1] not in "iu" or not listed.rows or listed.rows % nodes_of(kind):
        return None
    cells = Apart(listed, nodes_of(kind))
    if family is not None and (own is None or own.dtype[1] not in "iu" or own.rows != cells.rows):
        return None
    return Table(kind, cells, 1, orders.get(kind), regions=own)
