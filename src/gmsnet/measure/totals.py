"""Means and extremes over the cells of a mesh: exact sums, the same bits in any order."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex import cell_measures as cells
from gmsnet.kernels.simplex import measures as kernels
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.simplex.shell_measures import summarise_shell, summarise_shell_cells
from gmsnet.kernels.simplex.solid_measures import summarise_solids
from gmsnet.kernels.simplex.summary import CELLS, TRIANGLES, Summary
from gmsnet.kernels.simplex.tetra_measures import summarise_tetrahedra
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

if TYPE_CHECKING:
    from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]

NOWHERE = np.empty(0, dtype=np.float32)


class Looked(NamedTuple):
    """What was seen of some cells, at least one. figures: (F,) sums, extremes and counts, as kernels lay them out.

    number: of cells. grids: on which the sums are (kernels.simplex.measures.grids).
    """

    figures: Floats
    number: int
    grids: tuple[float, float]

    @classmethod
    def of(
        cls, summary: Summary, parts: Iterable[Floats], grids: tuple[float, float], number: int | None,
        executor: Executor,
    ) -> Looked:  # fmt: skip
        """From the figures of parts. executor: forms those of the whole mesh. number: None where it is among them."""
        figures = np.array(list(parts))
        found = np.array(executor.total(figures.sum(axis=0)))  # exact, but for extremes
        least, most = list(summary.least), list(summary.most)
        found[least] = executor.minimum(figures.min(axis=0))[least]
        if most:
            found[most] = -executor.minimum(-figures.max(axis=0))[most]
        return cls(found, int(found[cells.COUNT]) if number is None else number, grids)

    def joined(self, other: Looked) -> Looked | None:
        """The same of the cells of both; None where the sums are on other grids."""
        if self.grids != other.grids:
            return None
        summary, pair = CELLS if len(self.figures) == CELLS.figures else TRIANGLES, (self.figures, other.figures)
        found = self.figures + other.figures
        least, most = list(summary.least), list(summary.most)
        found[least], found[most] = np.minimum(*pair)[least], np.maximum(*pair)[most]
        return Looked(found, self.number + other.number, self.grids)


@dataclass(frozen=True)
class Totals:
    """Means and extremes over the cells of a mesh; angles in degrees. The means are those of exact sums.

    low, high: the smallest and the largest angles. uncertain: how many cells are not certainly valid; inverted: those
    of them that are not, as far as float64 can tell. Where not all cells are triangles, only 1/q and these two are
    told, of a cell's worst corner; the others are nan.
    """

    low_mean: float
    low_min: float
    high_mean: float
    high_max: float
    shape_mean: float
    shape_min: float
    aspect_mean: float
    aspect_min: float
    inverted: int
    uncertain: int
    looked: Looked | None = field(default=None, repr=False, compare=False)
    in_plane: bool = field(default=True, repr=False)

    @classmethod
    def of(cls, looked: Looked) -> Totals:
        """From what was seen of one cell or more."""
        figures, count = looked.figures, looked.number
        if len(figures) == CELLS.figures:
            mean, nan = float((figures[cells.COARSE] + figures[cells.FINE]) / count), math.nan
            bad, unsure = int(figures[cells.INVERTED]), int(figures[cells.UNCERTAIN])
            return cls(nan, nan, nan, nan, mean, float(figures[cells.MINIMUM]), nan, nan, bad, unsure, looked)
        means = (figures[: kernels.FINE] + figures[kernels.FINE : kernels.EXTREME]) / count
        low, high, shape, aspect = means.tolist()
        low_min, high_max, shape_min, aspect_min = figures[kernels.EXTREME : kernels.INVERTED].tolist()
        return cls(
            low, low_min, high, high_max, shape, shape_min, aspect, aspect_min, int(figures[kernels.INVERTED]),
            int(figures[kernels.UNCERTAIN]), looked,
        )  # fmt: skip

    def joined(self, other: Totals) -> Totals | None:
        """Those of the cells of both, to the bit; None where their sums are on other grids."""
        found = None if self.looked is None or other.looked is None else self.looked.joined(other.looked)
        return None if found is None else replace(Totals.of(found), in_plane=self.in_plane)

    @classmethod
    def of_columns(cls, columns: Floats) -> Totals:
        """From the measures (4, T) of each triangle, at least one."""
        low, high, shape, aspect = columns
        bad = int((shape <= 0.0).sum())
        mean, least, nan = float(shape.mean()), float(shape.min()), math.nan
        if np.isnan(aspect).any():  # of quads
            return cls(nan, nan, nan, nan, mean, least, nan, nan, bad, bad)
        return cls(
            float(low.mean()), float(low.min()), float(high.mean()), float(high.max()), mean, least,
            float(aspect.mean()), float(aspect.min()), bad, bad,
        )  # fmt: skip

    @property
    def qhat(self) -> float:
        """q̂ of equation 11 with 1/q as in the loss."""
        return self._weighted(self.shape_mean, self.shape_min)

    @property
    def qhat_aspect(self) -> float:
        """q̂ of equation 11 with 1/q_V as in the paper's tables."""
        return self._weighted(self.aspect_mean, self.aspect_min)

    def _weighted(self, mean: float, least: float) -> float:
        """Equation 11: (1/6)[(α_mean + α_min + 120 − β_max − β_mean)/60 + (1/q)_mean + (1/q)_min], in degrees."""
        angles = (self.low_mean + self.low_min + 120.0 - self.high_max - self.high_mean) / 60.0
        return (angles + mean + least) / 6.0


