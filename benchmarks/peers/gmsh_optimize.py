"""Gmsh: Relocate2D and Laplace2D. The mesh is that of a plane surface that it knows, with parameters for all nodes."""

from __future__ import annotations

import gmsh
import numpy as np

from peers.peer import Plane

LINE, TRIANGLE, QUAD = 1, 2, 3
CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("General.NumThreads", 1)
gmsh.option.setNumber("Mesh.Renumber", 0)


class Optimize:
    def __init__(self, plane: Plane, method: str) -> None:
        self.method, self.mixed = method, len(plane.quads) > 0
        gmsh.clear()
        geometry, mesh = gmsh.model.geo, gmsh.model.mesh
        ends = [geometry.addPoint(x, y, 0.0) for x, y in CORNERS]
        sides = [geometry.addLine(ends[k], ends[(k + 1) % 4]) for k in range(4)]
        self.surface = geometry.addPlaneSurface([geometry.addCurveLoop(sides)])
        geometry.synchronize()
        points, tags = plane.space, np.arange(1, len(plane.points) + 1)
        bounding = np.unique(plane.segments)
        for k, corner in enumerate(CORNERS):
            node = bounding[(plane.points[bounding] == corner).all(axis=1)]
            mesh.addNodes(0, ends[k], tags[node], points[node].ravel())
        for k, side in enumerate(sides):
            along, across = k % 2, 1 - k % 2
            parameter = plane.points[:, along] if k < 2 else 1.0 - plane.points[:, along]
            on = plane.points[:, across] == CORNERS[k][across]
            inner = bounding[on[bounding] & (parameter[bounding] > 0.0) & (parameter[bounding] < 1.0)]
            mesh.addNodes(1, side, tags[inner], points[inner].ravel(), parameter[inner])
            mesh.addElementsByType(side, LINE, [], tags[plane.segments[on[plane.segments].all(axis=1)]].ravel())
        inner = np.flatnonzero(~plane.held)
        places = points[inner].ravel()
        mesh.addNodes(2, self.surface, tags[inner], places, gmsh.model.getParametrization(2, self.surface, places))
        for kind, cells in ((TRIANGLE, plane.cells), (QUAD, plane.quads)):
            if len(cells):
                mesh.addElementsByType(self.surface, kind, [], tags[cells].ravel())

    def smooth(self, effort: int) -> None:
        gmsh.model.mesh.optimize(self.method, niter=effort)

    def points(self) -> np.ndarray:
        tags, places, _ = gmsh.model.mesh.getNodes()
        points = np.empty((len(tags), 3))
        points[tags.astype(np.int64) - 1] = places.reshape(-1, 3)
        return points

    def cells(self) -> np.ndarray | None:
        if self.mixed:
            return None
        return gmsh.model.mesh.getElementsByType(TRIANGLE, self.surface)[1].astype(np.int64).reshape(-1, 3) - 1
