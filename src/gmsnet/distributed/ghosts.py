"""Who moves which node, and the cells of other ranks that lie at them.

Each node has a home rank by its global id, which hears of all ranks that have the node and says who moves it: one of
those, by the id alone. Each rank then sends its cells to all who move one of their nodes. So the star of each node is
complete where it moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import agreed, raise_everywhere
from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.halo import Halo
from gmsnet.distributed.piece import Cells, Ids, Piece
from gmsnet.kernels.topology.places import places_in
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Nodes(NamedTuple):
    """ids: (n,) ascending. points: (n, dim). owner: (n,) the rank that moves each. fixed: (n,) bool."""

    ids: Ids
    points: Floats
    owner: Ids
    fixed: Flags

    def held_on(self, rank: int) -> Flags:
        """(n,) those that are fixed, and those that others move."""
        held: Flags = self.fixed | (self.owner != rank)
        return held

    def of(self, ids: Ids) -> Nodes:
        """Those with some ids."""
        at = places_in(self.ids, ids)
        return Nodes(ids, self.points[at], self.owner[at], self.fixed[at])


@dataclass(frozen=True, eq=False)
class Surrounded:
    """A piece with the cells of others at the nodes that this rank moves.

    blocks: the cells, in the order of their numbers; own: for each block (C,) bool, which are of the piece. sizes: how
    many cells each block has over all ranks. nodes: of all these cells, and of the piece.
    """

    nodes: Nodes
    blocks: tuple[Cells, ...]
    own: tuple[Flags, ...]
    sizes: tuple[int, ...]

    @property
    def numbers(self) -> Ids:
        """The global index of each cell, block by block."""
        first = np.cumsum([0, *self.sizes])[:-1]
        numbers = [low + block.numbers for low, block in zip(first, self.blocks, strict=True)]
        return np.concatenate([*numbers, np.empty(0, dtype=np.int64)])

    def mesh(self, piece: Piece) -> Mesh:
        """All of it, nodes by ascending ids; a part of the mesh that a piece is of."""
        ids = self.nodes.ids
        cells = [CellBlock(block.kind, places_in(ids, block.nodes), block.regions) for block in self.blocks]
        return Mesh(self.nodes.points, tuple(cells), single=piece.single, rounding=piece.rounding)

    def halo(self, comm: Any, places: NDArray[Any]) -> Halo:
        """Of all nodes that are here and elsewhere. places: (n,) of each in memory."""
        ids, owner = self.nodes.ids, self.nodes.owner
        wanted = by_rank(owner, comm.size)
        wanted[comm.rank] = wanted[comm.rank][:0]
        asked = comm.alltoall([ids[places] for places in wanted])
        own = {rank: places[places_in(ids, found)] for rank, found in enumerate(asked) if len(found)}
        return Halo(comm, own, {rank: places[found] for rank, found in enumerate(wanted) if len(found)})


def surrounded(piece: Piece, comm: Any) -> Surrounded:
    """With what other ranks know of its nodes.

    Raises InputError, on all ranks, where pieces disagree on where a node is, on a cell, on the kinds of cells, or on
    how many coordinates a node has.
    """
    agreed(comm, piece.points.shape[1], "how many coordinates a node has")
    kinds = agreed(comm, tuple(block.kind for block in piece.blocks), "the kinds of cells, block by block")
    mine = _owned(piece, comm)
    came = comm.alltoall(_parcels(piece, mine, comm))
    nodes = _joined([mine, *(nodes for nodes, _ in came)])
    blocks, own = [], []
    for k, kind in enumerate(kinds):
        parts = [piece.blocks[k], *(blocks[k] for _, blocks in came if len(blocks))]
        flags = np.repeat([True, False], [len(parts[0].nodes), sum(len(part.nodes) for part in parts[1:])])
        all_of = Cells(
            kind, *(np.concatenate([getattr(part, name) for part in parts]) for name in ("nodes", "regions", "numbers"))
        )
        order = np.argsort(all_of.numbers, kind="stable")
        blocks.append(all_of.take(order))
        own.append(flags[order])
    sizes = tuple(int(comm.allreduce(len(block.nodes))) for block in piece.blocks)
    _check_numbers(piece, sizes, comm)
    return Surrounded(nodes, tuple(blocks), tuple(own), sizes)


def _parcels(piece: Piece, nodes: Nodes, comm: Any) -> list[tuple[Nodes, tuple[Cells, ...]]]:
    """For each rank the cells that have a node which it moves, and their nodes; none for this rank."""
    chosen: list[list[Cells]] = [[] for _ in range(comm.size)]
    for block in piece.blocks:
        owner = nodes.owner[places_in(nodes.ids, block.nodes)].reshape(block.nodes.shape)
        for rank, rows in enumerate(owners_beside(owner, comm)):
            chosen[rank].append(block.take(rows))
    found = []
    for blocks in chosen:
        ids = sorted_unique(np.concatenate([nodes.ids[:0], *(block.nodes.ravel() for block in blocks)]))
        found.append((nodes.of(ids), tuple(blocks) if len(ids) else ()))
    return found


def owners_beside(owner: NDArray[np.integer[Any]], comm: Any) -> list[NDArray[np.intp]]:
    """For each other rank the rows, ascending, that it owns a node of; none for this rank. owner: (C, k)."""
    row, column = np.nonzero(owner != comm.rank)
    pairs = np.unique(np.stack([owner[row, column], row], axis=1), axis=0)
    return [pairs[rows, 1] for rows in by_rank(pairs[:, 0], comm.size)]


def _joined(parts: list[Nodes]) -> Nodes:
    """The nodes of all, each once."""
    ids, first = np.unique(np.concatenate([part.ids for part in parts]), return_index=True)
    _, points, owner, fixed = (np.concatenate(each)[first] for each in zip(*parts, strict=True))
    return Nodes(ids, points, owner, fixed)


def _owned(piece: Piece, comm: Any) -> Nodes:
    """The nodes of a piece in the order of their ids, with who moves them and whether anybody holds them."""
    order = np.argsort(piece.ids)
    ids, points, fixed = piece.ids[order], np.ascontiguousarray(piece.points[order]), piece.fixed[order]
    home = ids % comm.size
    lists = by_rank(home, comm.size)
    came = comm.alltoall([(ids[rows], points[rows], fixed[rows]) for rows in lists])
    whose = np.repeat(np.arange(comm.size), [len(each[0]) for each in came])
    all_ids, all_points, all_fixed = (np.concatenate(each) for each in zip(*came, strict=True))
    known, which = np.unique(all_ids, return_inverse=True)
    first = np.zeros(len(known), dtype=np.int64)
    first[which[::-1]] = np.arange(len(which))[::-1]
    differ = np.flatnonzero((all_points != all_points[first[which]]).any(axis=1))
    wrong = ""
    if len(differ):
        row = differ[0]
        wrong = (
            f"the node with the global id {all_ids[row]} is at {all_points[first[which[row]]].tolist()} on rank "
            f"{whose[first[which[row]]]} and at {all_points[row].tolist()} on rank {whose[row]}"
        )
    raise_everywhere(comm, wrong)
    held = np.zeros(len(known), dtype=bool)
    np.logical_or.at(held, which, all_fixed)
    number = np.bincount(which, minlength=len(known))
    by_node = np.argsort(which, kind="stable")
    starts = np.concatenate([[0], np.cumsum(number)])[:-1]
    owner = whose[by_node[starts + (known // comm.size) % np.maximum(number, 1)]] if len(known) else whose[:0]
    ends = np.cumsum([len(each[0]) for each in came])[:-1]
    back = comm.alltoall(list(zip(np.split(owner[which], ends), np.split(held[which], ends), strict=True)))
    owners, holds = np.empty(len(ids), dtype=np.int64), np.empty(len(ids), dtype=bool)
    for rows, (some, flags) in zip(lists, back, strict=True):
        owners[rows], holds[rows] = some, flags
    return Nodes(ids, points, owners, holds)


def _check_numbers(piece: Piece, sizes: tuple[int, ...], comm: Any) -> None:
    """InputError unless the cells of each block are numbered 0, 1, 2, … over all ranks, each once."""
    wrong = ""
    for block, size in zip(piece.blocks, sizes, strict=True):
        inside = ((block.numbers >= 0) & (block.numbers < size)).all()
        lists = by_rank(block.numbers % comm.size, comm.size)
        came = np.sort(np.concatenate(comm.alltoall([block.numbers[rows] for rows in lists])))
        if not inside or (came[1:] == came[:-1]).any():
            wrong = wrong or (
                f"the {size:,} {block.kind} cells of all ranks are not numbered from 0, each with a number of its own: "
                "give each cell to one rank, with its number"
            )
    raise_everywhere(comm, wrong)
