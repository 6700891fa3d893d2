"""Points of pieces of a file that are one node: found over ranks, with the numbers that a serial reader gives them.

Each rank has pieces that follow one another in the file. Points of the same coordinates, and of the same ids where all
pieces have some, have one home rank, which tells the first of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank
from gmsnet.io.merge import Part, among, same_points, used_points

Ids = NDArray[np.int64]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]


class Joined(NamedTuple):
    """node: (n,) the global id of each point of this rank's pieces. points: (n, dim) where the node is. unsure: (n,)
    bool, points at the place of others of the same piece. starts: (ranks + 1,) where the ids of each rank's nodes
    begin: a node is of the rank that has the first of its points.
    """

    node: Ids
    points: Floats
    unsure: Flags
    starts: Ids


def joined(comm: Any, parts: Sequence[Part], first_piece: int, dim: int) -> Joined:
    """See ``gmsnet.io.merge.merged``. All ranks call it. first_piece: how many pieces the ranks before have."""
    points = np.concatenate([*(part.parsed.points for part in parts), np.empty((0, dim))])
    numbered = all(comm.allgather(all(part.ids is not None for part in parts)))
    ids = np.concatenate([*(part.ids for part in parts if numbered and part.ids is not None), points[:0, 0]])
    piece = first_piece + np.repeat(np.arange(len(parts)), [len(part.parsed.points) for part in parts])
    if numbered:
        return joined_points(comm, points, piece, np.ones(len(points), dtype=bool), ids.astype(np.int64))
    return joined_points(comm, points, piece, used_points(parts))


def joined_points(comm: Any, points: Floats, piece: Ids, used: Flags, ids: Ids | None = None) -> Joined:
    """The same of points (n, dim) that follow one another in a file. piece: (n,) of each. used: (n,) which count. ids:
    (n,) where pieces have some."""
    rows = _starts(comm, len(points))
    if ids is None:
        ids = np.zeros(len(points), dtype=np.int64)
    first, unsure = _first(comm, (points, ids, piece), np.flatnonzero(used), int(rows[comm.rank]))
    own = first == np.arange(rows[comm.rank], rows[comm.rank + 1])
    starts = _starts(comm, int(np.count_nonzero(own)))
    number = starts[comm.rank] + np.cumsum(own) - 1
    lists = by_rank(np.searchsorted(rows, first, side="right") - 1, comm.size)
    asked = [wanted - rows[comm.rank] for wanted in comm.alltoall([first[rows] for rows in lists])]
    answers = comm.alltoall([(number[wanted], points[wanted]) for wanted in asked])
    node, places = np.empty(len(points), dtype=np.int64), np.empty_like(points)
    for mine, (numbers, where) in zip(lists, answers, strict=True):
        node[mine], places[mine] = numbers, where
    return Joined(node, places, unsure, starts)


def _starts(comm: Any, count: int) -> Ids:
    return np.cumsum([0, *comm.allgather(count)])


def _first(comm: Any, given: tuple[Floats, Ids, Ids], used: NDArray[np.intp], start: int) -> tuple[Ids, Flags]:
    """For each point the first one that is the same node, by its place in the file, and whether that is unsure.

    given: points, ids and pieces. used: those that count.
    """
    points, ids, piece = given
    number = start + np.arange(len(points))
    lists = [used[rows] for rows in by_rank(_homes(points[used], ids[used], comm.size), comm.size)]
    came = comm.alltoall([(points[rows], ids[rows], piece[rows], number[rows]) for rows in lists])
    found = same_points(*(np.concatenate(each) for each in zip(*came, strict=True)))
    cuts = np.cumsum([len(each[3]) for each in came])[:-1]
    back = comm.alltoall(list(zip(*(np.split(each, cuts) for each in found), strict=True)))
    first, unsure = number.copy(), np.zeros(len(points), dtype=bool)
    for rows, (numbers, several) in zip(lists, back, strict=True):
        first[rows], unsure[rows] = numbers, several
    return first, unsure


def _homes(points: Floats, ids: Ids, ranks: int) -> Ids:
    """(n,) the same rank for the same point, whatever the sign of a zero."""
    mixed = ids.view(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    for column in (points + 0.0).T:
        mixed = (mixed ^ np.ascontiguousarray(column).view(np.uint64)) * np.uint64(0xBF58476D1CE4E5B9)
        mixed ^= mixed >> np.uint64(31)
    return (mixed % np.uint64(ranks)).astype(np.int64)


def orphans(comm: Any, copies: Ids, cells: Ids) -> Flags:
    """(n,) which of the ghost cells (n, k) of this rank are own cells (m, k) of no rank. Nodes by global ids."""
    if not comm.allreduce(len(copies)):
        return np.zeros(0, dtype=bool)
    ghosts, own = (by_rank(each.min(axis=1, initial=np.iinfo(np.int64).max) % comm.size, comm.size)
                   for each in (copies, cells))  # fmt: skip
    came = comm.alltoall([(copies[some], cells[rows]) for some, rows in zip(ghosts, own, strict=True)])
    known = np.concatenate([each for _, each in came])
    back = comm.alltoall([among(each, known) for each, _ in came])
    found = np.zeros(len(copies), dtype=bool)
    for rows, there in zip(ghosts, back, strict=True):
        found[rows] = ~there
    return found
