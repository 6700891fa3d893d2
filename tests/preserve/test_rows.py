"""Layers of quads are held to their last row and all around, and nothing else with them."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb, layered_mesh, structured_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.protection import LAYER
from gmsnet.preserve.rows import RUN, followed
from gmsnet.topology.topology import Topology

LAYERS, AROUND = 20, 60


def o_grid(cells):
    return layered_mesh(LAYERS, 300.0, AROUND, cells=cells)


def thrown_outside(mesh):
    """The nodes beyond the layers, and beyond the cells next to them, thrown about."""
    topology, rows = Topology.of(mesh), (LAYERS + 1) * AROUND
    touched = np.arange(len(mesh.points)) < rows
    for block in mesh.cells:
        if block.dimension == 2:
            touched[block.nodes[(block.nodes < rows).any(axis=1)]] = True
    return disturb(mesh, topology.free[~touched[topology.free]], 0.5, seed=2, edge="shortest")


@pytest.mark.parametrize("outside", ["as it is", "disturbed"])
@pytest.mark.parametrize("cells", ["mixed", "quad"])
def test_all_rows_of_an_o_grid_are_layers_and_nothing_else(cells, outside):
    mesh = o_grid(cells)
    mesh = mesh if outside == "as it is" else thrown_outside(mesh)
    found = stretched_layers(mesh, Topology.of(mesh))
    assert np.flatnonzero(found.nodes).tolist() == list(range((LAYERS + 1) * AROUND))
    assert found.cells.sum() == LAYERS * AROUND
    result = gmsnet.smooth(mesh)
    assert result.points[found.nodes].tobytes() == mesh.points[found.nodes].tobytes()
    if outside == "disturbed":
        assert result.moved.sum() > 0.9 * (len(mesh.points) - found.nodes.sum() - AROUND)
        corners = [row for block in mesh.cells if block.dimension == 2 for row in block.nodes.tolist()]
        beyond = np.array([max(row) >= (LAYERS + 1) * AROUND for row in corners])
        assert result.after.shape[beyond].min() > 0.7


def test_the_airfoil_with_layers_of_quads(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_lam_hybrid_v1.su2")
    found = stretched_layers(mesh, Topology.of(mesh))
    quads = next(block.nodes for block in mesh.cells if block.kind == "quad")
    assert found.nodes[quads].all()
    result = gmsnet.smooth(mesh)
    assert result.held[LAYER].size > 4000
    assert not result.moved[quads].any()


def rows_of(columns, rows, heights):
    """A grid of quads with rows of these heights, and which quad is in which row."""
    mesh = structured_mesh(columns, rows)
    y = np.append(0.0, np.cumsum(heights))
    points = np.column_stack([mesh.points[:, 0] * columns, np.repeat(y, columns + 1)])
    return mesh.cells[0].nodes, points, np.repeat(np.arange(rows), columns)


def test_rows_are_followed_while_they_are_longer_than_thick():
    quads, points, row = rows_of(20, 6, [0.3, 0.45, 0.6, 0.8, 1.0, 1.3])
    inside = followed(quads, points, (row == 0) & (np.arange(len(row)) < 12))
    assert (inside == (row <= 3)).all()
    few = (row == 0) & (np.arange(len(row)) < RUN - 1)
    assert (followed(quads, points, few) == (row <= 3)).all()  # the row first, and then the next ones
    quads, points, row = rows_of(RUN - 1, 6, [0.3, 0.45, 0.6, 0.8, 1.0, 1.3])
    assert (followed(quads, points, row == 0) == (row == 0)).all()
    assert not followed(quads, points, row < 0).any()


def test_a_row_is_left_where_it_gets_thicker_than_long_or_skew():
    quads, points, row = rows_of(20, 3, [0.3, 2.0, 2.0])
    x = points[:, 0]
    points[:, 1] += np.where(points[:, 1] > 0, 0.5 * np.maximum(x - 12.0, 0.0), 0.0)  # thicker from there on
    found = followed(quads, points, (row == 0) & (np.arange(len(row)) < 3))
    assert found[:12].all()
    assert not found[13:].any()


def test_the_order_and_winding_of_quads_do_not_matter():
    quads, points, row = rows_of(15, 5, [0.2, 0.3, 0.5, 0.7, 1.0])
    rng = np.random.default_rng(0)
    points = points + 0.05 * rng.standard_normal(points.shape)
    chosen = row == 0
    wanted = followed(quads, points, chosen)
    assert chosen.sum() < wanted.sum() < len(quads)
    order = rng.permutation(len(quads))
    mixed = np.array([np.roll(quads[k][:: rng.choice([1, -1])], rng.integers(4)) for k in order])
    assert (followed(mixed, points, chosen[order]) == wanted[order]).all()


def test_the_order_of_cells_and_nodes_does_not_matter():
    mesh, rng = o_grid("mixed"), np.random.default_rng(0)
    order = rng.permutation(len(mesh.points))
    points = np.empty_like(mesh.points)
    points[order] = mesh.points
    blocks = []
    for block in mesh.cells[::-1]:
        cells = rng.permutation(len(block.nodes))
        cut = len(cells) // 2
        blocks += [
            CellBlock(block.kind, order[block.nodes[part]], block.regions[part]) for part in (cells[:cut], cells[cut:])
        ]
    other = Mesh(points, tuple(blocks), mesh.region_names)
    one, two = (stretched_layers(each, Topology.of(each)) for each in (mesh, other))
    assert (two.nodes[order] == one.nodes).all()
    assert two.cells.sum() == one.cells.sum()
