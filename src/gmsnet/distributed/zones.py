"""Nodes of a file in zones that ranks share: points of different zones that are at one place are one node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.joining import joined_points

Ids = NDArray[np.int64]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]


class Shared(NamedTuple):
    """Nodes of which each rank keeps some that follow each other. rows: (ranks + 1,) where those of each begin. points:
    (n, dim) of this rank's. held: (n,) which of these are to be held."""

    rows: Ids
    points: Floats
    held: Flags

    def marked(self, comm: Any, nodes: Ids) -> Flags:
        """All ranks call it: which of the nodes of this rank any rank names."""
        found = np.zeros(len(self.points), dtype=bool)
        for some in comm.alltoall([nodes[rows] for rows in by_rank(homes(self.rows, nodes), comm.size)]):
            found[some - self.rows[comm.rank]] = True
        return found


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


def in_zones(comm: Any, first: Sequence[int], points: Shared, named: Ids) -> tuple[Zones, Shared]:
    """All ranks call it: the nodes that points of zones are. first: of all zones the first point. named: points of
    cells that this rank has read. See ``gmsnet.io.merge.merged``."""
    used = points.marked(comm, named)
    start = int(points.rows[comm.rank])
    zone = np.searchsorted(np.asarray(first), start + np.arange(len(used)), side="right") - 1
    found = joined_points(comm, points.points, zone, used)
    ids, at = np.unique(found.node, return_index=True)
    own = at[(ids >= found.starts[comm.rank]) & (ids < found.starts[comm.rank + 1])]
    nodes = Shared(found.starts, found.points[own], np.zeros(len(own), dtype=bool))
    held = nodes.marked(comm, found.node[points.held | found.unsure])
    return Zones(points.rows, found.node), nodes._replace(held=held)
