"""From the rows of a file to blocks of cells: what all readers do with node numbers, types and regions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import face_name
from gmsnet.io.places import ranges
from gmsnet.io.text import Starts, Text
from gmsnet.mesh.cell_block import CellBlock

Small = NDArray[np.int64] | NDArray[np.int32] | NDArray[np.int8]  # types and sizes of cells

# Where types alternate more often than that, cells are grouped by type instead of being kept in the order of the file.
MOST_BLOCKS = 1000


def polygon_kinds(sizes: Small) -> dict[int, str]:
    """The names of all sizes of faces that occur."""
    return {size: face_name(size) for size in distinct(sizes)}


def cell_blocks(
    codes: Small,
    kinds: Mapping[int, str],
    sizes: Small,
    nodes: NDArray[np.int64],
    regions: NDArray[np.int64],
) -> tuple[list[CellBlock], NDArray[np.int64] | slice]:
    """Blocks of cells of one type and size. The arrays must not be written any more.

    Cell k has the type ``kinds[codes[k]]``, ``sizes[k]`` nodes, which follow those of the cell before it in ``nodes``,
    and the region ``regions[k]``. Blocks are runs of equal cells in the order of the file; where there are more than
    MOST_BLOCKS runs, there is one block for each type and size, in the order in which they first occur.

    Returns the blocks and, for all their cells one after another, the number that the cell has in the file.
    """
    if not len(codes):
        return [], slice(None)
    order: NDArray[np.int64] | slice = slice(None)
    cuts = _cuts(codes, sizes)
    if len(cuts) >= MOST_BLOCKS:
        key = codes.astype(np.int64) * (int(sizes.max()) + 1) + sizes
        _, seen, number = np.unique(key, return_index=True, return_inverse=True)
        order = np.argsort(seen[number], kind="stable")
        first = (np.cumsum(sizes, dtype=np.int64) - sizes)[order]
        codes, sizes, regions = codes[order], sizes[order], regions[order]
        nodes = nodes[ranges(first, sizes.astype(np.int64))]
        cuts = _cuts(codes, sizes)
    nodes, regions = sealed(nodes), sealed(regions)
    blocks, at = [], 0
    for start, end in zip([0, *cuts.tolist()], [*cuts.tolist(), len(codes)], strict=True):
        size = int(sizes[start])
        part = nodes[at : at + (end - start) * size].reshape(end - start, size)
        at += (end - start) * size
        blocks.append(CellBlock(kinds[int(codes[start])], part, regions[start:end]))
    return blocks, order


def _cuts(codes: Small, sizes: Small) -> NDArray[np.int64]:
    """Where a cell differs in type or size from the one before it."""
    return np.flatnonzero((codes[1:] != codes[:-1]) | (sizes[1:] != sizes[:-1])) + 1


def sealed(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, but neither it nor the one it is a part of can be written any more: a Mesh keeps it as it is."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        owner.flags.writeable = False
        owner = owner.base
    return array


def distinct(values: NDArray[Any]) -> list[int]:
    """The whole numbers that occur, ascending; there are most often few of them."""
    if not len(values) or values.min() == values.max():
        return values[:1].tolist()  # type: ignore[no-any-return]
    return np.unique(values).tolist()  # type: ignore[no-any-return]


def joined(parts: Sequence[NDArray[Any]], kind: type[np.generic] = np.int64) -> NDArray[Any]:
    """The arrays one behind the other; of the given type where there are none."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts or [np.empty(0, dtype=kind)])


def places_of(ids: NDArray[np.int64], named: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Where each of ``named`` is among ``ids``, which differ, and the index of the first that is not, or -1.

    The places may take the memory of ``named`` where all are known.
    """
    low, high = (int(ids.min()), int(ids.max())) if len(ids) else (0, -1)
    within = bool(named.size) and low <= named.min() and named.max() <= high
    known = np.ones(named.shape, dtype=bool) if within else (named >= low) & (named <= high)
    if bool((ids == np.arange(low, low + len(ids))).all()):
        place = np.subtract(named, low, out=named if within else None)
    elif high - low < 4 * len(ids):
        table = np.full(high - low + 1, -1, dtype=np.int64)
        table[ids - low] = np.arange(len(ids))
        place = table[np.where(known, named - low, 0)]
        known &= place >= 0
    else:
        order = np.argsort(ids, kind="stable")
        place = order[np.searchsorted(ids, named, sorter=order).clip(max=len(ids) - 1)]
        known = ids[place] == named
    return place, -1 if known.all() else int(np.argmin(known))


def first_repeated(ids: NDArray[np.int64]) -> int:
    """The index of an id that was there before, or -1: of the least of them the second."""
    if bool((ids[1:] > ids[:-1]).all()):
        return -1
    order = np.argsort(ids, kind="stable")
    twice = np.flatnonzero(np.diff(ids[order]) == 0)
    return int(order[twice[0] + 1]) if twice.size else -1


def counted(ids: NDArray[np.int64], base: int) -> bool:
    """Whether the ids are base, base + 1, …"""
    return bool((ids == np.arange(base, base + len(ids))).all())


def check_nodes(text: Text, starts: Starts, nodes: NDArray[np.int64], count: int, base: int = 0) -> None:
    """Raises FormatError, naming the line, where one of ``nodes`` (counted from 0) is not among ``count`` points.

    starts: where each of the node numbers stands; base: the number that the file gives to its first point.
    """
    if nodes.size and not 0 <= nodes.min() <= nodes.max() < count:
        bad = int(np.argmax((nodes < 0) | (nodes >= count)))
        found, known = int(nodes.flat[bad]) + base, f"{base} to {count + base - 1}"
        text.fail(int(starts.flat[bad]), f"a cell names the node {found}, but the nodes are {known}")


def numbered(names: Sequence[str]) -> dict[str, int]:
    """Name → 1, 2, 3, … in the order in which they first occur."""
    numbers: dict[str, int] = {}
    for name in names:
        numbers.setdefault(name, len(numbers) + 1)
    return numbers
