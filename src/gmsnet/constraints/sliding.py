"""The nodes of one run that slide: which, on what, and by how much the areas that their curves enclose change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.area import Borders, area_changes, borders_of
from gmsnet.constraints.constraints import constraint_of
from gmsnet.constraints.features import Curves, curves_of
from gmsnet.constraints.geometry import Geometry
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.surface import Surface
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]
REASON = "node of a curve that slides"  # why such nodes stand still while cells are untangled


@dataclass(frozen=True, eq=False)
class Rails:
    """What nodes slide on, for kernels alone: what that changes is told elsewhere."""

    constraint: Constraint | Surface


@dataclass(frozen=True, eq=False)
class Sliding:
    """curves: of the mesh. borders: of its regions. start: (N, 2) planar points of the input by ids.

    exponent: they are divided by this power of two. nodes: (N,) bool by ids, those that slide. constraint: for the
    kernels; None where no node slides.
    """

    curves: Curves
    borders: Borders
    start: NDArray[np.float64]
    exponent: int
    nodes: Flags
    constraint: Constraint | None

    @classmethod
    def of(
        cls, mesh: Mesh, curves: Curves, memory: NDArray[np.int32], free: NDArray[np.int32],
        geometry: Geometry | None, bounded_at: Flags | None = None,
    ) -> Sliding:  # fmt: skip
        """Of a mesh and its curves; memory, free: of its topology. bounded_at: see ``outline.sides``.

        Raises InputError for a geometry that does not fit the mesh.
        """
        points = planar_points(mesh)
        nodes = np.zeros(len(points), dtype=bool)
        nodes[free] = True
        nodes &= curves.slides
        constraint = constraint_of(curves, points, memory, mesh.single, geometry, mesh.exponent)
        borders = borders_of(mesh, points, bounded_at)
        return cls(curves, borders, points, mesh.exponent, nodes, constraint if nodes.any() else None)

    def note(self, mesh: Mesh, moved: Flags) -> str:
        """What to say of it. mesh: as it has become. moved: (N,) bool."""
        if self.constraint is None:
            return "slide: no node of a boundary, interface or marker can move along a curve"
        slid, curves = int((self.nodes & moved).sum()), len(np.unique(self.curves.curve[self.nodes]))
        points = np.ldexp(planar_points(mesh), mesh.exponent - self.exponent)  # the two may differ
        change = float(np.abs(area_changes(self.borders, self.start, points)).max(initial=0.0))
        return (
            f"slide: {slid:,} of {int(self.nodes.sum()):,} nodes have moved along {curves:,} "
            f"curve{'s' if curves != 1 else ''}; the area of no region changes by more than {change:.2g} of itself"
        )


def sliding_in_plane(
    mesh: Mesh, slide: Any, feature_angle: float, fixed: Flags, geometry: Geometry | None, threads: int = 1,
    bounded_at: Flags | None = None,
) -> tuple[Topology, NDArray[np.float64], Sliding | None]:  # fmt: skip
    """The connectivity of a planar mesh, its ``near_points``, and what its nodes slide on; None where none is to.

    fixed: (N,) bool, nodes that stay. bounded_at: see ``outline.sides``.
    """
    if slide is None or slide is False:
        return *Topology.and_points(mesh, fixed, threads), None
    curves = curves_of(mesh, slide, feature_angle, fixed, bounded_at)
    topology, near = Topology.and_points(mesh, fixed, threads, curves.slides)
    return topology, near, Sliding.of(mesh, curves, topology.memory, topology.free, geometry, bounded_at)
