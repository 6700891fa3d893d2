"""Fans of cells around the corners of a body, small and as thick as long, belong to its layers."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import with_fans

import gmsnet
from gmsnet.generate import disturb
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.protection import LAYER
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize("cells", ["triangle", "quad"])
@pytest.mark.parametrize("fan", [1, 2, 3, 5, 9])
@pytest.mark.parametrize("first", [1e-4, 2e-3])
def test_rows_are_held_around_corners(cells, fan, first):
    mesh, node = with_fans(cells, fan=fan, first=first, rows=14 if first > 1e-3 else 26)
    rows = node[1 : 8 if first > 1e-3 else 16]  # where cells beside the corners are flat
    given = disturb(mesh, np.setdiff1d(Topology.of(mesh).free, node), 0.3, seed=2, edge="shortest")
    result = gmsnet.smooth(given)
    assert result.moved.any()
    assert not result.moved[rows].any()
    assert np.isin(rows, result.held[LAYER]).all()


def test_small_cells_of_a_fan_are_not_damaged_and_flat_ones_are():
    mesh, node = with_fans("triangle", fan=3, first=1e-4, rows=26)
    topology = Topology.of(mesh)
    layers = stretched_layers(mesh, topology)
    assert layers.damaged == 0
    points = mesh.points.copy()
    points[node[3, 5]] = points[node[2, 5]] + 0.001 * (points[node[3, 5]] - points[node[2, 5]])
    assert stretched_layers(mesh.with_points(points), topology).damaged > 0


def test_a_node_thrown_out_of_a_fan_is_not_held():
    mesh, node = with_fans("triangle", fan=3, first=1e-4, rows=26)
    columns = np.flatnonzero(np.diff(node[0]) == 0)
    thrown = node[4, columns[1]]
    points = mesh.points.copy()
    points[thrown] += 3.0 * (points[node[8, columns[1]]] - points[thrown])
    given = mesh.with_points(points)
    assert gmsnet.quality(given).inverted
    result = gmsnet.smooth(given)
    assert result.after.inverted == 0
    assert result.moved[thrown]
    others = np.setdiff1d(node[1:12], thrown)
    assert not result.moved[others].any()


@pytest.mark.parametrize("cells", ["triangle", "quad"])
@pytest.mark.parametrize("seed", range(3))
def test_rows_beside_thrown_nodes_are_held_and_these_are_not(cells, seed):
    """Nodes thrown into layers look like their next row, and would cross their edges for ever."""
    mesh, node = with_fans(cells, fan=5, first=1e-4, rows=26)
    rows = node[:18]
    outside = np.setdiff1d(Topology.of(mesh).free, rows)
    given = disturb(mesh, outside, 2.0, seed=seed, keep_valid=False)
    assert gmsnet.quality(given).inverted > 50
    result = gmsnet.smooth(given)
    assert result.after.inverted == 0
    moved = (result.points[rows] != mesh.points[rows]).any(axis=2)
    assert not moved[:16].any()
    assert moved.sum() <= 3  # of 1,224: beside what could not be mended before
