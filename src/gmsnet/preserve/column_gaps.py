"""Gaps between columns of layers of volumes: around edges and corners of a wall, where cells are not flat.

Over an edge of a body no cell lies along the wall, and no column starts. The rows go on there all the same, and their
heights are meant. A node belongs to a row if it shares cells with nodes of that row, and of the one below, and is about
as high over the latter as these are. So rows are followed around edges, from the first one on, as far as half of the
columns go, and end where cells are as those of no row. Where most nodes of rows are in no column, there are no rows.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology.columns import EDGES
from gmsnet.preserve.shared import Shared
from gmsnet.topology.polygons import Ints
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

SHARE = 0.5  # of the columns: rows that fewer of them reach are not followed
MOST = 3.0  # times as many nodes as are in columns: else the columns are what is between others
AS_HIGH = math.log(1.8)  # from rows beside a node; along the mean normal of a cube's corner a row is 1.73 times as far


def neighbours(rows: Ints, chosen: Flags) -> tuple[Ints, Ints]:
    """The ends of the edges of the simplices (S, 4) with a chosen node (N,), both ways, once for each simplex."""
    corners = rows[connectivity.touching(rows, chosen)]
    one, two = (corners[:, EDGES[:, k]].ravel() for k in range(2))
    return np.concatenate([one, two]), np.concatenate([two, one])


def with_gaps(
    topology: Volume, points: Floats, columns: Ids, heights: Floats, number: Ids, wall: Flags, shared: Shared
) -> Flags:
    """(N,) by places: the nodes of columns (C, R), and those of the same rows between and beside them.

    columns: names of nodes, −1 behind their ends; number: (C,) of each among those of all processes. heights:
    (C, R − 1) of the rows. wall: (N,) the nodes of walls. R is the same for all processes.
    """
    row, high = np.full(len(points), -1, dtype=np.int32), np.zeros(len(points))

    def put(places: Ids, k: Ids, number: Ids, logarithm: Floats) -> tuple[()]:
        order = np.lexsort((number, k))  # the last one of a node stays
        row[places[order]], high[places[order]] = k[order], logarithm[order]
        return ()

    column, at = np.nonzero(columns >= 0)
    logarithm = np.log(np.where(at > 0, heights[column, at - 1], 1.0))
    shared.ask(columns[column, at], (at, number[column], logarithm), put)
    row, high = shared.spread(row), shared.spread(high)
    alone: Flags = row >= 0
    shell = topology.near[connectivity.touching(topology.near, alone)]
    shell = shell[(topology.near_free & ~alone)[shell].any(axis=1)]
    reach = shared.total((columns >= 0).sum(axis=0))
    own = shared.own
    for k in range(1, int(np.argmin(np.append(reach >= SHARE * reach[0], False)))):
        new, around = row == k, shell
        below = wall if k == 1 else row == k - 1
        while shared.total(int((new & own).any())):
            new = _beside(topology, points, around[new[around].any(axis=1)], row == k, below, row, high)
            row[new] = k
            new, row, high = shared.spread(new), shared.spread(row), shared.spread(high)
            around = topology.near[connectivity.touching(topology.near, new)]
            shell = np.concatenate([shell, around])
    whole: Flags = row >= 0
    many, few = shared.total(np.array([np.count_nonzero(whole & own), np.count_nonzero(alone & own)]))
    return whole if many <= MOST * few else alone


def _beside(
    topology: Volume, points: Floats, around: Ints, own: Flags, below: Flags, row: NDArray[np.int32], high: Floats
) -> Flags:
    """(N,) which nodes of some cells belong to a row. around: (S, 4) these cells, each with a node of the row.

    own, below: the nodes of the row, and of the one below. high: logarithms of heights, to which theirs are added.
    """
    found = np.zeros(len(row), dtype=bool)
    found[around[topology.near_free[around] & (row[around] < 0)]] = True
    if not found.any():
        return found
    one, two = neighbours(topology.near, found)
    over, with_row = found[one] & below[two], found[one] & own[two]
    height = np.full(len(row), np.inf)
    np.minimum.at(height, one[over], np.linalg.norm(points[one[over]] - points[two[over]], axis=1))
    number = np.bincount(one[with_row], minlength=len(row))
    usual = np.bincount(one[with_row], high[two[with_row]], minlength=len(row)) / np.maximum(number, 1)
    found &= np.isfinite(height) & (height > 0.0)
    own_height = np.log(height, where=found, out=np.zeros(len(row)))
    found &= abs(own_height - usual) <= AS_HIGH
    high[found] = own_height[found]
    return found
