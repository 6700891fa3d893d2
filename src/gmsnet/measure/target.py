"""What every cell of a mesh is to reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.below import missed
from gmsnet.kernels.methods.below_on_surface import missed_on_surface
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.simplex.tetra_measures import LOW, SHAPE
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.dihedral import SHARE, columns_of, most_shape_below, ratios_of
from gmsnet.measure.report import QualityReport
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.measure.totals import Totals
from gmsnet.measure.volumes import MeasuredTetrahedra
from gmsnet.topology.ordering import planar_points, space_points

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Rows = NDArray[np.int32]

# The largest 1/q of a sliver, or its share of that of cells that miss a target; between bounds; how many there are.
SLIVER, HALF, MUCH, THINNEST = 0.125, 0.5, 4.0, 40
SURE = 1.0 + 1e-12  # times the target: what is above it is so however it is measured


@dataclass(frozen=True)
class Nearness:
    """How near a mesh is to a target: by inverted cells, then by cells that miss it, then by the worst of these.

    In space, of two that miss it alike the one with the greater mean of 1/q or η is nearer.

    But of two that miss it, a mesh without slivers is nearer than one with any, and one of thick slivers than one of
    thin ones: else cells that miss it by little would outweigh them. Slivers are cells with a free node of a 1/q or η
    below that of ``sliver``; those are as thick that lie between the same two bounds, each MUCH times the one below.
    """

    inverted: int
    missed: int
    worst: float
    least: float
    mean: float = 0.0
    sliver: float = SLIVER

    @classmethod
    def of(cls, target: Target, inverted: int, missed: int, worst: float, totals: Totals | None) -> Nearness:
        """worst: of the cells that miss it. totals: of the cells with a free node."""
        if totals is None:
            return cls(inverted, missed, worst, math.inf)
        mean = 0.0 if totals.in_plane else totals.shape_mean
        return cls(inverted, missed, worst, totals.shape_min, mean, target.sliver)

    def __lt__(self, other: Nearness) -> bool:
        """Nearer."""
        return self._key < other._key

    def __le__(self, other: Nearness) -> bool:
        """As near, or nearer."""
        return self._key <= other._key

    @property
    def counts(self) -> tuple[int, int, float]:
        """Less is nearer, where slivers are alike."""
        return self.inverted, self.missed, -self.worst

    @property
    def _key(self) -> tuple[int, bool, int, int, float, float]:
        inverted, missed, worst = self.counts
        thin, bound = 0, self.sliver
        while missed and not inverted and self.least < bound and thin < THINNEST:
            thin, bound = thin + 1, bound / MUCH
        return inverted, missed > 0, thin, missed, worst, -self.mean if missed else 0.0


@dataclass(frozen=True)
class Target:
    """What every cell is to reach. quality: the minimum 1/q, of tetrahedra η. angle: the minimum angle in degrees.

    dihedral: the minimum dihedral angle of tetrahedra. None: no matter.
    """

    quality: float | None = None
    angle: float | None = None
    dihedral: float | None = None

    def __post_init__(self) -> None:
        """Takes any number for a float64: of single precision, SURE would be 1."""
        for name in ("quality", "angle", "dihedral"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, float(getattr(self, name)))

    def __bool__(self) -> bool:
        return self.quality is not None or self.least_angle is not None

    @property
    def least_angle(self) -> float | None:
        """The minimum angle of a cell in degrees, of whichever kind."""
        return self.angle if self.dihedral is None else self.dihedral

    def words(self, symbol: str) -> str:
        """What is asked for. symbol: what the quality of the cells is called."""
        kinds = ((symbol, self.quality, ""), ("angles", self.angle, "°"), ("dihedral angles", self.dihedral, "°"))
        return " and ".join(f"{kind} of {least:g}{unit} or more" for kind, least, unit in kinds if least is not None)

    def shortfall(self, shape: float, angle: float, symbol: str) -> list[str]:
        """By how much a mesh misses it, in words. shape: its minimum quality, called ``symbol``; angle: its minimum
        angle, NaN where that is not known."""
        found = []
        if self.quality is not None and shape < self.quality:
            gap = self.quality - shape
            found.append(f"the minimum {symbol} is {shape:.4g}, {gap:.4g} below {self.quality:g}")
        least = self.least_angle
        if least is not None and angle < least:
            kind = "angle" if self.dihedral is None else "dihedral angle"
            found.append(f"the minimum {kind} is {angle:.4g}°, {least - angle:.4g}° below {least:g}°")
        return found

    def missed(self, shape: Floats, min_angle: Floats) -> Flags:
        """Which cells miss it, by their 1/q and their smallest angles (of tetrahedra, dihedral ones) in degrees."""
        missed: Flags = np.zeros(len(shape), dtype=bool)
        if self.quality is not None:
            missed |= ~(shape >= self.quality)
        if self.least_angle is not None:
            missed |= ~((min_angle >= self.least_angle) & (shape > 0.0))
        return missed

    def tetrahedra_missing(self, points: Floats, cells: Tetrahedra, share: float = SURE) -> tuple[Rows, Floats]:
        """The rows of the tetrahedra that miss it, and their η. share: times the target that they are to reach.

        points: (N, 3 or 4).
        """
        if cells.shapes is not None:
            return self._corners_missing(points, cells, share)
        limit = most_shape_below(share * self.dihedral, 0.0) if self.dihedral is not None else 0.0
        limit = max(limit, share * SHARE * (self.quality or 0.0))
        rows = np.flatnonzero(~(ratios_of(points, cells) < 432.0 / limit**3)).astype(np.int32)
        columns = columns_of(points, cells, rows)
        wanted = Target(*(None if each is None else share * each for each in (self.quality, None, self.dihedral)))
        chosen = wanted.missed(columns[SHAPE], columns[LOW])
        return rows[chosen], columns[SHAPE][chosen]

    def _corners_missing(self, points: Floats, cells: Tetrahedra, share: float) -> tuple[Rows, Floats]:
        """The same of cells of any kinds: the worst corner simplex of each cell that misses it."""
        assert cells.cells is not None
        ratios = ratios_of(points, cells)
        shape = np.where(np.isinf(ratios), -1.0, np.cbrt(432.0 / np.maximum(ratios, 432.0)))
        rows = np.flatnonzero(~(shape >= share * (self.quality or 0.0)))
        rows = rows[np.lexsort((shape[rows], cells.cells[rows]))]
        first = np.append(True, np.diff(cells.cells[rows]) != 0)[: len(rows)]
        chosen = np.sort(rows[first]).astype(np.int32)
        return chosen, shape[chosen]

    def missed_in(self, report: QualityReport) -> NDArray[np.int32]:
        """The rows of the cells of a planar mesh, or of the tetrahedra, that miss it.

        What the report says of a cell decides; of those that are clear of the target it need not be asked.
        """
        return self.missed_with_shapes(report)[0]

    def missed_with_shapes(self, report: QualityReport) -> tuple[NDArray[np.int32], Floats]:
        """The same rows, and the 1/q of these cells."""
        triangles = report.cells
        if isinstance(triangles, MeasuredTetrahedra):
            cells = Tetrahedra(triangles.corners, triangles.orientation)
            return self.tetrahedra_missing(space_points(triangles), cells, 1.0)
        if isinstance(triangles, MeasuredSolids):
            shape = report.shape
            every = np.flatnonzero(self.missed(shape, report.min_dihedral)).astype(np.int32)
            return every, shape[every]
        assert isinstance(triangles, MeasuredCells)
        if triangles.order is not None or triangles.plane is None:
            low, _, shape, _ = triangles.columns()
            every = np.flatnonzero(self.missed(shape, low)).astype(np.int32)
            return every, shape[every]
        points = planar_points(triangles)
        rows = missed(points, Simplices(triangles.corners, triangles.orientation), *self.limits)
        low, _, shape, _ = triangles.columns(rows)
        chosen = self.missed(shape, low)
        return rows[chosen], shape[chosen]

    def corners_missing(
        self, points: Floats, simplices: Simplices | ShellSimplices, share: float = 1.0
    ) -> NDArray[np.int32]:
        """The rows of corner simplices that miss it, or are not clear of it. share: times the target.

        points: (N, 2), or of a surface in space (N, 3).
        """
        find = missed_on_surface if isinstance(simplices, ShellSimplices) else missed
        rows: NDArray[np.int32] = find(points, simplices, *(share * limit for limit in self.limits))
        return rows

    def clearly_missed(self, points: Floats, simplices: Simplices | ShellSimplices) -> bool:
        """Do all these corner simplices miss it, however they are measured?"""
        return len(self.corners_missing(points, simplices, SURE**-2)) == len(simplices.rows)

    def rank(self, report: QualityReport, totals: Totals | None) -> Nearness:
        """How near a mesh is. totals: of the cells with a node that may move."""
        rows, shape = self.missed_with_shapes(report)
        return Nearness.of(self, report.inverted, len(rows), float(shape.min(initial=np.inf)), totals)

    @property
    def limits(self) -> tuple[float, float]:
        """The minimum 1/q and the tangent of the minimum angle at which no way to measure leaves a doubt; 0 for
        none."""
        tangent = 0.0 if self.angle is None else math.tan(math.radians(self.angle))
        return (self.quality or 0.0) * SURE, tangent * SURE

    @property
    def sliver(self) -> float:
        """The 1/q or η below which a cell is a sliver: it has less than HALF of what one may have that misses it."""
        most = self.max_shape
        if self.dihedral is not None:
            most = max(most, min(1.0, most_shape_below(self.dihedral, 0.0)))
        return max(SLIVER, HALF * most)

    @property
    def max_shape(self) -> float:
        """The largest 1/q of a cell that misses it: of all triangles with an angle of α, (α, (π − α)/2, (π − α)/2)."""
        most = self.quality or 0.0
        if self.angle is not None:
            alpha = math.radians(self.angle)
            most = max(most, math.sqrt(3.0) * math.sin(alpha) / (2.0 - math.cos(alpha)))
        return most

    @property
    def shape(self) -> float:
        """The minimum 1/q that a cell has which meets it: of all triangles with angles of α or more, (α, α, π − 2α).

        Of tetrahedra with a minimum dihedral angle it is not known: then that of the quality that was asked for.
        """
        least = self.quality or 0.0
        if self.angle is not None:
            alpha = math.radians(self.angle)
            long = 2.0 * math.cos(alpha)  # the sides are 1, 1 and this, the height is sin α
            least = max(least, 2.0 * math.sqrt(3.0) * long * math.sin(alpha) / (2.0 + long * long))
        return least
