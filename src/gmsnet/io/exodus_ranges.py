"""How the numbers of an Exodus II file lie that is not in memory: those of sides where their elements list them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.io.exodus_elements import ORDERS, Sides, kind_of
from gmsnet.io.exodus_store import Store, coordinates_in, element_blocks, node_sets, side_sets
from gmsnet.io.hdf5_rows import stored_points
from gmsnet.io.ranges import Column, Plan, Table
from gmsnet.io.rows import AnyRows, Ranges, Rows

AT_ONCE = 1 << 16  # elements that are read together where some of them are wanted


def planned(store: Store) -> Plan | None:
    """None where coordinates of several axes are in one compressed variable, and for elements of one node."""
    keys = coordinates_in(store)
    store.check_apart(keys)
    axes = [store.rows(key) for key in keys]
    if keys == ["coord"] and isinstance(axes[0], Rows):
        axes = [axes[0].cut(k * axes[0].width, axes[0].width, 1, 1) for k in range(axes[0].rows)]
    columns = [Column(rows, 0, axis) for axis, rows in enumerate(axes) if rows is not None]
    shapes = {(each.rows.rows, each.rows.width, each.rows.dtype) for each in columns}
    if len(columns) not in (2, 3) or len(columns) < len(axes) or len(shapes) > 1:
        return None
    count, width, dtype = shapes.pop()
    if width != 1 or dtype[1] != "f":
        return None
    tables, names = list[Table](), dict[tuple[int, int], str]()
    for key, number, title in element_blocks(store):
        rows = store.rows(key)
        if rows is None or rows.dtype[1] not in "iu" or rows.width == 1:
            return None
        kind = kind_of(store.attribute(key, "elem_type"), rows.width, len(columns))
        tables.append(Table(kind, rows, 1, ORDERS.get(kind), number))
        names[CELLS[kind].dimension, number] = title
    every = [table.nodes for table in tables]
    for each in side_sets(store, [(table.kind, table.nodes.rows) for table in tables]):
        tables += [Table(kind, SideRows(every, parts), 1, None, each.number) for kind, parts in each.sides.items()]
        names[each.name[0], each.number] = each.name[1]
    called = {key: text for key, text in names.items() if text}
    encoded = stored_points([{f"/{key}": column for key, column in zip(keys, columns, strict=False)}])
    blocks = [[table] for table in tables]
    listed = bool(node_sets(store, count))
    return (
        Plan(columns, blocks, dtype[1:] == "f4", encoded=encoded, names=None if listed else called) if blocks else None
    )


@dataclass(frozen=True, eq=False)
class SideRows:
    """The nodes of sides. blocks: of elements. sides: one side of some elements, after another."""

    blocks: Sequence[AnyRows]
    sides: Sequence[Sides]

    @property
    def rows(self) -> int:
        """How many there are."""
        return sum(len(each.rows) for each in self.sides)

    @property
    def width(self) -> int:
        """Nodes of each."""
        return len(self.sides[0].corners)

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.blocks[self.sides[0].block].dtype

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """(last − first, width) the numbers of some rows."""
        found, before = [np.empty((0, self.width), dtype=np.int64)], 0
        for block, rows, corners in self.sides:
            some = rows[max(first - before, 0) : max(last - before, 0)]
            found.append(_picked(file, self.blocks[block], some)[:, list(corners)])
            before += len(rows)
        return np.concatenate(found)

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        for block, rows, _ in self.sides:
            if row < len(rows):
                return self.blocks[block].where(int(rows[row]))
            row -= len(rows)
        raise IndexError(row)


def _picked(file: Ranges, rows: AnyRows, some: NDArray[np.int64]) -> NDArray[np.int64]:
    """Some rows, in any order: those that lie near one another are read together."""
    found = np.empty((len(some), rows.width), dtype=np.int64)
    order = np.argsort(some, kind="stable")
    for window in np.split(order, np.flatnonzero(np.diff(some[order] // AT_ONCE)) + 1) if len(some) else ():
        low, high = int(some[window[0]]), int(some[window[-1]])
        found[window] = rows.of(file, low, high + 1)[some[window] - low]
    return found
