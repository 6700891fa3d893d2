"""What ranks know of a smoothed mesh: their own nodes, and the figures of all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.judged import UNKNOWN, Judged
from gmsnet.measure.target import Target
from gmsnet.measure.totals import Totals
from gmsnet.measure.worst import Place, named_numbers, named_places
from gmsnet.mesh.display import amount, miss_it, plain
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.sweep import Sweep


@dataclass(frozen=True, eq=False)
class RankResult:
    """What ``gmsnet.distributed.smooth`` returns on each rank; all but points and moved is the same on all.

    points: (n, dim) the nodes of this rank's piece, in its order; moved: (n,) bool. before, after: the figures of all
    cells of the mesh. sweeps, stop_reason, history, notes: as of a SmoothResult. held: reason → how many nodes of the
    mesh. nodes, cells: of the mesh. gathered: why the mesh was smoothed on the first rank, "" where it was shared out.
    seconds: for the whole call. messages, bytes: that this rank sent after colours. interrupted: this is the best mesh
    so far. missed: how many cells miss the target, None without one. judged: as of a SmoothResult. untangling: those of
    the notes that are of it. mended: (n, 2) or (n, 4) the nodes of the piece after it, as ``near_points``; None where
    nothing was mended. where: (n,) where on their curves or facets they are (along.where_on), if any slide. released:
    nodes near walls were let go at the end. worst: of the cells that are inverted or miss the target the worst ones, by
    their numbers in the mesh. whole: the SmoothResult of the first rank, where
    that has one.
    """

    points: NDArray[np.float64]
    moved: NDArray[np.bool_]
    before: Totals | None
    after: Totals | None
    sweeps: int
    stop_reason: str
    history: list[Sweep]
    notes: list[str]
    held: dict[str, int]
    nodes: int
    cells: int
    gathered: str
    seconds: float
    messages: int = 0
    bytes: int = 0
    interrupted: bool = False
    missed: int | None = None
    judged: Judged = UNKNOWN
    untangling: tuple[str, ...] = ()
    mended: NDArray[np.float64] | None = field(default=None, repr=False)
    where: NDArray[np.float64] | None = field(default=None, repr=False)
    released: bool = False
    worst: tuple[Place, ...] = ()
    whole: SmoothResult | None = field(default=None, repr=False)

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON."""
        return {
            "nodes": self.nodes, "cells": self.cells, "held": self.held, "sweeps": self.sweeps,
            "stop_reason": self.stop_reason, "target_met": None if self.missed is None else not self.missed,
            "missed": self.missed, "judged": self.judged.summary(), "gathered": self.gathered, "seconds": self.seconds,
            **{name: _figures(totals) for name, totals in (("before", self.before), ("after", self.after))},
        }  # fmt: skip

    def __repr__(self) -> str:
        """What was done, on a screen."""
        first, *lines = self.lines()
        if self.missed:
            lines.append(f"target not met: {amount(self.missed, 'cell')} {miss_it(self.missed)}")
        return "\n".join([f"RankResult: {first}", *lines, *self.notes])

    def faults(self, target: Target) -> list[str]:
        """What was asked for and is not so, in words: cells that miss the target, cells that are inverted still."""
        found, after = list[str](), self.after
        if self.missed and after is not None:
            figures = target.shortfall(after.shape_min, after.low_min, "shape")
            figures.append(named_numbers([each.cell for each in self.worst], self.missed, miss_it(self.missed)))
            found.append(f"target not met: {'; '.join(figures)}")
        if after is not None and after.inverted:
            found.append(f"inverted still: {amount(after.inverted, 'cell')}")
        return found

    def named(self) -> list[str]:
        """The cells in ``worst``, a line for each."""
        return named_places(self.worst, "shape")

    def lines(self) -> list[str]:
        """What was done, and what has become of each figure."""
        before, after = (_figures(totals) for totals in (self.before, self.after))
        done = f"{self.nodes:,} nodes, {self.sweeps} sweeps in {plain(self.seconds)} s, {self.stop_reason}"
        return [done, *(f"{name}: {before[name]:.6g} → {after[name]:.6g}" for name in before)]


def _figures(totals: Totals | None) -> dict[str, float]:
    """The figures that all kinds of cells have."""
    if totals is None:
        return {}
    return {"inverted": totals.inverted, "least shape": totals.shape_min, "mean shape": totals.shape_mean}
