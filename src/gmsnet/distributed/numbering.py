"""The numbers that cells have in the whole mesh, without anybody having the whole mesh.

Cells stand in memory by the first of their nodes, and nodes along a Morton curve. So the first corner simplex of a
cell has as many before it as belong to the nodes before its own, and to the cells before it at that node. Nodes are
sorted over all ranks for that, by their places on the curve.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank

Ids = NDArray[np.int64]

NO_ROWS = np.empty(0, dtype=np.int64)
SAMPLES = 64  # of each rank's nodes, by which the curve is shared out


class Numbers(NamedTuple):
    """What the rows of ``changeable`` of a rank are in the whole mesh.

    blocks: of each block of rows, its number. rows: (S,) of each row, its number. counted: (S,) bool, which rows this
    rank answers for; each is one rank's. cells: how many cells these belong to.
    """

    blocks: NDArray[np.int64] = NO_ROWS
    rows: NDArray[np.int64] = NO_ROWS
    counted: NDArray[np.bool_] = NO_ROWS > 0
    cells: int = 0


NO_NUMBERS = Numbers()


def before(comm: Any, codes: Ids, ids: Ids, counts: Ids) -> Ids:
    """For each node of this rank, the sum of the counts of all nodes of all ranks that come before it.

    codes: (n,) places on the curve, by which nodes come, those of one place by their ids (n,). counts: (n,). Each node
    is given by one rank.
    """
    size, order = comm.size, _in_order(codes, ids)
    sample = codes[order[np.linspace(0, len(order) - 1, SAMPLES).astype(np.int64)]] if len(order) else codes[:0]
    every = np.sort(np.concatenate(comm.allgather(sample)))
    ends = every[np.arange(1, size) * len(every) // size] if len(every) else np.zeros(size - 1, dtype=np.int64)
    to = np.searchsorted(ends, codes, side="right")
    lists = by_rank(to, size)
    came = comm.alltoall([(codes[rows], ids[rows], counts[rows]) for rows in lists])
    code, number, count = (np.concatenate(each) for each in zip(*came, strict=True))
    sequence = _in_order(code, number)
    sums = np.concatenate([[0], np.cumsum(count[sequence])])
    first = comm.exscan(int(sums[-1])) or 0
    found = np.empty(len(code), dtype=np.int64)
    found[sequence] = first + sums[:-1]
    back = comm.alltoall(np.split(found, np.cumsum([len(each[0]) for each in came])[:-1]))
    out = np.empty(len(codes), dtype=np.int64)
    for rows, values in zip(lists, back, strict=True):
        out[rows] = values
    return out


def _in_order(codes: Ids, ids: Ids) -> NDArray[np.intp]:
    """As ``np.lexsort((ids, codes))``, in less time where most stand in order and few codes are equal."""
    order = np.argsort(codes, kind="stable")
    ordered = codes[order]
    equal = ordered[1:] == ordered[:-1]
    tied = np.flatnonzero(np.append(False, equal) | np.append(equal, False))
    among = order[tied]
    order[tied] = among[np.lexsort((ids[among], codes[among]))]
    return order
