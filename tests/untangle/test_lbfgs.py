"""L-BFGS of untangling: where it ends on functions whose minimum is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import rosen, rosen_der

from gmsnet.untangle.lbfgs import descended


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_the_minimum_of_a_convex_quadratic(seed, size):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(size, size)) + 3.0 * np.eye(size)
    matrix, wanted = root @ root.T + np.eye(size), rng.normal(size=size)
    values = []

    def evaluate(place):
        away = matrix @ (place - wanted)
        values.append(0.5 * (place - wanted) @ away)
        return values[-1], away

    found, made = descended(evaluate, np.zeros(size), 500)
    assert made <= 500
    assert 0.5 * (found - wanted) @ matrix @ (found - wanted) <= 1e-6 * max(values[0], 1.0)


def test_a_curved_valley():
    found, made = descended(lambda x: (rosen(x), rosen_der(x)), np.full(10, -1.0), 1000)
    assert made < 200
    np.testing.assert_allclose(found, 1.0, atol=1e-3)


@pytest.mark.parametrize("iterations", [0, 1, 7])
def test_it_goes_downhill_and_no_further_than_it_is_told(iterations):
    seen = [rosen(np.full(4, -1.0))]
    for many in range(1, iterations + 1):
        found, made = descended(lambda x: (rosen(x), rosen_der(x)), np.full(4, -1.0), many)
        assert made == many
        seen.append(rosen(found))
    assert all(after < before for before, after in pairwise(seen))


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_it_stays_where_no_value_is_finite(value):
    start = np.ones(3)
    found, made = descended(lambda x: (value, np.full(3, np.nan)), start, 5)
    assert made == 0
    np.testing.assert_array_equal(found, start)


def test_it_stays_at_a_minimum():
    found, made = descended(lambda x: (x @ x, 2.0 * x), np.zeros(3), 5)
    assert made == 0
    np.testing.assert_array_equal(found, np.zeros(3))
