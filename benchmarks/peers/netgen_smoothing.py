"""Netgen: the smoothing step ("m") of its optimisation of surface meshes, in a square that it knows.

Without a geometry its nodes stay where they are: it asks that for the normal.
"""

from __future__ import annotations

import netgen.meshing
import numpy as np
from netgen.geom2d import SplineGeometry

from peers.peer import Plane

netgen.meshing.SetMessageImportance(0)


class Smoothing:
    def __init__(self, plane: Plane, elsizeweight: float) -> None:
        self.elsizeweight = elsizeweight
        self.mesh, self.geometry = netgen.meshing.Mesh(dim=2), SplineGeometry()
        self.geometry.AddRectangle((0.0, 0.0), (1.0, 1.0))
        self.mesh.SetGeometry(self.geometry)
        self.mesh.Add(netgen.meshing.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
        self.mesh.AddPoints(plane.space)
        self.mesh.AddElements(dim=2, index=1, data=plane.cells.astype(np.int32), base=0)
        self.mesh.AddElements(dim=1, index=1, data=plane.segments, base=0)

    def smooth(self, effort: int) -> None:
        parameters = netgen.meshing.MeshingParameters(
            optimize2d="m", optsteps2d=effort, elsizeweight=self.elsizeweight, parallel_meshing=False
        )
        self.mesh.OptimizeMesh2d(parameters)

    def points(self) -> np.ndarray:
        return np.asarray(self.mesh.Coordinates())

    def cells(self) -> np.ndarray:
        return self.mesh.Elements2D().NumPy()["nodes"][:, :3].astype(np.int64) - 1
