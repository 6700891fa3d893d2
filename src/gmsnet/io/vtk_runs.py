"""Grids of VTK whose cells stand in runs of one kind: where the nodes of each run lie in a file."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.io import vtk_cells
from gmsnet.io.cell_table import Kind
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.ranges import Table
from gmsnet.io.rows import Listed, Ranges
from gmsnet.io.vtk_ghosts import LEVELS, TYPES
from gmsnet.mesh.region_fields import NUMBERED, names_a_region
from gmsnet.mesh.vtk_types import POLYGON, POLYLINE, POLYVERTEX

Some = Callable[[int, int], NDArray[Any]]

CODES = {*vtk_cells.KINDS} - {POLYGON, POLYLINE, POLYVERTEX}  # types of a certain number of nodes
SIZES = np.array([nodes_of(vtk_cells.KINDS[code].name) if code in CODES else 0 for code in range(max(CODES) + 1)])
AT_ONCE = 1 << 20  # cells that are looked at together


class Field(NamedTuple):
    """Data of cells or points. rows: where these stand; None where they are in no such rows."""

    name: str
    rows: Listed | None


class Told(NamedTuple):
    """regions: of cells; fixed: of nodes, those that are not 0 are held. None where the file has no such numbers."""

    regions: Listed | None
    fixed: Listed | None


def told_by(file: Ranges, points: Iterable[Field], cells: Iterable[Field], counts: tuple[int, int]) -> Told | None:
    """What the data of points and cells tell, of which there are so many. None where only a reader of them all can tell
    (see ``region_fields.regions_of``), and where they mark copies of cells of others."""
    held = [field.rows for field in points if field.name == "fixed"][-1:]
    cells = list(cells)
    found = [field.rows for field in cells if names_a_region(field.name)]
    if any(rows is None or rows.rows != counts[0] for rows in held):
        return None
    if any(rows is None or rows.rows != counts[1] for rows in found) or any(f.name in (TYPES, LEVELS) for f in cells):
        return None
    single = [rows for rows in found if rows is not None and rows.width == 1]
    if len(single) > 1 or any(rows.dtype[1] not in "iu" or _may_number(file, rows) for rows in single):
        return None
    return Told(single[0] if single else None, held[0] if held else None)


def _may_number(file: Ranges, rows: Listed) -> bool:
    """Whether each of many cells may have a value of its own, as the first ones have."""
    return rows.rows >= NUMBERED and len(np.unique(rows.of(file, 0, NUMBERED))) == NUMBERED


def tables_of(
    types: Some, cells: int, numbers: int, nodes: Listed, offsets: Some | None = None, regions: Listed | None = None
) -> list[Table]:
    """A table for each run of cells of one kind; none where that cannot be told.

    types: some of VTK's types of the cells. numbers: of nodes in all cells. nodes: where these lie. offsets: some of
    where the nodes of each cell begin, with the end of the last one (cells + 1 in all); without, each cell has its
    number of nodes in front, which counts as one of them. regions: of the cells.
    """
    tables, lead = list[Table](), int(offsets is None)
    for first, last, kind, start in _runs(types, offsets, cells, numbers):
        width = nodes_of(kind.name)
        rows = nodes.cut(start + lead, last - first, width + lead, width)
        counts = nodes.cut(start, last - first, width + lead, 1) if lead else None
        own = None if regions is None else regions.cut(first, last - first, 1, 1)
        tables.append(Table(kind.name, rows, 0, kind.order, 0, own, counts))
    return tables


def _runs(types: Some, offsets: Some | None, cells: int, numbers: int) -> list[tuple[int, int, Kind, int]]:
    """First and last cell, kind and first number of each run of cells of one kind; none where that cannot be told."""
    runs, end = list[tuple[int, int, Kind, int]](), 0
    for first in range(0, cells, AT_ONCE):
        last = min(first + AT_ONCE, cells)
        codes = types(first, last)
        if not set(np.unique(codes).tolist()) <= CODES:
            return []
        sizes = SIZES[codes] + (offsets is None)
        ends = end + np.append(0, np.cumsum(sizes))
        if offsets is not None and (offsets(first, last + 1) != ends).any():
            return []
        cuts = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), last - first]
        for begin, stop in itertools.pairwise(cuts):
            kind = vtk_cells.KINDS[int(codes[begin])]
            if runs and runs[-1][2] == kind:
                runs[-1] = (*runs[-1][:1], first + stop, *runs[-1][2:])
            else:
                runs.append((first + begin, first + stop, kind, int(ends[begin])))
        end = int(ends[-1])
        if len(runs) >= MOST_BLOCKS:
            return []
    return runs if end == numbers else []
