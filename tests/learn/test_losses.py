from __future__ import annotations

import math

import numpy as np
import pytest

from gmsnet.learn.backend import torch
from gmsnet.learn.losses import MOST_HALVINGS, doubled_areas, metric_loss, truncation
from gmsnet.learn.optimum import optimal_position


def as_tensors(stars):
    return torch.as_tensor(stars.ring), torch.as_tensor(stars.degree)


def naive_loss(ring, position):
    """1 − 1/q from edge lengths and Heron's formula's signed sister, one triangle after another."""
    total = 0.0
    for k in range(len(ring)):
        a, b, c = np.array(position), ring[k], ring[(k + 1) % len(ring)]
        area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        edges = math.dist(a, b) ** 2 + math.dist(b, c) ** 2 + math.dist(c, a) ** 2
        total += 1 - 4 * math.sqrt(3) * area / edges
    return total / len(ring)


def test_metric_loss_equals_the_formula_in_plain_loops(stars):
    position = np.random.default_rng(2).normal(scale=0.2, size=(len(stars), 2))
    expected = [naive_loss(r[:n], x) for r, n, x in zip(stars.ring, stars.degree, position, strict=True)]
    assert metric_loss(*as_tensors(stars), torch.as_tensor(position)).numpy() == pytest.approx(expected, abs=1e-13)


def test_regular_hexagon_has_no_loss_and_the_right_areas():
    angle = np.arange(6) * np.pi / 3
    ring = torch.as_tensor(np.column_stack([np.cos(angle), np.sin(angle)]))[None]
    ring = torch.nn.functional.pad(ring, (0, 0, 0, 2))  # two rows of padding
    degree, origin = torch.tensor([6]), torch.zeros(1, 2, dtype=torch.float64)
    assert metric_loss(ring, degree, origin).item() == pytest.approx(0, abs=1e-15)
    areas = doubled_areas(ring, degree, origin)[0].tolist()
    assert areas == pytest.approx([math.sqrt(3) / 2] * 6 + [1, 1])


def test_gradient_of_the_loss(stars):
    ring, degree = (values[:20] for values in as_tensors(stars))
    position = torch.full((20, 2), 0.03, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: metric_loss(ring, degree, x), position)


def test_truncation_halves_as_often_as_needed_and_no_more(stars):
    ring, degree = as_tensors(stars)
    valid = (doubled_areas(ring, degree, torch.zeros(len(ring), 2)) > 0).all(dim=1)
    ring, degree = ring[valid], degree[valid]
    shift = torch.as_tensor(np.random.default_rng(3).normal(size=(len(ring), 2)))
    factor = truncation(ring, degree, shift)
    assert (doubled_areas(ring, degree, factor[:, None] * shift) > 0).all()
    cut = factor < 1
    assert 0.2 < cut.double().mean() < 1
    twice = doubled_areas(ring[cut], degree[cut], 2 * factor[cut, None] * shift[cut])
    assert (twice <= 0).any(dim=1).all()
    assert set(torch.log2(factor).tolist()) <= {-float(k) for k in range(MOST_HALVINGS)}


def test_truncation_of_an_inverted_star_is_zero_and_of_a_good_shift_one():
    angle = np.arange(5) * 2 * np.pi / 5
    good = np.column_stack([np.cos(angle), np.sin(angle)])
    ring = torch.as_tensor(np.stack([good, good[::-1].copy()]))
    factor = truncation(ring, torch.tensor([5, 5]), torch.full((2, 2), 0.1, dtype=torch.float64))
    assert factor.tolist() == [1.0, 0.0]


def test_truncation_is_a_constant_for_the_gradient():
    ring = torch.tensor([[[1.0, 0], [0, 1], [-1, 0], [0, -1]]])
    shift = torch.tensor([[3.0, 0.0]], requires_grad=True)
    factor = truncation(ring, torch.tensor([4]), shift)
    assert factor.item() == 0.25
    assert not factor.requires_grad
    (factor[:, None] * shift).sum().backward()
    assert shift.grad.tolist() == [[0.25, 0.25]]


def test_optimum_is_not_beaten_by_a_dense_search(stars):
    ring, degree = (values[:40] for values in as_tensors(stars))
    best = optimal_position(ring, degree)
    assert (doubled_areas(ring, degree, best) > 0).all(dim=1).sum() >= 39  # a star invalid at the start may stay
    least = metric_loss(ring, degree, best)
    rng = np.random.default_rng(4)
    for _ in range(200):
        tried = torch.as_tensor(rng.uniform(-0.6, 0.6, (40, 2)))
        valid = (doubled_areas(ring, degree, tried) > 0).all(dim=1)
        assert (metric_loss(ring, degree, tried)[valid] >= least[valid] - 1e-8).all()


def test_optimum_is_stationary_in_the_middle_of_a_star():
    angle = np.arange(7) * 2 * np.pi / 7
    ring = torch.as_tensor(np.column_stack([np.cos(angle), np.sin(angle)]) + 0.3)[None]
    assert optimal_position(ring, torch.tensor([7]))[0].tolist() == pytest.approx([0.3, 0.3], abs=1e-5)
