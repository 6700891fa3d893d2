"""Which columns of nodes over walls are layers: those that stand beside enough others, and grow or are even."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import columns as kernels
from gmsnet.kernels.topology import connectivity
from gmsnet.topology.polygons import Ints

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

FEWEST, SHARE = 12, 0.66  # columns beside one another; of the feet there
GROWN = 1.25  # times as flat at the wall as at the end of the column, or as high there, in the median
EVEN = 0.03  # of its height: by how much that of a row differs from column to column, in the median
# In columns of rows of one height: up to these shares of the free nodes, the last row must be so many times as high as
# the first. Rows that do not grow and are most of a mesh are a grid.
SHARES, GROWN_BY = (0.35, 0.75), (0.0, 1.1, GROWN)


def accepted_of(
    foot: Ids,
    long: Flags,
    first: Floats,
    highest: Floats,
    rows: Ids,
    flatness: Floats,
    last: Floats,
    pairs: Ids,
    *,
    free: int,
) -> tuple[Flags, tuple[float, float] | None]:
    """(C,) which columns stand beside enough others and have grown, or are of rows of one height that are not the mesh.

    foot: (C,) names of nodes. pairs: (E, 2) of nodes of walls, one of them or both the foot of a column that is long.
    first, highest: (C,) heights of rows; rows: (C,) how many. free: how many nodes may move. Returns also the median
    and the largest flatness, None where no column is accepted.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components  # loads what few runs need

    # Other nodes of walls link columns as well: those of a face with those around an edge.
    names, number = np.unique(np.concatenate([foot, pairs.ravel()]), return_inverse=True)
    column = np.full(len(names), -1, dtype=np.int64)
    column[number[: len(foot)][long]] = np.flatnonzero(long)
    edges = number[len(foot) :].reshape(-1, 2)
    graph = coo_array((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(len(names), len(names)))
    piece = connected_components(graph, directed=False)[1][number[: len(foot)]]
    feet = np.bincount(piece)  # of each piece
    between = column[edges]
    between = between[(between >= 0).all(axis=1)]
    accepted = np.zeros(len(foot), dtype=bool)
    higher = highest / np.where(first > 0.0, first, np.inf)
    differ = abs(first[between[:, 0]] - first[between[:, 1]]) / first[between].max(axis=1, initial=0.0)
    least = GROWN_BY[int(np.searchsorted(SHARES, rows[long].sum() / max(free, 1)))]
    for name in np.unique(piece[long]).tolist():
        own = long & (piece == name)
        if own.sum() < max(FEWEST, SHARE * feet[name]):
            continue
        grown = np.median(flatness[own]) >= GROWN * np.median(last[own])
        even = np.median(differ[piece[between[:, 0]] == name], axis=None) <= EVEN
        accepted[own] = grown or (even and np.median(higher[own]) >= least)
    of_them = flatness[accepted]
    return accepted, (float(np.median(of_them)), float(of_them.max())) if len(of_them) else None


def linked(rows: Ints, foot: Flags, wall: Flags) -> Ints:
    """The edges (E, 2) of cells between nodes of walls (N,), one of them or both a foot; once for each simplex."""
    corners = rows[connectivity.touching(rows, foot)]
    pairs = np.concatenate([corners[:, [a, b]] for a, b in kernels.EDGES])
    return np.asarray(pairs[wall[pairs].all(axis=1) & foot[pairs].any(axis=1)])
