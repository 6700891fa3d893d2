"""How good the triangles of a mesh are: angles, shape, aspect, validity, and the paper's weighted metric q̂."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import has_form
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex import measures as kernels
from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.defects import remarks_on
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.measure.summary import summary_of
from gmsnet.measure.totals import NOWHERE, Totals, totals_of
from gmsnet.measure.volumes import MeasuredTetrahedra
from gmsnet.mesh.display import html_table, text_table
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.mixed_volume import MixedVolume, volume_of, wound_of
from gmsnet.topology.ordering import near_points, space_points, taken
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import refuse_flat

SHAPE, ASPECT = "shape", "aspect"  # with which 1/q meshes on the way are compared: the loss's or Verdict's

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class QualityReport:
    """Measures of the T triangles and quads of a mesh (six-node triangles by their corners), or of its T tetrahedra.

    cell: (T,) index of each among all cells of the mesh, in file order. centre: (T, dim) where it is.
    min_angle, max_angle: (T,) degrees, of the geometric triangle. shape: (T,) 1/q = 4√3·S/(l² + m² + n²), the inverse
    of the paper's aspect ratio (equation 10). aspect: (T,) 1/q_V = 4√3·S/(l_max·(l₁ + l₂ + l₃)), the inverse of
    Verdict's aspect ratio, which the paper's tables fit. Both carry the sign of S after neighbours have been wound
    alike; on a surface that is not planar they are unsigned. Of a quad, shape is 2D/(|e₁|² + |e₂|²) of its worst
    corner, D = e₁ × e₂, angles are those at its corners, and aspect is nan. scaled_jacobian: (T,) the least of
    D/(|e₁||e₂|) over the corners, of a triangle times 2/√3. sign: (T,) int8, the exact sign of S in float64: 1, 0 or
    −1. valid: (T,) bool, whether it is positive.

    Of tetrahedra, shape is η = 12(3V)^(2/3)/Σl² with the sign of the volume V, which sign and valid are of, too.
    min_dihedral, max_dihedral: (T,) degrees; volume: (T,); scaled_jacobian: (T,) √2·6V over the largest product of the
    three edges at a corner (Verdict). They have no min_angle, max_angle, aspect and q̂.

    Of hexahedra, wedges, pyramids, and tetrahedra beside them or of second order, shape is η of the worst corner,
    scaled_jacobian is Verdict's, and dihedral angles are those at corners. sign is 1 where the Jacobian determinant is
    positive everywhere in the cell, −1 where it is not, and 0 where that is undecided, which counts as invalid, too.

    ``inverted`` and q̂ are known from the beginning, and so are the totals: means and extremes, None where there are no
    triangles. The columns are made when one of them is first asked for, of the triangles as they were measured.
    """

    cell: NDArray[np.int64]
    totals: Totals | None = field(repr=False)
    cells: MeasuredCells | MeasuredTetrahedra | MeasuredSolids = field(repr=False)
    signs: NDArray[np.int8] | None = field(repr=False)  # None where all are certainly positive

    def __repr__(self) -> str:
        """A line for each of ``figures``."""
        return text_table([("QualityReport", ""), *self.figures()])

    def _repr_html_(self) -> str:
        """For a notebook."""
        return html_table("QualityReport", [("", ""), *self.figures()])

    def figures(self) -> list[tuple[str, str]]:
        """(name, value) of the few figures that say the most, of those that there are."""
        counts = [("cells", f"{len(self.cell):,}"), ("inverted", f"{self.inverted:,}")]
        if self.totals is None:
            return counts
        if self.undecided:
            counts.append(("undecided", f"{self.undecided:,}"))
        if not isinstance(self.cells, MeasuredCells):
            return [*counts, *_of_volumes(self)]
        known = [
            ("1/q, least", self.totals.shape_min, 4),
            ("1/q, mean", self.totals.shape_mean, 4),
            ("min angle, least", self.totals.low_min, 2),
            ("max angle, greatest", self.totals.high_max, 2),
            ("q-hat with 1/q", self.qhat, 4),
        ]
        return [*counts, *((name, f"{value:.{places}f}") for name, value, places in known if not math.isnan(value))]

    @property
    def inverted(self) -> int:
        """How many cells are not valid: triangles with an area of zero or less. Undecided ones are among them."""
        return 0 if self.signs is None else int((self.signs <= 0).sum())

    @property
    def undecided(self) -> int:
        """How many cells are neither valid nor invalid for certain."""
        return self.cells.undecided if isinstance(self.cells, MeasuredSolids) else 0

    @property
    def remarks(self) -> list[str]:
        """What else is to be known of the cells, in words: defects of the file, with the numbers of the first."""
        return remarks_on(self.cells) if isinstance(self.cells, MeasuredSolids) else []

    @property
    def qhat(self) -> float:
        """q̂ of equation 11 with 1/q as in the loss; nan for a mesh without triangles."""
        return float("nan") if self.totals is None else self.totals.qhat

    @property
    def qhat_aspect(self) -> float:
        """q̂ of equation 11 with 1/q_V as in the paper's tables; nan for a mesh without triangles."""
        return float("nan") if self.totals is None else self.totals.qhat_aspect

    @cached_property
    def sign(self) -> NDArray[np.int8]:
        """(T,) int8, the exact sign of each area: 1, 0 or −1."""
        return np.ones(len(self.cell), dtype=np.int8) if self.signs is None else self.signs

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """(T,) bool, whether each area is positive: exact."""
        return np.ones(len(self.cell), dtype=bool) if self.signs is None else self.signs > 0

    @cached_property
    def centre(self) -> Floats:
        """(T, dim) where each triangle is."""
        return self.cells.centres()

    @property
    def min_angle(self) -> Floats:
        """(T,) in degrees."""
        return self.column("min_angle")

    @property
    def max_angle(self) -> Floats:
        """(T,) in degrees."""
        return self.column("max_angle")

    @property
    def min_dihedral(self) -> Floats:
        """(T,) in degrees."""
        return self.column("min_dihedral")

    @property
    def max_dihedral(self) -> Floats:
        """(T,) in degrees."""
        return self.column("max_dihedral")

    @property
    def volume(self) -> Floats:
        """(T,) signed."""
        return self.column("volume")

    @property
    def shape(self) -> Floats:
        """(T,) 1/q; η of tetrahedra."""
        return self.column("shape")

    @property
    def aspect(self) -> Floats:
        """(T,) 1/q_V."""
        return self.column("aspect")

    @property
    def symbol(self) -> str:
        """How the column ``shape`` is called."""
        return self.cells.symbol

    @property
    def angles(self) -> tuple[str, str]:
        """The names of the columns of the smallest and the largest angle."""
        low, high = self.cells.names[:2]
        return low, high

    def column(self, name: str) -> Floats:
        """(T,) by its name. Raises AttributeError for what cells of these kinds do not have."""
        if name not in self.cells.names:
            raise AttributeError(f"these cells have no {name}: they have {', '.join(self.cells.names)}")
        column: Floats = self._columns[self.cells.names.index(name)]
        return column

    @cached_property
    def _columns(self) -> Floats:
        return self.cells.columns()

    @cached_property
    def scaled_jacobian(self) -> Floats:
        """(T,) of each cell's worst corner."""
        if isinstance(self.cells, MeasuredCells):
            return self.cells.scaled_jacobian()
        return self.column("scaled_jacobian")

    def worst(self, count: int) -> NDArray[np.int64]:
        """Rows of the ``count`` triangles of minimum shape, the worst first."""
        if not 0 < count < len(self.cell):
            return np.argsort(self.shape, kind="stable")[:count]
        rows = np.flatnonzero(self.shape <= np.partition(self.shape, count - 1)[count - 1])
        return rows[np.argsort(self.shape[rows], kind="stable")[:count]]

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON: min, mean, max, 1st percentile (p1) and counts beyond thresholds."""
        return summary_of(self.cells, self.totals, self.inverted, partial(getattr, self))


def _of_volumes(report: QualityReport) -> list[tuple[str, str]]:
    """The same as ``figures``, after the counts."""
    totals = report.totals
    assert totals is not None
    return [
        ("η, least", f"{totals.shape_min:.4f}"),
        ("η, mean", f"{totals.shape_mean:.4f}"),
        ("dihedral angle, least", f"{report.min_dihedral.min():.2f}"),
        ("dihedral angle, greatest", f"{report.max_dihedral.max():.2f}"),
    ]


def measure(
    mesh: Mesh, topology: Topology | Volume | None = None, near: Floats | None = None, executor: Executor = serial,
    totals: Totals | None = None, shapes: NDArray[np.float32] = NOWHERE,
) -> QualityReport:  # fmt: skip
    """The measures of a mesh; ``topology`` saves building it again (it must belong to the same connectivity).

    With a topology of volumes, those of the cells that it has; without, those of all cells that can be measured.

    The signs are those of the topology's winding, so a report on moved points sees what has turned over. near:
    ``near_points(mesh, topology)``, where they are known; totals: of a planar mesh, where they are. shapes: see
    ``totals_of``.
    """
    if topology is None and _has_solids(mesh):
        return _of_any_volumes(mesh)
    topology = topology or connectivity_of(mesh)
    if isinstance(topology, Volume):
        return _of_volume(mesh, topology, near, executor, totals)
    cells, cell = MeasuredCells.of(mesh, topology)
    if not len(cell):
        return QualityReport(cell, None, cells, None)
    if mesh.plane is None:
        columns = cells.columns()
        report = QualityReport(cell, Totals.of_columns(columns), cells, (columns[kernels.SHAPE] > 0).astype(np.int8))
        report.__dict__["_columns"] = columns
        return report
    if totals is None:
        near = near_points(mesh, topology) if near is None else near
        executor = executor.for_blocks(-(-len(topology.near) // LANES))
        totals = totals_of(near, topology.simplices, executor, shapes)
    assert totals is not None
    return QualityReport(cell, totals, cells, cells.signs() if totals.uncertain else None)


def _has_solids(mesh: Mesh) -> bool:
    """Are there volumes that can be measured, besides tetrahedra of first order?"""
    return any(has_form(block.kind) and block.kind != "tetra" and len(block.nodes) for block in mesh.cells)


def _of_any_volumes(mesh: Mesh) -> QualityReport:
    """``measure`` of a mesh of volumes of any kinds."""
    refuse_flat(mesh)
    return _of_solids_at(*MeasuredSolids.of(mesh))


def measured_again(before: QualityReport, mesh: Mesh) -> QualityReport:
    """The measures of the same cells, volumes of any kinds, with their nodes at other places."""
    assert isinstance(before.cells, MeasuredSolids)
    return _of_solids_at(replace(before.cells, points=mesh.points), before.cell)


def _of_solids_at(cells: MeasuredSolids, cell: NDArray[np.int64]) -> QualityReport:
    columns, signs = cells.columns(), cells.signs()
    nan, shape, bad = math.nan, columns[cells.names.index(SHAPE)], int((signs <= 0).sum())
    mean = math.fsum(shape) / len(shape)
    totals = Totals(nan, nan, nan, nan, mean, float(shape.min()), nan, nan, bad, bad)
    report = QualityReport(cell, totals, cells, signs if bad else None)
    report.__dict__["_columns"] = columns
    return report


def connectivity_of(mesh: Mesh, fixed: NDArray[np.bool_] | None = None) -> Topology | Volume:
    """What follows from the connectivity of a mesh, of its volumes where it has any."""
    return volume_of(wound_of(mesh, fixed)) if mesh.has_volumes else Topology.of(mesh, fixed)


def _of_volume(
    mesh: Mesh, topology: Volume, near: Floats | None, executor: Executor, totals: Totals | None
) -> QualityReport:
    """``measure`` of a mesh of volumes that a connectivity has."""
    cells: MeasuredTetrahedra | MeasuredSolids
    if isinstance(topology, MixedVolume):
        kind, kinds = topology.file_numbers, topology.file_kinds
        cells, cell = MeasuredSolids.of_table(mesh, topology.cells, kind, kinds, topology.cell, topology.orientation)
    else:
        cells, cell = MeasuredTetrahedra.of(mesh, topology)
    if not len(cell):
        return QualityReport(cell, None, cells, None)
    near = taken(space_points(mesh), topology.memory) if near is None else near
    executor = executor.for_blocks(-(-len(topology.near) // LANES))
    totals = totals or totals_of(near, topology.simplices, executor)
    assert totals is not None
    return QualityReport(cell, totals, cells, cells.signs() if totals.uncertain else None)
