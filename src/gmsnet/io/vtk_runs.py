"""Grids of VTK whose cells stand in runs of one kind: where the nodes of each run lie in a file."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.io import vtk_cells
from gmsnet.io.cell_table import Kind
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.ranges import Rows, Table
from gmsnet.io.vtk_ghosts import LEVELS, TYPES
from gmsnet.mesh.region_fields import names_a_region
from gmsnet.mesh.vtk_types import POLYGON, POLYLINE, POLYVERTEX

Some = Callable[[int, int], NDArray[Any]]

CODES = {*vtk_cells.KINDS} - {POLYGON, POLYLINE, POLYVERTEX}  # types of a certain number of nodes
AT_ONCE = 1 << 20  # cells that are looked at together


def means_more(name: str) -> bool:
    """Whether cell data of this name are looked at by readers."""
    return names_a_region(name) or name in (TYPES, LEVELS)


def tables_of(types: Some, offsets: Some, cells: int, numbers: int, nodes: Rows) -> list[Table]:
    """A table for each run of cells of one kind; none where that cannot be told.

    types, offsets: some of VTK's types of the cells, and of where the nodes of each begin, with the end of the last one
    (cells + 1 in all). numbers: of nodes in all cells. nodes: where these lie.
    """
    tables, size = list[Table](), np.dtype(nodes.dtype).itemsize
    for first, last, kind, start in _runs(types, offsets, cells, numbers):
        width = nodes_of(kind.name)
        rows = Rows(nodes.start + start * size, last - first, width * size, nodes.dtype, width)
        tables.append(Table(kind.name, rows, 0, kind.order))
    return tables


def _runs(types: Some, offsets: Some, cells: int, numbers: int) -> list[tuple[int, int, Kind, int]]:
    """First and last cell, kind and first number of each run of cells of one kind; none where that cannot be told."""
    runs, end = list[tuple[int, int, Kind, int]](), 0
    for first in range(0, cells, AT_ONCE):
        last = min(first + AT_ONCE, cells)
        codes, ends = types(first, last), offsets(first, last + 1)
        if ends[0] != end or not set(np.unique(codes).tolist()) <= CODES:
            return []
        cuts = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), last - first]
        for begin, stop in itertools.pairwise(cuts):
            kind = vtk_cells.KINDS[int(codes[begin])]
            if (np.diff(ends[begin : stop + 1]) != nodes_of(kind.name)).any():
                return []
            if runs and runs[-1][2] == kind:
                runs[-1] = (*runs[-1][:1], first + stop, *runs[-1][2:])
            else:
                runs.append((first + begin, first + stop, kind, int(ends[begin])))
        end = int(ends[-1])
        if len(runs) >= MOST_BLOCKS:
            return []
    return runs if end == numbers else []
