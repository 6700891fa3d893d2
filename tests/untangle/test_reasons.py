"""Why cells stay inverted."""

from __future__ import annotations

import numpy as np
import pytest
from support.tangles import grid, mesh_of, moved, untangled

import gmsnet
from gmsnet.generate import block_volume
from gmsnet.topology.topology import Topology
from gmsnet.untangle.reasons import CROSSING, EMPTY, HELD, kernel_depth
from gmsnet.untangle.result import CORNER_HELD


def test_a_cell_whose_nodes_are_all_held():
    """A corner pulled in over the diagonal of its cell."""
    result, _, topology, _ = untangled(moved(grid(4), [4], [[0.3, 0.7]]))
    assert [row.reason for row in result.unmended] == [HELD]
    assert result.after == 1
    assert (topology.near_colours[topology.near[result.unmended[0].row]] < 0).all()
    assert result.unmended[0].place == pytest.approx(((0.3 + 0.0 + 0.25) / 6, (0.7 + 0.75 + 1.0) / 6))  # over 2


def test_a_boundary_that_crosses_itself():
    """A bottom node pulled up above the top: two edges of the bottom cross two of the top."""
    mesh = grid(4)
    result, _, _, _ = untangled(moved(mesh, [10], [[0.5, 1.2]]))
    assert result.after > 0
    assert CROSSING in {row.reason for row in result.unmended}
    # In the coordinates of the run, which are divided by 2.
    places = [row.place for row in result.unmended if row.reason == CROSSING]
    assert all(y == pytest.approx(0.5) for _, y in places)


def test_a_ring_that_no_place_sees_all_of():
    angle = np.pi / 3 * np.arange(6)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    assert kernel_depth(ring, np.roll(ring, -1, axis=0)) == pytest.approx(np.sqrt(0.75) / 2)
    # A Z: each of its arms looks past the other.
    ring = np.array([[0, 0], [4, 0], [4, 3], [3, 3], [3, 1], [0, 1]], float)
    assert kernel_depth(ring, np.roll(ring, -1, axis=0)) > 0
    ring = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 2], [4, 2], [4, 3], [0, 3]], float)  # a C
    assert kernel_depth(ring, np.roll(ring, -1, axis=0)) < 0
    points = np.vstack([[2.0, 0.5], ring])
    result, before, _, _ = untangled(mesh_of(points, [(0, 1 + i, 1 + (i + 1) % 8) for i in range(8)]))
    assert (result.points == before).all()
    assert {row.reason for row in result.unmended} == {EMPTY}
    assert result.before == result.after == len(result.unmended)


def test_depth_is_zero_for_an_edge_of_no_length_and_for_a_point():
    ring = np.array([[0, 0], [1, 0], [1, 0], [0, 1]], float)
    assert kernel_depth(ring, np.roll(ring, -1, axis=0)) == 0
    assert kernel_depth(np.zeros((4, 2)), np.zeros((4, 2))) == 0


def test_all_held():
    mesh = moved(grid(4), [12], [[0.9, 0.6]])
    result, _, _, _ = untangled(mesh, Topology.of(mesh, np.ones(25, dtype=bool)))
    assert result.after == result.before == len(result.unmended) > 0
    assert {row.reason for row in result.unmended} == {HELD}


def test_a_corner_that_is_held_is_told_from_a_cell_that_is():
    """Of a hexahedron with free nodes, where those of an inverted corner may not move."""
    mesh = block_volume(3)
    points = mesh.points.copy()
    corner = np.flatnonzero((points == points.min(axis=0)).all(axis=1))[0]
    points[corner] += 0.45  # beyond the first node inside
    result = gmsnet.smooth(mesh.with_points(points))
    assert CORNER_HELD in {cell.reason for cell in result.unmended}
    assert HELD not in {cell.reason for cell in result.unmended}
