"""GMSNet 2 in PyTorch: against plain loops, and the compiled network against it."""

from __future__ import annotations

import numpy as np
import pytest
from support.naive_gmsnet2 import shift as naive_shift
from support.random_stars import compiled_gmsnet2_shifts, random_gmsnet2_weights, star

from gmsnet import weights
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.model_gmsnet2 import ACTIVATIONS, GMSNet2
from gmsnet.weights import shapes


def batch(stars):
    degree = np.array([len(ring) for _, ring in stars])
    rings = np.zeros((len(stars), degree.max(), 2))
    for row, (_, ring) in zip(rings, stars, strict=True):
        row[: len(ring)] = ring
    return Stars.of(np.array([centre for centre, _ in stars]), rings, degree)


def model(trained):
    return GMSNet2.from_tensors(trained.tensors, trained.activation)


def test_as_many_parameters_as_the_file_says():
    assert tuple(ACTIVATIONS) == shapes.ACTIVATIONS
    net = GMSNet2(8, "silu")
    assert sum(p.numel() for p in net.parameters()) == 347
    assert {name: tuple(value.shape) for name, value in net.tensors().items()} == shapes.gmsnet2(8)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_equals_the_formulas_in_plain_loops(activation):
    rng = np.random.default_rng(0)
    trained = random_gmsnet2_weights(rng, 8, activation)
    stars = [star(rng, degree) for degree in range(3, 13) for _ in range(5)]
    stars.append((np.array([3.0, 0]), stars[-1][1]))  # tangled
    wanted = [naive_shift(*s, trained.tensors, activation) for s in stars]
    np.testing.assert_allclose(model(trained).double().propose(batch(stars)), wanted, rtol=0, atol=1e-12)


def test_it_starts_as_the_laplacian():
    rng = np.random.default_rng(1)
    stars = [star(rng, degree) for degree in range(3, 13)]
    wanted = [ring.mean(axis=0) - centre for centre, ring in stars]
    np.testing.assert_allclose(GMSNet2(8, "silu").double().propose(batch(stars)), wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("double", [False, True])
def test_the_compiled_network_equals_that_of_torch_for_stars_of_all_sizes_and_places(double):
    rng = np.random.default_rng(2)
    stars = []
    for _ in range(5_000):
        size, offset = 10.0 ** rng.uniform(-9, 9), rng.choice([0.0, 1.0, 1e3, 1e6])
        stars.append(star(rng, int(rng.integers(3, 15)), size, offset))
    trained = weights.load(model="gmsnet2")
    given, net = batch(stars), model(trained)
    gap = np.abs(compiled_gmsnet2_shifts(stars, trained) - (net.double() if double else net).propose(given))
    assert (gap.max(axis=1) / given.size).max() <= 1e-5


def test_gradients_are_finite_where_formulas_have_no_value():
    ring = torch.tensor([[[0.0, 0], [0, 0], [0, 0], [0, 0]], [[1, 0], [2, 0], [-1, 0], [0, 0]]], dtype=torch.float32)
    net = GMSNet2(8, "silu")
    torch.nn.init.ones_(net.decode.weight)
    ring.requires_grad_(True)
    net(ring, torch.tensor([4, 3])).sum().backward()
    assert torch.isfinite(ring.grad).all()
    assert all(torch.isfinite(p.grad).all() for p in net.parameters())
