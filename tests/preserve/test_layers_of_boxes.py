"""Layers of hexahedra around a box so coarse that no cell has all its corners in columns over one face."""

from __future__ import annotations

import itertools

import numpy as np

import gmsnet

SIDES = 4, 2, 2  # hexahedra along the box
HEIGHTS = 0.01 * 1.4 ** np.arange(6)
REACH = np.concatenate([[0.0], np.cumsum(HEIGHTS), HEIGHTS.sum() + np.cumsum([0.25, 0.4, 0.6])])


def around_a_box():
    """Hexahedra in shells around it, those beyond the layers with their inner nodes thrown."""
    grid = np.array(list(itertools.product(*(range(n + 1) for n in SIDES))))
    outer = ((grid == 0) | (grid == SIDES)).any(axis=1)
    number = np.full(len(grid), -1)
    number[outer] = np.arange(outer.sum())
    number = number.reshape([n + 1 for n in SIDES])
    quads = []
    for axis in range(3):
        for u, v in itertools.product(range(SIDES[axis - 2]), range(SIDES[axis - 1])):
            corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + np.array([u, v])
            for side in (0, SIDES[axis]):
                at = np.zeros((4, 3), dtype=int)
                at[:, axis], at[:, axis - 2], at[:, axis - 1] = side, corners[:, 0], corners[:, 1]
                quads.append(number[tuple(at.T)][:: 1 if side else -1])
    wall = grid[outer] / np.max(SIDES)
    sign = (grid[outer] == SIDES).astype(float) - (grid[outer] == 0)
    count = len(wall)
    points = np.concatenate([wall + reach * sign for reach in REACH])
    points[count * 7 : count * 9] += np.random.default_rng(1).uniform(-0.06, 0.06, (2 * count, 3))
    cells = [
        np.concatenate([quad + k * count, quad + (k + 1) * count]) for k in range(len(REACH) - 1) for quad in quads
    ]
    block = gmsnet.CellBlock("hexahedron", np.array(cells), np.zeros(len(cells), dtype=np.int64))
    return gmsnet.Mesh(points, (block,)), count


def test_rows_keep_their_heights():
    mesh, count = around_a_box()
    result = gmsnet.smooth(mesh)
    columns, before = (points.reshape(len(REACH), count, 3) for points in (result.points, mesh.points))
    assert (columns[:6] == before[:6]).all()
    assert (columns[7:9] != before[7:9]).any()
    assert result.after.inverted == 0
