"""Volumes that are wrong as cells: named, their nodes held, and what is around them smoothed all the same."""

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import block_volume, disturb, lattice_volume
from gmsnet.measure import defects
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.mixed_volume import volume_of, wound_of


def thrown(kind, cells=4):
    mesh = block_volume(cells, kind)
    mesh = Mesh(mesh.points, tuple(block for block in mesh.cells if block.dimension == 3))
    return disturb(mesh, volume_of(wound_of(mesh)).free, 0.2, seed=1)


def with_nodes(mesh, nodes):
    return Mesh(mesh.points, (CellBlock(mesh.cells[0].kind, nodes, mesh.cells[0].regions),))


def test_a_hexahedron_that_names_a_node_twice():
    mesh = thrown("hexahedron")
    nodes = mesh.cells[0].nodes.copy()
    nodes[21, 7] = nodes[21, 6]
    mesh = with_nodes(mesh, nodes)
    named = gmsnet.quality(mesh).summary()["defects"]
    assert named[defects.REPEATED] == {"count": 1, "cells": [21]}
    result = gmsnet.smooth(mesh)
    assert not result.moved[nodes[21]].any()
    assert result.moved.any()
    assert result.after.inverted == 0


def test_wedges_the_other_way_round_are_read_the_other_way_round():
    mesh = thrown("wedge")
    nodes = mesh.cells[0].nodes.copy()
    nodes[::3] = nodes[::3][:, [3, 4, 5, 0, 1, 2]]
    expected, result = gmsnet.smooth(mesh), gmsnet.smooth(with_nodes(mesh, nodes))
    assert result.after.inverted == 0
    np.testing.assert_allclose(result.after.shape.min(), expected.after.shape.min(), atol=0.01)
    assert any("other order" in note for note in result.notes)


def test_a_pyramid_with_its_apex_in_the_plane_of_its_base():
    mesh = thrown("pyramid", 3)
    points, nodes = mesh.points.copy(), mesh.cells[0].nodes
    apex = nodes[0, 4]
    points[apex] = points[nodes[0, :4]].mean(axis=0)
    flat = Mesh(points, mesh.cells)
    fixed = gmsnet.smooth(flat, fixed=[apex])
    assert not fixed.moved[apex]
    assert 0 in fixed.before.cell[~fixed.before.valid]
    assert gmsnet.smooth(flat).after.inverted == 0


def test_a_quadrilateral_on_two_triangles():
    mesh = thrown("hexahedron", 3)
    nodes = mesh.cells[0].nodes
    middle = nodes[13]
    cut = [[0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6], [0, 2, 7, 5]]
    tetrahedra = middle[np.array(cut)]
    cells = (
        CellBlock("hexahedron", np.delete(nodes, 13, axis=0), np.zeros(len(nodes) - 1, dtype=np.int64)),
        CellBlock("tetra", tetrahedra, np.zeros(len(tetrahedra), dtype=np.int64)),
    )
    result = gmsnet.smooth(Mesh(mesh.points, cells))
    assert not result.moved[middle].any()
    assert set(middle.tolist()) <= set(result.held["facet against others of other nodes"].tolist())


@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
def test_cells_that_are_there_twice_are_told_with_their_numbers(kind):
    """The copies are in a block of their own, and name their nodes in another order."""
    mesh = thrown(kind) if kind == "hexahedron" else lattice_volume(4)
    block = next(each for each in mesh.cells if each.dimension == 3)
    copies = CellBlock(kind, np.roll(block.nodes[[50, 7]], 1, axis=1)[:, ::-1], block.regions[[50, 7]])
    first = sum(len(each.nodes) for each in mesh.cells)
    result = gmsnet.smooth(Mesh(mesh.points, (*mesh.cells, copies)))
    assert (
        "doubled: 2 cells have all nodes of another one, and what is around is held; "
        f"the first is cell {first}, with the nodes of cell 50 (numbers from 0)"
    ) in result.notes
    assert not result.moved[copies.nodes].any()
    assert not [note for note in gmsnet.smooth(mesh).notes if "doubled" in note]
