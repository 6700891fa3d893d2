"""Thin rings of few second-order quads, curved as their circles are."""

from __future__ import annotations

import numpy as np

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def ring(around, layers, outer):
    """Quads of nine nodes between circles of radius 1 and ``outer``: valid, though their straight cells need not be."""
    places = np.array([(2 * i, 2 * j) for j in range(layers + 1) for i in range(around)], dtype=float)
    number = {tuple(place): k for k, place in enumerate(places.astype(int))}
    cells, places = [], places.tolist()

    def at(i, j):
        place = (i % (2 * around), j)
        if place not in number:
            number[place] = len(places)
            places.append([float(value) for value in place])
        return number[place]

    for j in range(0, 2 * layers, 2):
        for i in range(0, 2 * around, 2):
            offsets = ((0, 0), (0, 2), (2, 2), (2, 0), (0, 1), (1, 2), (2, 1), (1, 0), (1, 1))
            cells.append([at(i + x, j + y) for x, y in offsets])
    angle, radius = np.array(places).T * [[np.pi / around], [(outer - 1.0) / (2 * layers)]]
    points = (1.0 + radius)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    nodes = np.array(cells)[:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]
    return Mesh(points, (CellBlock("quad9", nodes, np.zeros(len(nodes), dtype=np.int64)),))


def thrown(around, layers, outer, amount, seed):
    """The same with inner nodes thrown by so much of the smaller size of a cell."""
    mesh, rng = ring(around, layers, outer), np.random.default_rng(seed)
    distance = np.hypot(*mesh.points.T)
    inner = (distance > 1.0 + 1e-9) & (distance < outer - 1e-9)
    size = min((outer - 1.0) / layers, 2.0 * np.pi / around)
    points = mesh.points.copy()
    points[inner] += amount * size * rng.uniform(-1.0, 1.0, (int(inner.sum()), 2))
    return mesh.with_points(points)
