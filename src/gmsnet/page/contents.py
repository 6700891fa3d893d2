"""What a page tells of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.report import QualityReport
from gmsnet.mesh.mesh import Mesh

LISTED = 100  # cells that could not be mended are named


class Grid(NamedTuple):
    """A table. rows: the first of them is its head."""

    title: str
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, eq=False)
class Contents:
    """What a page tells of. All texts may hold anything: they are escaped.

    title: most often the name of a file. verdict: a sentence. faults: what was asked for and is not so. mesh: its
    cells are shown. before: None where one mesh is shown alone. held: reason → node ids. unmended: (cell, reason) of
    the cells that could not be mended. worst_before, worst_after: as ``worst_cells`` answers. facts: (term, text).
    document: the whole as plain values, which becomes part of the page. command: that made it.
    """

    title: str
    verdict: str
    mesh: Mesh
    after: QualityReport
    document: Mapping[str, Any]
    command: str
    worst_after: Sequence[Mapping[str, Any]]
    worst_before: Sequence[Mapping[str, Any]] = ()
    before: QualityReport | None = None
    faults: Sequence[str] = ()
    held: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    unmended: Sequence[tuple[int, str]] = ()
    notes: Sequence[str] = ()
    facts: Sequence[tuple[str, str]] = ()
    grids: Sequence[Grid] = ()

    @property
    def reports(self) -> dict[str, QualityReport]:
        """The meshes that are compared, by what they are called."""
        return {"now": self.after} if self.before is None else {"before": self.before, "after": self.after}

    @cached_property
    def summaries(self) -> list[dict[str, Any]]:
        """Their figures."""
        return [report.summary() for report in self.reports.values()]

    @property
    def quads(self) -> bool:
        """Whether there are quads among the cells that are measured."""
        return isinstance(self.after.cells, MeasuredCells) and self.after.cells.order is not None
