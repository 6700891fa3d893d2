"""The cells of a mesh as they are when they are measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex import cell_measures, shell_measures
from gmsnet.kernels.simplex import measures as kernels
from gmsnet.measure.signs import exact_signs
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of
from gmsnet.topology.ordering import planar_points, space_points
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasuredCells:
    """The triangles and quads of a mesh as they are when they are measured: nothing of it changes afterwards.

    points: (N, dim), read-only. plane, single: as of the Mesh. corners: (T, 3) and quads: (Q, 4), their orientations
    ±1. order: (C,) where each cell stands among the triangles and then the quads; None where there are no quads.
    """

    points: Floats
    plane: tuple[int, int] | None
    single: bool
    corners: NDArray[np.int32]
    orientation: NDArray[np.int8]
    quads: NDArray[np.int32]
    quad_orientation: NDArray[np.int8]
    order: NDArray[np.intp] | None

    names: tuple[str, ...] = ("min_angle", "max_angle", "shape", "aspect")  # of the columns
    symbol = "1/q"  # of the shape

    @property
    def counts(self) -> dict[str, int]:
        """How many cells of which kind."""
        quads = {} if self.order is None else {"quads": len(self.quads)}
        return {"triangles": len(self.corners), **quads}

    @classmethod
    def of(cls, mesh: Mesh, topology: Topology) -> tuple[MeasuredCells, NDArray[np.int64]]:
        """Those of a mesh, and the index of each among all its cells."""
        cell, order = topology.cell, None
        quads, quad_orientation = topology.quads, topology.quad_orientation
        if len(quads):
            cell = np.concatenate([cell, topology.quad_cell])
            order = np.argsort(cell, kind="stable")
            cell = cell[order]
        made = cls(
            mesh.points, mesh.plane, mesh.single, topology.triangles, topology.orientation, quads, quad_orientation,
            order,
        )  # fmt: skip
        return made, cell

    @cached_property
    def exponent(self) -> int:
        """See ``exponent_of``."""
        return exponent_of(self.points, self.plane, self.single)

    def columns(self, rows: NDArray[np.int32] | None = None) -> Floats:
        """Smallest and largest angle, shape and aspect of each: (4, C), or of some, the same bits; a quad has no aspect
        (nan)."""
        if self.order is None:
            if rows is None:
                return self._of_triangles(self.corners, self.orientation)
            return self._of_triangles(self.corners[rows], self.orientation[rows])
        quads = self._of_quads()
        quads[kernels.ASPECT] = np.nan  # where per_quad has the scaled Jacobian
        every = np.concatenate([self._of_triangles(self.corners, self.orientation), quads], axis=1)
        chosen: Floats = every[:, self.order if rows is None else self.order[rows]]
        return chosen

    def _of_triangles(self, corners: NDArray[np.int32], orientation: NDArray[np.int8]) -> Floats:
        columns = np.empty((4, len(corners)))
        if self.plane is None:
            largest = float(np.abs(self.points).max(initial=0.0))
            scaled = np.ldexp(self.points, -int(np.frexp(largest)[1]))
            kernels.per_surface_cell(scaled, corners, columns)
        else:
            kernels.per_cell(planar_points(self), corners, orientation, columns)
        return columns

    def _of_quads(self) -> Floats:
        found = np.empty((4, len(self.quads)))
        if self.plane is None:
            shell_measures.per_quad_in_space(space_points(self), self.quads, self.quad_orientation, found)
        else:
            cell_measures.per_quad(planar_points(self), self.quads, self.quad_orientation, found)
        return found

    def scaled_jacobian(self) -> Floats:
        """(C,) the least of D/(|e₁||e₂|) over the corners of each, of a triangle times 2/√3."""
        low, high, shape, _ = self._of_triangles(self.corners, self.orientation)
        least = np.minimum(np.sin(np.radians(low)), np.sin(np.radians(high)))  # each angle lies between the two
        scaled: Floats = np.copysign(least * (2.0 / np.sqrt(3.0)), shape)
        if self.order is None:
            return scaled
        both: Floats = np.concatenate([scaled, self._of_quads()[cell_measures.SCALED_JACOBIAN]])
        ordered: Floats = both[self.order]
        return ordered

    def signs(self) -> NDArray[np.int8]:
        """(C,) the exact sign of each cell's area, of a quad's least corner."""
        points = planar_points(self)
        signs = exact_signs(points, self.corners, self.orientation)
        if self.order is None:
            return signs
        corners = np.concatenate([np.roll(self.quads, -k, axis=1)[:, [0, 1, 3]] for k in range(4)])
        of_corners = exact_signs(points, corners, np.tile(self.quad_orientation, 4)).reshape(4, -1)
        return np.concatenate([signs, of_corners.min(axis=0)])[self.order]

    def centres(self) -> Floats:
        """(C, dim) the mean of the corners of each."""
        third = self.points / 3.0  # before the sum, lest that overflow
        a, b, c = (np.take(third, corner, axis=0) for corner in self.corners.T)
        centres = np.asarray(a + b + c)
        if self.order is None:
            return centres
        return np.concatenate([centres, (self.points / 4.0)[self.quads].sum(axis=1)])[self.order]
