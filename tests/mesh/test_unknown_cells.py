"""Cells of a kind that is not known are never taken for another kind: their nodes are held, and they are named."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet import CellBlock, InputError, Mesh
from gmsnet.cells.table import CELLS
from gmsnet.io.gmsh_sections import KINDS as GMSH_KINDS
from gmsnet.io.medit import KINDS as MEDIT_KINDS
from gmsnet.io.su2 import CODES as SU2_CODES
from gmsnet.mesh.known_cells import unknown_cells, unmeasured
from gmsnet.mesh.vtk_types import VTK_KINDS, VTK_ORDERS
from gmsnet.topology.topology import Topology

REASON = "node of a cell that is not smoothed"


@pytest.fixture(scope="module")
def mixed():
    """A random square with two cells of sixteen nodes each, made of nodes that may move without them."""
    square = gmsnet.random_mesh(400, seed=11)
    free = Topology.of(square).free
    quads = CellBlock("quad16", free[:32].reshape(2, 16), [3, 3])
    return Mesh(square.points, (*square.cells, quads))


def test_a_kind_that_is_not_in_the_table_has_no_dimension_and_no_corners():
    block = CellBlock("quad16", np.arange(16)[None], [0])
    assert block.dimension is None
    assert not block.triangular
    for fact in ("cell", "corners"):
        with pytest.raises(InputError, match="cells of type 'quad16' are not known: known are vertex, line"):
            getattr(block, fact)


def test_a_kind_of_the_table_has_what_stands_there():
    block = CellBlock("triangle6", np.arange(6)[None], [0])
    assert (block.cell, block.dimension, block.corners, block.triangular) == (CELLS["triangle6"], 2, 3, True)
    assert CellBlock("polygon", np.arange(5)[None], [0]).corners == 5
    assert not CellBlock("tetra10", np.arange(10)[None], [0]).triangular


@pytest.mark.parametrize("kind", [kind for kind in CELLS.values() if kind.nodes], ids=lambda kind: kind.name)
def test_cells_must_have_as_many_nodes_as_their_kind(kind):
    with pytest.raises(InputError, match=f"a cell of type '{kind.name}' has {kind.nodes} nodes, got {kind.nodes + 1}"):
        CellBlock(kind.name, np.arange(kind.nodes + 1)[None], [0])


def test_their_nodes_are_held_and_a_note_names_them(mixed):
    result = gmsnet.smooth(mixed, max_sweeps=2)
    nodes = np.unique(mixed.cells[-1].nodes)
    assert result.held[REASON].tolist() == nodes.tolist()
    assert not result.moved[nodes].any()
    assert result.moved.any()
    assert "the nodes of 2 quad16 cells are held: gmsnet does not know this type of cells" in result.notes
    assert (unknown_cells(mixed), unmeasured(mixed)) == ("2 quad16 cells", "2 quad16 cells")


def test_a_mesh_of_known_kinds_has_no_such_note(mixed):
    result = gmsnet.smooth(Mesh(mixed.points, mixed.cells[:-1]), max_sweeps=1)
    assert not [note for note in result.notes if "does not know" in note]


def test_whether_they_are_volumes_is_left_open():
    points = np.random.default_rng(0).random((16, 3))
    with pytest.raises(InputError, match=r"cells of a type that gmsnet does not know \(1 quad16 cell\)") as raised:
        gmsnet.smooth(Mesh(points, (CellBlock("quad16", np.arange(16)[None], [0]),)))
    assert "whether it is a surface or a volume cannot be told" in str(raised.value)


def test_they_have_no_markers(mixed):
    named = Mesh(mixed.points, mixed.cells, region_names={(3, 3): "solid"})
    assert {"solid", "3"} & set(named.markers) == {"3"} & set(Mesh(mixed.points, mixed.cells[:-1]).markers)


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".msh", ".mesh", ".su2", ".ply", ".obj", ".off", ".stl", ".ele"])
def test_no_format_writes_them_as_something_else(mixed, suffix, tmp_path):
    with pytest.raises(InputError, match="cannot hold cells of type 'quad16'"):
        gmsnet.write(mixed, tmp_path / f"mixed{suffix}")
    assert not list(tmp_path.iterdir())


def test_formats_name_known_kinds_only():
    named = {kind.name for kind in GMSH_KINDS.values()} | {*MEDIT_KINDS.values(), *SU2_CODES.values()}
    assert named | set(VTK_KINDS.values()) <= set(CELLS)
    for code, order in VTK_ORDERS.items():
        assert sorted(order) == list(range(CELLS[VTK_KINDS[code]].nodes))
    for kind in GMSH_KINDS.values():
        assert kind.order is None or sorted(kind.order) == list(range(CELLS[kind.name].nodes))
