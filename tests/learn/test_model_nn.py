"""NN-Smoothing in PyTorch: against plain loops, and the compiled networks against it."""

from __future__ import annotations

import numpy as np
import pytest
from support.naive import nn_shift
from support.random_stars import compiled_nn_shifts, random_nn_weights, star

from gmsnet import weights
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.model_nn import NNSmoothing, frame
from gmsnet.weights.shapes import NN_HIDDEN, nn


def batch(stars):
    degree = np.array([len(ring) for _, ring in stars])
    rings = np.zeros((len(stars), degree.max(), 2))
    for row, (_, ring) in zip(rings, stars, strict=True):
        row[: len(ring)] = ring
    return Stars.of(np.array([centre for centre, _ in stars]), rings, degree)


def test_seven_networks_of_4864_parameters():
    model = NNSmoothing()
    assert sum(p.numel() for p in model.parameters()) == 4864
    assert {name: value.shape for name, value in model.tensors().items()} == nn()
    assert list(model) == [f"degree{n}" for n in range(3, 10)] == [f"degree{n}" for n in NN_HIDDEN]


def test_equals_the_formulas_in_plain_loops():
    rng = np.random.default_rng(0)
    tensors = random_nn_weights(rng).tensors
    stars = [star(rng, degree) for degree in range(3, 13) for _ in range(5)]
    found = NNSmoothing.from_tensors(tensors).double().propose(batch(stars))
    np.testing.assert_allclose(found, [nn_shift(*s, tensors) for s in stars], rtol=0, atol=1e-12)


def test_parameters_survive_the_names_of_the_file():
    rng = np.random.default_rng(1)
    tensors = random_nn_weights(rng).tensors
    again = NNSmoothing.from_tensors(tensors).tensors()
    assert again.keys() == tensors.keys()
    assert all(np.array_equal(again[name], tensors[name]) for name in tensors)


def test_the_frame_is_that_of_the_ring_alone():
    ring = torch.tensor([[[1.0, 5.0], [3.0, 5.5], [2.0, 6.0]]])
    low, size = frame(ring)
    assert low.tolist() == [[1.0, 5.0]]
    assert size.tolist() == [[2.0]]


@pytest.mark.parametrize("double", [False, True])
def test_compiled_networks_equal_those_of_torch_for_stars_of_all_sizes_and_places(double):
    rng = np.random.default_rng(2)
    stars = []
    for _ in range(5_000):
        size, offset = 10.0 ** rng.uniform(-9, 9), rng.choice([0.0, 1.0, 1e3, 1e6])
        stars.append(star(rng, int(rng.integers(3, 15)), size, offset))
    trained = weights.load(model="nn")
    model = NNSmoothing.from_tensors(trained.tensors)
    given = batch(stars)
    gap = np.abs(compiled_nn_shifts(stars, trained) - (model.double() if double else model).propose(given))
    assert (gap.max(axis=1) / given.size).max() <= 1e-5
