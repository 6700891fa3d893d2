"""Which cells miss a target, and the rounds over their nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.kernels.methods import below, missing, ranking
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import Precision, plain_guard
from gmsnet.measure.target import Target
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

coordinate = st.floats(-4.0, 4.0).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate)


def angles(a, b, c):
    """In degrees, by the law of cosines, of a triangle with three different corners."""
    sides = [math.dist(b, c), math.dist(c, a), math.dist(a, b)]
    for k in range(3):
        opposite, one, other = sides[k], sides[k - 1], sides[k - 2]
        yield math.degrees(math.acos(min(1.0, max(-1.0, (one**2 + other**2 - opposite**2) / (2.0 * one * other)))))


@given(point, point, point, st.floats(0.0, 1.0), st.one_of(st.just(0.0), st.floats(1.0, 60.0)))
def test_a_cell_misses_a_target_as_its_definition_says(a, b, c, quality, angle):
    if len({a, b, c}) < 3:
        return
    doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    shape = 2.0 * math.sqrt(3.0) * doubled / (math.dist(a, b) ** 2 + math.dist(b, c) ** 2 + math.dist(c, a) ** 2)
    least = min(angles(a, b, c))
    if abs(shape - quality) < 1e-9 or abs(least - angle) < 1e-4:
        return
    expected = shape < quality or (angle > 0.0 and (doubled <= 0.0 or least < angle))
    px, py, qx, qy = b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]
    assert missing.missing(px, py, qx, qy, quality, math.tan(math.radians(angle)), None) == expected


@pytest.mark.parametrize("target", [Target(0.4), Target(angle=25.0), Target(0.5, 20.0)])
def test_rows_and_nodes_against_a_slow_twin(target):
    mesh = gmsnet.random_mesh(300, seed=2)
    topology = Topology.of(mesh)
    points, near, may_move = near_points(mesh, topology), topology.near, topology.near_free
    report = gmsnet.quality(mesh)
    rows = below.missed(points, topology.simplices, *target.limits)
    expected = np.flatnonzero(target.missed(report.shape, report.min_angle))
    assert sorted(sorted(topology.memory[near[t]].tolist()) for t in rows) == sorted(
        sorted(topology.triangles[t].tolist()) for t in expected
    )
    assert target.missed_in(report).tolist() == expected.tolist()
    seen = np.zeros(len(points), dtype=bool)
    free = ranking.free_nodes(near, rows, np.zeros(len(rows)), 0.0, may_move, topology.memory, seen)
    assert len(set(free.tolist())) == len(free)
    assert set(free.tolist()) == {i for i in near[rows].ravel().tolist() if may_move[i]}
    chosen, tried = free[: len(free) // 2], np.zeros(len(points), dtype=bool)
    tried[chosen[::3]] = True
    around = {t for t in rows.tolist() if tried[near[t]].any()}
    found = below.still_missing(points, chosen, topology.links, may_move, *target.limits, tried, seen)
    assert len(set(found.tolist())) == len(found)
    assert set(found.tolist()) == {i for t in around for i in near[t].tolist() if may_move[i]}
    assert not seen.any()
    assert not tried.any()


def test_rounds_end_where_nothing_is_missed_or_too_much_was_done():
    mesh = gmsnet.random_mesh(500, seed=3)
    topology, target = Topology.of(mesh), Target(0.3)
    near, may_move, ids = topology.near, topology.near_free, topology.memory

    def made(plan, most, everywhere=False):
        points, tally = near_points(mesh, topology), np.zeros(3, dtype=np.int64)
        rows = below.missed(points, topology.simplices, *target.limits)
        shape, seen = np.zeros(len(rows)), np.zeros(len(points), dtype=bool)
        nodes = ranking.free_nodes(near, rows, shape, 0.0, may_move, ids, seen)
        guard, scale, limits = plain_guard(Precision()), target.shape, target.limits
        left = below.rounds(
            points, nodes, topology.links, may_move, ids, guard, np.array(plan), most, scale, limits, everywhere, tally
        )
        rows = below.missed(points, topology.simplices, *target.limits)
        assert set(left.tolist()) == {i for i in near[rows].ravel().tolist() if may_move[i]}
        return points.tobytes(), tally.tolist(), len(nodes), len(left)

    plan = [(2, 1), (3, 1), (4, 2), (5, 2), (6, 2), (6, 2)]
    assert made(plan, 10**6)[3] == 0
    assert made(plan, 10**6) == made([*plan, (6, 2)], 10**6)
    one, nodes = made([(2, 1)], 10**6), made([(2, 1)], 10**6)[2]
    assert made(plan, nodes - 1) == one  # the first round has made that many, so that there is no second one
    assert made(plan, nodes)[0] != one[0]
    some, all_of_them = made([(2, 1)], 10**6)[1][MOVED], made([(2, 1)], 10**6, everywhere=True)[1][MOVED]
    assert 0 < some < all_of_them == nodes  # the others' cells had been untangled before their turn


@given(
    st.lists(point, min_size=3, max_size=9, unique=True), point, st.floats(0.0, 1.0), st.floats(0.0, 1.5),
)  # fmt: skip
def test_a_star_misses_a_target_if_one_of_its_triangles_does(corners, centre, quality, tangent):
    ring, (x, y) = np.array(corners).ravel(), centre
    expected = any(
        missing.missing(a[0] - x, a[1] - y, b[0] - x, b[1] - y, quality, tangent, None)
        for a, b in zip([corners[-1], *corners[:-1]], corners, strict=True)
    )
    assert missing.any_missing(ring, len(corners), None, x, y, quality, tangent) == expected
