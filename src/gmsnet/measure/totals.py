"""Means and extremes over the cells of a mesh: exact sums, the same bits in any order."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

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

Floats = NDArray[np.float64]


NOWHERE = np.empty(0, dtype=np.float32)


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

    @classmethod
    def of(cls, parts: Iterable[Floats], triangles: int, executor: Executor = serial) -> Totals:
        """From what kernels.simplex.measures.summarise says of the parts of a mesh; so many triangles, at least one.

        executor: forms the figures of the whole mesh.
        """
        figures = np.array(list(parts))
        sums = executor.total(figures.sum(axis=0))  # of those before EXTREME: exact, see kernels.simplex.measures.grids
        means = (sums[: kernels.FINE] + sums[kernels.FINE : kernels.EXTREME]) / triangles
        low, high, shape, aspect = means.tolist()
        least = executor.minimum(figures.min(axis=0)).tolist()
        most = (-executor.minimum(-figures.max(axis=0))).tolist()
        inverted, uncertain = (int(sums[count]) for count in (kernels.INVERTED, kernels.UNCERTAIN))
        return cls(
            low, least[kernels.EXTREME + kernels.LOW], high, most[kernels.EXTREME + kernels.HIGH],
            shape, least[kernels.EXTREME + kernels.SHAPE], aspect, least[kernels.EXTREME + kernels.ASPECT],
            inverted, uncertain,
        )  # fmt: skip

    @classmethod
    def of_cells(cls, parts: Iterable[Floats], executor: Executor = serial) -> Totals:
        """From what kernels.simplex.cell_measures.summarise_cells says of the parts of a mesh, of one cell or more."""
        figures = np.array(list(parts))
        sums = executor.total(figures.sum(axis=0))  # exact: see kernels.simplex.measures.grids
        least = float(executor.minimum(figures.min(axis=0))[cells.MINIMUM])
        mean, nan = float((sums[cells.COARSE] + sums[cells.FINE]) / sums[cells.COUNT]), math.nan
        return cls(nan, nan, nan, nan, mean, least, nan, nan, int(sums[cells.INVERTED]), int(sums[cells.UNCERTAIN]))

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
) -> Totals | None:
    """Means and extremes over the cells of some corner simplices; None where there are none.

    executor: takes blocks of LANES simplices. shapes: (T,), for 1/q of each triangle, if it is wanted and all are
    triangles.
    """
    blocks, count = -(-len(simplices.rows) // LANES), int(executor.total(np.array(len(simplices.rows))))
    if not count:
        return None
    grids = kernels.grids(count)
    if isinstance(simplices, Tetrahedra):

        def part_of_volume(first: int, last: int) -> Floats:
            summarise = summarise_tetrahedra if simplices.shapes is None else summarise_solids
            figures: Floats = summarise(points, simplices, first, last, *grids)
            return figures

        return Totals.of_cells(executor.map(part_of_volume, 0, blocks), executor)
    if isinstance(simplices, ShellSimplices):
        summarised = summarise_shell if simplices.shapes is None else summarise_shell_cells

        def part_of_surface(first: int, last: int) -> Floats:
            figures: Floats = summarised(points, simplices, first, last, *grids)
            return figures

        parts = executor.map(part_of_surface, 0, blocks)
        return Totals.of(parts, count, executor) if simplices.shapes is None else Totals.of_cells(parts, executor)
    if simplices.shapes is not None:
        return Totals.of_cells(_parts(CELLS, points, (simplices,), blocks, grids, executor), executor)
    triangles = simplices.rows, simplices.orientation
    return Totals.of(_parts(TRIANGLES, points, triangles, blocks, (*grids, shapes), executor), count, executor)


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