def totals_of(
    points: Floats,
    simplices: Simplices | Tetrahedra | ShellSimplices,
    executor: Executor = serial,
    shapes: NDArray[np.float32] = NOWHERE,
    among: int | None = None,
) -> Totals | None:
    """Means and extremes over the cells of some corner simplices; None where there are none.

    executor: takes blocks of LANES simplices. shapes: (T,), for 1/q of each triangle, if it is wanted and all are
    triangles. among: of how many simplices the totals are part (``Totals.joined``).
    """
    blocks, count = -(-len(simplices.rows) // LANES), int(executor.total(np.array(len(simplices.rows))))
    if not count:
        return None
    grids = kernels.grids(among or count)
    if isinstance(simplices, Tetrahedra):

        def part_of_volume(first: int, last: int) -> Floats:
            summarise = summarise_tetrahedra if simplices.shapes is None else summarise_solids
            figures: Floats = summarise(points, simplices, first, last, *grids)
            return figures

        return Totals.of(Looked.of(CELLS, executor.map(part_of_volume, 0, blocks), grids, None, executor))
    if isinstance(simplices, ShellSimplices):
        summary, summarised = (
            (TRIANGLES, summarise_shell) if simplices.shapes is None else (CELLS, summarise_shell_cells)
        )

        def part_of_surface(first: int, last: int) -> Floats:
            figures: Floats = summarised(points, simplices, first, last, *grids)
            return figures

        parts = executor.map(part_of_surface, 0, blocks)
        looked = Looked.of(summary, parts, grids, count if summary is TRIANGLES else None, executor)
        return replace(Totals.of(looked), in_plane=False)
    if simplices.shapes is not None:
        seen = _parts(CELLS, points, (simplices,), blocks, grids, executor)
        return Totals.of(Looked.of(CELLS, seen, grids, None, executor))
    triangles = simplices.rows, simplices.orientation
    seen = _parts(TRIANGLES, points, triangles, blocks, (*grids, shapes), executor)
    return Totals.of(Looked.of(TRIANGLES, seen, grids, count, executor))


def totals_with_others(
    points: Floats, topology: Topology, scored: Totals | None, executor: Executor = serial
) -> Totals | None:
    """The same over all cells of a mesh in a plane, where those over its scored ones are known."""
    if topology.scored is topology.simplices:
        return scored
    others = totals_of(points, topology.others, executor, among=len(topology.simplices.rows))
    if scored is None or others is None:
        return scored or others
    return scored.joined(others) or totals_of(points, topology.simplices, executor)


def _parts(
    summary: Summary, points: Floats, cells: tuple[Any, ...], blocks: int, rest: tuple[Any, ...], executor: Executor
) -> Iterable[Floats]:
    """The figures of parts of a mesh in a plane of so many blocks. rest: grids; and room for 1/q of each, or none."""

    def part(first: int, last: int) -> Floats:
        figures: Floats = summary.kernel(points, *cells, first, last, *rest)
        return figures

    found = None
    if all(value is NOWHERE or not isinstance(value, np.ndarray) for value in rest):
        found = executor.figures(summary, points, cells, rest)
    return executor.map(part, 0, blocks) if found is None else found
