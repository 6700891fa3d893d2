"""trimesh: filter_laplacian with the boundary's nodes pinned."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.smoothing import filter_laplacian, laplacian_calculation

from peers.peer import Plane


class Laplacian:
    def __init__(self, plane: Plane, lamb: float) -> None:
        self.lamb = lamb
        self.mesh = trimesh.Trimesh(plane.space, plane.cells, process=False, validate=False)
        self.operator = laplacian_calculation(self.mesh, pinned_vertices=np.flatnonzero(plane.held))

    def smooth(self, effort: int) -> None:
        filter_laplacian(
            self.mesh, lamb=self.lamb, iterations=effort, volume_constraint=False, laplacian_operator=self.operator
        )

    def points(self) -> np.ndarray:
        return np.asarray(self.mesh.vertices)

    def cells(self) -> np.ndarray:
        return np.asarray(self.mesh.faces)
