"""GETMe for tetrahedra against its formula, node by node."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from support import volumes
from support.naive_objectives3 import shape

from gmsnet.kernels.methods import getme3
from gmsnet.kernels.star.guard import Precision, plain_guard
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume


def transformed(corners, sigma):
    """All four nodes of a tetrahedron, each along the normal of the opposite face, scaled about the centroid."""
    moved = []
    for k in range(4):
        a, b, c = (corners[i] for i in range(4) if i != k)
        normal = np.cross(b - a, c - a)
        normal = normal * np.sign(normal @ (corners[k] - a))
        normal = normal * np.sign(np.linalg.det(corners[1:] - corners[0]))
        moved.append(corners[k] + sigma * normal / np.sqrt(np.linalg.norm(normal)))
    moved = np.array(moved)
    lengths = [sum(np.linalg.norm(p[i] - p[j]) for i, j in combinations(range(4), 2)) for p in (corners, moved)]
    return corners.mean(axis=0) + lengths[0] / lengths[1] * (moved - moved.mean(axis=0))


def planned(mesh, sigma, power):
    """The shifts by places in memory, and what they are of."""
    topology = Volume.of(mesh)
    points, blocks = space_points(mesh)[topology.memory], topology.stars.blocks
    shifts = np.zeros((len(blocks.centre), 3))
    getme3.plan(points, blocks, 0, len(blocks.filled), sigma, power, shifts)
    found = {}
    for block, filled in enumerate(blocks.filled):
        for lane in range(block * LANES3, block * LANES3 + filled):
            found[int(blocks.centre[lane])] = shifts[lane]
    return topology, points, found


@pytest.mark.parametrize(("sigma", "power"), [(0.5, 2), (1.0, 0), (2.0, 1)])
@pytest.mark.parametrize("thrown", [0.0, 0.5])
def test_each_node_goes_to_the_mean_of_its_places(sigma, power, thrown):
    points, cells = volumes.cube(60, 3)
    free = Volume.of(volumes.mesh_of(points, cells)).free
    points[free[:3]] += thrown * np.random.default_rng(0).uniform(-1, 1, (3, 3))
    topology, at, found = planned(volumes.mesh_of(points, cells), sigma, power)
    assert sorted(found) == np.flatnonzero(topology.near_free).tolist()
    rows = np.where(topology.near_orientation[:, None] > 0, topology.near, topology.near[:, [0, 2, 1, 3]])
    for node, shift in found.items():
        total, place = 0.0, np.zeros(3)
        for row in rows[(rows == node).any(axis=1)].tolist():
            corners = at[row, :3]
            weight = (1 - shape(corners)) ** power
            total += weight
            place += weight * transformed(corners, sigma)[row.index(node)]
        np.testing.assert_allclose(at[node, :3] + shift, place / total, atol=1e-12)


def test_a_regular_tetrahedron_stays_and_any_other_becomes_more_regular():
    regular = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]], float)
    np.testing.assert_allclose(transformed(regular, 0.7), regular, atol=1e-14)
    rng = np.random.default_rng(1)
    for _ in range(50):
        corners = rng.normal(size=(4, 3))
        for _ in range(60):
            corners = transformed(corners, 0.5)
        assert shape(corners) > 0.999  # inverted ones, too


def test_the_guard_moves_nodes_by_what_was_planned():
    mesh = volumes.mesh_of(*volumes.lattice(3, 0.1, 2))
    topology, points, found = planned(mesh, 0.5, 2)
    blocks, tally, after = topology.stars.blocks, np.zeros(3, dtype=np.int64), points.copy()
    shifts = np.array([found[node] for node in blocks.centre.tolist()])
    getme3.carry_out(after, blocks, 0, len(blocks.filled), plain_guard(Precision()), shifts, tally)
    assert tally.tolist() == [len(found), 0, 0]
    for node, shift in found.items():
        np.testing.assert_array_equal(after[node, :3], points[node, :3] + shift)
