"""Untangling as a part of smoothing: what was done in words, and which cells stay inverted and why."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.report import QualityReport
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Reasons = dict[tuple[int, ...], str]


class StillInvertedCell(NamedTuple):
    """A cell that is inverted still. cell: its index among all cells of the mesh."""

    cell: int
    reason: str


def mended(points: Floats, topology: Topology, precision: Precision) -> tuple[Floats, str, Reasons]:
    """Points (N, 2) in memory order with fewer inverted cells, one sentence on it, and why others stay as they are.

    The reasons are kept by the nodes of the cells, ascending.
    """
    from gmsnet.untangle import untangle  # what it needs of SciPy takes 0.15 s more to import

    done = untangle(points, topology, precision)
    stages = ", ".join(f"{stage.name} ({stage.sweeps})" for stage in done.stages) or "nothing to try"
    left = f"{done.after:,} of {done.before:,} inverted cells are left" if done.after else f"all {done.before:,} mended"
    note = f"untangling: {left}; {stages}{f'; {done.why}' if done.why else ''}"
    corners = np.sort(topology.memory[topology.near[[cell.triangle for cell in done.unmended]].reshape(-1, 3)], axis=1)
    return (
        done.points,
        note,
        {tuple(nodes): cell.reason for nodes, cell in zip(corners.tolist(), done.unmended, strict=True)},
    )


def beside(reasons: Reasons, topology: Topology) -> NDArray[np.bool_]:
    """(N,) bool by id: the nodes of the cells that have a reason, and their neighbours."""
    chosen = np.zeros(len(topology.memory), dtype=bool)
    chosen[[node for nodes in reasons for node in nodes]] = True
    chosen[topology.triangles[chosen[topology.triangles].any(axis=1)]] = True
    return chosen


def still_inverted(after: QualityReport, topology: Topology, reasons: Reasons) -> list[StillInvertedCell]:
    """The cells of zero or negative area that have a reason for it."""
    rows = np.flatnonzero(~after.valid) if reasons else np.empty(0, dtype=int)
    nodes = map(tuple, np.sort(topology.triangles[rows], axis=1).tolist())
    cells = after.cell[rows].tolist()
    return [StillInvertedCell(cell, reasons[key]) for cell, key in zip(cells, nodes, strict=True) if key in reasons]
