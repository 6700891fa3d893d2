"""Heights over a chart: exact for quadratics, and places brought near to triangles."""

from __future__ import annotations

import numpy as np

from gmsnet.constraints.heights import heights_at, within
from gmsnet.measure.surface_change import Grid

RNG = np.random.default_rng(4)


def quadratic(at):
    x, y = at.T
    return 0.3 + 0.2 * x - 0.5 * y + 0.7 * x * x - 0.4 * x * y + 0.1 * y * y


def test_a_quadratic_is_told_exactly_with_its_slope():
    nodes, at = RNG.uniform(-1, 1, (400, 2)), RNG.uniform(-0.8, 0.8, (50, 2))
    found = heights_at(at, nodes, quadratic(nodes))
    x, y = at.T
    assert np.allclose(found.height, quadratic(at), atol=1e-6)
    assert np.allclose(found.slope, np.column_stack([0.2 + 1.4 * x - 0.4 * y, -0.5 - 0.4 * x + 0.2 * y]), atol=1e-4)
    assert found.off.max() < 1e-6


def test_a_step_is_off_every_quadratic():
    nodes = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), axis=-1).reshape(-1, 2)
    found = heights_at(np.array([[9.4, 10.0], [2.0, 10.0]]), nodes, np.where(nodes[:, 0] > 9.5, 1.0, 0.0))
    assert found.off[0] > 0.1
    assert found.off[1] < 1e-9


def test_few_nodes_and_nodes_on_one_line_are_enough():
    found = heights_at(np.zeros((1, 2)), np.array([[1.0, 0.0], [-1.0, 0.0], [2.0, 0.0]]), np.full(3, 0.5))
    assert np.allclose(found.height, 0.5)


def test_places_come_within_their_limit_of_triangles_and_no_nearer():
    triangles = RNG.normal(size=(200, 3, 3))
    triangles[:20, 2] = triangles[:20, 0]  # without area
    places, limit = 3.0 * RNG.normal(size=(200, 3)), RNG.uniform(0.1, 2.0, 200)
    moved = within(places, triangles, limit)
    for k in range(200):
        grid = Grid(triangles[k : k + 1])
        (before, after), _ = grid.nearest(np.stack([places[k], moved[k]]))
        assert np.isclose(after, min(before, limit[k]))
        assert np.isclose(np.linalg.norm(moved[k] - places[k]), before - after, atol=1e-9)
