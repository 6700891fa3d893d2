"""One binary file that ranks share: each reads some of its cells, and none holds the whole.

The first rank writes. It copies the file, and asks for moved nodes, some at a time, the rank that keeps their rows.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import agreed, everywhere, raise_everywhere
from gmsnet.distributed.by_rank import by_rank, cuts
from gmsnet.distributed.from_faces import cells_of_faces, occurring
from gmsnet.distributed.moved import Moved
from gmsnet.distributed.partition import along_curve
from gmsnet.distributed.piece import Cells, Piece
from gmsnet.distributed.planned import path_of, plan_of, said
from gmsnet.distributed.tags import nodes_of
from gmsnet.distributed.zones import Shared, Zones, asked, homes, in_zones, named_here, with_vertices
from gmsnet.errors import FormatError, GmsnetError, InputError
from gmsnet.io.atomic import replace_files
from gmsnet.io.formats import FORMATS, Entry
from gmsnet.io.linked import links_of, placed
from gmsnet.io.output import paths_of
from gmsnet.io.packed import is_packed, packed
from gmsnet.io.pieces import Piece as Bytes
from gmsnet.io.pieces import Pieces
from gmsnet.io.ranges import Column, Plan, put
from gmsnet.io.rows import AT_ONCE, Ranges, Rows
from gmsnet.io.stamps import Stamps
from gmsnet.io.vtk_ghosts import GHOST_CELLS
from gmsnet.kernels.topology.places import places_in
from gmsnet.kernels.topology.sorted_unique import sorted_unique

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class FileRanges:
    """What one rank has of a file. piece: its share of the cells, and their nodes. rows: (ranks + 1,) where the rows of
    coordinates begin that each rank keeps. zones: where the nodes are not the points of the file. index: the file that
    names it, where it is not the one that was asked for."""

    file: Ranges
    entry: Entry
    plan: Plan
    piece: Piece
    rows: Ids
    zones: Zones | None = None
    index: Ranges | None = None

    def write(self, target: str, points: Floats, comm: Any) -> None:
        """All ranks call it: a file of the same bytes but for the points (n, dim) of the piece that are elsewhere.

        Raises InputError, on all ranks, where it cannot be written; then nothing is.
        """
        rows, (ids, places) = self.rows, self._brought(points, comm)
        if self.zones is not None:
            rows, (ids, places) = self.zones.rows, self.zones.moved(comm, rows, ids, places)
        moved = Moved(comm, rows, ids, places)
        wrong = ""
        if comm.rank == 0:
            try:
                self._replace(target, self._contents(moved, target))
            except GmsnetError as error:
                wrong = str(error)
            finally:
                moved.end()
        else:
            moved.serve()
        raise_everywhere(comm, wrong)

    def _replace(self, target: str, contents: Iterator[Bytes]) -> None:
        """On the first rank. target: of the file that is asked for, which may name the one with these contents."""
        opened = [self.file, *self.plan.companions.values(), *([] if self.index is None else [self.index])]
        stamps = Stamps.of([(each.path, None, each.stamp) for each in opened])
        main = self.entry.suffixes[0]
        if self.index is None:
            files = {main: Pieces(lambda: contents)}
            files |= {key: Pieces(partial(each.copied, 0, each.size)) for key, each in self.plan.companions.items()}
            targets = paths_of(target, self.entry, list(files), stamps)
        else:
            text = bytes(self.index.read(0, self.index.size))
            (key,) = links_of(self.entry, text)
            given = {main: Pieces(lambda: [text]), key: Pieces(lambda: contents)}
            files, targets = placed(self.entry, given, target, stamps)
        every = {path: packed(files[key]) if is_packed(path) else files[key] for key, path in targets.items()}
        replace_files(every, stamps)

    def _brought(self, points: Floats, comm: Any) -> tuple[Ids, Floats]:
        """Of the rows that this rank keeps: the nodes that have moved on any rank, ascending, and where they are."""
        rows = np.flatnonzero((points != self.piece.points).any(axis=1))
        lists = by_rank(homes(self.rows, self.piece.ids[rows]), comm.size)
        came = comm.alltoall([(self.piece.ids[rows[some]], points[rows[some]]) for some in lists])
        ids, first = np.unique(np.concatenate([each for each, _ in came]), return_index=True)
        return ids, np.concatenate([each for _, each in came])[first]

    def _contents(self, moved: Moved, target: str) -> Iterator[Bytes]:
        """The file, on the first rank."""
        if self.plan.encoded is not None:
            folder = os.path.dirname(os.path.realpath(target))
            yield from self.plan.encoded.contents(self.file, moved.between, folder)
        else:
            yield from self._in_place(moved)
        self.file.check()

    def _in_place(self, moved: Moved) -> Iterator[Bytes]:
        """The same bytes, but for those of coordinates."""
        at = 0
        found = [(each, each.rows) for each in self.plan.points if isinstance(each.rows, Rows)]
        for column, rows in sorted(found, key=lambda each: each[1].start):
            yield from self.file.copied(at, rows.start)
            step = max(1, AT_ONCE // rows.stride)
            for begin in range(0, rows.rows, step):
                yield self._spliced(column, rows, begin, min(begin + step, rows.rows), moved)
            at = rows.end
        yield from self.file.copied(at, self.file.size)

    def _spliced(self, column: Column, rows: Rows, begin: int, end: int, moved: Moved) -> bytes:
        """The bytes of some rows of coordinates, those of moved nodes in their new places."""
        start = rows.start + begin * rows.stride
        data = self.file.read(start, min(rows.start + end * rows.stride, rows.end) - start)
        values = rows.in_bytes(data, end - begin)
        put(values, moved.between, column.first + begin, column.axis)
        return bytes(data)


def read_ranges(name: str, format: str, comm: Any) -> FileRanges:
    """All ranks call it; each reads as many cells of each block as the others.

    The mesh is that of ``gmsnet.read``. Raises InputError, on all ranks, with what it says.
    """
    file, index, entry = _opened(comm, path_of(name, format)), None, FORMATS[format]
    plan = comm.bcast(everywhere(comm, lambda: _planned(file, format) if comm.rank == 0 else None))
    if plan.beside:
        index = file
        file = _opened(comm, os.path.join(os.path.dirname(name), plan.beside))
    rows = cuts(plan.nodes, comm.size)
    first, last = rows[comm.rank : comm.rank + 2].tolist()
    names, images, called = plan.names or {}, np.empty(0, dtype=np.int64), GHOST_CELLS
    if plan.faces is None:
        read = everywhere(comm, lambda: said(file, lambda: _blocks(file, plan, comm)))
        ghosts = everywhere(comm, lambda: said(file, lambda: _ghosts(file, plan, comm)))
    else:
        read, images, stay = cells_of_faces(comm, file, plan.faces, plan.nodes, partial(said, file))
        names, called = occurring(comm, read, names), "zones"
    if plan.tags:
        read, images = _renumbered(comm, file, plan, read, first, last)
    nodes = everywhere(comm, lambda: said(file, lambda: _nodes(file, plan, rows, comm.rank)))
    nodes = nodes._replace(held=nodes.held | nodes.marked(comm, images))
    if plan.faces is None:
        stay = _ids_of([block.nodes[marks] for block, marks in zip(read, ghosts, strict=True)])
    zones = None
    if plan.zones:
        named = _ids_of([block.nodes for block in read])
        zones, nodes, stay = in_zones(comm, plan.zones, nodes, named)
        node = zones.of_points(comm, named)
        read = [replace(block, nodes=node[places_in(named, block.nodes)]) for block in read]
        called = "coincident points"
    read, names = with_vertices(comm, read, names, named_here(comm, nodes.rows, stay), called)
    ids = _ids_of([block.nodes[:, 0] for block in read])
    blocks = _shared_out(comm, read, ids, asked(comm, nodes.rows, nodes.points, ids))
    ids = _ids_of([block.nodes for block in blocks])
    lonely = np.flatnonzero(~nodes.marked(comm, ids)) + nodes.rows[comm.rank]  # of no cell
    ids = np.sort(np.concatenate([ids, lonely]))
    points, fixed = (asked(comm, nodes.rows, mine, ids) for mine in (nodes.points, nodes.held))
    for each in [file, *plan.companions.values(), *([] if index is None else [index])]:
        everywhere(comm, each.check)
    piece = everywhere(comm, lambda: Piece(ids, points, fixed, tuple(blocks), plan.single, names))
    return FileRanges(file, entry, plan, piece, nodes.rows, zones, index)


def _opened(comm: Any, name: str) -> Ranges:
    """All ranks call it: a file that is the same for all."""
    file = everywhere(comm, lambda: Ranges(name))
    agreed(comm, (file.stamp.size, file.stamp.modified), f"{name}: the file")
    return file


def _nodes(file: Ranges, plan: Plan, rows: Ids, rank: int) -> Shared:
    """Those of a rank. rows: see Shared."""
    first, last = rows[rank : rank + 2].tolist()
    held = np.zeros(last - first, dtype=bool)
    if plan.fixed is not None:
        held |= (plan.fixed.of(file, first, last) != 0).any(axis=1)
    return Shared(rows, plan.places(file, first, last), held)


def _planned(file: Ranges, format: str) -> Plan:
    found = plan_of(file, format)
    if found is None:
        raise InputError(f"{file.path}: ranks cannot share this file")
    return found


def _blocks(file: Ranges, plan: Plan, comm: Any) -> list[Cells]:
    return [
        Cells(tables[0].kind, *plan.cells(file, block, comm.rank, comm.size))
        for block, tables in enumerate(plan.blocks)
    ]


def _ghosts(file: Ranges, plan: Plan, comm: Any) -> list[NDArray[np.bool_]]:
    """Which of the same cells are copies of others."""
    return [plan.ghosts(file, block, comm.rank, comm.size) for block in range(len(plan.blocks))]


def _renumbered(
    comm: Any, file: Ranges, plan: Plan, read: Sequence[Cells], first: int, last: int
) -> tuple[list[Cells], Ids]:
    """Cells by nodes, of cells by tags, and the nodes of a share of the images. first, last: the nodes whose tags this
    rank reads."""
    tags = everywhere(comm, lambda: said(file, lambda: plan.tags_of(file, first, last)))
    images = np.array_split(plan.images, comm.size)[comm.rank]
    named = _ids_of([*(block.nodes for block in read), images])
    nodes, twice = nodes_of(comm, tags, first, plan.nodes, named)

    def checked() -> list[Cells]:
        if len(twice):
            node = int(twice.min())
            tag = int(plan.tags_of(file, node, node + 1)[0])
            raise FormatError(f"{plan.where_tag(node)}: the node {tag} is given twice")
        found = [replace(block, nodes=nodes[places_in(named, block.nodes)]) for block in read]
        for number, (block, old) in enumerate(zip(found, read, strict=True)):
            if (block.nodes < 0).any():
                row, column = np.argwhere(block.nodes < 0)[0].tolist()
                raise FormatError(f"{plan.where_cell(number, int(block.numbers[row]))}: a cell names the node "
                                  f"{old.nodes[row, column]}, which the file has not")  # fmt: skip
        return found

    pairs = nodes[places_in(named, images)]
    return everywhere(comm, lambda: said(file, checked)), pairs[(pairs >= 0).all(axis=1)].ravel()


def _ids_of(nodes: Sequence[Ids]) -> Ids:
    found: Ids = sorted_unique(np.concatenate([np.empty(0, dtype=np.int64), *(each.ravel() for each in nodes)]))
    return found


def _shared_out(comm: Any, blocks: Sequence[Cells], ids: Ids, points: Floats) -> list[Cells]:
    """Cells that lie near one another, as many for each rank, those of each block in ascending order.

    ids, points: the first node of each cell. So it does not matter in which order a file has its cells.
    """
    first = [places_in(ids, block.nodes[:, 0]) for block in blocks]
    ranks = along_curve(comm, points[np.concatenate([np.empty(0, dtype=np.int64), *first])])
    found, cuts = [], np.cumsum([len(each) for each in first])[:-1]
    for block, chosen in zip(blocks, np.split(ranks, cuts), strict=True):
        came = comm.alltoall([block.take(rows) for rows in by_rank(chosen, comm.size)])
        parts = (np.concatenate([getattr(each, name) for each in came]) for name in ("nodes", "regions", "numbers"))
        whole = Cells(block.kind, *parts)
        found.append(whole.take(np.argsort(whole.numbers)))
    return found
