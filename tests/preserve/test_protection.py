"""What is held because it is there on purpose, and the options about it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

import gmsnet
from gmsnet import InputError
from gmsnet.generate import disturb, layered_mesh
from gmsnet.preserve.protection import LAYER, WALL
from gmsnet.topology.topology import Topology


def layered(ratio=40.0, columns=30, rows=30):
    """A plate with ten thin rows of cells at its lower side under isotropic ones, disturbed above."""
    heights = np.concatenate([np.arange(10) / ratio, 10 / ratio + np.arange(rows - 9)])
    x, y = np.meshgrid(np.arange(columns + 1.0), heights)
    points = np.column_stack([x.ravel(), y.ravel()])
    nodes = np.arange(points.shape[0]).reshape(x.shape)
    a, b, c, d = nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    mesh = gmsnet.Mesh(points, (gmsnet.CellBlock("triangle", triangles, np.zeros(len(triangles), int)),))
    rng = np.random.default_rng(0)
    free = Topology.of(mesh).free
    above = free[points[free, 1] > heights[14]]
    points = points.copy()
    points[above] += rng.uniform(-0.45, 0.45, size=(len(above), 2))
    return mesh.with_points(points), heights


def test_layers_stay_and_the_rest_is_mended():
    mesh, heights = layered()
    result = gmsnet.smooth(mesh)
    in_layers = mesh.points[:, 1] < heights[9]
    assert not result.moved[in_layers].any()
    assert result.held[LAYER].size > 200
    assert result.after.shape[result.before.shape < 0.3].min() < 0.3  # the layers themselves
    outside = result.before.centre[:, 1] > heights[14]
    assert result.after.shape[outside].min() > result.before.shape[outside].min() + 0.2
    assert any("anisotropic on purpose" in note and "held" in note for note in result.notes)


def test_none_moves_them_and_says_so_and_fix_layers_holds_them_still():
    mesh, heights = layered()
    in_layers = (mesh.points[:, 1] < heights[8]) & (mesh.points[:, 1] > 0)
    free = gmsnet.smooth(mesh, preserve="none")
    assert free.moved[in_layers].any()
    assert any("nothing is held" in note for note in free.notes)
    fixed = gmsnet.smooth(mesh, preserve="none", fix_layers=True)
    assert not fixed.moved[in_layers].any()
    assert LAYER in fixed.held


def test_a_mesh_without_layers_is_smoothed_freely():
    mesh = gmsnet.random_mesh(500, seed=0)
    result = gmsnet.smooth(mesh)
    assert LAYER not in result.held
    assert WALL not in result.held
    assert result.notes == []
    assert gmsnet.smooth(mesh, fix_layers=True).notes == [
        "fix_layers: no stretched layers were found, so none are held"
    ]


def test_size_takes_the_method_that_keeps_it():
    mesh = gmsnet.random_mesh(500, seed=0)
    kept = gmsnet.smooth(mesh, preserve="size")
    assert kept.points.tobytes() == gmsnet.smooth(mesh, "sized", preserve="size").points.tobytes()
    with pytest.raises(InputError, match="gmsnet does not keep the sizes"):
        gmsnet.smooth(mesh, "gmsnet", preserve="size")
    with pytest.raises(InputError, match="contradict"):
        gmsnet.smooth(mesh, preserve="size", target_quality=0.3)


def test_a_mesh_stretched_as_a_whole_is_smoothed_and_fix_layers_holds_it():
    rng = np.random.default_rng(3)
    points = rng.random((800, 2))
    triangles = Delaunay(points).simplices
    mesh = (points * (20.0, 1.0), triangles)
    result = gmsnet.smooth(mesh)
    assert LAYER not in result.held
    assert any("not in layers of a wall" in note and "fix_layers" in note for note in result.notes)
    result = gmsnet.smooth(mesh, fix_layers=True)
    assert result.stop_reason == "nothing to move" or result.held[LAYER].size > 500


@pytest.mark.parametrize("seed", range(4))
def test_layers_stay_when_cells_beside_them_are_mended(seed):
    """Untangling knows of nodes that are held on account of layers."""
    mesh, heights = layered()
    free = Topology.of(mesh).free
    above = free[mesh.points[free, 1] > heights[11]]
    tangled = disturb(mesh, above, 1.2, seed=seed, keep_valid=False)
    result = gmsnet.smooth(tangled)
    assert result.before.inverted > 10
    assert result.after.inverted == 0
    assert result.held[LAYER].size > 300
    assert not result.moved[mesh.points[:, 1] < heights[11]].any()


@pytest.mark.parametrize(("layers", "aspect", "around", "seed"), [(11, 627.3, 83, 105), (16, 276.2, 106, 81)])
def test_rows_stay_where_all_outside_of_them_is_tangled(layers, aspect, around, seed):
    """Thrown nodes that look like a layer's by chance are told from its own, whose rows are whole."""
    mesh = layered_mesh(layers, aspect, around)
    outside = Topology.of(mesh).free
    outside = outside[outside >= (layers + 1) * around]
    result = gmsnet.smooth(disturb(mesh, outside, 1.0, seed=seed, keep_valid=False))
    assert result.before.inverted > 300
    assert result.after.inverted == 0
    assert not result.moved[: (layers + 1) * around].any()


@pytest.mark.parametrize("seed", range(3))
def test_no_layers_are_told_of_tangles(seed):
    mesh = gmsnet.random_mesh(3000, seed=seed)
    tangled = disturb(mesh, Topology.of(mesh).free, 2.0, seed=seed, keep_valid=False)
    result = gmsnet.smooth(tangled)
    assert result.before.inverted > 1000
    assert result.after.inverted == 0
    assert LAYER not in result.held


def test_a_damaged_cell_frees_no_node_of_the_rows_beside_it(real_meshes):
    """Quads of a C-grid, thrown about from the twentieth row on."""
    mesh = gmsnet.read(real_meshes / "n0012_113-33.su2")
    rows = Topology.of(mesh).free[nodes_beyond(mesh, 20)[Topology.of(mesh).free]]
    result = gmsnet.smooth(disturb(mesh, rows, 0.5, seed=1, edge="shortest"))
    assert len(rows) > 800
    moved = np.flatnonzero(result.moved)
    assert np.isin(moved, rows).all()


def nodes_beyond(mesh, rows):
    """(N,) bool: the nodes further than so many rows of quads from the airfoil."""
    (quads,) = (block.nodes for block in mesh.cells if block.kind == "quad")
    reached = np.zeros(len(mesh.points), dtype=bool)
    reached[mesh.markers["airfoil"]] = True
    for _ in range(rows):
        reached[quads[reached[quads].any(axis=1)]] = True
    return ~reached
