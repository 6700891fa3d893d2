"""The compiled network against the one of PyTorch Geometric, with the shipped weights and with random ones."""

from __future__ import annotations

import numpy as np
import pytest
from support.random_stars import compiled_shifts, random_weights, star

from gmsnet import weights
from gmsnet.learn.data import Stars
from gmsnet.learn.model import GMSNet


def worst_gap(stars, trained, double=False):
    """The largest distance between the two proposals, over the star's size."""
    degree = np.array([len(ring) for _, ring in stars])
    rings = np.zeros((len(stars), degree.max(), 2))
    for row, (_, ring) in zip(rings, stars, strict=True):
        row[: len(ring)] = ring
    batch = Stars.of(np.array([centre for centre, _ in stars]), rings, degree)
    net = GMSNet.from_tensors(trained.tensors)
    found = compiled_shifts(stars, trained)
    wanted = (net.double() if double else net).propose(batch)
    return float((np.abs(found - wanted).max(axis=1) / batch.size).max())


@pytest.mark.parametrize("double", [False, True])
def test_ten_thousand_stars_of_all_sizes_and_places(double):
    rng = np.random.default_rng(0)
    trained = weights.load()
    stars = []
    for _ in range(10_000):
        size, offset = 10.0 ** rng.uniform(-9, 9), rng.choice([0.0, 1.0, 1e3, 1e6])
        stars.append(star(rng, int(rng.integers(3, 21)), size, offset))
    assert worst_gap(stars, trained, double) <= 1e-5


@pytest.mark.parametrize("hidden", [4, 8, 9, 16, 64])
def test_any_width(hidden):
    rng = np.random.default_rng(hidden)
    trained = random_weights(rng, hidden)
    assert worst_gap([star(rng, degree) for degree in range(3, 60)], trained) <= 1e-5
