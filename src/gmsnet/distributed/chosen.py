"""Nodes that a user wants held, named by ids or by markers, of a mesh of which each rank has a piece."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.distributed.agreement import everywhere
from gmsnet.distributed.library import mpi
from gmsnet.distributed.piece import Piece
from gmsnet.mesh.markers import marker_names

# What is named in a mesh of so many nodes with such markers: markers and ids. Raises InputError.
Chosen = Callable[[int, Collection[str]], Sequence[str | NDArray[np.int64]]]


def holding(piece: Piece, chosen: Chosen | None, comm: Any) -> Piece:
    """All ranks call it: the same with more nodes held. chosen: of the first rank, None where it names none."""
    if not comm.bcast(chosen is not None):
        return piece
    markers = _markers(piece, comm)
    count = 1 + int(comm.allreduce(int(piece.ids.max(initial=-1)), mpi().MAX))
    named = comm.bcast(everywhere(comm, lambda: () if chosen is None else chosen(count, markers)))
    held = [np.empty(0, dtype=np.int64)]
    for each in named:
        if not isinstance(each, str):
            held.append(each)
            continue
        for block, region in markers[each]:
            cells = piece.blocks[block]
            held.append(cells.nodes[cells.regions == region].ravel())
    return replace(piece, fixed=piece.fixed | np.isin(piece.ids, np.concatenate(held)))


def _markers(piece: Piece, comm: Any) -> dict[str, list[tuple[int, int]]]:
    """Name of each marker and region, in the order of ``Mesh.markers`` → the blocks and regions of its cells."""
    found: dict[str, list[tuple[int, int]]] = {}
    every = comm.allgather([np.unique(block.regions).tolist() for block in piece.blocks])
    for number, (block, regions) in enumerate(zip(piece.blocks, zip(*every, strict=True), strict=True)):
        dimension = CELLS[block.kind].dimension if block.kind in CELLS else None
        for region in sorted({each for some in regions for each in some}):
            for name in marker_names(piece.names, dimension, region):
                found.setdefault(name, []).append((number, region))
    return found
