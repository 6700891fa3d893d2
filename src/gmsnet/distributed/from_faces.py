"""Cells of a file that lists faces: each rank reads some faces, and tells them to the ranks that have their cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.distributed.agreement import everywhere
from gmsnet.distributed.by_rank import by_rank, cuts
from gmsnet.distributed.library import mpi
from gmsnet.distributed.piece import Cells
from gmsnet.distributed.zones import Names, homes
from gmsnet.errors import FormatError
from gmsnet.io.cells import distinct
from gmsnet.io.face_ranges import FaceLists, SomeFaces
from gmsnet.io.foam_cells import SHAPES, Sides, walls
from gmsnet.io.rows import Ranges, share
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

Ids = NDArray[np.int64]
Value = TypeVar("Value")
Here = Callable[[Callable[[], Value]], Value]  # what each rank makes for itself, or all raise


class FromFaces(NamedTuple):
    """blocks: cells of this rank. images: nodes of this rank's faces that must match others. held: nodes that zones
    name."""

    blocks: list[Cells]
    images: Ids
    held: Ids


def cells_of_faces(comm: Any, file: Ranges, lists: FaceLists, nodes: int, said: Here[Any]) -> FromFaces:
    """All ranks call it: the cells of the mesh, each on one rank, in the order of a reader of the whole.

    nodes: how many the mesh has. said: names the file where it is damaged.
    """
    first, last = share(lists.count, comm.rank, comm.size)

    def read() -> SomeFaces:
        return _checked(lists.some(file, first, last), nodes, lists.count)

    mine: SomeFaces = everywhere(comm, lambda: said(read))
    most = np.max([mine.owner.max(initial=-1), mine.other.max(initial=-1)])
    count = 1 + int(comm.allreduce(int(most), mpi().MAX))
    if not 0 < count <= lists.count:
        everywhere(comm, lambda: said(lambda: _fail(f"{lists.count} faces name {count} cells: is the file damaged?")))
    cells = cuts(count, comm.size)
    begin, end = cells[comm.rank : comm.rank + 2].tolist()
    regions = _regions(comm, lists, cells, said)

    came = _told(comm, mine, cells)
    faces = came.outward
    volumes = everywhere(comm, lambda: said(lambda: lists.cells(faces, Sides.of(faces, begin, end), regions, begin)))
    edge = np.flatnonzero(mine.other < 0)
    outer = mine.take(edge)._replace(inward=np.zeros(len(edge), dtype=bool))
    border = walls(outer.sizes, outer.nodes, outer.markers)
    blocks = [*_numbered(comm, volumes, _by_shape), *_numbered(comm, border, _by_marker)]
    return FromFaces(blocks, mine.take(np.flatnonzero(np.isin(mine.markers, lists.periodic))).nodes,
                     _held(comm, lists, mine, first, nodes, said))  # fmt: skip


def occurring(comm: Any, blocks: Sequence[Cells], names: Names) -> Names:
    """All ranks call it: the names of regions and markers that have cells on any rank."""
    mine = {(CELLS[block.kind].dimension, region) for block in blocks for region in distinct(block.regions)}
    there = {key for each in comm.allgather(mine & names.keys()) for key in each}
    return {key: name for key, name in names.items() if key in there}


def _fail(text: str) -> None:
    raise FormatError(text)


def _checked(faces: SomeFaces, nodes: int, most: int) -> SomeFaces:
    for what, ids, least, limit in (
        ("point", faces.nodes, 0, nodes), ("cell", faces.owner, 0, most), ("cell", faces.other, -1, most)
    ):  # fmt: skip
        wrong = ids[(ids < least) | (ids >= limit)]
        if len(wrong):
            raise FormatError(f"a face names the {what} {wrong[0]}, which is none of 0 to {limit - 1}")
    return faces


def _told(comm: Any, mine: SomeFaces, cells: Ids) -> SomeFaces:
    """The faces of the cells of this rank, those between two cells first, each in the order of the file."""
    rank, other = homes(cells, mine.owner), np.where(mine.other < 0, -1, homes(cells, mine.other))
    twice = np.flatnonzero((other >= 0) & (other != rank))
    rows = np.concatenate([np.arange(len(rank)), twice])
    lists = by_rank(np.concatenate([rank, other[twice]]), comm.size)
    came = SomeFaces.joined(comm.alltoall([mine.take(np.sort(rows[some])) for some in lists]))
    return came.take(np.argsort(came.other < 0, kind="stable"))


def _regions(comm: Any, lists: FaceLists, cells: Ids, said: Here[Any]) -> Ids:
    """(n,) of the cells of this rank."""
    begin, end = cells[comm.rank : comm.rank + 2].tolist()
    regions = np.zeros(end - begin, dtype=np.int64)
    found = everywhere(comm, lambda: said(lambda: lists.regions(comm.rank, comm.size, int(cells[-1]))))
    named = np.concatenate([cells[:0], *(some for _, some in found)])
    everywhere(comm, lambda: said(lambda: _within(named, int(cells[-1]), "cells")))
    for region, some in found:
        here = np.concatenate(comm.alltoall([some[rows] for rows in by_rank(homes(cells, some), comm.size)]))
        regions[here - begin] = region
    return regions


def _held(comm: Any, lists: FaceLists, mine: SomeFaces, first: int, nodes: int, said: Here[Any]) -> Ids:
    """Nodes that zones of faces and of points name."""
    faces, points = everywhere(comm, lambda: said(lambda: lists.held(comm.rank, comm.size)))
    everywhere(comm, lambda: said(lambda: _within(faces, lists.count, "faces")))
    everywhere(comm, lambda: said(lambda: _within(points, nodes, "points")))
    lists_of = by_rank(homes(cuts(lists.count, comm.size), faces), comm.size)
    here = np.concatenate(comm.alltoall([faces[rows] for rows in lists_of]))
    return np.concatenate([mine.take(sorted_unique(here - first)).nodes, points])


def _within(ids: Ids, most: int, what: str) -> None:
    if len(ids) and not 0 <= ids.min() <= ids.max() < most:
        raise FormatError(f"a zone names {ids.max()}, but there are {most} {what}")


def _by_shape(block: CellBlock) -> tuple[int, ...]:
    """The order of ``foam_cells.volumes``: known shapes, and then polyhedra by their points."""
    shapes = list(SHAPES)
    return (shapes.index(block.kind) if block.kind in SHAPES else len(shapes), block.nodes.shape[1])


def _by_marker(block: CellBlock) -> tuple[int, ...]:
    """The order of ``foam_cells.walls``."""
    return (int(block.regions[0]), block.nodes.shape[1])


def _numbered(comm: Any, found: list[CellBlock], order: Callable[[CellBlock], tuple[int, ...]]) -> list[Cells]:
    """The same blocks on all ranks, in order; those of lower ranks have the lower numbers."""
    mine = {order(block): block for block in found}
    kinds = {key: kind for each in comm.allgather({key: block.kind for key, block in mine.items()})
             for key, kind in each.items()}  # fmt: skip
    keys = sorted(kinds)
    counts = np.array(comm.allgather([len(mine[key].nodes) if key in mine else 0 for key in keys]), dtype=np.int64)
    blocks = []
    for key, before in zip(keys, counts[: comm.rank].sum(axis=0).tolist() if len(keys) else (), strict=True):
        none = np.empty(0, dtype=np.int64)
        block = mine.get(key)
        nodes, regions = (none.reshape(0, key[-1]), none) if block is None else (block.nodes, block.regions)
        blocks.append(Cells(kinds[key], nodes, regions, before + np.arange(len(nodes))))
    return blocks
