"""Nodes that cells name by tags: which node has a tag. No rank has the tags of all nodes.

Where they are counted one after another, ranks only tell each other so. Else each rank keeps some, by their remainder.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank

Ids = NDArray[np.int64]


def nodes_of(comm: Any, tags: Ids, first: int, total: int, named: Ids) -> tuple[Ids, Ids]:
    """All ranks call it: (n,) the nodes with the tags that are ``named``, −1 where there is none; and nodes whose tags
    others have, too.

    tags: of the nodes from ``first`` on, which this rank keeps. total: how many nodes there are.
    """
    low = next(each[0] for each in comm.allgather(tags[:1].tolist()) if each)
    if not comm.allreduce(int((tags != low + first + np.arange(len(tags))).any())):
        nodes = named - low
        return np.where((nodes >= 0) & (nodes < total), nodes, -1), tags[:0]
    lists = by_rank(tags % comm.size, comm.size)
    came = comm.alltoall([(tags[some], first + some) for some in lists])
    known, node = (np.concatenate([each[k] for each in came]) for k in (0, 1))
    order = np.lexsort((node, known))
    known, node = known[order], node[order]
    twice = node[1:][known[1:] == known[:-1]]
    lists = by_rank(named % comm.size, comm.size)
    answers = comm.alltoall(
        [_looked_up(known, node, asked) for asked in comm.alltoall([named[some] for some in lists])]
    )
    nodes = np.empty(len(named), dtype=np.int64)
    for some, found in zip(lists, answers, strict=True):
        nodes[some] = found
    return nodes, twice


def _looked_up(known: Ids, node: Ids, asked: Ids) -> Ids:
    if not len(known):
        return np.full(len(asked), -1, dtype=np.int64)
    at = np.searchsorted(known, asked).clip(max=len(known) - 1)
    return np.where(known[at] == asked, node[at], -1)
