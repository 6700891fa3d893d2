"""Cells of a mesh by the rows of ``near``: a triangle or tetrahedron is one, others those of their corners in turn."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]
Rows = NDArray[np.intp]


class Corners(NamedTuple):
    """Of k cells the nodes (k, n), those of triangles among quads with the last one twice, and how many each has."""

    nodes: Ints
    sides: Rows


def whole_cells(topology: Topology | Volume, rows: Flags) -> Flags:
    """(T,) all rows of the cells that have one of some rows (T, bool)."""
    cells = topology.simplices.cells
    if cells is None:
        return rows
    chosen = np.zeros(int(cells.max(initial=-1)) + 1, dtype=bool)
    chosen[cells[rows]] = True
    return np.take(chosen, cells)


def first_rows(topology: Topology | Volume, rows: Flags) -> Rows:
    """The first row of each cell of which all rows, or none, are chosen (T, bool)."""
    chosen, cells = np.flatnonzero(rows), topology.simplices.cells
    if cells is None:
        return chosen
    return np.compress(np.diff(cells[chosen], prepend=-1) != 0, chosen)


def corners_of(topology: Topology, first: Rows) -> Corners:
    """The corners of the cells with these first rows."""
    cells = topology.near_cells
    if cells is None:
        return Corners(topology.near[first], np.full(len(first), 3))
    next_row = np.minimum(first + 1, len(cells) - 1)
    quad = (next_row > first) & (cells[next_row] == cells[first])
    nodes = np.column_stack([topology.near[first], topology.near[first, 2]])
    nodes[quad] = topology.near[first[quad, None] + np.arange(4), 0]
    return Corners(nodes, np.where(quad, 4, 3))


def most_of_cells(topology: Topology, rows: Rows, values: Ints) -> tuple[Rows, Ints]:
    """The first row of each cell of which all rows are among some, ascending; the largest of the values of its rows."""
    if topology.near_cells is None or not len(rows):
        return rows, values
    first = np.flatnonzero(np.diff(topology.near_cells[rows], prepend=-1))
    return rows[first], np.maximum.reduceat(values, first)
