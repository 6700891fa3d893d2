"""Meshes of shapes that formulas describe, and their nodes thrown out of place along them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.shapes import Shape, tangents
from gmsnet.errors import InputError
from gmsnet.generate.arguments import one_of, positive
from gmsnet.generate.disturb import EDGES, corner_triangles, edge_lengths, edges_of, orientations, random_directions
from gmsnet.generate.random import generator
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_HALVINGS = 60


class Shaped(NamedTuple):
    """A mesh and the true shape of its faces.

    faces: name of a region of facets → its shape. Facets are seen from outside, where normals point. Nodes of two
    regions lie on the features between them.
    """

    mesh: Mesh
    faces: Mapping[str, Shape]


def faced(points: Floats, rings: Mapping[str, Ints], faces: Mapping[str, Shape], regions: Mapping[str, Ints]) -> Shaped:
    """A surface. rings: kind of cell → nodes. regions: kind → the number of the face of each cell, from 0."""
    blocks = tuple(CellBlock(kind, nodes, regions[kind] + 1) for kind, nodes in rings.items())
    return Shaped(Mesh(points, blocks, {(2, k): name for k, name in enumerate(faces, start=1)}), faces)


def disturb_on(shaped: Shaped, amount: float, *, seed: int = 0, keep_valid: bool = True, edge: str = "mean") -> Shaped:
    """The mesh with its nodes thrown to random places: those inside of a face along it, others inside of volumes.

    Nodes of two faces or more stay. amount: radius of the disc or ball in which nodes land, in lengths of the node's
    edges. edge: which length, "mean" or "shortest". keep_valid: halve throws until no corner of a facet turns away from
    its face and no cell is inverted. All nodes end on the true shape.

    Raises InputError for an amount that is not positive and for another ``edge``.
    """
    mesh, faces = shaped.mesh, list(shaped.faces.values())
    amount = positive(amount, "the amount of a disturbance")
    one_of(edge, "edge", EDGES)
    old = mesh.points
    triangles, of = _facets(mesh)
    on, still = _face_of_nodes(mesh, len(faces))
    edges = np.concatenate(
        [edges_of(block) for block in mesh.cells if block.dimension == (3 if mesh.has_volumes else 2)]
    )
    rng = generator(seed)
    throw = random_directions(len(old), 3, rng)
    flat = random_directions(len(old), 2, rng)
    for k, face in enumerate(faces):
        rows = np.flatnonzero(on == k)
        u, v = tangents(face.normal(old[rows]))
        throw[rows] = flat[rows, :1] * u + flat[rows, 1:] * v
    shift = throw * (amount * edge_lengths(old, edges, edge))[:, None]
    shift[still] = 0.0
    cells = [block.nodes for block in mesh.cells if block.dimension == 3]
    for halving in range(MOST_HALVINGS + 1):
        new = _landed(old, shift, on, faces)
        bad = _broken(new, triangles, of, faces, cells) if keep_valid else np.zeros(0, dtype=np.int64)
        if not len(bad):
            return Shaped(mesh.with_points(new), shaped.faces)
        shift[bad] *= 0.5 if halving < MOST_HALVINGS - 1 else 0.0
    raise InputError("the mesh has facets that are turned away from their face, or inverted cells, already")


def _landed(old: Floats, shift: Floats, on: Ints, faces: list[Shape]) -> Floats:
    new = old + shift
    thrown = (shift != 0.0).any(axis=1)
    for k, face in enumerate(faces):
        rows = np.flatnonzero((on == k) & thrown)
        new[rows] = face.project(new[rows])
    return new


def _facets(mesh: Mesh) -> tuple[Ints, Ints]:
    """The triangles at the corners of all facets, and the face of each."""
    triangles, of = [], []
    for block in mesh.cells:
        if block.dimension == 2:
            ring = block.nodes[:, : block.corners]
            corners = corner_triangles([ring])
            triangles.append(corners)
            of.append(np.tile(block.regions - 1, len(corners) // max(len(ring), 1)))
    return np.concatenate(triangles), np.concatenate(of)


def _face_of_nodes(mesh: Mesh, faces: int) -> tuple[Ints, NDArray[np.bool_]]:
    """The only face that each node lies on, else −1, and whether it lies on several."""
    on = np.zeros((faces, len(mesh.points)), dtype=bool)
    for block in mesh.cells:
        if block.dimension == 2:
            on[np.repeat(block.regions - 1, block.nodes.shape[1]), block.nodes.ravel()] = True
    count = on.sum(axis=0)
    return np.where(count == 1, on.argmax(axis=0), -1), count > 1


def _broken(points: Floats, triangles: Ints, of: Ints, faces: list[Shape], cells: list[Ints]) -> Ints:
    """The nodes of facets that are turned away from their face, and of inverted cells."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal, centre = np.cross(b - a, c - a), (a + b + c) / 3.0
    along = np.zeros(len(triangles))
    for k, face in enumerate(faces):
        rows = np.flatnonzero(of == k)
        along[rows] = (normal[rows] * face.normal(face.project(centre[rows]))).sum(axis=1)
    bad = [triangles[along <= 0.0].ravel()]
    bad += [nodes[orientations(points, nodes) <= 0].ravel() for nodes in cells]
    found: Ints = sorted_unique(np.concatenate(bad))
    return found
