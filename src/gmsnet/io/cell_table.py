"""Cells that a file lists one after another, of mixed types and in the node order of its format, made into blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io.cells import Small, cell_blocks, distinct
from gmsnet.io.places import ranges
from gmsnet.mesh.cell_block import CellBlock


class Kind(NamedTuple):
    """A type of cell of a format, by its name in Mesh.

    order: where the format lists the nodes in another order, the place in its list of each of Mesh's nodes.
    """

    name: str
    order: tuple[int, ...] | None = None


def table_blocks(
    kinds: Mapping[int, Kind],
    codes: Small,
    sizes: Small,
    nodes: NDArray[np.int64],
    regions: NDArray[np.int64],
    fields: Mapping[str, NDArray[Any]],
) -> tuple[list[CellBlock], dict[str, tuple[NDArray[Any], ...]]]:
    """Blocks as ``cell_blocks`` makes them, and cell data (name → (n, …)) cut likewise.

    Cell k has the type ``kinds[codes[k]]`` and ``sizes[k]`` nodes, which follow those of the cell before it in
    ``nodes``. Raises FormatError naming a cell with a number of nodes that its type does not have.
    """
    present = distinct(codes)
    for code in present:
        expected = CELLS[kinds[code].name].nodes if kinds[code].name in CELLS else None
        if expected is None:
            continue
        wrong = np.flatnonzero((codes == code) & (sizes != expected))
        if wrong.size:
            found, name = int(sizes[wrong[0]]), kinds[code].name
            raise FormatError(f"cell {wrong[0]} (counted from 0) is a {name} with {found} nodes instead of {expected}")
    names = {code: kind.name for code, kind in kinds.items()}
    for code in present:
        if (place := kinds[code].order) is not None:
            first = np.cumsum(sizes, dtype=np.int64) - sizes
            chosen = first[codes == code][:, None] + np.arange(len(place))
            nodes = nodes.copy()
            nodes[chosen] = nodes[chosen[:, place]]
    cells, order = cell_blocks(codes, names, sizes, nodes, regions)
    cuts = np.cumsum([len(block.nodes) for block in cells])[:-1]
    return cells, {name: tuple(np.split(array[order], cuts)) for name, array in fields.items()}


def check_range(nodes: NDArray[np.int64], count: int, fail: Callable[[int, str], NoReturn]) -> None:
    """``nodes`` (counted from 0) must name one of ``count`` points; ``fail(index, message)`` blames the first other."""
    if len(nodes) and not 0 <= nodes.min() <= nodes.max() < count:
        k = int(np.argmax((nodes < 0) | (nodes >= count)))
        known = f"the nodes are 0 to {count - 1}" if count else "the file has no nodes"
        fail(k, f"a cell names the node {nodes[k]}, but {known}")


def split_cells(
    sizes: NDArray[np.int64], nodes: NDArray[np.int64], pieces: NDArray[np.int64], piece_size: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Cells cut into ``pieces[k]`` cells of ``piece_size[k]`` nodes, each one node further than the last.

    This makes lines of a polyline and vertices of a set of them. Returns the cell that each piece is of, and ``sizes``
    and ``nodes`` of the pieces.
    """
    owner = np.repeat(np.arange(len(pieces)), pieces)
    starts = ranges(np.cumsum(sizes) - sizes, pieces)
    return owner, piece_size[owner], nodes[ranges(starts, piece_size[owner])]
