"""The tetrahedra of a mesh as they are when they are measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import orientation3
from gmsnet.kernels.simplex import tetra_measures as kernels
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.untangle.space import find_bad, find_bad_inside
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
Signs = NDArray[np.int8]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class MeasuredTetrahedra:
    """The tetrahedra of a mesh as they are when they are measured: nothing of it changes afterwards.

    points: (N, 3), read-only. single: as of the Mesh. corners: (T, 4), their orientations ±1.
    """

    points: Floats
    single: bool
    corners: NDArray[np.int32]
    orientation: Signs

    names: tuple[str, ...] = ("min_dihedral", "max_dihedral", "shape", "scaled_jacobian", "volume")  # of the columns
    symbol = "η"  # of the shape
    plane = None

    @classmethod
    def of(cls, mesh: Mesh, topology: Volume) -> tuple[MeasuredTetrahedra, NDArray[np.int64]]:
        """Those of a mesh, and the index of each among all its cells."""
        return cls(mesh.points, mesh.single, topology.cells, topology.orientation), topology.cell

    @property
    def counts(self) -> dict[str, int]:
        """How many cells of which kind."""
        return {"tetrahedra": len(self.corners)}

    @property
    def exponent(self) -> int:
        """See ``exponent_of``."""
        return exponent_of(self.points, None, self.single)

    def columns(self, rows: NDArray[np.int32] | None = None) -> Floats:
        """Smallest and largest dihedral angle in degrees, η, scaled Jacobian and volume of each: (5, T), or of some."""
        corners = self.corners if rows is None else self.corners[rows]
        orientation = self.orientation if rows is None else self.orientation[rows]
        columns = np.empty((kernels.COLUMNS, len(corners)))
        kernels.per_tetrahedron(space_points(self), corners, orientation, 0, len(corners), columns)
        with np.errstate(over="ignore", under="ignore"):  # a volume can be beyond the range where coordinates are not
            columns[kernels.VOLUME] = np.ldexp(columns[kernels.VOLUME], 3 * self.exponent)
        return columns

    def signs(self) -> Signs:
        """(T,) the exact sign of each volume."""
        return exact_signs3(space_points(self), self.corners, self.orientation)

    def centres(self) -> Floats:
        """(T, 3) the mean of the corners of each."""
        centres: Floats = (self.points / 4.0)[self.corners].sum(axis=1)
        return centres


def exact_signs3(points: Floats, corners: NDArray[np.int32], orientation: Signs) -> Signs:
    """The exact sign of orientation × volume of each: float64 where its error bound decides, else whole numbers.

    points: (N, 3 or more). corners: (T, 4).
    """
    out = np.empty(len(corners), dtype=np.int8)
    if orientation3.signs(points, corners, orientation, 0.0, out):
        rows = np.flatnonzero(out == 0)
        mantissa, exponent = np.frexp(points[corners[rows], :3])
        whole = np.ldexp(mantissa, 53).astype(np.int64)  # a float is a whole number times a power of two
        shift = np.where(whole == 0, 0, exponent - np.where(whole == 0, 2000, exponent).min(axis=(1, 2), keepdims=True))
        for t, numbers, shifts in zip(rows.tolist(), whole.tolist(), shift.tolist(), strict=True):
            d, a, b, c = ([n << s for n, s in zip(*each, strict=True)] for each in zip(numbers, shifts, strict=True))
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ([p - q for p, q in zip(e, d, strict=True)] for e in (a, b, c))
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            out[t] = int(orientation[t]) * ((volume > 0) - (volume < 0))
    return out


def look(
    points: Floats, simplices: Tetrahedra, precision: Precision, bad: Flags, inverted: Flags, ratio: Floats
) -> int:
    """Writes what ``find_bad`` says of simplices, those of cells that may be bad between their corners as bad, too.

    points: (N, 3 or more) by places in memory. Returns how many are bad.
    """
    unit, grain, shapes = precision.unit, precision.grain, simplices.shapes
    left = find_bad(points, simplices.rows, simplices.orientation, unit, grain, bad, inverted, ratio, shapes)
    return int(left if shapes is None else find_bad_inside(points, simplices, unit, grain, bad, inverted))
