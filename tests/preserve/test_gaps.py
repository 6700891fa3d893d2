"""Gaps in the rows of layers are closed, and nothing else that lies between stretched cells."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import blunt, grid, made

import gmsnet
from gmsnet.generate import (
    disturb,
    kershaw_mesh,
    random_mesh,
    sheared_mesh,
    structured_mesh,
    swirled_mesh,
    terrain_mesh,
)
from gmsnet.preserve.gaps import in_gaps
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.protection import LAYER
from gmsnet.preserve.survey import rim_of
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def gaps(mesh, layers, wall=None):
    """(N,) the nodes in gaps, where the corners of cells of layers are known. wall: places there, those of the rim."""
    topology = Topology.of(mesh)
    rim = np.zeros(len(layers), dtype=bool)
    rim[topology.memory] = rim_of(topology) > 0
    triangles, equal = topology.memory[topology.near], np.ones(len(topology.near), dtype=bool)
    if len(topology.quads):
        equal[:] = topology.near_shapes == topology.near_shapes.min() if len(topology.triangles) else False
    points = planar_points(mesh)
    wall = points[rim] if wall is None else wall
    return in_gaps(triangles, topology.near_orientation, equal, points, rim, layers, wall)


def test_rows_of_triangles_are_held_around_a_blunt_nose():
    mesh, node = blunt()
    rows = np.roll(node, 8, axis=1)[1:20, :17]  # 36 of them were free
    result = gmsnet.smooth(disturb(mesh, node[26:-1].ravel(), 0.5, seed=1, edge="shortest"))
    assert result.moved.any()
    assert np.isin(rows, result.held[LAYER]).all()
    assert not result.moved[rows].any()


def test_the_leading_edge_of_an_airfoil(real_meshes):
    mesh = gmsnet.read(real_meshes / "n0012_113-33.su2")
    result = gmsnet.smooth(mesh)
    assert len(result.held[LAYER]) == len(Topology.of(mesh).free)


@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_a_gap_is_closed_wherever_it_lies_in_the_rows(cells):
    mesh, node = blunt(cells)
    for rows, columns in ((slice(5, 9), slice(10, 14)), (slice(14, 15), slice(70, 78)), (slice(2, 30), slice(33, 35))):
        layers = np.ones(len(mesh.points), dtype=bool)
        layers[node[rows, columns]] = False
        assert (gaps(mesh, layers, mesh.points[node[0]]) == ~layers).all()


def test_no_gap_goes_up_to_a_wall_or_lies_open_or_is_large():
    mesh, node = blunt("quad")
    for rows, columns in ((slice(0, 6), slice(4)), (slice(20, None), slice(9)), (slice(9, 18), slice(40)),
                          (slice(9, 10), slice(5))):  # fmt: skip
        layers = np.ones(len(mesh.points), dtype=bool)
        layers[node[rows, columns]] = False
        assert not gaps(mesh, layers, mesh.points[node[0]]).any()


@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_the_inside_of_a_duct_is_no_gap_of_the_layers_around_it(cells):
    mesh = structured_mesh(20, 11)
    mesh = made(mesh.points * (20.0, 11.0), mesh.cells[0].nodes, cells)
    away = np.minimum(mesh.points, (20.0, 11.0) - mesh.points).min(axis=1)
    assert not gaps(mesh, away < 4.5).any()
    assert gaps(mesh, away < 4.5, mesh.points[mesh.points[:, 1] == 0.0]).sum() == 22  # of the bottom alone


def test_no_gap_lies_between_two_layers():
    """Nor where the nodes around belong to one layer and to another."""
    mesh, node = blunt("quad")
    layers = np.ones(len(mesh.points), dtype=bool)
    layers[node[10:13, :5]] = False
    cut = layers.copy()
    cut[node[11]] = False
    assert gaps(mesh, layers, mesh.points[node[0]]).any()
    assert not gaps(mesh, cut, mesh.points[node[0]]).any()


def test_cells_in_no_rows_are_in_no_gap():
    x = np.linspace(0.0, 1.0, 31)
    good, random = grid(x, x), random_mesh(961, seed=3)
    for mesh, wanted in ((good, True), (random, False)):
        layers = np.linalg.norm(mesh.points - 0.5, axis=1) > 0.1
        assert gaps(mesh, layers, np.array([[0.5, 0.0]])).any() == wanted
    turned = np.linalg.norm(good.points - 0.5, axis=1) < 0.05
    skewed = good.with_points(good.points + np.where(turned[:, None], [0.015, 0.01], 0.0))
    assert not gaps(skewed, np.linalg.norm(good.points - 0.5, axis=1) > 0.1, np.array([[0.5, 0.0]])).any()


def test_holes_in_what_is_stretched_otherwise_stay_free():
    """Even where all that is stretched alike is held."""
    terrain = terrain_mesh(12, ratio=5.0)
    found = stretched_layers(terrain, Topology.of(terrain)).nodes
    assert gaps(terrain, found).any()
    held = gmsnet.smooth(terrain, fix_layers=True).held[LAYER]
    assert found[held].all()
    for mesh in (sheared_mesh(57, 73, amplitude=0.918, waves=2.05), swirled_mesh(60), kershaw_mesh(42)):
        assert not gaps(mesh, stretched_layers(mesh, Topology.of(mesh)).nodes).any()


def test_neither_order_nor_winding_matter():
    mesh, node = blunt("quad")
    layers = np.ones(len(mesh.points), dtype=bool)
    layers[node[10:13, :5]] = False
    rng = np.random.default_rng(0)
    order = rng.permutation(len(mesh.points))
    points, other = np.empty_like(mesh.points), np.empty_like(layers)
    points[order], other[order] = mesh.points, layers
    quads = np.array([np.roll(q[:: rng.choice([1, -1])], rng.integers(4)) for q in mesh.cells[0].nodes])
    again = made(points, order[rng.permutation(quads)], "quad")
    assert (gaps(again, other, mesh.points[node[0]])[order] == gaps(mesh, layers, mesh.points[node[0]])).all()
