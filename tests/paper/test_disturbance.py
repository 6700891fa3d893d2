from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import Curve, good_mesh
from gmsnet.paper.disturbance import Disturbance, min_angle, push


@pytest.fixture(scope="module")
def good():
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    return good_mesh([[Curve(corners[k : k + 2], "side") for k in range(4)]], 0.08)


def test_min_angle_is_that_of_the_report(good):
    nodes = good.cells[0].nodes
    found = min_angle(*(good.points[nodes[:, k]] for k in range(3)))
    assert found == pytest.approx(gmsnet.quality(good).min_angle, abs=1e-9)


@pytest.mark.parametrize("angle", [0.2, 4.0, 15.0])
@pytest.mark.parametrize("direction", [0.0, 2.0, 5.0])
def test_a_push_makes_the_asked_angle_and_keeps_the_cells_valid(good, angle, direction):
    nodes = good.cells[0].nodes
    node = int(np.setdiff1d(nodes, good.cells[1].nodes)[7])
    points = good.points.copy()
    push(points, nodes, node, direction, angle)
    assert (points != good.points).any(axis=1).nonzero()[0].tolist() == [node]
    way = points[node] - good.points[node]
    assert np.arctan2(way[1], way[0]) % (2 * np.pi) == pytest.approx(direction % (2 * np.pi))
    report = gmsnet.quality(good.with_points(points))
    assert report.inverted == 0
    assert report.min_angle.min() == pytest.approx(angle, abs=1e-6)


def test_a_push_leaves_what_is_flatter_already(good):
    nodes = good.cells[0].nodes
    node = int(np.setdiff1d(nodes, good.cells[1].nodes)[0])
    points = good.points.copy()
    push(points, nodes, node, 1.0, 60.0)
    assert np.array_equal(points, good.points)


@pytest.mark.parametrize("seed", range(5))
def test_throws_move_the_asked_share_and_stay_above_the_flattest(good, seed):
    inner = np.setdiff1d(good.cells[0].nodes, good.cells[1].nodes)
    thrown = Disturbance(share=0.4, amount=0.7, pushed=0, flattest=6.0).applied(good, seed)
    moved = (thrown.points != good.points).any(axis=1).nonzero()[0]
    assert len(moved) == round(0.4 * len(inner))
    assert np.isin(moved, inner).all()
    assert thrown.cells is good.cells
    report = gmsnet.quality(thrown)
    assert report.inverted == 0
    assert report.min_angle.min() >= 6.0


def test_pushed_nodes_are_apart_and_set_the_least_angle(good):
    pushed = Disturbance(share=0.0, amount=0.5, pushed=5, flattest=1.0).applied(good, 3)
    moved = (pushed.points != good.points).any(axis=1).nonzero()[0]
    assert len(moved) == 5
    assert max(np.isin(row, moved).sum() for row in good.cells[0].nodes) == 1
    report = gmsnet.quality(pushed)
    assert report.inverted == 0
    assert 1.0 <= report.min_angle.min() <= 1.5
    assert (report.min_angle < 1.6).sum() >= 5


def test_the_seed_decides(good):
    rule = Disturbance(share=0.3, amount=0.5, pushed=2, flattest=2.0)
    assert np.array_equal(rule.applied(good, 1).points, rule.applied(good, 1).points)
    assert not np.array_equal(rule.applied(good, 1).points, rule.applied(good, 2).points)
