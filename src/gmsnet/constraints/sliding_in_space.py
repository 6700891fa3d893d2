"""The nodes of one run that slide on the boundary of a volume, and what that changes of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets, boundary_of, diagonals_apart, edge_lengths
from gmsnet.constraints.features import may_slide, rounding_of
from gmsnet.constraints.geometry import Geometry
from gmsnet.constraints.on_geometry import OnGeometry
from gmsnet.constraints.on_surface import surface_of
from gmsnet.constraints.options import APART_IN_VOLUMES, APART_ON_SURFACES, FEATURE_ANGLE
from gmsnet.constraints.outline import Flags
from gmsnet.constraints.patches import Patches, patches_of
from gmsnet.constraints.smooth_patches import Vertices
from gmsnet.kernels.star.off_surface import farthest
from gmsnet.kernels.star.surface import Surface
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.mixed_volume import volume_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.polygons import Ints
from gmsnet.topology.solids import WoundSolids
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import Wound

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurfaceSliding:
    """facets, patches: of the boundary. start: (N, 3) points of the input by ids, over 2 to the power of ``exponent``.

    memory: (N,) ids in memory order. nodes: (N,) bool by ids, those that slide. constraint: for the kernels; None where
    no node slides. mended: were folds taken out of the input's facets before?
    """

    facets: Facets
    patches: Patches
    start: Floats
    exponent: int
    memory: Ints
    nodes: Flags
    constraint: Surface | None
    mended: bool = False

    @classmethod
    def of(
        cls, mesh: Mesh, facets: Facets, patches: Patches, memory: Ints, free: Ints, tolerance: float = math.inf,
        geometry: Geometry | None = None, vertices: Vertices | None = None, hausdorff: float | None = None,
        mended: bool = False,
    ) -> SurfaceSliding:  # fmt: skip
        """Of a mesh and the patches of its boundary; memory, free: of its topology.

        tolerance: how far from the facets nodes may go, over the mean length of their edges. geometry: their
        true shape, which is asked once. vertices: see ``surface_of``. hausdorff: how far facets may go from them, over
        the diagonal of the box around all; None: see constraints.options, and as far as they go with a geometry.
        """
        points = space_points(mesh)[:, :3].copy()
        nodes = np.zeros(len(points), dtype=bool)
        nodes[free] = True
        nodes &= patches.slides | patches.curves.slides
        # What quadrilaterals are warped by is not taken off: nodes would go to chords then, and round bodies shrink.
        limit = tolerance * edge_lengths(facets, points, mesh) if tolerance < math.inf else None
        bound = math.inf
        if hausdorff is None and geometry is None and limit is not None:
            share = APART_IN_VOLUMES if facets.closed else APART_ON_SURFACES
            bound = max(facets.bound(points, share), float(limit[nodes].max(initial=0.0)))
        if hausdorff is not None:
            bound = facets.bound(points, hausdorff)
            limit = np.minimum(np.inf if limit is None else limit, np.full(len(points), bound))
        on = None if geometry is None else OnGeometry(geometry, facets, mesh.exponent)
        constraint = None
        if nodes.any():
            constraint = surface_of(patches, points, memory, mesh.single, limit, on, facets.closed, vertices, bound)
        return cls(facets, patches, points, mesh.exponent, memory, nodes, constraint, mended)

    def note(self, mesh: Mesh, moved: Flags) -> str:
        """What to say of it. mesh: as it has become. moved: (N,) bool."""
        closed = self.facets.closed
        if self.constraint is None:
            return "slide: no node of the boundary can move along it" if closed else "surface: no node can move on it"
        points = np.ldexp(mesh.points, -self.exponent)  # its own exponent may differ
        away = farthest(self.constraint, points[self.memory], moved[self.memory])
        of = "the facets as mended" if self.mended else "the input's facets"
        said = (
            f"{'slide' if closed else 'surface'}: {int((self.nodes & moved).sum()):,} of {int(self.nodes.sum()):,} "
            f"nodes have moved {'along the boundary' if closed else 'on it'}, at most {away:.2g} of an edge from {of}"
        )
        count, angle = self.patches.alone
        if count:
            said += (
                f"; {count:,} nodes do not, for they are at edges that bend by less than {angle:g}°, three in a row at "
                f"most, as uneven nodes make them on a curved surface: a feature angle of {angle:g} lets them"
            )
        if not closed:
            return said
        before, after = enclosed(self.start, self.facets), enclosed(points, self.facets)
        change = abs(after - before) / abs(before) if before else 0.0
        return f"{said}; the volume changes by {change:.2g} of itself"


def enclosed(points: Floats, facets: Facets) -> float:
    """The volume that facets enclose."""
    corners = points[facets.rows]
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def sliding_volume(
    mesh: Mesh, wound: Wound | WoundSolids, names: Sequence[str] | None, feature_angle: float, held: Flags | None,
    tolerance: float, geometry: Geometry | None, hausdorff: float | None = None, threads: int = 1,
) -> tuple[Volume, SurfaceSliding | None]:  # fmt: skip
    """The connectivity of a mesh of volumes, and what nodes of its boundary slide on; None where no node is to.

    names, held, tolerance: see ``patches_to_slide_on``. geometry, hausdorff: see ``SurfaceSliding.of``.
    """
    surface = patches_to_slide_on(mesh, wound, names, feature_angle, held, tolerance)
    if surface is None:
        return volume_of(wound, None, threads), None
    topology = volume_of(wound, surface[1].slides | surface[1].curves.slides, threads)
    sliding = SurfaceSliding.of(
        mesh, *surface, topology.memory, topology.free, tolerance, geometry, hausdorff=hausdorff
    )
    return topology, sliding


def patches_to_slide_on(
    mesh: Mesh, wound: Wound | WoundSolids, names: Sequence[str] | None, feature_angle: float = FEATURE_ANGLE,
    held: Flags | None = None, tolerance: float = math.inf,
) -> tuple[Facets, Patches] | None:  # fmt: skip
    """The boundary of a mesh of volumes and its patches; None where no node is to slide.

    names: as ``check_slide`` gives them. held: (N,) bool. tolerance: as of SurfaceSliding. Nodes stay where
    quadrilaterals are warped by more: the diagonals pass each other at a greater distance.
    """
    if names == ():
        return None
    facets = boundary_of(mesh, wound)
    points = space_points(mesh)[:, :3].copy()
    may = may_slide(mesh, names, held)
    if facets.halves and tolerance < math.inf:
        room = tolerance * edge_lengths(facets, points, mesh) + rounding_of(points, mesh.single)
        may &= diagonals_apart(facets, points) <= room
    return facets, patches_of(facets, points, feature_angle, mesh.single, may)
