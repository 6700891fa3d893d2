"""Rows of layers around edges and corners of a body, where no column starts, are held as those between them."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import around_a_cube

import gmsnet
from gmsnet.generate import disturb
from gmsnet.preserve.column_gaps import with_gaps
from gmsnet.preserve.protection import LAYER
from gmsnet.preserve.shared import Alone
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken


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
    heights, number = np.tile(0.01 * 1.3 ** np.arange(3), (len(columns), 1)), np.arange(len(columns))

    def found(some):
        rows = columns[some].astype(np.int64), heights[some], number[some]
        return set(volume.memory[with_gaps(volume, points, *rows, wall, Alone(volume))].tolist())

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
