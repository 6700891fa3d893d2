"""L-BFGS over all free nodes at once on the mean of q², a barrier: benchmarks/barrier.py, compiled by Numba."""

from __future__ import annotations

import numpy as np
from barrier import minimise
from reference import Plane as Whole

from gmsnet.mesh.adapters import to_mesh
from peers.peer import Plane


class Lbfgs:
    def __init__(self, plane: Plane, power: int) -> None:
        mesh, _ = to_mesh((plane.points, plane.cells))
        self.whole, self.power = Whole.of(mesh), power

    def smooth(self, effort: int) -> None:
        self.end = minimise(self.whole.problem, self.whole.start, self.power, most=effort).points

    def points(self) -> np.ndarray:
        return self.whole.written(self.end)

    def cells(self) -> None:
        return None
