"""MeshKernel: orthogonalization blended with smoothing; only nodes inside of a polygon move, so the boundary is held.

Without the polygon nodes of the boundary slide wherever orthogonality counts at all.
"""

from __future__ import annotations

import numpy as np
from meshkernel import GeometryList, Mesh2d, MeshKernel, OrthogonalizationParameters, ProjectToLandBoundaryOption

from peers.peer import Plane

MARGIN = 1e-9  # from the sides of the square to the polygon


class Orthogonalize:
    def __init__(self, plane: Plane, factor: float) -> None:
        tail, head = plane.edges
        count = len(plane.points)
        keys = np.unique(np.minimum(tail, head).astype(np.int64) * count + np.maximum(tail, head))
        edges = np.column_stack(np.divmod(keys, count)).astype(np.int32)
        x, y = plane.points.T.copy()
        self.kernel = MeshKernel()
        self.kernel.mesh2d_set(Mesh2d(x, y, edges.ravel()))
        low, high = MARGIN, 1.0 - MARGIN
        self.inside = GeometryList(np.array([low, high, high, low, low]), np.array([low, low, high, high, low]))
        self.factor = factor

    def smooth(self, effort: int) -> None:
        parameters = OrthogonalizationParameters(
            outer_iterations=effort, boundary_iterations=1, orthogonalization_to_smoothing_factor=self.factor,
            orthogonalization_to_smoothing_factor_at_boundary=self.factor,
        )  # fmt: skip
        self.kernel.mesh2d_compute_orthogonalization(
            ProjectToLandBoundaryOption.DO_NOT_PROJECT_TO_LANDBOUNDARY, parameters, GeometryList(), self.inside
        )

    def points(self) -> np.ndarray:
        mesh = self.kernel.mesh2d_get()
        return np.column_stack([mesh.node_x, mesh.node_y])

    def cells(self) -> None:
        return None
