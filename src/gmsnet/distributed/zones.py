"""Nodes of a file in zones that ranks share: points of different zones that are at one place are one node."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.joining import joined_points
from gmsnet.distributed.library import mpi
from gmsnet.distributed.piece import Cells
from gmsnet.kernels.topology.sorted_unique import sorted_unique

Ids = NDArray[np.int64]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Names = Mapping[tuple[int, int], str]


class Shared(NamedTuple):
    """Nodes of which each rank keeps some that follow each other. rows: (ranks + 1,) where those of each begin. points:
    (n, dim) of this rank's. held: (n,) which of these are to be held."""

    rows: Ids
    points: Floats
    held: Flags

    def marked(self, comm: Any, nodes: Ids) -> Flags:
        """All ranks call it: which of the nodes of this rank any rank names."""
        found = np.zeros(len(self.points), dtype=bool)
        found[named_here(comm, self.rows, nodes) - self.rows[comm.rank]] = True
        return found


def named_here(comm: Any, rows: Ids, nodes: Ids) -> Ids:
    """All ranks call it: those of the nodes that this rank keeps that any rank names, ascending. rows: see Shared."""
    lists = by_rank(homes(rows, nodes), comm.size)
    return sorted_unique(np.concatenate(comm.alltoall([nodes[some] for some in lists])))


def with_vertices(
    comm: Any, blocks: Sequence[Cells], names: Names, nodes: Ids, called: str
) -> tuple[list[Cells], Names]:  # fmt: skip
    """All ranks call it: cells, and names of regions, with a vertex at each of some nodes; see
    ``gmsnet.io.vtk_ghosts.with_vertices``. nodes: of those that this rank keeps, ascending."""
    counts = comm.allgather(len(nodes))
    if not any(counts):
        return [*blocks], names
    regions = [int(block.regions.max(initial=0)) for block in blocks if CELLS[block.kind].dimension == 0]
    region = 1 + int(comm.allreduce(max(regions, default=0), mpi().MAX))
    numbers = sum(counts[: comm.rank]) + np.arange(len(nodes))
    vertices = Cells("vertex", nodes[:, None], np.full(len(nodes), region), numbers)
    return [*blocks, vertices], {**names, (0, region): called}


def homes(rows: Ids, nodes: Ids) -> Ids:
    """Which rank keeps some nodes. rows: see Shared."""
    found: Ids = np.searchsorted(rows, nodes, side="right") - 1
    return found


def asked(comm: Any, rows: Ids, mine: NDArray[Any], needed: Ids) -> NDArray[Any]:
    """All ranks call it: what the ranks that keep some nodes say of them. mine: (n, …) of those of this rank."""
    lists = by_rank(homes(rows, needed), comm.size)
    answers = comm.alltoall([mine[each - rows[comm.rank]] for each in comm.alltoall([needed[some] for some in lists])])
    found = np.empty((len(needed), *mine.shape[1:]), dtype=mine.dtype)
    for some, told in zip(lists, answers, strict=True):
        found[some] = told
    return found


@dataclass(frozen=True, eq=False)
class Zones:
    """The points of all zones, one zone after another. rows: (ranks + 1,) where those of each rank begin. node: (n,) of
    this rank's, the node that each is."""

    rows: Ids
    node: Ids

    def of_points(self, comm: Any, points: Ids) -> Ids:
        """All ranks call it: the nodes of some points."""
        return asked(comm, self.rows, self.node, points)

    def moved(self, comm: Any, rows: Ids, ids: Ids, places: Floats) -> tuple[Ids, Floats]:
        """All ranks call it: the points of this rank that have moved, ascending, and where they are.

        ids, places: the same of the nodes that this rank keeps. rows: see Shared.
        """
        table = np.zeros((int(rows[comm.rank + 1] - rows[comm.rank]), 1 + places.shape[1]))
        table[ids - rows[comm.rank]] = np.column_stack([np.ones(len(ids)), places])
        told = asked(comm, rows, table, self.node)
        there = np.flatnonzero(told[:, 0])
        return self.rows[comm.rank] + there, told[there, 1:]


def in_zones(comm: Any, first: Sequence[int], points: Shared, named: Ids) -> tuple[Zones, Shared, Ids]:
    """All ranks call it: the nodes that points of zones are, and those of them at the place of others of their zone.

    See ``gmsnet.io.merge.merged``. first: of all zones the first point; a range where each point is one.
    named: points of cells that this rank has read.
    """
    used = points.marked(comm, named)
    start = int(points.rows[comm.rank])
    zone = start + np.arange(len(used))
    if not isinstance(first, range):  # else each point is a zone
        zone = np.searchsorted(np.asarray(first), zone, side="right") - 1
    found = joined_points(comm, points.points, zone, used)
    ids, at = np.unique(found.node, return_index=True)
    own = at[(ids >= found.starts[comm.rank]) & (ids < found.starts[comm.rank + 1])]
    nodes = Shared(found.starts, found.points[own], np.zeros(len(own), dtype=bool))
    nodes = nodes._replace(held=nodes.marked(comm, found.node[points.held]))
    return Zones(points.rows, found.node), nodes, found.node[found.unsure]
