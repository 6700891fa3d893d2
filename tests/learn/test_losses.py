from __future__ import annotations

import math

import numpy as np
import pytest

from gmsnet.learn.backend import torch
from gmsnet.learn.losses import LOSSES, MOST_HALVINGS, doubled_areas, metric_loss, truncation
from gmsnet.learn.optimum import optimal_position


def as_tensors(stars):
    return torch.as_tensor(stars.ring), torch.as_tensor(stars.degree)


def plain_metric(a, b, c):
    """1 − 1/q from edge lengths and the signed area."""
    area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    return 1 - 4 * math.sqrt(3) * area / (math.dist(a, b) ** 2 + math.dist(b, c) ** 2 + math.dist(c, a) ** 2)


def plain_q(a, b, c):
    inverse = 1 - plain_metric(a, b, c)
    return 1 / inverse if inverse > 0 else math.inf


def plain_angles(a, b, c):
    """By the law of cosines."""
    x, y, z = math.dist(b, c), math.dist(c, a), math.dist(a, b)
    cosines = [(y * y + z * z - x * x) / (2 * y * z), (z * z + x * x - y * y) / (2 * z * x)]
    alpha, beta = (math.acos(min(max(value, -1.0), 1.0)) for value in cosines)
    return alpha, beta, math.pi - alpha - beta


PLAIN = {
    "metric": plain_metric,
    "q": plain_q,
    "cosine": lambda *corners: sum((math.cos(angle) - 0.5) ** 2 for angle in plain_angles(*corners)) / 3,
    "min-max-angle": lambda *corners: max(plain_angles(*corners)),
}
every_loss = pytest.mark.parametrize("name", LOSSES)


@every_loss
def test_losses_equal_the_formulas_in_plain_loops(stars, name):
    position = np.random.default_rng(2).normal(scale=0.2, size=(len(stars), 2))
    found = LOSSES[name](*as_tensors(stars), torch.as_tensor(position)).numpy()
    for ring, n, x, loss in zip(stars.ring, stars.degree, position, found, strict=True):
        triangles = [(x, ring[k], ring[(k + 1) % n]) for k in range(n)]
        expected = sum(PLAIN[name](*corners) for corners in triangles) / n
        assert loss == pytest.approx(expected, rel=1e-9, abs=1e-9), n
    assert np.isinf(found).any() == (name == "q")  # some of these stars are inverted


HEXAGON = np.column_stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3)])
RINGS = {  # all triangles of these stars are alike
    "equilateral": HEXAGON,
    "inverted": HEXAGON[::-1],
    "flat": np.array([[1.0, 0], [-2, 0], [1, 0], [-2, 0]]),
    "needle": np.array([[1.0, 0], [1, 0], [1, 0]]),
    "point": np.zeros((3, 2)),
}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("metric", {"equilateral": 0, "inverted": 2, "flat": 1, "needle": 1, "point": 1}),
        ("q", {"equilateral": 1, "inverted": math.inf, "flat": math.inf, "needle": math.inf, "point": math.inf}),
        ("cosine", {"equilateral": 0, "inverted": 0, "flat": 11 / 12, "needle": 0.25, "point": 0.25}),
        ("min-max-angle", {"equilateral": 1, "inverted": 1, "flat": 3, "needle": 0, "point": 0}),  # in π/3
    ],
)
def test_values_of_degenerate_triangles_are_the_documented_ones(name, values):
    for shape, expected in values.items():
        ring = torch.as_tensor(RINGS[shape].copy())[None]
        loss = LOSSES[name](ring, torch.tensor([len(RINGS[shape])]), torch.zeros(1, 2, dtype=torch.float64))
        unit = math.pi / 3 if name == "min-max-angle" else 1.0
        assert loss.item() / unit == pytest.approx(expected, abs=1e-12), shape


@every_loss
def test_no_loss_depends_on_the_scale_or_the_padding(stars, name):
    ring, degree = as_tensors(stars)
    position = torch.full((len(stars), 2), 0.03, dtype=torch.float64)
    loss = LOSSES[name](ring, degree, position)
    scaled = LOSSES[name](torch.nn.functional.pad(1e3 * ring, (0, 0, 0, 5)), degree, 1e3 * position)
    assert scaled.numpy() == pytest.approx(loss.numpy(), rel=1e-10)


@every_loss
def test_no_number_in_no_number_out(stars, name):
    ring, degree = as_tensors(stars)
    position = torch.zeros(len(stars), 2, dtype=torch.float64)
    position[5, 1] = torch.nan
    assert torch.argwhere(LOSSES[name](ring, degree, position).isnan()).tolist() == [[5]]


@every_loss
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_gradients_are_finite_wherever_the_free_node_lies(stars, name, dtype):
    """Also on a ring node, between two of them, far outside, and where the star is a single point."""
    ring, degree = (values[:50] for values in as_tensors(stars))
    ring = ring.to(dtype)
    beside = ring[:, 0] + 1e-10
    places = [ring[:, 0], beside, (ring[:, 0] + ring[:, 1]) / 2, 50 * ring[:, 2], torch.zeros(50, 2, dtype=dtype)]
    for position in (place.clone().requires_grad_() for place in places):
        for star in (ring, torch.zeros_like(ring)):
            loss = LOSSES[name](star, degree, position)
            assert not loss.isnan().any()
            (gradient,) = torch.autograd.grad(loss[loss.isfinite()].sum(), position)
            assert torch.isfinite(gradient).all()


def test_regular_hexagon_has_no_loss_and_the_right_areas():
    ring = torch.nn.functional.pad(torch.as_tensor(HEXAGON)[None], (0, 0, 0, 2))  # two rows of padding
    degree, origin = torch.tensor([6]), torch.zeros(1, 2, dtype=torch.float64)
    assert metric_loss(ring, degree, origin).item() == pytest.approx(0, abs=1e-15)
    areas = doubled_areas(ring, degree, origin)[0].tolist()
    assert areas == pytest.approx([math.sqrt(3) / 2] * 6 + [1, 1])


@every_loss
def test_gradients(stars, name):
    ring, degree = as_tensors(stars)
    position = torch.full((len(stars), 2), 0.03, dtype=torch.float64)
    valid = (doubled_areas(ring, degree, position) > 0.02).all(dim=1)
    ring, degree, position = ring[valid][:20], degree[valid][:20], position[valid][:20].requires_grad_()
    assert len(ring) == 20
    assert torch.autograd.gradcheck(lambda x: LOSSES[name](ring, degree, x), position)


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


def test_the_largest_angle_by_its_cosine_would_not_be_a_number():
    """Nodes that truncation leaves close to an edge: rounding takes the cosine of a flat angle beyond −1."""
    rng = np.random.default_rng(5)
    share = torch.as_tensor(rng.uniform(0.05, 0.95, (1000, 1)), dtype=torch.float32)
    ring = torch.as_tensor(rng.normal(size=(1000, 3, 2)), dtype=torch.float32)
    a, b = ring[:, 0], ring[:, 1]
    place = (a + share * (b - a)) * (1 - 1e-6)
    degree = torch.full((1000,), 3)
    u, v = a - place, b - place
    cosine = (u * v).sum(dim=1) / (u.norm(dim=1) * v.norm(dim=1))
    assert torch.acos(cosine).isnan().sum() > 50
    assert torch.isfinite(LOSSES["min-max-angle"](ring, degree, place)).all()
