"""MeshLib: relax, of all nodes that it does not find on the boundary. Coordinates are in single precision."""

from __future__ import annotations

import numpy as np
from meshlib import mrmeshnumpy, mrmeshpy

from peers.peer import Plane


class Relax:
    def __init__(self, plane: Plane, force: float) -> None:
        self.mesh = mrmeshnumpy.meshFromFacesVerts(plane.cells.astype(np.int32), plane.space)
        topology = self.mesh.topology
        self.parameters = mrmeshpy.MeshRelaxParams()
        self.parameters.force = force
        self.region = topology.getValidVerts() - topology.findBdVerts()  # the parameters keep a reference only
        self.parameters.region = self.region

    def smooth(self, effort: int) -> None:
        self.parameters.iterations = effort
        mrmeshpy.relax(self.mesh, self.parameters)

    def points(self) -> np.ndarray:
        return mrmeshnumpy.getNumpyVerts(self.mesh)

    def cells(self) -> np.ndarray:
        return mrmeshnumpy.getNumpyFaces(self.mesh.topology)
