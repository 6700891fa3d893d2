"""PyMeshLab: Laplacian smoothing of the nodes that it does not find on the boundary."""

from __future__ import annotations

import numpy as np
import pymeshlab

from peers.peer import Plane


class Laplacian:
    def __init__(self, plane: Plane, cotangentweight: bool) -> None:
        self.cotangentweight = cotangentweight
        self.meshes = pymeshlab.MeshSet(verbose=False)
        self.meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=plane.space, face_matrix=plane.cells.astype(np.int32)))
        self.meshes.compute_selection_from_mesh_border()
        self.meshes.apply_selection_inverse(invfaces=False, invverts=True)

    def smooth(self, effort: int) -> None:
        self.meshes.apply_coord_laplacian_smoothing(
            stepsmoothnum=effort, cotangentweight=self.cotangentweight, selected=True
        )

    def points(self) -> np.ndarray:
        return self.meshes.current_mesh().vertex_matrix()

    def cells(self) -> np.ndarray:
        return self.meshes.current_mesh().face_matrix()
