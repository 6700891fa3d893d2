"""Blocks of stars in space, as they stand in memory: LANES3 of one colour."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit import vectors
from gmsnet.kernels.jit.compile import inlined
from gmsnet.kernels.simplex import mean_ratio3

LANES3 = vectors.WIDTH


class Mixture(NamedTuple):
    """What blocks have beside where cells are not all tetrahedra: the rows of a block then have one role each.

    The role of a simplex is which ideal shape it has and which of its vertices is free. role: uint8 by [block][row], a
    row of ``weights``: (R, 8) float32 those of |a|², |b|², |c|², |b − a|², |c − b|², |a − c|², then σ and σ/3. exact:
    (R, 6) the same in float64. present: uint16 by [block][row], the lanes that have such a simplex. owner: by
    [block][row][lane], the cell of each. edges: (B·LANES3,) how many nodes of the ring, from the first on, an edge
    joins to the free one. solids: all cells. cells: (I,) those of them that are not valid just where their corner
    simplices are positive. at: (N + 1,), those at each node begin there in ``around``, as 8 times their number among
    these + the corner. slack: (I,) of each (kernels.simplex.slack3). gone: (8I,) how far each corner has gone of it, if
    the guard alone has moved points since both were set to 0.
    """

    role: NDArray[np.uint8]
    weights: NDArray[np.float32]
    exact: NDArray[np.float64]
    present: NDArray[np.uint16]
    owner: NDArray[np.int32]
    edges: NDArray[np.int32]
    solids: mean_ratio3.Solids
    at: NDArray[np.int64]
    around: NDArray[np.int32]
    slack: NDArray[np.float64]
    gone: NDArray[np.float64]
    cells: NDArray[np.int32]


class SpaceBlocks(NamedTuple):
    """The free nodes in blocks of LANES3 of one colour.

    centre: (B·LANES3,) the free nodes. ring: by [block][row][lane], the nodes around; offset (B,) where a block begins,
    degree (B,) its rows: those of a lane that has fewer repeat its first. spoke: uint8 by [block][simplex][3][lane],
    the rows of the ring in which the spokes end; at (B,) where a block begins; simplices (B,) the most of a lane,
    cells (B·LANES3,) those of each. filled: (B,) how many lanes hold stars of their own; the others repeat the last.
    most, most_simplices: the largest of all blocks. mixture: None where all cells are tetrahedra.
    """

    centre: NDArray[np.int32]
    ring: NDArray[np.int32]
    offset: NDArray[np.int64]
    degree: NDArray[np.int32]
    spoke: NDArray[np.uint8]
    at: NDArray[np.int64]
    simplices: NDArray[np.int32]
    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    most: int
    most_simplices: int
    mixture: Mixture | None = None


@inlined
def rows_in(mixture, blocks, block, lane):
    """How many rows of a block to go through for the simplices of a lane."""
    if mixture is None:
        return blocks.cells[block * LANES3 + lane]
    return blocks.simplices[block]


@inlined
def is_present(mixture, at, k, lane):
    """Has the lane a simplex in row k? at: where its block begins in ``spoke``."""
    if mixture is None:
        return True
    return (np.int64(mixture.present[at // (3 * LANES3) + k]) >> lane) & 1 == 1


@inlined
def weights_in_row(mixture, at, k):
    """The weights of the simplices in row k; None for tetrahedra."""
    if mixture is None:
        return None
    w, exact = np.int64(mixture.role[at // (3 * LANES3) + k]), mixture.exact
    return mean_ratio3.Weights3(exact[w, 0], exact[w, 1], exact[w, 2], exact[w, 3], exact[w, 4], exact[w, 5])
