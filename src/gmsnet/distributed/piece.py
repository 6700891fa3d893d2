"""What one rank brings: nodes by global ids, and the cells that are its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import plain_array, whole_numbers
from gmsnet.mesh.checks import finite_points
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.rounding import Rounding

Ids = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Cells:
    """Some cells of one block of a mesh. nodes: (C, k) global ids. regions: (C,). numbers: (C,) their places among all
    cells of this block, over all ranks."""

    kind: str
    nodes: Ids
    regions: Ids
    numbers: Ids

    def in_one_region(self) -> Cells:
        """The same cells, all of region 0."""
        return Cells(self.kind, self.nodes, np.zeros_like(self.regions), self.numbers)

    def take(self, rows: NDArray[np.integer[Any]] | Flags) -> Cells:
        """Some of them."""
        return Cells(self.kind, self.nodes[rows], self.regions[rows], self.numbers[rows])


@dataclass(frozen=True, eq=False)
class Piece:
    """Some cells of a mesh and their nodes.

    ids: (n,) the global id of each node, each once. points: (n, dim). fixed: (n,) bool, to be held. blocks: the same on
    all ranks, though some may be empty. single, names, rounding: as of the Mesh, the same on all ranks.

    Raises InputError for ids that are negative or come twice, points that are not finite, and cells of other nodes.
    """

    ids: Ids
    points: NDArray[np.float64]
    fixed: Flags
    blocks: tuple[Cells, ...]
    single: bool = False
    names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    rounding: Rounding | None = None

    def __post_init__(self) -> None:
        ids = whole_numbers(self.ids, "the global ids of nodes")
        points = finite_points(plain_array(self.points, "points"))
        if ids.shape != (len(points),):
            raise InputError(f"{len(points):,} nodes need one global id each, got shape {ids.shape}")
        if len(ids) and ids.min() < 0:
            raise InputError(f"global ids count from 0, got {ids.min()}")
        known, first = np.unique(ids, return_index=True)
        if len(known) != len(ids):
            twice = np.delete(ids, first)[0]
            raise InputError(f"the global id {twice} is given to two nodes of one piece: give each node once")
        for block in self.blocks:
            wrong = block.nodes[~np.isin(block.nodes, known)]
            if wrong.size:
                raise InputError(f"a {block.kind} cell names the global id {wrong[0]}, which no node of its piece has")
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "points", points)

    def with_one_region(self) -> Piece:
        """As of the Mesh: the blocks are the same on all ranks, and so are those of the highest dimension."""
        dimensions = [CELLS[block.kind].dimension if block.kind in CELLS else 0 for block in self.blocks]
        each = zip(self.blocks, dimensions, strict=True)
        joined = (block.in_one_region() if one == max(dimensions) else block for block, one in each)
        return replace(self, blocks=tuple(joined))


def pieces_of(mesh: Mesh, fixed: Flags, parts: Sequence[NDArray[np.int32]], ranks: int) -> list[Piece]:
    """A mesh cut up. fixed: (N,) bool. parts: for each block, the rank of each cell.

    A node that no cell has goes to the first rank.
    """
    found = []
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        used[block.nodes] = True
    for rank in range(ranks):
        inside = ~used if rank == 0 else np.zeros(len(mesh.points), dtype=bool)
        blocks = []
        for block, part in zip(mesh.cells, parts, strict=True):
            rows = np.flatnonzero(part == rank)
            blocks.append(Cells(block.kind, block.nodes[rows], block.regions[rows], rows))
            inside[block.nodes[rows]] = True
        ids = np.flatnonzero(inside)
        found.append(
            Piece(ids, mesh.points[ids], fixed[ids], tuple(blocks), mesh.single, dict(mesh.region_names), mesh.rounding)
        )
    return found
