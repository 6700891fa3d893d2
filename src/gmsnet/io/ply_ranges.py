"""Binary PLY of which a process reads and writes some rows only: faces with lists of one length follow each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from gmsnet.cells.table import face_name
from gmsnet.io import ply_header
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.ply_header import Element, Header, Property
from gmsnet.io.ranges import Column, Plan, Table, blocks_of
from gmsnet.io.rows import AT_ONCE, HEAD, Ranges, Rows
from gmsnet.io.vtk_runs import Field, Told, told_by

_FIRST_LOOK = 64  # faces that are looked at first for as many nodes; then twice as many each time
_LARGEST = 4  # nodes of a face: for those of more, each has to be asked
_BEHIND = 1 << 12  # bytes behind the last row, at most, that may be white space


@dataclass(frozen=True)
class Run:
    """Rows with lists of one length. start: the first byte. count: how many there are. size: of the list."""

    start: int
    count: int
    size: int


@dataclass(frozen=True)
class Layout:
    """Of the rows of an element. order: of bytes. listed: the name of its list, "" where it has none."""

    element: Element
    order: str
    listed: str = ""

    def stride(self, size: int) -> int:
        """Bytes of a row whose list has so many numbers."""
        return sum(self._bytes(each, size) for each in self.element.properties)

    def rows(self, run: Run, name: str, width: int = 1, *, lengths: bool = False) -> Rows:
        """The numbers of a property, and of those behind it, in a run. lengths: of a list its length instead."""
        at = run.start
        for each in self.element.properties:
            if each.name == name:
                break
            at += self._bytes(each, run.size)
        kind = each.length if lengths and each.length else each.kind
        at += _size(each.length) if each.length and not lengths else 0
        return Rows(at, run.count, self.stride(run.size), f"{self.order}{kind}", width)

    def _bytes(self, each: Property, size: int) -> int:
        return _size(each.kind) if each.length is None else _size(each.length) + size * _size(each.kind)


def _size(kind: str) -> int:
    return np.dtype(kind).itemsize


def plan(file: Ranges, lists: tuple[str, ...]) -> Plan | None:
    """How the numbers of a binary file lie; None of a text, and where only a reader of the whole can tell.

    lists: the names that the list of the nodes of faces may have.
    """
    header = ply_header.parse(bytes(file.read(0, min(file.size, HEAD))))
    found = _found(file, header, lists) if header.order else None
    if found is None or not {"face", "edge"} & found.keys():
        return None
    layout, runs = found["vertex"]
    column = _points(layout, runs[0])
    if column is None:
        return None
    told = _told(file, found)
    if told is None:
        return None
    tables = list[Table]()
    for name, (layout, runs) in found.items():
        if name != "vertex":
            made = _faces(layout, runs, told) if name == "face" else _edges(layout, runs[0], told)
            if made is None:
                return None
            tables += made
    return Plan([column], blocks_of(tables), column.rows.dtype[1:] == "f4", fixed=told.fixed)


_Found = Mapping[str, tuple[Layout, list[Run]]]


def _found(file: Ranges, header: Header, lists: tuple[str, ...]) -> _Found | None:
    """The rows of vertices, faces and edges; None where others stand among them, or other lists."""
    at, found = header.end, dict[str, tuple[Layout, list[Run]]]()
    for element in header.elements:
        named = [each.name for each in element.properties if each.length]
        listed = named[0] if named else ""
        if element.name not in ("vertex", "face", "edge") or len(named) != (element.name == "face"):
            return None
        if listed and listed not in lists:
            return None
        layout = Layout(element, header.order, listed)
        runs = [*islice(_runs(file, layout, at), MOST_BLOCKS + 1)] if listed else [Run(at, element.count, 0)]
        if sum(run.count for run in runs) != element.count or len(runs) > MOST_BLOCKS:
            return None
        at = max([at, *(run.start + run.count * layout.stride(run.size) for run in runs)])
        if element.count or element.name == "vertex":
            found[element.name] = layout, runs
    behind = file.size - at
    if not 0 <= behind <= _BEHIND or bytes(file.read(at, behind)).strip():
        return None
    return found if "vertex" in found else None


def _runs(file: Ranges, layout: Layout, at: int) -> Iterator[Run]:
    """Rows with lists of one length, as they follow each other; fewer than all where the file ends before."""
    left = layout.element.count
    while left:
        first = layout.rows(Run(at, 1, 0), layout.listed, lengths=True)
        if first.end > file.size:
            return
        run = _alike(file, layout, Run(at, left, int(first.of(file, 0, 1)[0, 0])))
        if not run.count:
            return
        yield run
        at += run.count * layout.stride(run.size)
        left -= run.count


def _alike(file: Ranges, layout: Layout, run: Run) -> Run:
    """Of a run, as many rows as have lists of its length."""
    if run.size < 0:
        return replace(run, count=0)
    stride = layout.stride(run.size)
    most, count, look = min(run.count, (file.size - run.start) // stride), 0, _FIRST_LOOK
    while count < most:
        some = Run(run.start + count * stride, min(look, most - count, max(1, AT_ONCE // stride)), run.size)
        same = layout.rows(some, layout.listed, lengths=True).of(file, 0, some.count)[:, 0] == run.size
        if not same.all():
            return replace(run, count=count + int(np.argmin(same)))
        count, look = count + some.count, 2 * look
    return replace(run, count=most)


def _points(layout: Layout, run: Run) -> Column | None:
    """The coordinates; None where these do not follow each other, or are of different types."""
    names = [each.name for each in layout.element.properties]
    if not {"x", "y", "z"} <= {*names} or names[names.index("x") :][:3] != ["x", "y", "z"]:
        return None
    kinds = {each.kind for each in layout.element.properties if each.name in ("x", "y", "z")}
    return Column(layout.rows(run, "x", 3)) if kinds in ({"f4"}, {"f8"}) else None


def _told(file: Ranges, found: _Found) -> Told | None:
    """What the data of vertices and cells tell; see ``told_by``. Data of cells are told where all are of one run."""
    vertices, cells = list[Field](), list[Field]()
    parts = [(of, name) for of, name in ((vertices, "vertex"), (cells, "face"), (cells, "edge")) if name in found]
    alone = len(parts) == 2
    for of, name in parts:
        layout, runs = found[name]
        one = len(runs) == 1 and (alone or of is vertices)
        of += [Field(each.name, layout.rows(runs[0], each.name) if one else None)
               for each in layout.element.properties if each.length is None]  # fmt: skip
    counts = [sum(run.count for run in found[name][1]) for _, name in parts]
    told = told_by(file, vertices, cells, (counts[0], sum(counts[1:])))
    return None if told is None else told.without_ghosts


def _faces(layout: Layout, runs: list[Run], told: Told) -> list[Table] | None:
    item = next(each for each in layout.element.properties if each.name == layout.listed)
    if item.kind[0] == "f" or not all(3 <= run.size <= _LARGEST for run in runs):
        return None
    return [Table(face_name(run.size), layout.rows(run, item.name, run.size), 0, regions=told.regions) for run in runs]


def _edges(layout: Layout, run: Run, told: Told) -> list[Table] | None:
    """None where their ends do not follow each other, or are of different types."""
    names = [each.name for each in layout.element.properties]
    kinds = {each.kind for each in layout.element.properties if each.name in ("vertex1", "vertex2")}
    if "vertex1" not in names or names[names.index("vertex1") :][:2] != ["vertex1", "vertex2"]:
        return None
    if len(kinds) != 1 or kinds & {"f4", "f8"}:
        return None
    return [Table("line", layout.rows(run, "vertex1", 2), 0, regions=told.regions)]
