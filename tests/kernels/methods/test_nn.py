from __future__ import annotations

import numpy as np
import pytest
from support.naive import nn_shift
from support.random_stars import compiled_nn_shifts, random_nn_weights, size, star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import nn


def worst_error(stars, weights):
    found = compiled_nn_shifts(stars, weights)
    wanted = np.array([nn_shift(*s, weights.tensors) for s in stars])
    return float((np.abs(found - wanted).max(axis=1) / [size(*s) for s in stars]).max())


@pytest.mark.parametrize("degree", range(3, 15))
def test_compiled_networks_equal_the_loops(degree):
    rng = np.random.default_rng(degree)
    assert worst_error([star(rng, degree) for _ in range(100)], random_nn_weights(rng)) < 1e-5


@pytest.mark.parametrize("length", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_size_and_place_do_not_matter(length, offset):
    rng = np.random.default_rng(1)
    weights = random_nn_weights(rng)
    stars = [star(rng, degree, length, offset) for degree in range(3, 12) for _ in range(10)]
    assert worst_error(stars, weights) < 1e-5


def test_the_free_node_does_not_matter_also_outside_of_its_ring():
    rng = np.random.default_rng(2)
    weights = random_nn_weights(rng)
    for degree in range(3, 12):
        centre, ring = star(rng, degree)
        places = [centre, ring[0], centre + np.array([0.3, -0.2]), centre + np.array([5.0, 1.0])]
        ends = [place + compiled_nn_shifts([(place, ring)], weights)[0] for place in places]
        np.testing.assert_allclose(ends, np.tile(ends[0], (4, 1)), rtol=0, atol=1e-5)


def test_the_order_of_the_ring_matters_where_there_is_a_network():
    rng = np.random.default_rng(3)
    weights = random_nn_weights(rng)
    for degree in range(3, 12):
        centre, ring = star(rng, degree)
        off = np.abs(np.diff(compiled_nn_shifts([(centre, ring), (centre, np.roll(ring, 1, axis=0))], weights), axis=0))
        assert (off.max() > 1e-3) == (degree <= 9)


def test_all_lanes_agree():
    rng = np.random.default_rng(4)
    shifts = compiled_nn_shifts([star(rng, 7)] * LANES, random_nn_weights(rng))
    assert (shifts == shifts[0]).all()


def test_a_star_of_a_single_point_stays():
    weights = random_nn_weights(np.random.default_rng(5))
    for degree in range(3, 12):
        assert (compiled_nn_shifts([(np.ones(2), np.ones((degree, 2)))], weights) == 0).all()


def test_sigmoid_is_exact_to_the_last_bits_everywhere():
    wide = np.concatenate([np.linspace(-90, 90, 20_000), [0.0, 1e-30, -1e-30, 1e30, -1e30, np.inf, -np.inf]])
    given = np.resize(wide, LANES * -(-len(wide) // LANES)).astype(np.float32)
    width = len(given) // LANES
    rows = np.full(nn.padded(width) * LANES, 7.0, dtype=np.float32)
    rows[: len(given)] = given
    nn.activate(width, rows)
    with np.errstate(over="ignore"):
        exact = 1.0 / (1.0 + np.exp(-given.astype(np.float64)))
    np.testing.assert_allclose(rows[: len(given)], exact, rtol=5e-7, atol=2e-35)
    assert (rows[len(given) :] == 0).all()
    rows[:LANES] = np.nan
    nn.activate(1, rows)
    assert np.isnan(rows[:LANES]).all()
