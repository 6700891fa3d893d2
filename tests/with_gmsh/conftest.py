"""Live models of Gmsh, which is left as it was found."""

from __future__ import annotations

import numpy as np
import pytest
from support.optional import library


@pytest.fixture
def gmsh():
    """The module, initialised, with an empty model; skipped where Gmsh is not installed, or lacks its libraries."""
    gmsh = library("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def plate(gmsh, size=0.1, kernel="occ", recombine=0.0, order=1):
    """A unit square with a round hole of radius 0.2 in the middle, meshed."""
    gmsh.model.add("plate")
    if kernel == "occ":
        maker = gmsh.model.occ
        maker.cut([(2, maker.addRectangle(0, 0, 0, 1, 1))], [(2, maker.addDisk(0.5, 0.5, 0, 0.2, 0.2))])
    else:
        maker = gmsh.model.geo
        corners = [maker.addPoint(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        centre = maker.addPoint(0.5, 0.5, 0)
        ring = [maker.addPoint(0.5 + 0.2 * x, 0.5 + 0.2 * y, 0) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        outer = [maker.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        inner = [maker.addCircleArc(a, centre, b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        maker.addPlaneSurface([maker.addCurveLoop(outer), maker.addCurveLoop(inner)])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    if recombine:
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1 if recombine == 45.0 else 0)
        gmsh.model.mesh.setRecombine(2, gmsh.model.getEntities(2)[0][1], recombine)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)


def ball_in_box(gmsh, size=0.25):
    """A unit cube with a round hole of radius 0.25 in the middle, meshed with tetrahedra."""
    gmsh.model.add("box")
    maker = gmsh.model.occ
    maker.cut([(3, maker.addBox(0, 0, 0, 1, 1, 1))], [(3, maker.addSphere(0.5, 0.5, 0.5, 0.25))])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)


def throw(gmsh, dimension, far, axes=2, seed=0):
    """Throws the nodes inside the entities of a dimension out of their places."""
    rng = np.random.default_rng(seed)
    for dim, tag in gmsh.model.getEntities(dimension):
        tags, places, _ = gmsh.model.mesh.getNodes(dim, tag)
        new = places.reshape(-1, 3).copy()
        new[:, :axes] += far * rng.normal(size=(len(new), axes))
        for node, place in zip(tags.tolist(), new, strict=True):
            gmsh.model.mesh.setNode(node, place, [])


def places(gmsh):
    """Tags in ascending order, and the coordinates (N, 3) of all nodes."""
    tags, points, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    return tags[order].astype(np.int64), points.reshape(-1, 3)[order]


def inside(gmsh, dimension):
    """The tags of the nodes that lie inside entities of a dimension."""
    return np.concatenate([gmsh.model.mesh.getNodes(d, t)[0] for d, t in gmsh.model.getEntities(dimension)])
