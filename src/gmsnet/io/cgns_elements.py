"""Elements of a zone of a CGNS file: sections that list them, and the grid of a structured zone, which lists none.

Source: CGNS Standard Interface Data Structures, "Element connectivity" and "Structured grid".
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import distinct
from gmsnet.io.exodus_elements import ORDERS
from gmsnet.io.hdf5 import Node, shown
from gmsnet.io.hdf5_rows import rows_of
from gmsnet.io.ranges import Table
from gmsnet.io.rows import AnyRows, Ranges
from gmsnet.io.typed_rows import typed_rows
from gmsnet.kernels.text.typed import typed_starts

Ints = NDArray[np.int64]

DATA = " data"
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
    found = rows_of(node.need(f"ElementConnectivity/{DATA}"))
    if len(head) < 1 or len(bounds) != 2 or found is None or found.dtype[1] not in "iu":
        return None
    number, listed = int(bounds[1]) - int(bounds[0]) + 1, found.cut(0, found.rows * found.width, 1, 1)
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


def structured(zone: Node, points: NDArray[np.float64]) -> Section:
    """The quads or hexahedra of a structured zone, whose points (N, dim) are listed along i first, then j, then k.

    Hexahedra of a grid whose axes are left-handed are listed the other way round. Raises FormatError where the points
    are none of such a grid.
    """
    sizes = zone.need(DATA).integers()
    axes = sizes[0].tolist() if sizes.ndim == 2 and len(sizes) == 3 else []
    if len(axes) not in (2, 3) or min(axes) < 2 or int(np.prod(axes, dtype=object)) != len(points):
        raise FormatError(
            f"{shown(zone.path)}: {len(points)} points are no grid of two or three axes, each of two or more points"
        )
    steps = [1, axes[0], axes[0] * axes[1]]
    first = np.zeros(1, dtype=np.int64)
    for size, step in zip(axes, steps, strict=False):
        first = (step * np.arange(size - 1)[:, None] + first).reshape(-1)
    around = np.array([0, steps[0], steps[0] + steps[1], steps[1]])
    if len(axes) == 2:
        return Section(title(zone), 1, [("quad", first[:, None] + around)])
    if points.shape[1] < 3:
        raise FormatError(f"{shown(zone.path)}: CoordinateZ of a grid of three axes is missing")
    with np.errstate(over="ignore", invalid="ignore"):
        volume = np.linalg.det(np.stack([points[first + step] - points[first] for step in steps], axis=1)).sum()
    around = around[::-1] if volume < 0 else around
    return Section(title(zone), 1, [("hexahedron", first[:, None] + np.concatenate([around, steps[2] + around]))])
