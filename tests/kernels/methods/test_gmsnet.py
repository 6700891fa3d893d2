from __future__ import annotations

import numpy as np
import pytest
from support.naive import gmsnet_shift
from support.random_stars import compiled_shifts, random_weights, star


def worst_error(stars, weights):
    found = compiled_shifts(stars, weights)
    wanted = np.array([gmsnet_shift(*s, weights.tensors) for s in stars])
    size = np.array([np.ptp(np.vstack([c, r]), axis=0).max() for c, r in stars])
    return float((np.abs(found - wanted).max(axis=1) / size).max())


@pytest.mark.parametrize("hidden", [4, 5, 8, 13, 32, 64])
def test_compiled_network_equals_the_loops(hidden):
    rng = np.random.default_rng(hidden)
    weights = random_weights(rng, hidden)
    stars = [star(rng, degree) for degree in range(3, 40)]
    assert worst_error(stars, weights) < 1e-5


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_size_and_place_do_not_matter(size, offset):
    rng = np.random.default_rng(1)
    weights = random_weights(rng)
    stars = [star(rng, degree, size, offset) for degree in range(3, 21) for _ in range(10)]
    assert worst_error(stars, weights) < 1e-5


def test_the_order_of_the_ring_does_not_matter():
    rng = np.random.default_rng(2)
    weights = random_weights(rng)
    for degree in range(3, 21):
        centre, ring = star(rng, degree)
        given = compiled_shifts([(centre, ring)], weights)
        shuffled = compiled_shifts([(centre, ring[rng.permutation(degree)])], weights)
        np.testing.assert_allclose(given, shuffled, rtol=0, atol=2e-6)


def test_all_lanes_agree():
    rng = np.random.default_rng(3)
    weights = random_weights(rng)
    one = star(rng, 7)
    shifts = compiled_shifts([one] * 64, weights)
    assert (shifts == shifts[0]).all()


def test_a_star_of_a_single_point_gives_a_finite_shift():
    weights = random_weights(np.random.default_rng(4))
    collapsed = (np.zeros(2), np.zeros((5, 2)))
    assert (compiled_shifts([collapsed], weights) == 0).all()
