"""The barrier: derivatives against automatic differentiation, visits against a slow twin, and what F may do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive_objectives
from support.one_block import visited
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import barrier as kernels
from gmsnet.kernels.methods import barrier_lanes as lanes
from gmsnet.kernels.methods import barrier_star
from gmsnet.kernels.methods.barrier_star import Power

POWERS = (1, 2, 4)
every_power = pytest.mark.parametrize("p", POWERS)
NAMES = {1: "q", 2: "q2", 4: "q4"}


def at(p, ring, place):
    """F, gradient and Hessian, by automatic differentiation; F is a sum of Q = √3·q."""
    factor = len(ring) * math.sqrt(3) ** p
    value, gradient, hessian = naive_objectives.derivatives_at(NAMES[p], ring, np.asarray(place, dtype=float))
    return factor * value, factor * gradient, factor * hessian


def value(p, ring, place):
    """F by its formula alone, infinite where a triangle is not positive."""
    a, b = np.roll(ring, 1, axis=0) - place, ring - place
    d = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return (((a * a + b * b - a * b).sum(axis=1) / d) ** p).sum() if (d > 0).all() else math.inf


def least_surplus(ring, place, floor):
    """The minimum D − floor·L of the star's triangles."""
    a, b = np.roll(ring, 1, axis=0) - place, ring - place
    d, sides = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * a + b * b + (a - b) ** 2).sum(axis=1)
    return (d - floor * sides).min()


def step(p, ring, place):
    """The step, before over-relaxation and safeguards, and its factor on Newton's."""
    f, g, h = at(p, ring, place)
    newton = -np.linalg.solve(h, g)
    return newton, 1 / max(1 - (1 + 1 / p) * (-g @ newton) / f, 1 / barrier_star.MOST)


def descent(p, ring, place):
    """The slow twin of ``descend``."""
    place = np.asarray(place, dtype=float)
    if naive_objectives.least_area(ring, place) <= 0:
        return ring.mean(axis=0)
    for _ in range(barrier_star.STEPS):
        before = value(p, ring, place)
        newton, whole = step(p, ring, place)
        share = whole
        while value(p, ring, place + share * newton) >= before:
            share /= 2
            if share < 2.0**-30:
                return place
        place = place + share * newton
        if share == whole and value(p, ring, place) >= barrier_star.FAR * before:
            break
    return place


def visit(p, ring, place, relaxation, stretch):
    """The slow twin of a visit in lanes, in float64."""
    if naive_objectives.least_area(ring, place) > 0:
        before = value(p, ring, place)
        mean = place + stretch * (ring.mean(axis=0) - place)
        if stretch and value(p, ring, mean) < before:
            return mean
        newton, share = step(p, ring, place)
        there = place + max(share, relaxation) * newton
        if barrier_star.FAR * before <= value(p, ring, there) < before:
            return there
    return descent(p, ring, place)


def local_of(ring, place, dtype):
    return np.repeat((np.asarray(ring) - place).ravel(), LANES).astype(dtype)


def near_the_rim(rng, degree, height):
    """A star with a convex ring whose free node is that near (relative to its size) to one edge of it."""
    angles = np.sort(rng.random(degree) + np.arange(degree)) * 2 * np.pi / degree
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    a, b = ring[0], ring[1]
    inwards = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    return (0.6 * a + 0.4 * b) + height * inwards, ring


