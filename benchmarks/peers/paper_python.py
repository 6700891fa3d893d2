"""The setting of the paper's timings: plain Python, one node after the other, the network in PyTorch (gmsnet.paper)."""

from __future__ import annotations

import numpy as np

from gmsnet.mesh.adapters import to_mesh
from gmsnet.paper import plain
from peers.peer import Plane


class Python:
    def __init__(self, plane: Plane, move: str) -> None:
        mesh, _ = to_mesh((plane.points, plane.cells))
        self.mesh = plain.PlainMesh.of(mesh)
        if move == "gmsnet":
            from gmsnet.paper import plain_torch  # PyTorch is needed for this one only

            self.move = plain_torch.gmsnet()
        else:
            self.move = getattr(plain, move)

    def smooth(self, effort: int) -> None:
        for _ in range(effort):
            plain.sweep(self.mesh, self.move)

    def points(self) -> np.ndarray:
        return self.mesh.array()

    def cells(self) -> None:
        return None
