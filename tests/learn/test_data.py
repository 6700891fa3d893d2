from __future__ import annotations

import numpy as np
import pytest

from gmsnet.generate import random_mesh
from gmsnet.learn import data
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def test_twenty_squares_of_differing_size_and_density():
    drawn = data.meshes(0)
    inside = [len(mesh.points) - len(mesh.cells[1].nodes) for mesh in drawn]
    sides = [np.ptp(mesh.points) for mesh in drawn]
    assert len(drawn) == sum(data.SPLIT) == 20
    assert data.NODES[0] <= min(inside) < max(inside) <= data.NODES[1]
    assert data.SIZES[0] <= min(sides) < max(sides) <= data.SIZES[1]
    assert len(set(inside)) > 15
    assert all(np.array_equal(a.points, b.points) for a, b in zip(drawn, data.meshes(0), strict=True))
    assert len(data.meshes(1)[0].points) != len(drawn[0].points)


def test_stars_of_a_mesh_are_its_rings_counter_clockwise():
    mesh = random_mesh(60, seed=1, size=5.0)
    stars = data.Stars.of_mesh(mesh)
    triangles = mesh.cells[0].nodes
    free = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells[1].nodes)
    assert len(stars) == len(free) == 60
    for k, node in enumerate(free):
        around = triangles[(triangles == node).any(axis=1)]
        n = stars.degree[k]
        assert n == len(around)
        ring = stars.ring[k, :n] * stars.size[k] + mesh.points[node]
        found = [int(np.argmin(np.linalg.norm(mesh.points - place, axis=1))) for place in ring]
        assert mesh.points[found] == pytest.approx(ring, abs=1e-12)
        assert found[0] == min(found)
        pairs = {(found[j], found[(j + 1) % n]) for j in range(n)}
        rotated = [np.roll(t, -list(t).index(node)) for t in around.tolist()]
        assert pairs == {(int(t[1]), int(t[2])) for t in rotated}
        assert (stars.ring[k, n:] == 0).all()
        box = np.ptp(np.vstack([ring, mesh.points[node]]), axis=0)
        assert stars.size[k] == pytest.approx(box.max())


def test_the_free_node_counts_for_the_box():
    ring = np.array([[[1.0, 0.0], [3.0, 0.0], [2.0, 1.0], [0.0, 0.0]]])
    stars = data.Stars.of(np.zeros((1, 2)), ring, np.array([3]))
    assert stars.size.tolist() == [3.0]
    assert stars.ring[0, :3] == pytest.approx(ring[0, :3] / 3)


def test_stars_of_a_mesh_in_another_plane_are_the_same():
    flat = random_mesh(30, seed=2)
    lifted = np.column_stack([np.full(len(flat.points), 4.0), flat.points])
    stars, other = data.Stars.of_mesh(flat), data.Stars.of_mesh(Mesh(lifted, flat.cells))
    assert np.array_equal(stars.ring, other.ring)


def test_joined_keeps_each_star():
    parts = [data.Stars.of_mesh(random_mesh(20, seed=s)) for s in (1, 2)]
    whole = data.joined(parts)
    assert len(whole) == 40
    for at, part in ((0, parts[0]), (20, parts[1])):
        most = part.ring.shape[1]
        assert np.array_equal(whole.ring[at : at + 20, :most], part.ring)
        assert (whole.ring[at : at + 20, most:] == 0).all()


def test_a_mesh_without_free_nodes_has_no_stars():
    mesh = Mesh(np.eye(3, 2), (CellBlock("triangle", np.array([[0, 1, 2]]), np.zeros(1, dtype=int)),))
    assert len(data.Stars.of_mesh(mesh)) == 0
