"""GETMe for volumes of several kinds against its formula, node by node."""

from __future__ import annotations

import numpy as np
import pytest
from support import blocks

from gmsnet.cells.dual import dual_places, ideal_corners
from gmsnet.cells.table import CELLS
from gmsnet.kernels.methods import getme_solids
from gmsnet.kernels.star.guard import Precision, plain_guard
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.methods.getme import duals, getme3
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.solids import KINDS

SPLIT = {"wedges": [(0, 0), (1, 2)], "pyramids": [(2, 1, 1), (1, 1, 1)]}


def shape(corners, kind):
    """η of the worst corner, by ‖A W⁻¹‖."""
    found = []
    for (first, *ends), inverse in zip(kind.simplices, kind.ideal, strict=True):
        deviation = (corners[ends] - corners[first]).T @ np.array(inverse)
        size = np.linalg.det(deviation)
        found.append(3 * np.sign(size) * abs(size) ** (2 / 3) / np.square(deviation).sum())
    return min(found)


def transformed(corners, kind):
    """All corners, where the transformation takes them."""
    means, normals = dual_places(kind, corners)
    moved = means + duals().sigma[KINDS.index(kind.name)] * normals
    centre = corners.mean(axis=0)
    moved -= moved.mean(axis=0)
    return centre + np.linalg.norm(corners - centre) / np.linalg.norm(moved) * moved


def planned(mesh, power):
    topology = volume_of(wound_of(mesh))
    points, stars = space_points(mesh)[topology.memory], topology.stars.blocks
    shifts = np.zeros((len(stars.centre), 3))
    getme_solids.plan(points, stars, 0, len(stars.filled), duals(), power, shifts)
    lanes = [block * LANES3 + lane for block, filled in enumerate(stars.filled) for lane in range(filled)]
    return topology, points, {int(topology.memory[stars.centre[lane]]): shifts[lane] for lane in lanes}


@pytest.mark.parametrize("power", [0, 1, 2])
@pytest.mark.parametrize(("split", "jitter"), [((), 0.3), (("wedges",), 0.2), (("wedges", "pyramids"), 0.9)])
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e200])
def test_each_node_goes_to_the_mean_of_its_places(power, split, jitter, scale):
    mesh = blocks.block(3, 4, 3, jitter=jitter, seed=power, scale=scale, **{name: SPLIT[name] for name in split})
    topology, at, found = planned(mesh, power)
    near = np.empty((len(at), 3))
    near[topology.memory] = at[:, :3]
    assert sorted(found) == np.sort(topology.free).tolist()
    total, places = np.zeros(len(mesh.points)), np.zeros((len(mesh.points), 3))
    for cells in mesh.cells:
        kind = CELLS[cells.kind]
        for nodes in cells.nodes:
            corners = near[nodes]
            weight = (1 - shape(corners, kind)) ** power
            total[nodes] += weight
            places[nodes] += weight * transformed(corners, kind)
    for node, shift in found.items():
        np.testing.assert_allclose(near[node] + shift, places[node] / total[node], atol=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_an_ideal_cell_stays_and_any_other_becomes_more_regular(name):
    kind, rng = CELLS[name], np.random.default_rng(1)
    ideal = ideal_corners(kind)
    np.testing.assert_allclose(transformed(ideal, kind), ideal, atol=1e-14)
    for _ in range(50):
        corners = ideal + rng.normal(scale=0.6, size=ideal.shape)
        for _ in range(60):
            corners = transformed(corners, kind)
        assert shape(corners, kind) > 0.999  # inverted ones, too


def test_the_guard_moves_nodes_by_what_was_planned():
    topology, points, found = planned(blocks.block(3, 3, 3, jitter=0.1, **SPLIT), 1)
    stars, tally, after = topology.stars.blocks, np.zeros(3, dtype=np.int64), points.copy()
    shifts = np.array([found[node] for node in topology.memory[stars.centre].tolist()])
    getme3.carry_out(after, stars, 0, len(stars.filled), plain_guard(Precision()), shifts, tally)
    assert tally.tolist() == [len(found), 0, 0]
    for node, shift in zip(stars.centre.tolist(), shifts, strict=True):
        np.testing.assert_array_equal(after[node, :3], points[node, :3] + shift)
