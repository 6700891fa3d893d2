"""Whether what a mesh is made of can be used."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.mesh.arrays import coordinates, float64_rows, plain_array, read_only, whole_numbers
from gmsnet.mesh.cell_block import CellBlock


def in_words(nodes: int) -> str:
    """Which nodes a mesh of so many has."""
    return f"the nodes 0 to {nodes - 1}" if nodes else "no nodes"


def finite_points(points: Any) -> NDArray[np.float64]:
    """The coordinates as float64 rows. InputError where one is not finite."""
    array = float64_rows(coordinates(points))
    if not np.isfinite(array).all():
        bad = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InputError(f"node {bad} (counted from 0) has a coordinate that is not finite: {array[bad].tolist()}")
    return array


def cell_blocks(cells: Any) -> tuple[CellBlock, ...]:
    """The blocks as a tuple. InputError for anything else."""
    mend = 'cells must be a list of CellBlocks, such as [CellBlock("triangle", nodes, regions)]'
    if isinstance(cells, CellBlock) or not isinstance(cells, Iterable):
        raise InputError(f"{mend}, got one {type(cells).__name__}")
    blocks = tuple(cells)
    for block in blocks:
        if not isinstance(block, CellBlock):
            raise InputError(f"{mend}, got a list with {type(block).__name__} in it")
    return blocks


def items_of(fields: Any, what: str) -> Iterable[tuple[Any, Any]]:
    """The items of a mapping. InputError for anything else."""
    if not isinstance(fields, Mapping):
        raise InputError(f"{what} must be a mapping of names, such as a dict, got {type(fields).__name__}")
    return fields.items()


def region_names_of(names: Any) -> dict[tuple[int, int], str]:
    """A copy of the names of regions. InputError where a key is no (dimension, region)."""
    for key, name in items_of(names, "region_names"):
        if not (isinstance(key, tuple) and len(key) == 2 and isinstance(name, str)):
            raise InputError(
                f"region_names must be of the form {{(dimension, region): name}}, got {{{key!r}: {name!r}}}"
            )
    return dict(names)


def rows_of(values: Any, what: str, count: int) -> NDArray[Any]:
    """An array with one row a point, read-only."""
    array = plain_array(values, what)
    if array.ndim == 0 or len(array) != count:
        rows = f"{len(array)} rows" if array.ndim else "no rows"
        raise InputError(f"{what} has {rows} for {count} points")
    return read_only(array)


def arrays_per_block(arrays: Any, what: str, counts: list[int]) -> tuple[NDArray[Any], ...]:
    """One array a block, with one row a cell, read-only."""
    parts = [plain_array(part, what) for part in arrays] if isinstance(arrays, Iterable) else []
    if [len(part) if part.ndim else -1 for part in parts] != counts:
        raise InputError(f"{what} does not have one row for each cell of each block: give one array a block")
    return tuple(map(read_only, parts))


def node_set_of(ids: Any, what: str, count: int) -> NDArray[np.int64]:
    """The ids of a node set. InputError for nodes that do not exist."""
    nodes = whole_numbers(ids, what)
    if nodes.ndim != 1:
        raise InputError(f"{what} must be a list of node ids, got shape {nodes.shape}")
    if nodes.size and (nodes.min() < 0 or nodes.max() >= count):
        wrong = nodes[(nodes < 0) | (nodes >= count)][0]
        raise InputError(f"{what} names the node {wrong}, but the mesh has {in_words(count)}")
    return nodes
