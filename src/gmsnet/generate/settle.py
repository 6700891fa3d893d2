"""Nodes moved to the middles of their neighbours, a few times over: how meshing software ends its work."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import whole_number
from gmsnet.generate.delaunay import unique_edges
from gmsnet.generate.disturb import keep_orientation
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]


def settle(mesh: Mesh, sweeps: int) -> Mesh:
    """The mesh after so many sweeps of Laplacian smoothing, all nodes at once; those of line cells stand still.

    Shifts are halved where they would change the orientation of a triangle. The first cells must be triangles in the
    plane (N × 2). For meshes that are to be the same whatever becomes of the smoothers of ``gmsnet.methods``.
    """
    whole_number(sweeps, "the number of sweeps", 0)
    if mesh.cells[0].kind != "triangle" or mesh.points.shape[1] != 2:
        raise InputError("only meshes of triangles in the plane (N × 2) can settle")
    triangles = mesh.cells[0].nodes
    edges = unique_edges(triangles)
    both = np.concatenate([edges, edges[:, ::-1]])
    degree = np.bincount(both[:, 0], minlength=len(mesh.points))
    held = degree == 0
    for block in mesh.cells[1:]:
        held[block.nodes] = True
    points = mesh.points.copy()
    for _ in range(sweeps):
        sums = [np.bincount(both[:, 0], points[both[:, 1], axis], minlength=len(points)) for axis in range(2)]
        shift = np.column_stack(sums) / np.maximum(degree, 1)[:, None] - points
        shift[held] = 0.0
        keep_orientation(points, shift, triangles, single=False)
        points = np.where(shift != 0, points + shift, points)
    return mesh.with_points(points)
