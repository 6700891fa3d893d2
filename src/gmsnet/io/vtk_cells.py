"""What the two VTK formats share: the types of cells, and the data of a mesh on the way out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cell_table import Kind, check_range, split_cells, table_blocks
from gmsnet.io.cells import distinct
from gmsnet.io.document import Parsed
from gmsnet.io.pieces import Piece
from gmsnet.io.splice import Slots
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import names_a_region, regions_of
from gmsnet.mesh.vtk_types import POLYGON, POLYHEDRON, POLYLINE, POLYVERTEX, STRIP, VTK_KINDS, VTK_ORDERS

Fields = Sequence[tuple[str, NDArray[Any]]]  # name and values, in the order of the file

UNSUPPORTED = {STRIP: "triangle strips"}  # the others have no name that users know
KINDS = {code: Kind(kind, VTK_ORDERS.get(code)) for code, kind in VTK_KINDS.items() if code not in UNSUPPORTED}
UNWRITTEN = (POLYVERTEX, POLYLINE, POLYHEDRON)  # nothing is known of a polyhedron but its nodes
CODES = {kind.name: code for code, kind in KINDS.items() if kind.order is None and code not in UNWRITTEN}

_TOGETHER = 1 << 16  # cells that are written at once
_WIDTH = 12  # integers in a line


def parsed(
    points: NDArray[np.float64],
    slots: Slots,
    single: bool,
    codes: NDArray[np.int64],
    sizes: NDArray[np.int64],
    nodes: NDArray[np.int64],
    point_fields: Fields,
    cell_fields: Fields,
    fail: Callable[[int, str], NoReturn],
    unread: Sequence[str],
) -> Parsed:
    """The facts of a VTK file. codes: (n,) VTK's types; sizes: (n,) numbers of nodes; nodes: of all cells in turn,
    those of a polyhedron once each.

    Raises FormatError where there are no cells, for a type that is not supported and, through
    ``fail(index into nodes, message)``, for a node that does not exist.
    """
    if not len(codes):
        raise FormatError("the file has no cells: there is nothing to smooth")
    present = distinct(codes)
    for code in present:
        if code not in KINDS:
            what = UNSUPPORTED.get(code, f"cells of VTK type {code}")
            where = f"cell {int(np.flatnonzero(codes == code)[0])}, counted from 0"
            raise FormatError(f"{what} are not supported ({where}): turn them into simple cells first")
    check_range(nodes, len(points), fail)
    small = codes.astype(np.int8)
    least = np.ones(128, dtype=np.int8)
    least[POLYLINE], least[POLYGON], least[POLYHEDRON] = 2, 3, 4
    if (short := np.flatnonzero(sizes < least[small])).size:
        raise FormatError(f"cell {short[0]} (counted from 0) has only {sizes[short[0]]} nodes")
    regions = regions_of(cell_fields, len(small))
    if POLYLINE in present or POLYVERTEX in present:
        lines, dots = small == POLYLINE, small == POLYVERTEX
        pieces = np.where(lines, sizes - 1, np.where(dots, sizes, 1))
        owner, sizes, nodes = split_cells(sizes, nodes, pieces, np.where(lines, 2, np.where(dots, 1, sizes)))
        small, regions = small[owner], regions[owner]
        cell_fields = [(name, array[owner]) for name, array in cell_fields]
    for code, count, kind in (
        (POLYVERTEX, 1, "vertex"),
        (POLYLINE, 2, "line"),
        (POLYGON, 3, "triangle"),
        (POLYGON, 4, "quad"),
    ):
        if code in present:
            small[(small == code) & (sizes == count)] = CODES[kind]
    cells, cell_data = table_blocks(KINDS, small, sizes, nodes, regions, dict(cell_fields))
    return Parsed(points, cells, slots, {}, dict(point_fields), cell_data, single, unread)


def parts(mesh: Mesh) -> Iterator[tuple[CellBlock, slice]]:
    """The cells in turn, some at a time."""
    for block in mesh.cells:
        for k in range(0, len(block.nodes), _TOGETHER):
            yield block, slice(k, k + _TOGETHER)


def codes(mesh: Mesh) -> Iterator[NDArray[np.uint8]]:
    """VTK's type of each cell, some at a time."""
    for block, some in parts(mesh):
        yield np.full(len(block.regions[some]), CODES[block.kind], dtype=np.uint8)


def fields_out(mesh: Mesh, title: str) -> tuple[Fields, Fields, list[str]]:
    """(point data, cell data, what is lost): the fields of numbers, each as (n, components).

    The regions are the cell field ``region``, unless the cell data already tell them apart in the same way.
    """
    lost = convert.lost_names(mesh, title) + convert.lost_data(mesh, title, [*mesh.point_data, *mesh.cell_data])
    cells = [(name, np.concatenate([np.asarray(a) for a in parts])) for name, parts in mesh.cell_data.items() if parts]
    regions = np.concatenate([np.empty(0, dtype=np.int64), *(block.regions for block in mesh.cells)])
    if not np.array_equal(regions_of(cells, len(regions)), regions):
        against = [repr(name) for name, _ in cells if names_a_region(name)]
        if against:
            lost.append(f"the cell data {', '.join(against)} were left out: they contradict the regions")
        cells = [(name, array) for name, array in cells if not names_a_region(name)] + [("region", regions)]
    out: list[list[tuple[str, NDArray[Any]]]] = [[], []]
    for k, (place, fields) in enumerate([("point", list(mesh.point_data.items())), ("cell", cells)]):
        for name, values in fields:
            array = np.asarray(values)
            if array.dtype.kind not in "iufb" or not array.size:
                lost.append(f"{title} cannot hold {place} data that are not numbers: {name!r} was left out")
                continue
            if array.dtype.kind == "b":
                array = array.astype(np.uint8)
            elif array.dtype.kind == "f" and array.dtype.itemsize not in (4, 8):
                array = array.astype(np.float64)
            array = array.astype(array.dtype.newbyteorder("="))
            out[k].append((name, array.reshape(len(array), -1)))
    return out[0], out[1], lost


def rows_text(array: NDArray[Any]) -> Iterator[Piece]:
    """A line for each row (n × m), each number as the shortest text that reads back as the same value of its type."""
    return convert.rows(convert.row_of(array.shape[1]), array)


def lines_text(arrays: Iterable[NDArray[Any]]) -> Iterator[Piece]:
    """The integers of all arrays one after another, as lines of a few each."""
    rest = np.empty(0, dtype=np.int64)
    for array in arrays:
        numbers = np.concatenate([rest, array.reshape(-1)])
        whole = len(numbers) - len(numbers) % _WIDTH
        yield from convert.rows(convert.row_of(_WIDTH), numbers[:whole].reshape(-1, _WIDTH))
        rest = numbers[whole:]
    if len(rest):
        yield from convert.rows(convert.row_of(len(rest)), rest[None])
