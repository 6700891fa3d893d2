"""Grids of VTK: where the nodes lie of each run of cells of one type, or of all cells of a type."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.io import vtk_cells
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.ranges import Table
from gmsnet.io.rows import Listed, Ranges
from gmsnet.io.vtk_ghosts import BITS
from gmsnet.mesh.region_fields import NUMBERED, names_a_region
from gmsnet.mesh.vtk_types import POLYGON, POLYHEDRON, POLYLINE, POLYVERTEX

Some = Callable[[int, int], NDArray[Any]]

CODES = {*vtk_cells.KINDS} - {POLYGON, POLYHEDRON, POLYLINE, POLYVERTEX}  # types of a certain number of nodes
SIZES = np.array([nodes_of(vtk_cells.KINDS[code].name) if code in CODES else 0 for code in range(max(CODES) + 1)])
AT_ONCE = 1 << 18  # cells that are looked at together


class Field(NamedTuple):
    """Data of cells or points. rows: where these stand; None where they are in no such rows."""

    name: str
    rows: Listed | None


class Told(NamedTuple):
    """regions: of cells; fixed: of nodes, those that are not 0 are held. None where the file has no such numbers.
    ghosts: of cells, and the bits that tell copies of cells of others."""

    regions: Listed | None = None
    fixed: Listed | None = None
    ghosts: Sequence[tuple[Listed, int]] = ()

    @property
    def without_ghosts(self) -> Told:
        """For formats whose files are no pieces of others, and hold no cells for them."""
        return self._replace(ghosts=())


def told_by(file: Ranges, points: Iterable[Field], cells: Iterable[Field], counts: tuple[int, int]) -> Told | None:
    """What the data of points and cells tell, of which there are so many. None where only a reader of them all can tell
    (see ``region_fields.regions_of``)."""
    held = [field.rows for field in points if field.name == "fixed"][-1:]
    cells = list(cells)
    found = [field.rows for field in cells if names_a_region(field.name)]
    marks = {field.name: field.rows for field in cells if field.name in BITS}
    if any(rows is None or rows.rows != counts[0] for rows in held):
        return None
    if any(rows is None or rows.rows != counts[1] for rows in [*found, *marks.values()]):
        return None
    single = [rows for rows in found if rows is not None and rows.width == 1]
    if len(single) > 1 or any(rows.dtype[1] not in "iu" or _may_number(file, rows) for rows in single):
        return None
    ghosts = [(rows, BITS[name]) for name, rows in marks.items()
              if rows is not None and rows.width == 1 and rows.dtype[1] in "iu"]  # fmt: skip
    return Told(single[0] if single else None, held[0] if held else None, ghosts)


def _may_number(file: Ranges, rows: Listed) -> bool:
    """Whether each of many cells may have a value of its own, as the first ones have."""
    return rows.rows >= NUMBERED and len(np.unique(rows.of(file, 0, NUMBERED))) == NUMBERED


def tables_of(file: Ranges, types: Listed, nodes: Listed, offsets: Some | None, told: Told) -> list[Table]:
    """A table for each run of cells of one type, or where runs are many for each type; none where that cannot be told.

    types: VTK's of the cells. nodes: of all cells. offsets: some of where the nodes of each cell begin, with the end of
    the last one (cells + 1 in all); without, each cell has its number of nodes in front, which counts as one of them.
    told: by the data of the cells.
    """
    lead = int(offsets is None)
    walk = _walked(file, types, offsets, nodes.rows)
    if walk is None:
        return []
    if walk.runs is None:
        return [_scattered(code, walk, types, nodes, lead, told) for code in walk.codes]
    tables = list[Table]()
    for first, last, code, start in walk.runs:
        kind, width = vtk_cells.KINDS[code], int(SIZES[code])
        rows = nodes.cut(start + lead, last - first, width + lead, width)
        counts = nodes.cut(start, last - first, width + lead, 1) if lead else None
        own = None if told.regions is None else told.regions.cut(first, last - first, 1, 1)
        ghosts = [(values.cut(first, last - first, 1, 1), bits) for values, bits in told.ghosts]
        tables.append(Table(kind.name, rows, 0, kind.order, 0, own, counts, ghosts=ghosts))
    return tables


def _scattered(code: int, walk: Walk, types: Listed, nodes: Listed, lead: int, told: Told) -> Table:
    """All cells of one type."""
    kind, width = vtk_cells.KINDS[code], int(SIZES[code])
    before = walk.before[:, code].copy()
    among = Among(types, code, lead, walk.cells, walk.starts, before)
    counts = KindNodes(among, nodes, 0, 1) if lead else None
    own = None if told.regions is None else KindValues(among, told.regions)
    ghosts = [(KindValues(among, values), bits) for values, bits in told.ghosts]
    return Table(kind.name, KindNodes(among, nodes, lead, width), 0, kind.order, 0, own, counts, ghosts=ghosts)


class Walk(NamedTuple):
    """Where cells are. runs: first and last cell, type and first number of each run of cells of one type, None where
    they are many. codes: the types in the order in which they first occur. cells, starts, before: (m, …) at some
    cells, their numbers, their first numbers of nodes, and how many cells of each type there are before.
    """

    runs: list[tuple[int, int, int, int]] | None
    codes: list[int]
    cells: NDArray[np.int64]
    starts: NDArray[np.int64]
    before: NDArray[np.int64]


def _walked(file: Ranges, types: Listed, offsets: Some | None, numbers: int) -> Walk | None:
    """None where a type is not known, or the offsets and the number of all nodes do not fit the types."""
    runs, end, seen = list[tuple[int, int, int, int]](), 0, dict[int, None]()
    many, starts, before = False, [0], [np.zeros(len(SIZES), dtype=np.int64)]
    marks = [*range(0, types.rows, AT_ONCE), types.rows]
    for first, last in itertools.pairwise(marks):
        codes = types.of(file, first, last)[:, 0].astype(np.int64)
        if not set(np.unique(codes).tolist()) <= CODES:
            return None
        ends = end + np.append(0, np.cumsum(SIZES[codes] + (offsets is None)))
        if offsets is not None and (offsets(first, last + 1) != ends).any():
            return None
        cuts = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), last - first]
        seen |= dict.fromkeys(codes[cuts[:-1]].tolist())
        goes_on = bool(runs) and runs[-1][2] == codes[0]
        many |= len(runs) + len(cuts) - 1 - goes_on > MOST_BLOCKS
        for begin, stop in () if many else itertools.pairwise(cuts):
            if runs and runs[-1][2] == codes[begin]:
                runs[-1] = (*runs[-1][:1], first + stop, *runs[-1][2:])
            else:
                runs.append((first + begin, first + stop, int(codes[begin]), int(ends[begin])))
        end = int(ends[-1])
        starts.append(end)
        before.append(before[-1] + np.bincount(codes, minlength=len(SIZES)))
    if end != numbers:
        return None
    return Walk(None if many else runs, [*seen], np.array(marks), np.array(starts), np.array(before))


@dataclass(frozen=True, eq=False)
class Among:
    """Where cells of one type are among all. types, lead: see tables_of. cells, starts, before: (m,) see Walk."""

    types: Listed
    code: int
    lead: int
    cells: NDArray[np.int64]
    starts: NDArray[np.int64]
    before: NDArray[np.int64]

    def of(self, file: Ranges, first: int, last: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(last − first,) some of the cells, and where their numbers begin."""
        begin, end = self.mark(first), int(np.searchsorted(self.before, last))
        codes = self.types.of(file, int(self.cells[begin]), int(self.cells[end]))[:, 0].astype(np.int64)
        rows = np.flatnonzero(codes == self.code)[first - self.before[begin] : last - self.before[begin]]
        sizes = SIZES[np.where(codes < len(SIZES), codes, 0)] + self.lead
        return self.cells[begin] + rows, self.starts[begin] + (np.cumsum(sizes) - sizes)[rows]

    def mark(self, row: int) -> int:
        """The last of the marks in front of one of the cells."""
        return int(np.searchsorted(self.before, row, side="right")) - 1


