"""How good the triangles of a mesh are: angles, shape, aspect, validity, and the paper's weighted metric q̂."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex import measures as kernels
from gmsnet.kernels.simplex import predicates
from gmsnet.kernels.simplex.exact import exact
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.topology import Topology, near_points, planar_points

SHAPE, ASPECT = "shape", "aspect"  # with which 1/q meshes on the way are compared: the loss's or Verdict's

Floats = NDArray[np.float64]

NOWHERE = np.empty(0, dtype=np.float32)
THRESHOLDS = {"min_angle": (5.0, 10.0, 20.0, 30.0), "max_angle": (120.0, 150.0, 170.0), "shape": (0.1, 0.2, 0.3, 0.5)}


@dataclass(frozen=True)
class Totals:
    """Means and extremes over the triangles of a mesh; angles in degrees. The means are those of exact sums.

    low, high: the smallest and the largest angles. doubts: how many triangles are not certainly of positive area;
    inverted: those of them that are not, as far as float64 can tell.
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
    def of_columns(cls, columns: Floats) -> Totals:
        """From the measures (4, T) of each triangle, at least one."""
        low, high, shape, aspect = columns
        bad = int((shape <= 0.0).sum())
        return cls(
            float(low.mean()), float(low.min()), float(high.mean()), float(high.max()), float(shape.mean()),
            float(shape.min()), float(aspect.mean()), float(aspect.min()), bad, bad,
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


@dataclass(frozen=True, eq=False)
class Triangles:
    """The triangles of a mesh as they are when they are measured: nothing of it changes afterwards.

    points: (N, dim), read-only. plane, single: as of the Mesh. corners: (T, 3). orientation: (T,) ±1.
    """

    points: Floats
    plane: tuple[int, int] | None
    single: bool
    corners: NDArray[np.int32]
    orientation: NDArray[np.int8]

    @cached_property
    def exponent(self) -> int:
        """See ``exponent_of``."""
        return exponent_of(self.points, self.plane, self.single)

    def columns(self, rows: NDArray[np.int32] | None = None) -> Floats:
        """Smallest and largest angle, shape and aspect of each: (4, T), or of some of them, the same bits."""
        corners, orientation = (
            (self.corners, self.orientation) if rows is None else (self.corners[rows], self.orientation[rows])
        )
        columns = np.empty((4, len(corners)))
        if self.plane is None:
            largest = float(np.abs(self.points).max(initial=0.0))
            scaled = np.ldexp(self.points, -int(np.frexp(largest)[1]))
            kernels.per_surface_cell(scaled, corners, columns)
        else:
            kernels.per_cell(planar_points(self), corners, orientation, columns)
        return columns

    def centres(self) -> Floats:
        """(T, dim) the mean of the corners of each."""
        third = self.points / 3.0  # before the sum, lest that overflow
        a, b, c = (np.take(third, corner, axis=0) for corner in self.corners.T)
        return np.asarray(a + b + c)


@dataclass(frozen=True, eq=False)
class QualityReport:
    """Measures of the T triangles of a mesh (six-node triangles by their corners).

    cell: (T,) index of each among all cells of the mesh, in file order. centre: (T, dim) where it is.
    min_angle, max_angle: (T,) degrees, of the geometric triangle. shape: (T,) 1/q = 4√3·S/(l² + m² + n²), the inverse
    of the paper's aspect ratio (equation 10). aspect: (T,) 1/q_V = 4√3·S/(l_max·(l₁ + l₂ + l₃)), the inverse of
    Verdict's aspect ratio, which the paper's tables fit. Both carry the sign of S after neighbours have been wound
    alike; on a surface that is not planar they are unsigned. valid: (T,) int8, the exact sign of S in float64.

    ``inverted`` and q̂ are known from the beginning, and so are the totals: means and extremes, None where there are no
    triangles. The columns are made when one of them is first asked for, of the triangles as they were measured.
    """

    cell: NDArray[np.int64]
    totals: Totals | None = field(repr=False)
    triangles: Triangles = field(repr=False)
    signs: NDArray[np.int8] | None = field(repr=False)  # None where all are certainly positive

    @property
    def inverted(self) -> int:
        """How many triangles have an area of zero or less."""
        return 0 if self.signs is None else int((self.signs <= 0).sum())

    @property
    def qhat(self) -> float:
        """q̂ of equation 11 with 1/q as in the loss; nan for a mesh without triangles."""
        return float("nan") if self.totals is None else self.totals.qhat

    @property
    def qhat_aspect(self) -> float:
        """q̂ of equation 11 with 1/q_V as in the paper's tables; nan for a mesh without triangles."""
        return float("nan") if self.totals is None else self.totals.qhat_aspect

    @cached_property
    def valid(self) -> NDArray[np.int8]:
        """(T,) the exact sign of each area."""
        return np.ones(len(self.cell), dtype=np.int8) if self.signs is None else self.signs

    @cached_property
    def centre(self) -> Floats:
        """(T, dim) where each triangle is."""
        return self.triangles.centres()

    @property
    def min_angle(self) -> Floats:
        """(T,) in degrees."""
        return self._column(kernels.LOW)

    @property
    def max_angle(self) -> Floats:
        """(T,) in degrees."""
        return self._column(kernels.HIGH)

    @property
    def shape(self) -> Floats:
        """(T,) 1/q."""
        return self._column(kernels.SHAPE)

    @property
    def aspect(self) -> Floats:
        """(T,) 1/q_V."""
        return self._column(kernels.ASPECT)

    def _column(self, which: int) -> Floats:
        column: Floats = self._columns[which]
        return column

    @cached_property
    def _columns(self) -> Floats:
        return self.triangles.columns()

    def worst(self, count: int) -> NDArray[np.int64]:
        """Rows of the ``count`` triangles of minimum shape, the worst first."""
        if not 0 < count < len(self.cell):
            return np.argsort(self.shape, kind="stable")[:count]
        rows = np.flatnonzero(self.shape <= np.partition(self.shape, count - 1)[count - 1])
        return rows[np.argsort(self.shape[rows], kind="stable")[:count]]

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON: min, mean, max, 1st percentile (p1) and counts beyond thresholds."""
        document: dict[str, Any] = {"triangles": len(self.cell), "inverted": self.inverted}
        if self.totals is None:
            return document
        means = (self.totals.low_mean, self.totals.high_mean, self.totals.shape_mean, self.totals.aspect_mean)
        for name, mean in zip(("min_angle", "max_angle", "shape", "aspect"), means, strict=True):
            values = getattr(self, name)
            best_is_low = name == "max_angle"
            document[name] = {
                "min": float(values.min()),
                "mean": mean,
                "max": float(values.max()),
                "p1": percentile(values, 99 if best_is_low else 1),
            }
            for limit in THRESHOLDS.get(name, ()):
                beyond = values > limit if best_is_low else values < limit
                document[name][f"{'above' if best_is_low else 'below'}_{limit:g}"] = int(np.count_nonzero(beyond))
        return {**document, "qhat": self.qhat, "qhat_aspect": self.qhat_aspect}


def percentile(values: Floats, percent: int) -> float:
    """What ``np.percentile`` says, in an eighth of its time: NumPy is quick to find one value in order, not two."""
    place = percent / 100 * (len(values) - 1)
    below = int(place)
    parted = np.partition(values, below)
    low = float(parted[below])
    return low if place == below else low + (float(parted[below + 1 :].min()) - low) * (place - below)


def measure(
    mesh: Mesh, topology: Topology | None = None, near: Floats | None = None, executor: Executor = serial,
    totals: Totals | None = None, shapes: NDArray[np.float32] = NOWHERE,
) -> QualityReport:  # fmt: skip
    """The measures of a mesh; ``topology`` saves building it again (it must belong to the same connectivity).

    The signs are those of the topology's winding, so a report on moved points sees what has turned over. near:
    ``near_points(mesh, topology)``, where they are known; totals: of a planar mesh, where they are. shapes: see
    ``totals_of``.
    """
    topology = topology or Topology.of(mesh)
    triangles = Triangles(mesh.points, mesh.plane, mesh.single, topology.triangles, topology.orientation)
    if not len(topology.triangles):
        return QualityReport(topology.cell, None, triangles, None)
    if mesh.plane is None:
        columns = triangles.columns()
        report = QualityReport(
            topology.cell, Totals.of_columns(columns), triangles, (columns[kernels.SHAPE] > 0).astype(np.int8)
        )
        report.__dict__["_columns"] = columns
        return report
    if totals is None:
        near = near_points(mesh, topology) if near is None else near
        executor = executor.for_blocks(-(-len(topology.near) // LANES))
        totals = totals_of(near, topology.near, topology.near_orientation, executor, shapes)
    assert totals is not None
    signs = exact_signs(planar_points(mesh), topology.triangles, topology.orientation) if totals.uncertain else None
    return QualityReport(topology.cell, totals, triangles, signs)


def totals_of(
    points: Floats,
    corners: NDArray[np.int32],
    orientation: NDArray[np.int8],
    executor: Executor = serial,
    shapes: NDArray[np.float32] = NOWHERE,
) -> Totals | None:
    """Means and extremes of some triangles (T, 3) of planar points; None where there are none.

    executor: takes blocks of LANES triangles. shapes: (T,), for 1/q of each, if it is wanted.
    """
    triangles = int(executor.total(np.array(len(corners))))
    grids = kernels.grids(triangles)

    def part(first: int, last: int) -> Floats:
        figures: Floats = kernels.summarise(points, corners, orientation, first, last, *grids, shapes)
        return figures

    return Totals.of(executor.map(part, 0, -(-len(corners) // LANES)), triangles, executor) if triangles else None


def exact_signs(points: Floats, triangles: NDArray[np.int32], orientation: NDArray[np.int8]) -> NDArray[np.int8]:
    """The exact sign of orientation × area of each triangle: float64 where the error bound decides, else exact
    arithmetic."""
    out = np.empty(len(triangles), dtype=np.int8)
    if predicates.signs(points, triangles, orientation, 0.0, out):
        rows = np.flatnonzero(out == 0)
        for t in rows[: exact(points, triangles, rows, orientation, out)].tolist():
            (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in points[i].tolist()] for i in triangles[t])
            area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
            out[t] = int(orientation[t]) * ((area > 0) - (area < 0))
    return out
