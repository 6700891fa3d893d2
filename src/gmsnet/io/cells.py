"""From the rows of a file to blocks of cells: what all readers do with node numbers, types and regions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.text import Spans, fail
from gmsnet.mesh import CellBlock

# Where types alternate more often than that, cells are grouped by type instead of being kept in the order of the file.
MOST_BLOCKS = 1000


def polygon_kind(size: int) -> str:
    """meshio's name of a face with ``size`` corners."""
    return {3: "triangle", 4: "quad"}.get(size, "polygon")


def polygon_kinds(sizes: NDArray[np.int64]) -> dict[int, str]:
    """The names of all sizes of faces that occur."""
    return {size: polygon_kind(size) for size in np.unique(sizes).tolist()}


def cell_blocks(
    codes: NDArray[np.int64],
    kinds: Mapping[int, str],
    sizes: NDArray[np.int64],
    nodes: NDArray[np.int64],
    first: NDArray[np.int64],
    regions: NDArray[np.int64],
) -> tuple[list[CellBlock], NDArray[np.int64]]:
    """Blocks of cells of one type and size.

    Cell k has the type ``kinds[codes[k]]``, the nodes ``nodes[first[k] : first[k] + sizes[k]]`` and the region
    ``regions[k]``. Blocks are runs of equal cells in the order of the file; where there are more than MOST_BLOCKS
    runs, there is one block for each type and size, in the order in which they first occur.

    Returns the blocks and, for all their cells one after another, the number that the cell has in the file.
    """
    if not len(codes):
        return [], np.empty(0, dtype=np.int64)
    key = codes * (int(sizes.max()) + 1) + sizes
    order = np.arange(len(codes))
    cuts = np.flatnonzero(np.diff(key)) + 1
    if len(cuts) >= MOST_BLOCKS:
        _, seen, number = np.unique(key, return_index=True, return_inverse=True)
        order = np.argsort(seen[number], kind="stable")
        cuts = np.flatnonzero(np.diff(key[order])) + 1
    blocks = []
    for part in np.split(order, cuts):
        size = int(sizes[part[0]])
        rows = nodes[first[part][:, None] + np.arange(size)]
        blocks.append(CellBlock(kinds[int(codes[part[0]])], rows, regions[part]))
    return blocks, order


def check_nodes(data: bytes, spans: Spans, nodes: NDArray[np.int64], count: int, base: int = 0) -> None:
    """Raises FormatError, naming the line, where one of ``nodes`` (counted from 0) is not among ``count`` points.

    spans: where each of the node numbers stands; base: the number that the file gives to its first point.
    """
    bad = np.flatnonzero(((nodes < 0) | (nodes >= count)).ravel())
    if bad.size:
        found = int(nodes.ravel()[bad[0]]) + base
        offset = int(spans.reshape(-1, 2)[bad[0], 0])
        fail(data, offset, f"a cell names the node {found}, but the nodes are {base} to {count + base - 1}")


def numbered(names: Sequence[str]) -> dict[str, int]:
    """Name → 1, 2, 3, … in the order in which they first occur."""
    numbers: dict[str, int] = {}
    for name in names:
        numbers.setdefault(name, len(numbers) + 1)
    return numbers
