"""The whole mesh on the first rank, for what is not shared out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.piece import Ids, Piece
from gmsnet.kernels.topology.places import places_in
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Flags = NDArray[np.bool_]


class Whole(NamedTuple):
    """ids: (N,) of its nodes, ascending. fixed: (N,) bool, those that are to be held."""

    mesh: Mesh
    ids: Ids
    fixed: Flags


def gathered(piece: Piece, comm: Any, known: Whole | None = None) -> Whole | None:
    """The mesh of all pieces, nodes by global ids and cells by their numbers, on the first rank; None elsewhere.

    known: the mesh, if the first rank has it anyway. A cell that several ranks bring is there once.
    """
    if comm.bcast(known is not None):
        return known
    parts = comm.gather(piece)
    if parts is None:
        return None
    ids, first = np.unique(np.concatenate([part.ids for part in parts]), return_index=True)
    points = np.concatenate([part.points for part in parts])[first]
    fixed = np.zeros(len(ids), dtype=bool)
    for part in parts:
        fixed[places_in(ids, part.ids[part.fixed])] = True
    blocks = []
    for cells in zip(*(part.blocks for part in parts), strict=True):
        _, order = np.unique(np.concatenate([block.numbers for block in cells]), return_index=True)
        nodes = np.concatenate([block.nodes for block in cells])[order]
        regions = np.concatenate([block.regions for block in cells])[order]
        blocks.append(CellBlock(cells[0].kind, places_in(ids, nodes), regions))
    whole = Mesh(points, tuple(blocks), piece.names, single=piece.single, rounding=piece.rounding)
    return Whole(whole, ids, fixed)


def brought(whole: Whole | None, values: NDArray[Any], piece: Piece, comm: Any) -> NDArray[Any] | None:
    """Values (n, …) at the nodes of each piece, in the order of the whole mesh, where that is; None elsewhere."""
    came = comm.gather((piece.ids, values))
    if came is None or whole is None:
        return None
    found = np.empty((len(whole.ids), *values.shape[1:]), dtype=values.dtype)
    for ids, some in came:
        found[places_in(whole.ids, ids)] = some
    return found


def scattered(whole: Whole | None, values: NDArray[Any] | None, piece: Piece, comm: Any) -> NDArray[Any]:
    """Values (N, …) at the nodes of the whole mesh, which the first rank has, at those of each piece."""
    wanted = comm.gather(piece.ids)
    parcels = None
    if whole is not None and values is not None:
        parcels = [values[places_in(whole.ids, ids)] for ids in wanted]
    found: NDArray[Any] = comm.scatter(parcels)
    return found