@dataclass(frozen=True)
class KindNodes:
    """The numbers of cells of one type. skip: how many in front of each do not count. width: of each."""

    among: Among
    nodes: Listed
    skip: int
    width: int

    @property
    def rows(self) -> int:
        """How many there are."""
        return int(self.among.before[-1])

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.nodes.dtype

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """(last − first, width) the numbers of some rows."""
        if last <= first:
            return np.empty((0, self.width), dtype=self.dtype)
        _, starts = self.among.of(file, first, last)
        low = int(starts[0])
        values = self.nodes.of(file, low, int(starts[-1]) + self.skip + self.width)[:, 0]
        found: NDArray[Any] = values[(starts - low + self.skip)[:, None] + np.arange(self.width)]
        return found

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        return f"{self.nodes.where(int(self.among.starts[self.among.mark(row)]))} or behind"


@dataclass(frozen=True)
class KindValues:
    """The values of cells of one type, one each."""

    among: Among
    values: Listed
    width: int = 1

    @property
    def rows(self) -> int:
        """How many there are."""
        return int(self.among.before[-1])

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.values.dtype

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """(last − first, 1) the values of some rows."""
        if last <= first:
            return np.empty((0, 1), dtype=self.dtype)
        cells, _ = self.among.of(file, first, last)
        found: NDArray[Any] = self.values.of(file, int(cells[0]), int(cells[-1]) + 1)[cells - cells[0]]
        return found

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        return f"{self.values.where(int(self.among.cells[self.among.mark(row)]))} or behind"
