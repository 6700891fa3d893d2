"""Validity of second-order cells: exact where float64 leaves a doubt."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from support import curved

from gmsnet.kernels.simplex.bernstein import CORNERS, NAMES, NODES, QUAD, TRIANGLE, WIDEST
from gmsnet.measure.curved import exact_sign, judge_curved


def table(nodes, kind):
    cells = np.full((1, WIDEST), -1, dtype=np.int32)
    cells[0, : NODES[kind]] = range(NODES[kind])
    return np.ascontiguousarray(nodes, dtype=float), cells, np.array([kind], dtype=np.int8)


@pytest.mark.parametrize("kind", range(3))
def test_exact_signs_are_those_of_the_twin(kind):
    rng = np.random.default_rng(kind)
    seen = set()
    for k in range(200):
        nodes = curved.random_cell(rng, NAMES[kind], (0.1, 0.3)[k % 2])
        nodes = np.round(nodes, 1 + k % 3)  # coarse coordinates make values that are exactly zero
        sign = exact_sign(nodes, kind)
        assert sign == curved.exact_sign(nodes, NAMES[kind], depth=7, budget=4000)
        seen.add(sign)
    assert seen >= {1, -1}


@pytest.mark.parametrize("kind", [TRIANGLE, QUAD])
def test_a_first_order_cell_has_the_sign_of_its_corners(kind):
    rng, corners, seen = np.random.default_rng(kind), CORNERS[kind], set()
    for k in range(300):
        nodes = rng.integers(0, 3 + k % 5, (corners, 2)) * 0.1  # on a grid that floats miss by their rounding
        exact = [[Fraction(v) for v in node] for node in nodes.tolist()]
        around = [(exact[j], exact[(j + 1) % corners], exact[j - 1]) for j in range(corners)]
        least = min((p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]) for o, p, q in around)
        sign, quality = judge_curved(*table(nodes, kind))
        assert sign.tolist() == [1 if least > 0 else -1]
        assert quality[0] <= 0 or least > 0
        seen.add(least > 0)
    assert seen == {True, False}


def test_a_corner_without_an_angle_is_invalid_exactly():
    """Where an edge leaves a corner along the other one, det J is zero there: float64 cannot tell, rationals can."""
    nodes = curved.straight_nodes(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    nodes[5] = [0.25, 0.25]  # the slope of the edge 2–0 at the corner 0 is 4·(¼, ¼) − (0, 1) = (1, 0)
    assert curved.value(curved.determinant(nodes, "triangle6"), 0, 0) == 0
    sign, quality = judge_curved(*table(nodes, 0))
    assert sign.tolist() == [-1]
    assert quality[0] <= 0


def test_a_straight_cell_has_quality_one():
    sign, quality = judge_curved(*table(curved.straight_nodes(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]])), 2))
    assert sign.tolist() == [1]
    assert quality[0] == pytest.approx(1.0, abs=1e-12)
