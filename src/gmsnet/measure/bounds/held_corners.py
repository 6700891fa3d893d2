"""Bounds of quads and volumes from corners that cannot change: a node and all that it has an edge to in the cell are
held. The quality of a cell is that of its worst corner, so it is at most that of such a one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.kind import CellKind
from gmsnet.cells.table import CELLS
from gmsnet.measure.bounds.groups import ABOVE, HELD_CORNER, NOWHERE, Flags, Floats, Groups
from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.corners import eta_at_corners
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.topology.ordering import planar_points, space_points


def held_corners(cells: MeasuredCells | MeasuredSolids, free: Flags, below: float) -> Groups:
    """One for each cell with a free node and a held corner worse than ``below``; rows are those of ``columns()``.

    free: (N,) by id. Of triangles and tetrahedra, whose corners are all alike, there is none.
    """
    nothing = np.empty(0, dtype=np.intp), np.empty(0)
    parts = [nothing, *(_least_of_cells(*block, free) for block in _blocks(cells))]
    node, bound = (np.concatenate(each) for each in zip(*parts, strict=True))
    if cells.order is not None:
        node, bound = node[cells.order], bound[cells.order]
    rows = np.flatnonzero(bound + ABOVE < below)
    one = np.ones(len(rows), dtype=np.intp)
    return Groups.of(HELD_CORNER, node[rows], np.zeros(len(rows)), bound[rows] + ABOVE, one, rows)


def _blocks(cells: MeasuredCells | MeasuredSolids) -> Iterator[tuple[NDArray[np.int32], CellKind, Floats]]:
    """Cells (C, corners), their kind, and the quality of each corner simplex: (S, C)."""
    if isinstance(cells, MeasuredSolids):
        for block in cells.blocks:
            kind = CELLS[block.kind]
            values = eta_at_corners(space_points(cells), block.nodes, kind, block.orientation)
            yield block.nodes[:, : kind.corners], kind, values
        return
    yield cells.corners, CELLS["triangle"], np.full((3, len(cells.corners)), np.inf)
    yield cells.quads, CELLS["quad"], _of_quads(cells)


def _of_quads(cells: MeasuredCells) -> Floats:
    """(4, Q) 1/q of the corners; of surfaces without sign, which is no less."""
    at = (planar_points(cells) if cells.plane is not None else space_points(cells)[:, :3])[cells.quads]
    found = np.empty((4, len(at)))
    for k, (corner, after, before) in enumerate(CELLS["quad"].simplices):
        u, v = at[:, after] - at[:, corner], at[:, before] - at[:, corner]
        if cells.plane is None:
            area = np.linalg.norm(np.cross(u, v), axis=1)
        else:
            area = cells.quad_orientation * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        squares = (u * u + v * v).sum(axis=1)
        found[k] = np.divide(2.0 * area, squares, out=np.zeros(len(at)), where=squares > 0.0)
    return found


def _least_of_cells(
    nodes: NDArray[np.int32], kind: CellKind, values: Floats, free: Flags
) -> tuple[NDArray[np.intp], Floats]:
    """Of each cell the node at its worst held corner, and the value there: NOWHERE and inf for none, or no others."""
    may = free[nodes]
    held = np.stack([~may[:, simplex].any(axis=1) for simplex in kind.simplices]) & may.any(axis=1)
    values = np.where(held, values, np.inf)
    worst, cell = values.argmin(axis=0), np.arange(len(nodes))
    bound: Floats = values[worst, cell]
    corner = nodes[cell, np.array([simplex[0] for simplex in kind.simplices])[worst]]
    return np.where(np.isfinite(bound), corner, NOWHERE).astype(np.intp), bound
