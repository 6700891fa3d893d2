"""Untangling as a part of smoothing: what was done in words, and which cells stay inverted and why."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.report import QualityReport
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Reasons = dict[int, str]


class StillInvertedCell(NamedTuple):
    """A cell that is inverted still. cell: its index among all cells of the mesh."""

    cell: int
    reason: str


def mended(points: Floats, topology: Topology, precision: Precision) -> tuple[Floats, str, Reasons]:
    """Points (N, 2) in memory order with fewer inverted cells, one sentence on it, and why others stay as they are.

    The reasons are kept by the index of each cell among all cells of the mesh.
    """
    from gmsnet.untangle import untangle  # what it needs of SciPy takes 0.15 s more to import

    done = untangle(points, topology, precision)
    stages = ", ".join(f"{stage.name} ({stage.sweeps})" for stage in done.stages) or "nothing to try"
    left = f"{done.after:,} of {done.before:,} inverted cells are left" if done.after else f"all {done.before:,} mended"
    note = f"untangling: {left}; {stages}{f'; {done.why}' if done.why else ''}"
    cells = topology.cells_of(np.array([cell.row for cell in done.unmended], dtype=np.intp)).tolist()
    return done.points, note, {index: cell.reason for index, cell in zip(cells, done.unmended, strict=True)}


def beside(reasons: Reasons, topology: Topology) -> NDArray[np.bool_]:
    """(N,) bool by id: the nodes of the cells that have a reason, and their neighbours."""
    chosen = np.zeros(len(topology.memory), dtype=bool)
    cells = np.array(list(reasons), dtype=np.int64)
    for corners, index in ((topology.triangles, topology.cell), (topology.quads, topology.quad_cell)):
        chosen[corners[np.isin(index, cells)]] = True
    around = chosen.copy()
    for corners in (topology.triangles, topology.quads):
        around[corners[chosen[corners].any(axis=1)]] = True
    return around


def still_inverted(after: QualityReport, reasons: Reasons) -> list[StillInvertedCell]:
    """The cells with a corner of zero or negative area that have a reason for it."""
    cells = after.cell[after.valid <= 0].tolist() if reasons else []
    return [StillInvertedCell(cell, reasons[cell]) for cell in cells if cell in reasons]
