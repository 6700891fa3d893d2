"""Meshes of surfaces in space for tests: a sphere, a bent sheet and a box, thrown along them; and meshes in halves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from support.surfaces import sphere


def surface_mesh(points, cells, single=False):
    """A mesh of cells, kind → rows, in one region."""
    blocks = (
        CellBlock(kind, np.asarray(rows, dtype=np.int32), np.zeros(len(rows), dtype=np.int64))
        for kind, rows in cells.items()
        if len(rows)
    )
    return Mesh(points, tuple(blocks), single=single)


def ball(count=400, seed=0, amount=0.3):
    """The unit sphere, its nodes thrown along it."""
    points, rows = sphere(count, seed)
    rng = np.random.default_rng(seed)
    points = points + amount * math.sqrt(4.0 * math.pi / count) * rng.uniform(-1.0, 1.0, points.shape)
    points /= np.linalg.norm(points, axis=1)[:, None]
    return surface_mesh(points, {"triangle": rows})


def wavy(side=16, seed=0, amount=0.3, kind="quad"):
    """A sheet that is bent both ways, its inner nodes thrown along it."""
    k = np.arange(side + 1)
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(k, k, indexing="ij"))
    inner = (x > 0) & (x < side) & (y > 0) & (y < side)
    rng = np.random.default_rng(seed)
    x[inner] += amount * rng.uniform(-1, 1, inner.sum())
    y[inner] += amount * rng.uniform(-1, 1, inner.sum())
    points = np.column_stack([x, y, 1.5 * np.sin(x / 5.0) * np.cos(y / 6.0)])
    corner = (k[:-1, None] * (side + 1) + k[None, :-1]).ravel()
    quads = np.column_stack([corner, corner + side + 1, corner + side + 2, corner + 1]).astype(np.int32)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    half = len(quads) // 2
    cells = {
        "quad": {"quad": quads},
        "triangle": {"triangle": triangles},
        "mixed": {"quad": quads[:half], "triangle": np.concatenate([triangles[half : 2 * half], triangles[-half:]])},
    }[kind]
    return surface_mesh(points, cells)


def box(side=6, seed=0, amount=0.25, kind="triangle"):
    """The surface of a cube of one kind of cell; the nodes inside of its sides are thrown within these."""
    points, rows = {}, []

    def node(*place):
        return points.setdefault(place, len(points))

    for axis in range(3):
        for level in (0, side):
            for u in range(side):
                for v in range(side):

                    def at(a, b, axis=axis, level=level):
                        place = [a, b]
                        place.insert(axis, level)
                        return node(*place)

                    a, b, c, d = at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)
                    rows.append((a, b, c, d) if (level == side) != (axis == 1) else (a, d, c, b))
    p = np.array(list(points), dtype=float)
    rng = np.random.default_rng(seed)
    inner = ((p > 0) & (p < side)).sum(axis=1) == 2
    p += amount * rng.uniform(-1, 1, p.shape) * ((p > 0) & (p < side)) * inner[:, None]
    rows = np.array(rows, dtype=np.int32)
    return surface_mesh(p, {kind: rows if kind == "quad" else rows[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)}), inner


def halves(mesh):
    """The same, its cells of the highest dimension in two regions, left and right."""
    middle, highest = np.median(mesh.points[:, 0]), max(each.dimension for each in mesh.cells)
    cells = tuple(
        CellBlock(each.kind, each.nodes, 1 + (mesh.points[each.nodes, 0].mean(axis=1) > middle))
        if each.dimension == highest
        else each
        for each in mesh.cells
    )
    return replace(mesh, cells=cells)
