"""The objectives of a star: values against plain formulas, derivatives against automatic differentiation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support import naive_objectives
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex import objectives
from gmsnet.learn.backend import torch
from gmsnet.learn.losses import LOSSES

every_objective = pytest.mark.parametrize("name", objectives.NAMES)
BARRIERS = ("q", "q2")


def evaluate(name, ring, places):
    """Values (64,), gradients (64, 2), least doubled areas (64,) and Hessians (64, 2, 2) at 64 places in one star."""
    local = np.repeat(np.asarray(ring, dtype=float).ravel(), LANES)
    at = np.asarray(places, dtype=float).T.ravel().copy()
    out, other = np.empty(objectives.OUT * LANES), np.empty(objectives.OUT * LANES)
    hessian = np.empty(3 * LANES)
    code = objectives.NAMES.index(name)
    objectives.evaluate(code, local, len(ring), None, at, out, hessian)
    objectives.evaluate(code, local, len(ring), None, at, other, None)
    np.testing.assert_array_equal(out, other)  # whether or not a Hessian is wanted
    value, gx, gy, least = out.reshape(4, LANES)
    xx, xy, yy = hessian.reshape(3, LANES)
    return value, np.column_stack([gx, gy]), least, np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1)


def places_about(rng):
    """32 places near the middle of a star and 32 anywhere."""
    near = np.geomspace(0.01, 0.5, 32)[:, None] * rng.normal(size=(32, 2))
    return np.vstack([near, 2.0 * rng.random((32, 2)) - 1.0])


@every_objective
@pytest.mark.parametrize("degree", [*range(3, 31), 64, 100])
def test_value_gradient_and_hessian(name, degree):
    rng = np.random.default_rng(degree)
    ring, places = star(rng, degree)[1], places_about(rng)
    value, gradient, least, hessian = evaluate(name, ring, places)
    wanted, slope, curvature = naive_objectives.derivatives(name, ring, places)
    areas = [naive_objectives.least_area(ring, p) for p in places]
    np.testing.assert_allclose(least, areas, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(value, wanted, rtol=1e-11)
    assert 2 < (least > 0).sum() < LANES
    known = np.isfinite(wanted)
    assert known.sum() == ((least > 0).sum() if name in BARRIERS else LANES)
    steep, bent = np.abs(slope).max(axis=1), np.abs(curvature).max(axis=(1, 2))
    assert (np.abs(gradient - slope).max(axis=1) < 1e-9 * (1 + steep))[known].all()
    assert (np.abs(hessian - curvature).max(axis=(1, 2)) < 1e-8 * (1 + bent))[known].all()


@pytest.mark.parametrize("name", LOSSES)
def test_they_are_the_losses_of_training(name):
    rng = np.random.default_rng(1)
    ring = star(rng, 7)[1]
    places = places_about(rng)
    rings = torch.tensor(ring).expand(LANES, -1, -1)
    wanted = LOSSES[name](rings, torch.full((LANES,), 7), torch.tensor(places))
    np.testing.assert_allclose(evaluate(name, ring, places)[0], wanted.numpy(), rtol=1e-11)


def one(name, a, b):
    """Value, gradient and Hessian of a single triangle with the free node at the origin."""
    functions = (
        objectives.metric,
        objectives.aspect,
        objectives.aspect_squared,
        objectives.cosines,
        objectives.largest_angle,
    )
    spokes = *map(float, a), *map(float, b)
    found = functions[objectives.NAMES.index(name)](*spokes, *(() if name in objectives.OF_ANGLES else (None,)))
    return found[0], found[1:]


HALF = math.sqrt(3) / 2
SHAPES = {  # what the triangle (0, a, b) is like → its spokes, and metric, q, q2, cosine, min-max-angle
    "equilateral": ((1, 0), (0.5, HALF), (0, 1, 1, 0, math.pi / 3)),
    "right": ((1, 0), (0, 1), (1 - HALF, 1 / HALF, 4 / 3, (0.25 + 2 * (math.sqrt(0.5) - 0.5) ** 2) / 3, math.pi / 2)),
    "flat, the node between": ((1, 0), (-1, 0), (1, math.inf, math.inf, (2.25 + 0.25 + 0.25) / 3, math.pi)),
    "flat, the node at an end": ((1, 0), (2, 0), (1, math.inf, math.inf, (0.25 + 2.25 + 0.25) / 3, math.pi)),
    "inverted": ((0.5, HALF), (1, 0), (2, math.inf, math.inf, 0, math.pi / 3)),
    "the node on a neighbour": ((0, 0), (1, 0), (1, math.inf, math.inf, 0.75 / 3, math.pi)),
    "neighbours in one place": ((1, 0), (1, 0), (1, math.inf, math.inf, 0.75 / 3, math.pi)),
    "a point": ((0, 0), (0, 0), (1, math.inf, math.inf, 0.25, math.pi)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_triangles_that_degenerate(shape):
    a, b, wanted = SHAPES[shape]
    for name, value in zip(objectives.NAMES, wanted, strict=True):
        found, derivatives = one(name, a, b)
        assert found == pytest.approx(value, rel=1e-14, abs=1e-15)
        assert np.isfinite(derivatives).all()
        if math.isinf(value):
            assert not np.any(derivatives)


@every_objective
def test_inverted_triangles(name):
    """MetricLoss tells them by its sign, angles do not, barriers have no value for them."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        a, b = rng.normal(size=(2, 2))
        a, b = (a, b) if a[0] * b[1] > a[1] * b[0] else (b, a)
        valid, mirrored = one(name, a, b)[0], one(name, b, a)[0]
        wanted = {"metric": 2 - valid, "q": math.inf, "q2": math.inf}.get(name, valid)
        assert mirrored == pytest.approx(wanted, rel=1e-12)


@every_objective
def test_scaling_a_star_scales_the_derivatives(name):
    rng = np.random.default_rng(3)
    ring = star(rng, 6)[1]
    places = places_about(rng)
    value, gradient, _, hessian = evaluate(name, ring, places)
    larger = evaluate(name, 8.0 * ring, 8.0 * places)
    np.testing.assert_allclose(larger[0], value, rtol=1e-14)
    np.testing.assert_allclose(8.0 * larger[1], gradient, rtol=1e-13)
    np.testing.assert_allclose(64.0 * larger[3], hessian, rtol=1e-13)
