"""Bernstein coefficients of det J against an exact rational twin, and the certificates that rest on them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import curved
from support.curved_kernels import certified_positive, curved_quality, lower_bound

from gmsnet.kernels.simplex import bernstein, jacobian
from gmsnet.kernels.simplex.bernstein import NAMES

KINDS = range(3)
U64, U32 = 2.0**-53, 2.0**-24
CELLS = 3334  # of each of the three kinds: 10⁴ altogether


def delta_of(nodes, unit=U64):
    return unit * np.abs(nodes).max()


def fractions(nodes):
    """Nodes relative to the first one, exactly."""
    return np.array([[Fraction(v) - Fraction(w) for v, w in zip(p, nodes[0], strict=True)] for p in nodes], object)


def coefficients(nodes, kind):
    """By the functions that are compiled, as they stand in the source, on fractions."""
    count = 3 if kind == bernstein.TRIANGLE6 else 6
    work, first, second, out = (np.zeros(shape, dtype=object) for shape in ((9, 2), (count, 2), (count, 2), 16))
    if kind == bernstein.TRIANGLE6:
        bernstein.differences_of_triangle.py_func(fractions(nodes), work, first, second)
        bernstein.coefficients_of_triangle.py_func(first, second, out)
    else:
        bernstein.differences_of_quad.py_func(fractions(nodes), kind == bernstein.QUAD9, work, first, second)
        bernstein.coefficients_of_quad.py_func(first, second, out)
    return out[: bernstein.COEFFICIENTS[kind]].tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_the_coefficients_are_those_of_the_shape_functions_exactly(kind):
    rng = np.random.default_rng(kind)
    for _ in range(20):
        nodes = curved.random_cell(rng, NAMES[kind], 0.4)
        assert coefficients(nodes, kind) == curved.bernstein(curved.determinant(nodes, NAMES[kind]), NAMES[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_quarters_have_the_coefficients_of_the_polynomial_on_them(kind):
    rng = np.random.default_rng(kind)
    whole = rng.integers(-(2**20), 2**20, 16).astype(float)  # so that quarters of quarters are exact
    children, name = np.zeros((4, 16)), NAMES[kind]
    if kind == bernstein.TRIANGLE6:
        bernstein.split_triangle(whole, children, 0)
    else:
        bernstein.split_quad(whole, children, 0, np.empty((2, 16)))
    count = bernstein.COEFFICIENTS[kind]
    basis = [curved.bernstein({e: Fraction(1)}, name) for e in curved.pairs_degree(name)]
    inverse = curved.solve([list(row) for row in zip(*basis, strict=True)])
    values = [sum(w * Fraction(v) for w, v in zip(row, whole[:count], strict=True)) for row in inverse]
    polynomial = dict(zip(curved.pairs_degree(name), values, strict=True))
    expected = [curved.bernstein(part, name) for part in curved.quarters(polynomial, name)]
    if kind == bernstein.TRIANGLE6:  # each begins with the corner, or the middle, that its number is of
        expected = [
            [part[(k + first) % 3 + at] for at in (0, 3) for k in range(3)]
            for part, first in zip(expected, (0, 1, 2, 2), strict=True)
        ]
    else:
        expected = [expected[k] for k in (0, 2, 1, 3)]  # the second axis first
    assert children[:, :count].tolist() == [[float(v) for v in part] for part in expected]


@pytest.mark.parametrize("kind", KINDS)
def test_ten_thousand_cells_are_judged_as_exact_arithmetic_does(kind):
    rng = np.random.default_rng(100 + kind)
    signs = {1: 0, -1: 0, 0: 0}
    for k in range(CELLS):
        nodes = curved.random_cell(rng, NAMES[kind], (0.02, 0.1, 0.2, 0.4)[k % 4])
        sign = certified_positive(nodes, kind, delta_of(nodes))
        signs[sign] += 1
        assert sign == curved.exact_sign(nodes, NAMES[kind])
    assert signs[0] == 0
    assert min(signs[1], signs[-1]) > CELLS // 10


@pytest.mark.parametrize("kind", KINDS)
def test_lower_bounds_are_below_each_value_and_close_to_the_least(kind):
    rng = np.random.default_rng(200 + kind)
    for _ in range(100):
        nodes = curved.random_cell(rng, NAMES[kind], 0.15)
        bound = lower_bound(nodes, kind, delta_of(nodes))
        polynomial = curved.determinant(nodes, NAMES[kind])
        steps = [Fraction(k, 12) for k in range(13)]
        places = [(x, y) for x in steps for y in steps if kind != bernstein.TRIANGLE6 or x + y <= 1]
        values = [curved.value(polynomial, x, y) for x, y in places]
        assert bound <= min(values)
        assert float(min(values)) - bound < 0.05 * max(map(abs, curved.bernstein(polynomial, NAMES[kind])))


@pytest.mark.parametrize("kind", KINDS)
def test_of_a_straight_cell_the_quality_is_one(kind):
    corners = np.array([[0.0, 0.0], [3.0, 1.0], [4.0, 3.0], [1.0, 2.0]])
    nodes = curved.straight_nodes(corners if kind else corners[:3])[: bernstein.NODES[kind]]
    assert curved_quality(nodes, kind, delta_of(nodes)) == pytest.approx(1.0, abs=1e-12)


def near_the_limit(rng, kind):
    """A cell whose least det J is about zero: between a valid and an invalid one, by halving in exact arithmetic."""
    while True:
        good, bad = (curved.random_cell(rng, NAMES[kind], bend) for bend in (0.0, 0.5))
        bad[: 3 if kind == 0 else 4] = good[: 3 if kind == 0 else 4]
        if curved.exact_sign(good, NAMES[kind]) == 1 and curved.exact_sign(bad, NAMES[kind]) == -1:
            break
    low, high = 0.0, 1.0
    for _ in range(52):
        middle = 0.5 * (low + high)
        sign = certified_positive(good + middle * (bad - good), kind, 0.0)
        low, high = (middle, high) if sign > 0 else (low, middle)
    return good, bad, low


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_near_the_limit_what_is_certified_is_true(kind, offset):
    rng = np.random.default_rng(300 + kind)
    undecided = 0
    for _ in range(10):
        good, bad, at = near_the_limit(rng, kind)
        for nudge in (-1e-9, -1e-12, -1e-15, 0.0, 1e-15, 1e-12, 1e-9):
            nodes = good + (at + nudge) * (bad - good) + offset
            sign = certified_positive(nodes, kind, 0.0)
            exact = curved.exact_sign(nodes, NAMES[kind])
            assert sign in (0, exact) or exact == 0
            undecided += sign == 0
    assert undecided > 0 or offset  # else the test has not come near enough


@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS), st.sampled_from([U64, U32]), st.sampled_from([0.0, 1.0, 1e3]))
def test_what_is_certified_holds_for_all_coordinates_within_delta(seed, kind, unit, offset):
    rng = np.random.default_rng(seed)
    nodes = curved.random_cell(rng, NAMES[kind], rng.choice([0.05, 0.3])) * rng.choice([1.0, 1e-3, 1e-5]) + offset
    delta = delta_of(nodes, unit)
    sign = certified_positive(nodes, kind, delta)
    readings = [nodes + delta * rng.choice([-1.0, 1.0], nodes.shape) * (1 - 1e-9) for _ in range(3)]
    readings += [nodes] + [np.float64(np.float32(nodes))] * (unit == U32)
    for reading in readings:
        assert sign in (0, curved.exact_sign(reading, NAMES[kind]))


def test_values_that_are_no_numbers_are_undecided():
    nodes = curved.straight_nodes(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    nodes[4, 0] = np.nan
    assert certified_positive(nodes, bernstein.TRIANGLE6, 0.0) == 0


def test_a_collapsed_cell_is_undecided_and_has_no_quality():
    for kind in KINDS:
        nodes = np.zeros((bernstein.NODES[kind], 2))
        assert certified_positive(nodes, kind, 0.0) == 0
        assert curved_quality(nodes, kind, 0.0) == -np.inf


@pytest.mark.parametrize("kind", KINDS)
def test_judging_a_table_of_cells_is_judging_each(kind):
    rng = np.random.default_rng(400 + kind)
    count = bernstein.NODES[kind]
    nodes = np.array([curved.random_cell(rng, NAMES[kind], 0.2) for _ in range(30)])
    cells = np.full((30, bernstein.WIDEST), -1, dtype=np.int32)
    cells[:, :count] = np.arange(30 * count).reshape(30, count)
    sign, quality = np.zeros(30, dtype=np.int8), np.zeros(30)
    kinds = np.full(30, kind, dtype=np.int8)
    jacobian.judge_cells(nodes.reshape(-1, 2), cells, kinds, U64, 0.0, 0, 30, sign, quality)
    for k in range(30):
        assert sign[k] == certified_positive(nodes[k], kind, delta_of(nodes[k]))
        assert quality[k] == curved_quality(nodes[k], kind, delta_of(nodes[k]))
        assert (quality[k] > 0) == (sign[k] > 0)
