"""Quads and hexahedra whose corners are in a wrong order are inverted themselves; those around are as without them."""

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


def thrown_block(side=6):
    """(points, hexahedra) of a cube, inner nodes thrown."""
    across = np.linspace(0.0, 1.0, side)
    points = np.stack(np.meshgrid(across, across, across, indexing="ij"), axis=-1).reshape(-1, 3)
    at = np.arange(side**3).reshape(side, side, side)
    low, high = slice(None, -1), slice(1, None)
    square = [(low, low), (high, low), (high, high), (low, high)]
    hexahedra = np.stack([at[x, y, z] for z in (low, high) for x, y in square], axis=-1).reshape(-1, 8)
    inner = at[1:-1, 1:-1, 1:-1].ravel()
    points[inner] += np.random.default_rng(0).uniform(-0.05, 0.05, (len(inner), 3))
    return points, hexahedra


WRONG = {"voxel": (0, 1, 3, 2, 4, 5, 7, 6), "bottom": (1, 0, 3, 2, 4, 5, 6, 7), "diagonal": (0, 2, 1, 3, 4, 6, 5, 7)}


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("order", WRONG)
@pytest.mark.parametrize("cell", [0, 12, 62, 124])
def test_one_hexahedron_in_a_wrong_order_holds_its_own_nodes_alone(cell, order, backwards):
    points, hexahedra = thrown_block()
    if backwards:  # the file reads them inside out
        hexahedra = hexahedra[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    wrong = hexahedra.copy()
    wrong[cell] = wrong[cell, list(WRONG[order])]
    result = gmsnet.smooth((points, [("hexahedron", wrong)]))
    assert result.after.inverted == 1
    assert [each.cell for each in result.unmended] == [cell]
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    inside[hexahedra[cell]] = False
    assert result.moved[inside].all()
    assert not result.moved[~inside].any()
    assert result.judged.after.shape_min > 0.85 > result.judged.before.shape_min


def test_wedges_and_hexahedra_beside_one_in_a_wrong_order():
    points, hexahedra = thrown_block()
    split = hexahedra[:25]
    wedges = np.concatenate([split[:, [0, 1, 2, 4, 5, 6]], split[:, [0, 2, 3, 4, 6, 7]]])
    rest = hexahedra[25:].copy()
    rest[50] = rest[50, list(WRONG["voxel"])]
    result = gmsnet.smooth((points, [("hexahedron", rest), ("wedge", wedges)]))
    assert result.after.inverted == 1
    assert [each.cell for each in result.unmended] == [50]
    assert result.moved.sum() >= 64 - 8
