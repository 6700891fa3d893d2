"""Mmg (mmgpy): mmg2d with neither insertion nor swaps, its only means then being to move nodes; pass after pass."""

from __future__ import annotations

import mmgpy
import numpy as np

from peers.peer import Plane


class Moves:
    def __init__(self, plane: Plane, **options: int) -> None:
        self.options = options
        self.mesh = mmgpy.MmgMesh2D()
        segments = plane.segments
        self.mesh.set_mesh_size(vertices=len(plane.points), triangles=len(plane.cells), edges=len(segments))
        self.mesh.set_vertices(plane.points)
        self.mesh.set_triangles(plane.cells.astype(np.int32))
        self.mesh.set_edges(segments)
        self.mesh.set_required_edges(np.arange(len(segments), dtype=np.int32))
        self.mesh.set_required_vertices(np.flatnonzero(plane.held).astype(np.int32))

    def smooth(self, effort: int) -> None:
        for _ in range(effort):
            self.mesh.remesh(verbose=-1, **self.options)

    def points(self) -> np.ndarray:
        return np.asarray(self.mesh.get_vertices())

    def cells(self) -> np.ndarray:
        return np.asarray(self.mesh.get_triangles())
