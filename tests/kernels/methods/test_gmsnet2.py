from __future__ import annotations

import math

import numpy as np
import pytest
from support.naive_gmsnet2 import shift as naive_shift
from support.random_stars import compiled_gmsnet2_shifts, random_gmsnet2_weights, size, star

from gmsnet import weights
from gmsnet.weights.shapes import ACTIVATIONS


def of_all_sizes_and_places(rng, count):
    for _ in range(count):
        yield star(rng, int(rng.integers(3, 21)), 10.0 ** rng.uniform(-9, 9), rng.choice([0.0, 1.0, 1e3, 1e6]))


def gap(stars, trained):
    """The largest distance from the slow twin, over the star's size."""
    found = compiled_gmsnet2_shifts(stars, trained)
    wanted = [naive_shift(*s, trained.tensors, trained.activation) for s in stars]
    return (np.abs(found - wanted).max(axis=1) / [size(*s) for s in stars]).max()


def test_shipped_weights_on_stars_of_all_sizes_and_places():
    assert gap(list(of_all_sizes_and_places(np.random.default_rng(0), 1000)), weights.load(model="gmsnet2")) <= 1e-5


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("hidden", [4, 5, 8, 11, 16, 64])
def test_any_width_and_activation(hidden, activation):
    rng = np.random.default_rng(hidden)
    trained = random_gmsnet2_weights(rng, hidden, activation)
    assert gap([star(rng, degree) for degree in (*range(3, 40), 4096)], trained) <= 1e-5


def test_a_tangled_star_goes_to_the_mean_of_its_ring():
    trained = random_gmsnet2_weights(np.random.default_rng(1), 8, "silu")
    ring = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    outside = np.array([5.0, 1])
    found = compiled_gmsnet2_shifts([(outside, ring)], trained)
    np.testing.assert_allclose(outside + found[0], [2, 2], atol=1e-5)


@pytest.mark.parametrize(
    "ring",
    [
        np.zeros((5, 2)),  # a single point
        [[-1.0, 0], [0.5, 0], [1, 0]],  # a line through the free node
        [[1e-30, 0], [0, 1], [-1, -1]],
        [[1.0, -1e-20], [1, 1e-20], [-1, 0]],  # a needle
        [[1e-25, -1e-25], [1e-25, 1e-25], [-1, 0]],  # squares that underflow
    ],
)
def test_finite_whatever_the_star(ring):
    for activation in ACTIVATIONS:
        trained = random_gmsnet2_weights(np.random.default_rng(2), 8, activation, scale=3.0)
        assert np.isfinite(compiled_gmsnet2_shifts([(np.zeros(2), np.array(ring))], trained)).all()


@pytest.mark.parametrize("case", ["turned", "mirrored", "scaled", "from another node on"])
def test_what_the_network_commutes_with(case):
    rng = np.random.default_rng(3)
    trained = random_gmsnet2_weights(rng, 8, "silu")
    angle = rng.uniform(0, 2 * math.pi)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    for _ in range(100):
        centre, ring = star(rng, int(rng.integers(3, 12)))
        matrix, order = {
            "turned": (turn, slice(None)),
            "mirrored": (turn @ np.diag([1.0, -1.0]), slice(None, None, -1)),  # counter-clockwise again
            "scaled": (1e3 * np.eye(2), slice(None)),
            "from another node on": (np.eye(2), np.roll(np.arange(len(ring)), 2)),
        }[case]
        one, other = compiled_gmsnet2_shifts([(centre, ring), (matrix @ centre, (ring @ matrix.T)[order])], trained)
        np.testing.assert_allclose(other, matrix @ one, rtol=0, atol=1e-5 * np.abs(matrix).max())


def test_an_untrained_network_is_the_laplacian():
    rng = np.random.default_rng(4)
    trained = random_gmsnet2_weights(rng, 8, "silu")
    for name in ("decode.weight", "decode.bias"):
        trained.tensors[name][:] = 0
    for _ in range(20):
        centre, ring = star(rng, int(rng.integers(3, 12)))
        np.testing.assert_allclose(
            compiled_gmsnet2_shifts([(centre, ring)], trained)[0], ring.mean(axis=0) - centre, rtol=0, atol=1e-6
        )
