"""L-BFGS over all free nodes at once on the mean of q², a barrier: benchmarks/barrier.py, compiled by Numba."""

from __future__ import annotations

import numpy as np
from barrier import minimise
from corners import Corners
from reference import Plane as Whole

from gmsnet.mesh.adapters import to_mesh
from gmsnet.topology.ordering import planar_points
from peers.mixed import mesh_of
from peers.peer import Plane


class Lbfgs:
    def __init__(self, plane: Plane, power: int) -> None:
        self.power = power
        if len(plane.quads):
            self.whole = Corners.of(mesh_of(plane))
            self.start = planar_points(self.whole.mesh)
        else:
            self.whole = Whole.of(to_mesh((plane.points, plane.cells))[0])
            self.start = self.whole.start

    def smooth(self, effort: int) -> None:
        self.end = minimise(self.whole.problem, self.start, self.power, most=effort).points

    def points(self) -> np.ndarray:
        return self.whole.written(self.end)

    def cells(self) -> None:
        return None
