"""What the nodes of a surface mesh slide on, and on which side its cells show: the mesh itself, as it is given.

Smooth nodes always slide on their patch; nodes of feature curves only where they are asked to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets, surface_itself
from gmsnet.constraints.features import lengths_of, may_slide
from gmsnet.constraints.outline import Flags
from gmsnet.constraints.patches import Patches, patches_of
from gmsnet.constraints.smooth_patches import Vertices
from gmsnet.kernels.whole import facets as kernels
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import space_points
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]

FEATURE = "feature of the surface"  # why nodes of sharp edges are held
SAME = 2e-6  # of the longest side of the box: so far apart may be what would be one point but for rounding


def patches_of_surface(
    mesh: Mesh, topology: Topology, names: Sequence[str] | None, feature_angle: float, held: Flags,
    free_needles: Flags | bool = False,
) -> tuple[Facets, Patches]:  # fmt: skip
    """The facets of a mesh in no plane and its patches; which of its nodes slide: (N,) by id.

    names: of the markers whose nodes slide along curves: as ``check_slide`` gives them. held: (N,) bool. free_needles:
    see ``patches_of``.
    """
    facets = surface_itself(mesh, topology)
    points = space_points(mesh)[:, :3].copy()
    patches = patches_of(facets, points, feature_angle, mesh.single, ~held, free_needles)
    along = patches.curves.slides & may_slide(mesh, names, held)
    return facets, replace(patches, curves=replace(patches.curves, slides=along))


def torn_apart(points: Floats, rim: NDArray[np.int64] | NDArray[np.int32] | None) -> Flags:
    """(N,) bool, the nodes of the boundary, given by ids, at which there is another one of these, to rounding."""
    found = np.zeros(len(points), dtype=bool)
    if rim is not None and len(rim) > 1:
        from scipy.spatial import cKDTree  # it takes a tenth of a second to import

        at = points[rim]
        near = SAME * np.ptp(at, axis=0).max() + 4.0 * np.spacing(abs(at).max())
        found[rim] = cKDTree(at).query(at, k=[2], distance_upper_bound=near)[0][:, 0] <= near
    return found


def sides_of(mesh: Mesh, topology: Topology, patches: Patches, vertices: Vertices) -> NDArray[np.float32]:
    """(S, 3) the vector n of each row of ``topology.near`` (kernels.star.shell). vertices: see ``vertices_of``.

    Of a triangle, its own normal, or where it has none the mean of the reference's at its corners; of a quad the normal
    of its diagonals.
    """
    points = space_points(mesh)[:, :3]
    triangles = len(topology.triangles)
    of_triangles = np.empty((triangles, 3))
    kernels.own_sides(patches.unit, vertices.own, vertices.table, of_triangles)
    if np.array_equal(topology.face_cell, topology.cell):
        return of_triangles.astype(np.float32)[topology.near_origin]
    quads = points[topology.quads]
    of_quads = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]) * topology.quad_orientation[:, None]
    sides = np.zeros((len(topology.face_cell), 3))
    sides[np.searchsorted(topology.face_cell, topology.cell)] = of_triangles
    sides[np.searchsorted(topology.face_cell, topology.quad_cell)] = _unit(of_quads)
    face = topology.near_origin if topology.near_cells is None else topology.near_origin[topology.near_cells]
    return sides[face].astype(np.float32)


def _unit(vectors: Floats) -> Floats:
    """Of length 1, or 0."""
    length = lengths_of(vectors)[:, None]
    unit: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return unit