def stars_of(rng, degree, count):
    """Valid stars, half of them convex."""
    convex = [(0.6 * (rng.random(2) - 0.5), near_the_rim(rng, degree, 0)[1]) for _ in range(count)]
    stars = valid([star(rng, degree) for _ in range(count)])[: count // 2]
    stars = valid(stars + convex)[:count]
    assert len(stars) > count // 2
    return stars


def valid(stars):
    return [(place, ring) for place, ring in stars if naive_objectives.least_area(ring, place) > 0]


@every_power
@pytest.mark.parametrize("degree", [*range(3, 10), 30, 100])
def test_derivatives_and_step(p, degree):
    rng = np.random.default_rng(degree)
    power, sums, shift = Power.of(p), np.zeros(lanes.SUMS * LANES), np.empty(2 * LANES)
    for place, ring in stars_of(rng, degree, 4):
        local = local_of(ring, place, float)
        lanes.derive(local, degree, None, power, sums)
        lanes.propose(sums, 1.0, power.ratio, shift)
        lanes.judge(local, degree, None, power, shift, 0.1, sums)
        rows = sums.reshape(lanes.SUMS, LANES)
        assert (rows == rows[:, :1]).all()  # all lanes hold the same star
        f, g, h = at(p, ring, place)
        even = 2 * rows[lanes.ROUND, 0]
        xx, xy, yy = rows[[lanes.XX, lanes.XY, lanes.YY], 0] * (2, 1, 2)
        assert rows[lanes.VALUE, 0] == pytest.approx(f, rel=1e-12)
        np.testing.assert_allclose(-rows[[lanes.GX, lanes.GY], 0], g, rtol=1e-10, atol=1e-10 * np.abs(h).max())
        np.testing.assert_allclose([[xx + even, xy], [xy, yy + even]], h, rtol=1e-10, atol=1e-11 * np.abs(h).max())
        assert rows[lanes.LEAST, 0] == pytest.approx(naive_objectives.least_area(ring, place), rel=1e-12)
        newton, factor = step(p, ring, place)
        np.testing.assert_allclose(shift[[0, LANES]], max(factor, 1) * newton, rtol=1e-8, atol=1e-12)
        there = place + shift[[0, LANES]]
        least = naive_objectives.least_area(ring, there)
        assert rows[lanes.LEAST_AFTER, 0] == pytest.approx(least, rel=1e-9, abs=1e-12)
        assert rows[lanes.LOWEST_MARGIN, 0] == pytest.approx(least_surplus(ring, there, 0.1), rel=1e-5, abs=1e-5)
        if least > 0:
            assert rows[lanes.AFTER, 0] == pytest.approx(value(p, ring, there), rel=1e-10)
        pairs = np.vstack([place, ring]).repeat(LANES, axis=0).ravel()
        found = barrier_star.derivatives(*place, pairs, degree, None, 3, power)
        np.testing.assert_allclose(found[0], f, rtol=1e-12)
        np.testing.assert_allclose([found[3], found[4], found[5]], h[[0, 0, 1], [0, 1, 1]], rtol=1e-10, atol=1e-9)


@every_power
@pytest.mark.parametrize("stretch", [0.0, 1.1])
@pytest.mark.parametrize("degree", [3, 4, 5, 6, 7, 12, 100])
def test_a_visit_does_what_its_twin_does(p, stretch, degree):
    rng = np.random.default_rng(degree)
    stars = stars_of(rng, degree, 16)
    compared = 0
    for _ in range(3):
        found, tally = visited(kernels.sweep, stars, Power.of(p), 1.5, stretch)
        assert tally.tolist() == [len(stars), 0, 0]
        for (place, ring), there in zip(stars, found, strict=True):
            if step(p, ring, place)[1] < 2:  # a step much longer than Newton's is a quotient of small differences
                np.testing.assert_allclose(there, visit(p, ring, place, 1.5, stretch), rtol=0, atol=2e-5)
                compared += 1
        stars = [(there, ring) for (_, ring), there in zip(stars, found, strict=True)]
    assert compared > len(stars)


@every_power
@pytest.mark.parametrize("stretch", [0.0, 1.1])
@given(seed=st.integers(0, 2**32 - 1), degree=st.integers(3, 20))
@settings(max_examples=40)
def test_the_objective_never_rises_and_stars_stay_valid(p, stretch, seed, degree):
    rng = np.random.default_rng(seed)
    stars = [star(rng, degree) if rng.random() < 0.5 else near_the_rim(rng, degree, 10.0 ** -rng.integers(1, 8))
             for _ in range(20)]  # fmt: skip
    stars = valid(stars)
    if not stars:
        return
    for _ in range(4):
        found, _ = visited(kernels.sweep, stars, Power.of(p), 1.5, stretch)
        for (place, ring), there in zip(stars, found, strict=True):
            assert naive_objectives.least_area(ring, there) > 0
            assert value(p, ring, there) <= value(p, ring, place) * (1 + 1e-6)  # lanes are float32
        stars = [(there, ring) for (_, ring), there in zip(stars, found, strict=True)]


@every_power
@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9])
def test_slivers_are_left_within_few_visits(p, height):
    """Newton steps alone would lengthen the short height by a half at most each."""
    rng = np.random.default_rng(1)
    stars = valid([near_the_rim(rng, 6, height) for _ in range(20)])
    assert len(stars) > 10
    for _ in range(4):
        found, _ = visited(kernels.sweep, stars, Power.of(p), 1.5, 0.0)
        stars = [(there, ring) for (_, ring), there in zip(stars, found, strict=True)]
    for there, ring in stars:
        best = there + naive_objectives.newton(NAMES[p], there, ring)
        assert value(p, ring, there) < 2**p * value(p, ring, best)


@every_power
def test_newton_ends_at_the_optimum(p):
    rng = np.random.default_rng(2)
    first = stars = stars_of(rng, 7, 12)
    for _ in range(25):
        found, _ = visited(kernels.sweep, stars, Power.of(p), 1.0, 0.0)
        stars = [(there, ring) for (_, ring), there in zip(stars, found, strict=True)]
    for (_, ring), there in zip(first, found, strict=True):
        f, g, h = at(p, ring, there)
        assert g @ np.linalg.solve(h, g) < 1e-9 * f


@every_power
def test_a_tangled_star_goes_to_the_mean_of_its_ring(p):
    angles = 2 * np.pi * np.arange(6) / 6
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    found, _ = visited(kernels.sweep, [(np.array([1.5, 0.2]), ring)], Power.of(p), 1.5, 0.0)
    np.testing.assert_allclose(found, [[0, 0]], atol=1e-12)


@every_power
def test_turning_mirroring_scaling_and_shifting_commute(p):
    rng = np.random.default_rng(3)
    stars = [star(rng, 6) for _ in range(30)] + [near_the_rim(rng, 6, 1e-4) for _ in range(30)]
    one, _ = visited(kernels.sweep, stars, Power.of(p), 1.5, 1.1)
    c, s = np.cos(1), np.sin(1)
    for matrix in ([[c, s], [-s, c]], [[1, 0], [0, -1]], [[0.001, 0], [0, 0.001]]):
        turned = np.array(matrix)
        order = -1 if np.linalg.det(turned) < 0 else 1
        mapped = [(place @ turned + 1, (ring @ turned + 1)[::order]) for place, ring in stars]
        other, _ = visited(kernels.sweep, mapped, Power.of(p), 1.5, 1.1)
        size = np.linalg.norm(turned, 2)
        np.testing.assert_allclose(other, one @ turned + 1, rtol=0, atol=1e-5 * size)


def test_a_star_that_is_no_star_is_left_alone():
    """All nodes in one place, or no numbers: nothing moves, and nothing is raised."""
    together = (np.ones(2), np.ones((5, 2)))
    nowhere = (np.ones(2), np.full((5, 2), np.nan))
    found, tally = visited(kernels.sweep, [together, nowhere], Power.of(2), 1.5, 1.1)
    np.testing.assert_array_equal(found, np.ones((2, 2)))
    assert tally[0] == 0
