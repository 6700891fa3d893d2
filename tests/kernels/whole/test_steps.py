from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.kernels.whole.steps import count_below, largest_step
from gmsnet.topology.topology import Topology


@given(st.integers(0, 2**32 - 1))
def test_the_largest_step_is_where_a_first_triangle_has_no_area(seed):
    rng = np.random.default_rng(seed)
    points, shifts = rng.random((3, 2)), rng.normal(size=(3, 2))
    edges = points[1:] - points[0]
    if edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0] < 0:
        points = points[[0, 2, 1]]
    found = largest_step(points, np.array([[0, 1, 2]], dtype=np.int32), shifts)

    def area(share):
        moved = points + share * shifts
        a, b = moved[1] - moved[0], moved[2] - moved[0]
        return a[0] * b[1] - a[1] * b[0]

    ways = np.linspace(0.0, min(found, 50.0), 400)[1:-1]
    assert all(area(way) > -1e-12 for way in ways)
    if found < 1e3:
        assert abs(area(found)) < 1e-6 * max(1.0, found * found)


def test_simplices_are_counted_that_come_below_a_floor():
    mesh = gmsnet.random_mesh(50, seed=1)
    topology = Topology.of(mesh)
    before = mesh.points[topology.memory][:, :2].copy()
    points, simplices = before.copy(), topology.simplices
    assert count_below(points, before, simplices, 1e9, 0.0, 0.0) == 0  # none has a node that has moved
    node = int(np.flatnonzero(topology.near_free)[0])
    points[node] += 1e-9
    around = int((simplices.rows == node).any(axis=1).sum())
    assert count_below(points, before, simplices, 0.0, 0.0, 0.0) == 0
    assert count_below(points, before, simplices, 1e9, 0.0, 0.0) == around
    points[node] += 10.0
    assert 0 < count_below(points, before, simplices, 0.0, 0.0, 0.0) < around
