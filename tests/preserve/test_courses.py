"""Rows of nodes over walls: layers of low aspect, around sharp tails, and of meshes that are all layers."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import grid, made

import gmsnet
from gmsnet.generate import disturb, layered_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.protection import LAYER
from gmsnet.topology.topology import Topology


def airfoil(cells, around=80, aspect=4.0, growth=1.15, thickness=0.2, rows=30):
    """An O-grid of one height in each row around a NACA airfoil with a sharp tail, and its nodes row by row.

    Nodes are so close together at the tail and at the nose that cells there are as thick as long.
    """
    x = 0.5 + 0.5 * np.cos(np.linspace(0.0, np.pi, around // 2 + 1))
    y = np.polynomial.Polynomial([0.0, -0.126, -0.3516, 0.2843, -0.1036])(x) + 0.2969 * np.sqrt(x)
    upper = np.column_stack([x, 5.0 * thickness * y])
    loop = np.vstack([upper, (upper * (1.0, -1.0))[-2:0:-1]])
    along = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    width = np.hypot(*(np.roll(loop, -1, axis=0) - loop).T).mean()
    height = np.append(0.0, np.cumsum(width / aspect * growth ** np.arange(rows)))[:, None, None]
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    circle = [0.5, 0.0] + height[-1] * np.column_stack([np.cos(turn), np.sin(turn)])
    share = height / height[-1]
    points = (1.0 - share) ** 2 * (loop + height * normal)
    points = points + (1.0 - (1.0 - share) ** 2) * (share * circle + (1.0 - share) * (loop + height * normal))
    node = np.arange((rows + 1) * around).reshape(rows + 1, around)
    a, b, d, c = node[:-1], np.roll(node[:-1], -1, axis=1), node[1:], np.roll(node[1:], -1, axis=1)
    return made(points.reshape(-1, 2), np.stack((a, d, c, b), axis=-1).reshape(-1, 4), cells), node


def plate(cells, aspect, growth, rows, columns):
    """Rectangles over a wall from one end of the mesh to the other, and the nodes row by row."""
    y = np.append(0.0, np.cumsum(growth ** np.arange(rows) / columns / aspect))
    x = np.linspace(0.0, 1.0, columns + 1)
    node = np.arange(len(x) * len(y)).reshape(len(y), len(x))
    if cells == "triangle":
        return grid(x, y, alternate=True), node
    quads = np.stack((node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]), axis=-1)
    return made(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2), quads.reshape(-1, 4), cells), node


def are_kept(mesh, node, rows):
    """Are all nodes of so many rows over the wall held?"""
    result = gmsnet.smooth(mesh)
    free = np.zeros(len(mesh.points), dtype=bool)
    free[Topology.of(mesh).free] = True
    first = node[1 : rows + 1]
    return np.isin(first[free[first]], result.held[LAYER]).all()


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_rows_go_around_a_sharp_tail_and_a_nose(cells):
    mesh, node = airfoil(cells)
    assert are_kept(mesh, node, 7)
    assert are_kept(disturb(mesh, node[14:-1].ravel(), 0.4, seed=3, edge="shortest"), node, 7)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_layers_of_low_aspect_that_are_all_of_the_mesh(cells):
    """Cells grow until they are as high as wide, and stretched the other way."""
    mesh, node = plate(cells, 5.0, 1.1, 30, 60)
    assert are_kept(mesh, node, 9)
    mesh, node = plate(cells, 4.0, 1.15, 20, 80)
    assert are_kept(mesh, node, 4)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_layers_on_both_sides_of_an_interface(cells):
    mesh, node = plate(cells, 60.0, 1.25, 20, 60)
    points = np.concatenate([mesh.points[node[:0:-1].ravel()] * (1.0, -1.0), mesh.points])
    both = np.arange(len(points)).reshape(-1, node.shape[1])
    quads = np.stack((both[:-1, :-1], both[:-1, 1:], both[1:, 1:], both[1:, :-1]), axis=-1).reshape(-1, 4)
    mesh = made(points, quads, cells)
    (block,) = mesh.cells
    regions = (points[block.nodes].mean(axis=1)[:, 1] > 0.0).astype(int)
    mesh = Mesh(points, (CellBlock(block.kind, block.nodes, regions),))
    assert are_kept(mesh, both[20:], 15)
    assert are_kept(mesh, both[20::-1], 15)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_layers_that_are_thicker_downstream(cells):
    """As laminar boundary layers are: all rows grow by one factor, from a height that differs along the wall."""
    mesh, node = plate(cells, 50.0, 1.2, 25, 80)
    x, y = mesh.points.T
    assert are_kept(mesh.with_points(np.column_stack([x, y * np.sqrt(x + 0.05)])), node, 15)


def test_rows_that_do_not_grow_alike_are_smoothed():
    """Pressed towards the wall, by more at one end of it than at the other."""
    mesh, _ = plate("quad", 1.5, 1.0, 30, 30)
    x, y = mesh.points[:, 0], mesh.points[:, 1] / mesh.points[:, 1].max()
    pressed = mesh.with_points(np.column_stack([x, 0.7 * y ** (1.05 + x)]))
    assert LAYER not in gmsnet.smooth(pressed).held


@pytest.mark.parametrize("growth", [1.0, 1.05])
@pytest.mark.parametrize("amount", [0.05, 0.15, 0.3])
@pytest.mark.parametrize(("columns", "aspect", "rows"), [(30, 200, 12), (40, 100, 12), (60, 30, 20)])
def test_rows_are_layers_where_only_what_is_behind_them_is_disturbed(columns, aspect, rows, amount, growth):
    """Quads, and grown triangles behind them, whose nodes are thrown about by shares of their height."""
    first = 1.0 / columns / aspect
    height = list(np.append(0.0, np.cumsum(first * growth ** np.arange(rows))))
    step = height[-1] - height[-2]
    while height[-1] < 0.6:
        step = min(1.2 * step, 1.0 / columns)
        height.append(height[-1] + step)
    x, y = np.linspace(0.0, 1.0, columns + 1), np.array(height)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    node = np.arange(len(points)).reshape(len(y), len(x))
    quads = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1)
    layer, above = quads[:rows].reshape(-1, 4), quads[rows:].reshape(-1, 4)
    thrown = node[rows + 1 : -1, 1:-1].ravel()
    size = np.repeat(np.gradient(y)[rows + 1 : -1], len(x) - 2)[:, None]
    points[thrown] += 0.5 * amount * size * np.random.default_rng(0).uniform(-1.0, 1.0, (len(thrown), 2))
    triangles = np.concatenate([above[:, [0, 1, 2]], above[:, [0, 2, 3]]])
    blocks = (("quad", layer), ("triangle", triangles))
    mesh = Mesh(points, tuple(CellBlock(kind, rows_, np.zeros(len(rows_), dtype=int)) for kind, rows_ in blocks))
    result = gmsnet.smooth(mesh)
    inside = node[1:rows, 1:-1].ravel()
    assert np.isin(inside, result.held[LAYER]).all()
    assert not result.moved[inside].any()
    assert result.moved[thrown].sum() > 0.2 * len(thrown)


@pytest.mark.parametrize("cells", ["quad", "mixed"])
@pytest.mark.parametrize("amount", [0.15, 0.3, 0.45])
@pytest.mark.parametrize("aspect", [5, 20, 100])
def test_rows_that_were_thrown_about_are_layers_still(aspect, amount, cells):
    """Heights along a row are noise then, but rows still grow by one factor."""
    mesh = layered_mesh(around=120, layers=20, aspect=aspect, cells=cells)
    thrown = disturb(mesh, Topology.of(mesh).free, amount, seed=1, edge="shortest")
    kept, wanted = (gmsnet.smooth(each, max_sweeps=0).held[LAYER] for each in (thrown, mesh))
    assert np.isin(wanted, kept).mean() > 0.6
    assert np.isin(kept, wanted).all()


@pytest.mark.parametrize("amount", [0.0, 0.15, 0.3, 0.45])
@pytest.mark.parametrize("factor", [2.0, 6.0])
def test_grids_of_one_height_that_were_thrown_about_and_stretched_are_not(factor, amount):
    mesh, _ = plate("quad", factor, 1.0, 40, 60)
    thrown = disturb(mesh, Topology.of(mesh).free, amount, seed=2, edge="shortest") if amount else mesh
    assert LAYER not in gmsnet.smooth(thrown, max_sweeps=0).held


@pytest.mark.parametrize("power", [1.2, 1.3, 1.4])
def test_grids_that_were_pressed_and_thrown_about_are_not(power):
    """They grow from row to row, but by less and less."""
    mesh, _ = plate("quad", 1.5, 1.0, 40, 40)
    x, y = mesh.points[:, 0], mesh.points[:, 1] / mesh.points[:, 1].max()
    pressed = mesh.with_points(np.column_stack([x, 0.7 * y ** (power - 0.4 + 0.8 * x)]))
    thrown = disturb(pressed, Topology.of(pressed).free, 0.3, seed=2, edge="shortest")
    assert LAYER not in gmsnet.smooth(thrown, max_sweeps=0).held


@pytest.mark.parametrize("cells", ["quad", "triangle"])
@pytest.mark.parametrize(("aspect", "growth", "rows"), [(60.0, 1.08, 40), (200.0, 1.12, 40)])
def test_layers_up_to_a_boundary_along_which_cells_are_flat_still(cells, aspect, growth, rows):
    """As of half a channel: the cells at its middle, 2.4 to 3 times as long as high, start no rows of their own."""
    mesh, node = plate(cells, aspect, growth, rows, 60)
    assert are_kept(mesh, node, rows - 1)
