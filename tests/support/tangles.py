"""Tangled meshes with a known way out, or a known reason why there is none."""

from __future__ import annotations

import numpy as np

from gmsnet import CellBlock, Mesh
from gmsnet.kernels.star.guard import Precision
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology
from gmsnet.untangle import untangle


def mesh_of(points, triangles, *, single=False):
    triangles = np.asarray(triangles)
    return Mesh(np.asarray(points, dtype=float), (CellBlock("triangle", triangles, np.zeros(len(triangles), int)),),
                single=single)  # fmt: skip


def grid(n, *, offset=0.0, single=False):
    """(n + 1)² nodes of the unit square, two triangles a cell."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    points = np.column_stack([i.ravel(), j.ravel()]) / n + offset
    a = (i[:-1, :-1] * (n + 1) + j[:-1, :-1]).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    return mesh_of(points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]), single=single)


def annulus(rings, nodes, degrees, inner=0.4):
    """Circles of nodes from radius ``inner`` to 1, the innermost, a boundary, turned against the others."""
    angle = 2 * np.pi * np.arange(nodes) / nodes
    points, triangles = [], []
    for i in range(rings):
        radius = inner + (1 - inner) * i / (rings - 1)
        turned = angle + (i % 2) * np.pi / nodes + (np.radians(degrees) if i == 0 else 0.0)
        points.append(radius * np.column_stack([np.cos(turned), np.sin(turned)]))
    for i in range(rings - 1):
        for j in range(nodes):
            a, b = i * nodes + j, i * nodes + (j + 1) % nodes
            c, d = a + nodes, b + nodes
            triangles += [(a, c, b), (b, c, d)] if i % 2 == 0 else [(a, c, d), (a, d, b)]
    return mesh_of(np.vstack(points), triangles)


def moved(mesh, nodes, places):
    points = mesh.points.copy()
    points[nodes, :2] = places
    return mesh.with_points(points)


def prepared(mesh, topology=None):
    """Points in memory order, topology and precision of a mesh."""
    topology = topology or Topology.of(mesh)
    precision = Precision.of(single=mesh.single, exponent=mesh.exponent)
    return planar_points(mesh)[topology.memory], topology, precision


def untangled(mesh, topology=None):
    """The result, with points, topology and precision."""
    points, topology, precision = prepared(mesh, topology)
    return untangle(points, topology, precision), points, topology, precision


def quad_grid(n, triangles=0.0, seed=0):
    """(n + 1)² nodes of the unit square; this share of its cells, chosen at random, is two triangles, the rest quads.

    Half of the cells are wound clockwise.
    """
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    a = (i[:-1, :-1] * (n + 1) + j[:-1, :-1]).ravel()
    quads = np.column_stack([a, a + n + 1, a + n + 2, a + 1])
    split = rng.random(len(quads)) < triangles
    halves = np.concatenate([quads[split][:, [0, 1, 2]], quads[split][:, [0, 2, 3]]])
    blocks = []
    for kind, cells in (("quad", quads[~split]), ("triangle", halves)):
        turned = rng.random(len(cells)) < 0.5
        cells[turned] = cells[turned, ::-1]
        blocks.append(CellBlock(kind, cells, np.zeros(len(cells), int)))
    return Mesh(np.column_stack([i.ravel(), j.ravel()]) / n, tuple(block for block in blocks if len(block.nodes)))


def thrown(mesh, nodes, length, seed=0):
    """Each of the nodes is thrown this far, in a random direction."""
    angle = 2 * np.pi * np.random.default_rng(seed).random(len(nodes))
    shift = length * np.column_stack([np.cos(angle), np.sin(angle)])
    return moved(mesh, nodes, mesh.points[nodes, :2] + shift)
