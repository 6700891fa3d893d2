"""Quads whose corners are in a wrong order are inverted themselves; the cells around are as they are without them."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

SIDE = 9


def thrown_grid():
    """(points, quads) of a square, inner nodes thrown."""
    across = np.linspace(0.0, 1.0, SIDE)
    points = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    grid = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)
    inner = grid[1:-1, 1:-1].ravel()
    points[inner] += np.random.default_rng(0).uniform(-0.03, 0.03, (len(inner), 2))
    return points, quads


def mesh_of(points, *cells):
    return Mesh(points, tuple(CellBlock("quad", each, np.zeros(len(each), dtype=np.int64)) for each in cells))


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("order", [(0, 2, 1, 3), (0, 1, 3, 2), (1, 0, 2, 3)])
@pytest.mark.parametrize("cell", [0, 4, 27, 36])
def test_one_crossed_quad_is_the_only_inverted_cell(cell, order, backwards):
    points, quads = thrown_grid()
    wrong = quads.copy()
    wrong[cell] = wrong[cell, list(order)]
    if backwards:  # some cells of the file are wound the other way
        wrong[10:20] = wrong[10:20, ::-1]
    result = gmsnet.smooth(mesh_of(points, wrong))
    assert result.before.inverted == result.after.inverted == 1
    assert [each.cell for each in result.unmended] == [cell]
    hole = Topology.of(mesh_of(points, np.delete(quads, cell, axis=0)))
    free = np.setdiff1d(hole.free, quads[cell])
    assert result.topology.free.tolist() == free.tolist()
    assert result.moved[free].all()
    assert result.judged.after.shape_min > 0.9 > result.judged.before.shape_min


def test_two_crossed_quads_beside_each_other():
    points, quads = thrown_grid()
    for cell in (27, 28):
        quads[cell] = quads[cell, [0, 2, 1, 3]]
    result = gmsnet.smooth(mesh_of(points, quads))
    assert sorted(each.cell for each in result.unmended) == [27, 28]
    assert result.before.inverted == result.after.inverted == 2
    assert result.moved.any()
