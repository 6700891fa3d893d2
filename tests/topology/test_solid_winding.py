"""Volumes of cells as they are summed to tell how a mesh is to be read, and what does not sway that."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.blocks import block, inner_nodes

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.kernels.topology.solids import volumes
from gmsnet.topology.solids import KINDS, tables

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
PLACES = {
    "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "pyramid": [*CUBE[:4], (0, 0, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hexahedron": CUBE,
}
SIXTIMES = {"tetra": 1, "pyramid": 2, "wedge": 3, "hexahedron": 6}


def six_volumes(points, kind, cells):
    cells = np.asarray(cells, dtype=np.int32)
    near = np.repeat(cells[:, :1], 8, axis=1)
    near[:, : cells.shape[1]] = cells
    found, size = np.empty((2, len(cells)))
    volumes(
        np.asarray(points, dtype=float), near, np.full(len(cells), KINDS.index(kind), np.uint8), tables(), found, size
    )
    assert (abs(found) <= size).all()
    return found


@pytest.mark.parametrize("kind", PLACES)
def test_of_reference_cells(kind):
    found = six_volumes(PLACES[kind], kind, [range(CELLS[kind].corners)])
    assert found == pytest.approx([SIXTIMES[kind]], abs=1e-15)


def integrated(corners):
    """Six times ∫ det J of a trilinear hexahedron: two places a direction are exact for what is of degree 2 in each."""
    root, total = 3.0**-0.5, 0.0
    signs = 2.0 * np.array(CUBE) - 1.0
    for place in root * signs:
        one = 1.0 + signs * place
        slopes = np.stack([signs[:, k] * np.delete(one, k, axis=1).prod(axis=1) / 8.0 for k in range(3)])
        total += np.linalg.det(slopes @ corners)
    return 6.0 * total


def test_of_hexahedra_of_any_shape():
    rng = np.random.default_rng(1)
    for _ in range(50):
        corners = np.array(CUBE) + rng.uniform(-1.0, 1.0, (8, 3))
        assert six_volumes(corners, "hexahedron", [range(8)]) == pytest.approx([integrated(corners)], abs=1e-12)


def test_the_sum_hangs_on_the_boundary_alone():
    mesh = block(3, 3, 3, wedges=[(1, 1)], pyramids=[(0, 0, 1), (2, 2, 2)])
    inner, rng = inner_nodes(mesh), np.random.default_rng(2)
    for reach in (1.0, 10.0, 1000.0):
        points = mesh.points + inner[:, None] * rng.uniform(-reach, reach, mesh.points.shape)
        total = sum(six_volumes(points, each.kind, each.nodes).sum() for each in mesh.cells)
        assert total == pytest.approx(6 * Fraction(27), abs=1e-9 * reach**3)


@pytest.mark.parametrize("reach", [20.0, 1000.0])
def test_a_node_that_is_far_off_does_not_turn_the_mesh_round(reach):
    mesh = block(3, 3, 3, pyramids=[(1, 1, 1)])
    for node in np.flatnonzero(inner_nodes(mesh)):
        for axis in range(3):
            points = mesh.points.copy()
            points[node, axis] += reach
            result = gmsnet.smooth(replace(mesh, points=points))
            assert 0 < result.before.inverted < sum(len(each.nodes) for each in mesh.cells) / 2
            assert result.after.inverted == 0
