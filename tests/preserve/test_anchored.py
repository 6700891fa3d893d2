"""Layers of walls against cells that are stretched alike for other reasons."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import rows_around

from gmsnet.generate import (
    c_grid_mesh,
    disturb,
    kershaw_mesh,
    layered_mesh,
    moved_hole_mesh,
    sheared_mesh,
    swirled_mesh,
    terrain_mesh,
    zigzag_mesh,
)
from gmsnet.preserve.anchored import split
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.survey import Survey
from gmsnet.topology.topology import Topology


def found(mesh):
    topology = Topology.of(mesh)
    survey = Survey.of(mesh, topology)
    layers = stretched_layers(mesh, topology, survey)
    return (layers, layers, layers) if not layers else (layers, *split(mesh, topology, survey, layers))


def stretched(factor, amount=0.3, seed=1):
    mesh = sheared_mesh(40, amplitude=0.0)
    mesh = disturb(mesh, Topology.of(mesh).free, amount, seed=seed)
    return mesh.with_points(mesh.points * (factor, 1.0))


def bent(cells, amount=0.4, seed=1):
    """Rows of one height around most of a ring: cells are three times as long at its outside."""
    mesh = sheared_mesh(24, 20, amplitude=0.0, cells=cells)
    angle, radius = 1.6 * np.pi * mesh.points[:, 0], 0.3 + 0.7 * mesh.points[:, 1]
    mesh = mesh.with_points(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    return disturb(mesh, Topology.of(mesh).free, amount, seed=seed, edge="shortest") if amount else mesh


def squeezed(amount, mesh, *, everywhere=False):
    """Pressed towards the bottom and the top, in the middle or everywhere: thin there, and thicker from row to row."""
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    part = 1.0 if everywhere else np.sin(np.pi * x)
    return mesh.with_points(np.column_stack([x, y - amount * np.sin(2.0 * np.pi * y) / (2.0 * np.pi) * part]))


NO_LAYERS = {
    "sheared": lambda: sheared_mesh(60, 120, amplitude=0.9, waves=2),
    "sheared quads": lambda: sheared_mesh(30, 90, amplitude=0.6, waves=3, cells="quad"),
    "sheared by much": lambda: sheared_mesh(57, 73, amplitude=0.918, waves=2.05),
    "quads sheared by much": lambda: sheared_mesh(63, 64, amplitude=0.696, waves=2.99, cells="quad"),
    "sheared by part of a wave": lambda: sheared_mesh(37, 52, amplitude=0.882, waves=0.61),
    "sheared by less": lambda: sheared_mesh(76, 54, amplitude=0.732, waves=0.81),
    "sheared along a part of a wall": lambda: sheared_mesh(49, 89, amplitude=0.709, waves=0.83),
    "sheared along a part of a short wall": lambda: sheared_mesh(24, 48, amplitude=0.803, waves=0.65),
    "sheared along parts of walls": lambda: sheared_mesh(34, 71, amplitude=0.831, waves=1.17),
    "sheared along a side": lambda: sheared_mesh(27, 56, amplitude=0.87, waves=0.73),
    "sheared in columns of one width": lambda: sheared_mesh(29, 60, amplitude=0.771, waves=0.32),
    "sheared by a third of a wave": lambda: sheared_mesh(84, 47, amplitude=0.92, waves=0.34),
    "sheared and long": lambda: sheared_mesh(76, 50, amplitude=0.5, waves=0.3),
    "sheared by a fine grid": lambda: sheared_mesh(150, 210, amplitude=0.9, waves=0.6),
    "swirled": lambda: swirled_mesh(60),
    "zigzag": lambda: zigzag_mesh(40),
    "Kershaw": lambda: kershaw_mesh(42),
    "flat Kershaw": lambda: kershaw_mesh(60, flatness=0.1),
    "hole moved": lambda: moved_hole_mesh(0.04, shift=1.5, turn=0.7),
    "terrain": lambda: terrain_mesh(12, ratio=5.0),
    "terrain of many lines": lambda: terrain_mesh(24, ratio=1.72, seed=829),
    "stretched": lambda: stretched(2.5),
    "stretched more": lambda: stretched(6.0),
    "squeezed": lambda: squeezed(0.77, moved_hole_mesh(0.033, shift=0.0)),
    "squeezed grid": lambda: squeezed(0.9, sheared_mesh(37, amplitude=0.0)),
    "hole squashed": lambda: moved_hole_mesh(0.02, shift=0.0, squash=0.115, turn=3.5),
    "ring": lambda: bent("quad", 0.0),
    "ring of triangles": lambda: bent("triangle", 0.0),
    "disturbed ring": lambda: bent("quad", seed=2),
    "another disturbed ring": lambda: bent("quad", seed=5),
    "disturbed ring of triangles": lambda: bent("triangle"),
}
LAYERS = {
    "triangles": lambda: layered_mesh(),
    "quads": lambda: layered_mesh(cells="quad"),
    "mixed": lambda: layered_mesh(cells="mixed"),
    "circle": lambda: layered_mesh(30, 100, body="circle"),
    "C-grid": lambda: c_grid_mesh(20, 300),
    "C-grid of triangles": lambda: c_grid_mesh(10, 50, cells="triangle"),
    "few thick ones": lambda: layered_mesh(10, 5),
    "hardly any": lambda: layered_mesh(10, 3),
    "to the other boundary": lambda: rows_around(60, 30, 1e-3, 1.15),
    "to the other boundary, of triangles": lambda: rows_around(60, 30, 1e-3, 1.15, cells="triangle"),
    "around a flat body": lambda: rows_around(60, 30, 1e-3, 1.15, flat=0.2),
    "thin and many": lambda: rows_around(60, 45, 1e-4, 1.2, flat=0.5),
}


@pytest.mark.parametrize("name", NO_LAYERS)
def test_what_is_stretched_otherwise_is_no_layer(name):
    layers, at_walls, elsewhere = found(NO_LAYERS[name]())
    assert not at_walls
    assert elsewhere.cells.tolist() == layers.cells.tolist()


@pytest.mark.parametrize("name", LAYERS)
def test_layers_of_walls_are_kept_whole(name):
    layers, at_walls, elsewhere = found(LAYERS[name]())
    assert at_walls
    assert not elsewhere
    assert at_walls.nodes[layers.nodes].all()
    if name != "hardly any":  # there rows go on where cells are hardly stretched
        assert at_walls.nodes.tolist() == layers.nodes.tolist()
    assert (at_walls.median, at_walls.largest) == (layers.median, layers.largest)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_only_what_lies_along_the_wall_is_a_layer_of_it(cells):
    """Rows that grow until cells are stretched away from the body."""
    mesh = rows_around(120, 15, 1e-2, 1.3, cells=cells)
    _, at_walls, elsewhere = found(mesh)
    row = np.arange(len(mesh.points)) // 120
    last = row[at_walls.nodes].max()
    assert 5 <= last <= 7
    assert np.count_nonzero(at_walls.nodes) == 120 * (last + 1)
    assert elsewhere
    assert not (at_walls.cells & elsewhere.cells).any()


def test_rows_have_nodes_over_nodes():
    """Both are thinner at their walls alike, but cells of one lie in no rows that anybody could have made."""
    assert found(squeezed(0.8, sheared_mesh(37, amplitude=0.0), everywhere=True))[1]
    layers, at_walls, _ = found(squeezed(0.8, moved_hole_mesh(0.033, shift=0.0), everywhere=True))
    assert layers
    assert not at_walls


def test_each_piece_is_judged_by_itself():
    layered, swirl = layered_mesh(10, 50, around=60), swirled_mesh(60)
    points = np.vstack([layered.points, swirl.points * 2.0 + 20.0])
    blocks = [
        type(block)(block.kind, block.nodes + offset, block.regions)
        for mesh, offset in ((layered, 0), (swirl, len(layered.points)))
        for block in mesh.cells
    ]
    _, at_walls, elsewhere = found(type(layered)(points, tuple(blocks)))
    inside = np.arange(len(points)) < len(layered.points)
    assert at_walls.nodes.any()
    assert elsewhere.nodes.any()
    assert inside[at_walls.nodes].all()
    assert not inside[elsewhere.nodes].any()


def test_small_changes_of_the_input_are_no_cliff():
    """Stretched by 2.0 and by 2.1, thrown by 0.15 and by 0.3: nothing is held."""
    for factor in (1.9, 2.0, 2.1, 2.5, 3.0):
        for amount in (0.15, 0.3):
            assert not found(stretched(factor, amount))[1]
