"""What a page knows of each cell and node that it draws."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.report import QualityReport
from gmsnet.page.contents import Contents

Ints = NDArray[np.int64]

UNKNOWN = np.iinfo(np.int16).min  # the measure of a cell that has none
STEPS = {"shape": 1000, "angle": 10}  # of one: to so many parts measures are kept


def measures_of(state: str, report: QualityReport, cells: Ints) -> dict[str, NDArray[Any]]:
    """Of the cells that are drawn: 1/q and the smallest angle, rounded, and which are inverted."""
    every = int(max(cells.max(), report.cell.max(initial=0))) + 1
    row = np.full(every, -1)
    row[report.cell] = np.arange(len(report.cell))
    row = row[cells]
    measured = row >= 0
    made: dict[str, NDArray[Any]] = {}
    for name, column in (("shape", "shape"), ("angle", report.angles[0])):
        rounded = np.full(len(cells), UNKNOWN, dtype=np.int16)
        if measured.any():
            values = report.column(column)[row[measured]]
            rounded[measured] = np.where(np.isfinite(values), np.rint(np.nan_to_num(values) * STEPS[name]), UNKNOWN)
        made[f"{name}-{state}"] = rounded
    invalid = measured.copy()
    invalid[measured] = ~report.valid[row[measured]]
    made[f"invalid-{state}"] = np.flatnonzero(invalid).astype(np.uint32)
    return made


def reasons_of(contents: Contents, nodes: int) -> NDArray[np.uint8]:
    """(N,) 0 for free nodes, else 1 and more in the order of the reasons."""
    found = np.zeros(nodes, dtype=np.uint8)
    for k, ids in enumerate(contents.held.values(), start=1):
        found[ids] = k
    return found
