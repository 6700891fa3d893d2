"""Elements of a zone of a CGNS file: sections that list them, and the grid of a structured zone, which lists none.

Source: CGNS Standard Interface Data Structures, "Element connectivity" and "Structured grid".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import distinct
from gmsnet.io.exodus_elements import ORDERS
from gmsnet.io.hdf5 import Node, shown
from gmsnet.io.hdf5_rows import numbers_of
from gmsnet.io.ranges import Table
from gmsnet.io.rows import AnyRows, Ranges
from gmsnet.io.typed_rows import typed_rows
from gmsnet.kernels.text.typed import typed_starts

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Places = Callable[[int, int], Floats]

DATA = " data"
AT_ONCE = 1 << 18  # points that are looked at together
KINDS = {
    2: "vertex", 3: "line", 4: "line3", 5: "triangle", 6: "triangle6", 7: "quad", 8: "quad8", 9: "quad9",
    10: "tetra", 11: "tetra10", 12: "pyramid", 13: "pyramid14", 14: "wedge", 15: "wedge15", 16: "wedge18",
    17: "hexahedron", 18: "hexahedron20", 19: "hexahedron27", 21: "pyramid13",
}  # fmt: skip
# Middles as in Exodus files, but for the centres: of a hexahedron its faces −z, −y, x, y, −x, z, then its inside.
CGNS_ORDERS = ORDERS | {"hexahedron27": (*range(12), *range(16, 20), *range(12, 16), 24, 22, 21, 23, 20, 25, 26)}
MIXED, NGON, NFACE = 20, 22, 23
SIZES = np.array([nodes_of(KINDS[code]) if code in KINDS else 0 for code in range(max(KINDS) + 1)])


class Section(NamedTuple):
    """Elements of a section. first: the number of its first element in the zone, from 1."""

    name: str
    first: int
    blocks: list[tuple[str, Ints]]


def title(node: Node) -> str:
    """The name of a node, printable."""
    return "".join(c if c.isprintable() else " " for c in node.name)


def section(node: Node, count: int) -> Section:
    """A section of a zone of ``count`` nodes. Raises FormatError naming the section."""
    head, bounds = (node.need(path).integers().reshape(-1) for path in (DATA, f"ElementRange/{DATA}"))
    if len(head) < 1 or len(bounds) != 2:
        raise FormatError(f"{shown(node.path)}: the type or the range of its elements is missing")
    code, number = int(head[0]), int(bounds[1]) - int(bounds[0]) + 1
    if code in (NGON, NFACE):
        raise FormatError(f"{shown(node.path)}: polyhedra (NGON, NFACE) are not read: write cells by their type")
    listed = node.need(f"ElementConnectivity/{DATA}").integers().reshape(-1)
    if code == MIXED:
        blocks = list(_mixed(node, listed, number, count))
    elif code in KINDS:
        width = nodes_of(KINDS[code])
        if len(listed) != number * width:
            raise FormatError(f"{shown(node.path)}: {len(listed)} nodes do not make {number} cells of {width}")
        blocks = [(KINDS[code], _ordered(node, KINDS[code], listed.reshape(-1, width) - 1, count))]
    else:
        raise FormatError(f"{shown(node.path)}: elements of the type {code} are not known")
    return Section(title(node), int(bounds[0]), [(kind, nodes) for kind, nodes in blocks if len(nodes)])


def tables_of(node: Node, file: Ranges) -> tuple[int, list[Table]] | None:
    """The number of the first element of a section, and where its elements of each kind stand; None where only a reader
    of the whole can tell."""
    head, bounds = (node.need(path).integers().reshape(-1) for path in (DATA, f"ElementRange/{DATA}"))
    listed = numbers_of(node.need(f"ElementConnectivity/{DATA}"))
    if len(head) < 1 or len(bounds) != 2 or listed is None or listed.dtype[1] not in "iu":
        return None
    number = int(bounds[1]) - int(bounds[0]) + 1
    if int(head[0]) == MIXED:
        parts = typed_rows(file, listed, SIZES)
        if parts is None or sum(rows.rows for rows in parts.values()) != number:
            return None
        return int(bounds[0]), [_table(code, rows) for code, rows in parts.items()]
    width = nodes_of(KINDS[int(head[0])]) if int(head[0]) in KINDS else 0
    if not width or listed.rows != number * width:
        return None
    return int(bounds[0]), [_table(int(head[0]), listed.cut(0, number, width, width))]


def _table(code: int, rows: AnyRows) -> Table:
    return Table(KINDS[code], rows, 1, CGNS_ORDERS.get(KINDS[code]))


def _mixed(node: Node, listed: Ints, number: int, count: int) -> Iterator[tuple[str, Ints]]:
    """Blocks of elements that each have their type in front, in the order of the types."""
    starts = np.empty(max(0, min(number, len(listed))), dtype=np.int64)
    found, at = typed_starts(listed, SIZES, 0, starts)
    if found < len(starts):
        raise FormatError(f"{shown(node.path)}: element {found} (counted from 0) has a type that is not known")
    if at != len(listed) or len(starts) != number:
        raise FormatError(f"{shown(node.path)}: the nodes of the elements do not fit their types")
    codes = listed[starts]
    for code in distinct(codes):
        width = nodes_of(KINDS[code])
        nodes = listed[starts[codes == code][:, None] + np.arange(1, width + 1)] - 1
        yield KINDS[code], _ordered(node, KINDS[code], nodes, count)


def _ordered(node: Node, kind: str, nodes: Ints, count: int) -> Ints:
    def fail(index: int, message: str) -> Any:
        raise FormatError(f"{shown(node.path)}: {message} (counted from 0)")

    check_range(nodes.reshape(-1), count, fail)
    return np.ascontiguousarray(nodes[:, CGNS_ORDERS[kind]]) if kind in CGNS_ORDERS else nodes


@dataclass(frozen=True)
class GridCells:
    """The cells of a structured zone, along i first, then j, then k. sizes: how many points the grid has along each
    axis. corners: the points of its first cell, counted from 0."""

    sizes: tuple[int, ...]
    corners: tuple[int, ...]
    dtype: str = "<i8"

    @property
    def rows(self) -> int:
        """How many there are."""
        return math.prod(size - 1 for size in self.sizes)

    @property
    def width(self) -> int:
        """Points of each."""
        return len(self.corners)

    @property
    def kind(self) -> str:
        """Of the cells."""
        return "quad" if len(self.sizes) == 2 else "hexahedron"

    def between(self, first: int, last: int) -> Ints:
        """(last − first, width) the points of some of them."""
        cells, begin, step = np.arange(first, last), np.zeros(last - first, dtype=np.int64), 1
        for size in self.sizes:
            cells, at = np.divmod(cells, size - 1)
            begin += step * at
            step *= size
        found: Ints = begin[:, None] + np.array(self.corners)
        return found

    def of(self, file: Ranges, first: int, last: int) -> Ints:
        """See AnyRows: no file lists them."""
        return self.between(first, last)

    def where(self, row: int) -> str:
        """Of a cell, for messages."""
        return f"cell {row} of a grid (counted from 0)"


def structured(zone: Node, points: Floats) -> Section:
    """The cells of a structured zone, whose points are (N, dim). Raises FormatError as ``grid``."""
    cells = grid(zone, points.shape, lambda first, last: points[first:last])
    return Section(title(zone), 1, [(cells.kind, cells.between(0, cells.rows))])


def grid(zone: Node, shape: tuple[int, ...], places: Places) -> GridCells:
    """The cells of a structured zone. shape: of all its points. places: some of them.

    Hexahedra of a grid whose axes are left-handed are listed the other way round. Raises FormatError where the points
    are none of such a grid.
    """
    sizes = zone.need(DATA).integers()
    axes = tuple(sizes[0].tolist()) if sizes.ndim == 2 and len(sizes) == 3 else ()
    if len(axes) not in (2, 3) or min(axes) < 2 or math.prod(axes) != shape[0]:
        raise FormatError(
            f"{shown(zone.path)}: {shape[0]} points are no grid of two or three axes, each of two or more points; "
            "rows of points beside it (Rind) are not read"
        )
    around = (0, 1, 1 + axes[0], axes[0])
    if len(axes) == 2:
        return GridCells(axes, around)
    if shape[1] < 3:
        raise FormatError(f"{shown(zone.path)}: CoordinateZ of a grid of three axes is missing")
    around = around[::-1] if _volume(axes, places) < 0 else around
    return GridCells(axes, (*around, *(axes[0] * axes[1] + corner for corner in around)))


def _volume(sizes: tuple[int, ...], places: Places) -> float:
    """The volume of the parallelepipeds at the first corners of all cells, negative where axes are left-handed."""
    plane, total = sizes[0] * sizes[1], 0.0
    step = max(1, AT_ONCE // plane)
    for first in range(0, sizes[2] - 1, step):
        last = min(first + step, sizes[2] - 1) + 1
        at = places(plane * first, plane * last).reshape(last - first, sizes[1], sizes[0], 3)
        corner = at[:-1, :-1, :-1]
        with np.errstate(over="ignore", invalid="ignore"):
            i, j, k = at[:-1, :-1, 1:] - corner, at[:-1, 1:, :-1] - corner, at[1:, :-1, :-1] - corner
            total += float((np.cross(i, j) * k).sum())
    return total
