"""What the two VTK formats share: the types of cells, and the data of a mesh on the way out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cell_table import Kind, check_range, split_cells, table_blocks
from gmsnet.io.document import Parsed
from gmsnet.io.splice import Slots
from gmsnet.mesh import Mesh
from gmsnet.region_fields import names_a_region, regions_of

Fields = Sequence[tuple[str, NDArray[Any]]]  # name and values, in the order of the file

POLYVERTEX, POLYLINE, POLYGON = 2, 4, 7

KINDS = {
    1: Kind("vertex"), POLYVERTEX: Kind("vertex"), 3: Kind("line"), POLYLINE: Kind("line"), 5: Kind("triangle"),
    POLYGON: Kind("polygon"), 8: Kind("quad", (0, 1, 3, 2)), 9: Kind("quad"), 10: Kind("tetra"),
    11: Kind("hexahedron", (0, 1, 3, 2, 4, 5, 7, 6)), 12: Kind("hexahedron"), 13: Kind("wedge"), 14: Kind("pyramid"),
    21: Kind("line3"), 22: Kind("triangle6"), 23: Kind("quad8"), 24: Kind("tetra10"), 25: Kind("hexahedron20"),
    26: Kind("wedge15"), 27: Kind("pyramid13"), 28: Kind("quad9"), 29: Kind("hexahedron27"), 34: Kind("triangle7"),
    35: Kind("line4"),
}  # fmt: skip

CODES = {kind.name: code for code, kind in KINDS.items() if kind.order is None and code not in (POLYVERTEX, POLYLINE)}

UNSUPPORTED = {6: "triangle strips", 42: "polyhedra"}  # the others have no name that users know


def parsed(
    points: NDArray[np.float64],
    slots: Slots,
    single: bool,
    codes: NDArray[np.int64],
    first: NDArray[np.int64],
    nodes: NDArray[np.int64],
    point_fields: Fields,
    cell_fields: Fields,
    fail: Callable[[int, str], NoReturn],
) -> Parsed:
    """The facts of a VTK file. codes: (n,) VTK's types; cell k has the nodes first[k] to first[k + 1] - 1 of ``nodes``.

    Raises FormatError where there are no cells, for a type that is not supported and, through
    ``fail(index into nodes, message)``, for a node that does not exist.
    """
    if not len(codes):
        raise FormatError("the file has no cells: there is nothing to smooth")
    for code in np.unique(codes).tolist():
        if code not in KINDS:
            what = UNSUPPORTED.get(code, f"cells of VTK type {code}")
            where = f"cell {int(np.flatnonzero(codes == code)[0])}, counted from 0"
            raise FormatError(f"{what} are not supported ({where}): turn them into simple cells first")
    check_range(nodes, len(points), fail)
    size = np.diff(first)
    short = np.flatnonzero(size < np.select([codes == POLYLINE, codes == POLYGON], [2, 3], 1))
    if short.size:
        raise FormatError(f"cell {short[0]} (counted from 0) has only {size[short[0]]} nodes")
    regions, lines, dots = regions_of(cell_fields, len(codes)), codes == POLYLINE, codes == POLYVERTEX
    if (lines & (size > 2)).any() or (dots & (size > 1)).any():
        pieces = np.where(lines, size - 1, np.where(dots, size, 1))
        owner, first, nodes = split_cells(first, nodes, pieces, np.where(lines, 2, np.where(dots, 1, size)))
        codes, regions, size = codes[owner], regions[owner], np.diff(first)
        cell_fields = [(name, array[owner]) for name, array in cell_fields]
    for code, count, kind in (
        (POLYVERTEX, 1, "vertex"),
        (POLYLINE, 2, "line"),
        (POLYGON, 3, "triangle"),
        (POLYGON, 4, "quad"),
    ):
        codes = np.where((codes == code) & (size == count), CODES[kind], codes)
    cells, cell_data = table_blocks(KINDS, codes, first, nodes, regions, dict(cell_fields))
    return Parsed(points, cells, slots, {}, dict(point_fields), cell_data, single)


def cells_out(mesh: Mesh, title: str) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """(codes, sizes, nodes): VTK's type and number of nodes of each cell, and the nodes of all one after another.

    Raises FormatError naming a kind of cell that VTK does not have.
    """
    convert.check_kinds(mesh, title, CODES)
    none = [np.empty(0, dtype=np.int64)]
    codes = [np.full(len(block.nodes), CODES[block.kind]) for block in mesh.cells if len(block.nodes)]
    sizes = [np.full(len(block.nodes), block.nodes.shape[1]) for block in mesh.cells]
    nodes = [block.nodes.ravel() for block in mesh.cells]
    return np.concatenate(none + codes), np.concatenate(none + sizes), np.concatenate(none + nodes)


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


def rows_text(array: NDArray[Any]) -> str:
    """A line for each row (n × m), each number as the shortest text that reads back as the same value of its type."""
    words = map(str, array.ravel() if array.dtype == np.float32 else array.ravel().tolist())
    return "".join(" ".join(row) + "\n" for row in zip(*[words] * array.shape[1], strict=True))


def lines_text(array: NDArray[Any]) -> str:
    """Integers (n,) as lines of a few each."""
    words = list(map(str, array.tolist()))
    return "".join(" ".join(words[k : k + 12]) + "\n" for k in range(0, len(words), 12))
