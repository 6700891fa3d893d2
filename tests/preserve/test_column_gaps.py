"""Rows of layers around edges and corners of a body, where no column starts, are held as those between them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.column_gaps import with_gaps
from gmsnet.preserve.protection import LAYER
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken


def around_a_cube(kind, side=6, rows=14, first=0.01, growth=1.3):
    """Rows around a cube of edge 1, and its nodes row by row. Those on edges and corners are higher, by √2 and √3."""
    grid = np.array(list(itertools.product(range(side + 1), repeat=3)))
    surface = grid[((grid == 0) | (grid == side)).any(axis=1)]
    number = {tuple(node): k for k, node in enumerate(surface.tolist())}
    quads = []
    for axis, end in itertools.product(range(3), (0, side)):
        one, two = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        for i, j in itertools.product(range(side), repeat=2):
            foot = end * np.eye(3, dtype=int)[axis] + i * one + j * two
            quad = [number[tuple((foot + way).tolist())] for way in (0 * one, one, one + two, two)]
            quads.append(quad if end else quad[::-1])
    height = np.append(0.0, np.cumsum(first * growth ** np.arange(rows)))
    away = (surface == side) * 1.0 - (surface == 0)
    points = np.concatenate([surface / side - 0.5 + h * away for h in height])
    node = np.arange(len(points)).reshape(len(height), -1)
    quads = np.array(quads)
    if kind == "hexahedron":
        cells = [np.hstack([node[k][quads], node[k + 1][quads]]) for k in range(rows)]
        return Mesh(points, (CellBlock(kind, np.concatenate(cells), np.zeros(rows * len(quads), dtype=int)),)), node
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    wedges = np.concatenate([np.hstack([node[k][triangles], node[k + 1][triangles]]) for k in range(rows)])
    if kind == "wedge":
        return Mesh(points, (CellBlock(kind, wedges, np.zeros(len(wedges), dtype=int)),)), node
    tetrahedra = []
    for wedge in wedges.tolist():  # its thirds, so that neighbours have one diagonal: from the lower row's larger id
        a, b, c = sorted(range(3), key=lambda k, wedge=wedge: wedge[k])
        low, high = wedge[:3], wedge[3:]
        tetrahedra += [[low[a], low[b], low[c], high[c]], [low[a], low[b], high[b], high[c]],
                       [low[a], high[a], high[b], high[c]]]  # fmt: skip
    return Mesh(points, (CellBlock("tetra", np.array(tetrahedra), np.zeros(len(tetrahedra), dtype=int)),)), node


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
@pytest.mark.parametrize(("side", "first"), [(3, 0.01), (6, 0.01), (6, 1e-3), (9, 0.005)])
def test_all_rows_that_are_flat_are_held(kind, side, first):
    rows = 14 if first > 1e-3 else 20
    mesh, node = around_a_cube(kind, side, rows, first)
    height = first * 1.3 ** np.arange(rows)
    flat = 1 + int(np.sum(height < 1.0 / side / 3.0))  # levels of nodes
    outside = np.setdiff1d(volume_of(wound_of(mesh)).free, node[:flat])
    given = disturb(mesh, outside, 0.1, seed=1)
    result = gmsnet.smooth(given)
    assert np.isin(node[1:flat], result.held[LAYER]).all()
    assert not result.moved[node[:flat]].any()
    assert gmsnet.smooth(given, preserve="none").moved[node[1:flat]].any()


def test_the_last_row_is_held_with_its_top():
    """Where cells are regular above layers of one height, the nodes between have both around them."""
    rows, side = 5, 8
    mesh, node = around_a_cube("wedge", side, rows + 6, 0.02, 1.2)
    away = np.sign(mesh.points[node[1]] - mesh.points[node[0]])
    height = np.sum(0.02 * 1.2 ** np.arange(rows)) + np.cumsum(np.full(6, 0.2))
    points = mesh.points.copy()
    points[node[rows + 1 :]] = mesh.points[node[0]] + height[:, None, None] * away
    result = gmsnet.smooth(mesh.with_points(points))
    assert set(result.held[LAYER].tolist()) == set(node[1 : rows + 1].ravel().tolist())


def test_rows_end_where_cells_are_higher_and_gaps_are_the_lesser_part():
    mesh, node = around_a_cube("hexahedron")
    volume = volume_of(wound_of(mesh))
    points, wall = taken(space_points(mesh), volume.memory), np.isin(volume.memory, node[0])
    inner = (np.abs(mesh.points[node[0]]) < 0.49).sum(axis=1) == 2  # of faces
    columns = volume.places[node[:4]].T
    heights = np.tile(0.01 * 1.3 ** np.arange(3), (len(columns), 1))

    def found(some):
        return set(volume.memory[with_gaps(volume, points, columns[some], heights[some], wall)].tolist())

    whole = set(node[:4][:, inner].ravel().tolist()) | set(node[1:4].ravel().tolist())
    assert found(inner) == whole
    few = inner & (np.arange(len(inner)) % 5 == 0)  # so that most nodes of rows are in no column
    assert found(few) == set(node[:4][:, few].ravel().tolist())
    above = volume.places[node[1]]
    points[above[~inner]] *= 1.2  # ten times as high
    assert found(inner) == set(node[:4][:, inner].ravel().tolist())


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_rows_beside_inverted_cells_are_held(kind):
    mesh, node = around_a_cube(kind)
    flat = 8
    outside = np.setdiff1d(volume_of(wound_of(mesh)).free, node[:flat])
    given = disturb(mesh, outside, 1.0, seed=3, edge="shortest", keep_valid=False)
    assert gmsnet.quality(given).inverted
    result = gmsnet.smooth(given)
    assert not result.after.inverted
    assert (result.points[node[:flat]] == mesh.points[node[:flat]]).all()
