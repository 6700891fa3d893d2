"""The objectives of stars with quads: values in exact arithmetic, derivatives against differences of these."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from support.patterns import Linked

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import adam, newton, sized
from gmsnet.kernels.simplex import objectives

NAMES = [name for name in objectives.NAMES if name not in objectives.OF_ANGLES]
STARS = {"4 quads": Linked(0, 4), "3 quads": Linked(0, 3), "2 triangles, 2 quads": Linked(2, 2), "6": Linked(6, 0)}
every_star = pytest.mark.parametrize("kind", STARS)
every_objective = pytest.mark.parametrize("name", NAMES)
STEP = Fraction(1, 2**17)


def ratios(star, ring, place):
    """D and 1/q of each simplex, as fractions but for the factor 2√3."""
    x, y = (Fraction(float(v)) if isinstance(v, float) else v for v in place)
    for i, j, weights in star.simplices(len(ring)):
        (ax, ay), (bx, by) = ([Fraction(v) for v in ring[k].tolist()] for k in (i, j))
        ax, ay, bx, by = ax - x, ay - y, bx - x, by - y
        squares = ax**2 + ay**2, bx**2 + by**2, (ax - bx) ** 2 + (ay - by) ** 2
        d = ax * by - ay * bx
        yield d, d / sum(Fraction(w) * s for w, s in zip(weights, squares, strict=True))


FACTOR = Fraction(2.0 * math.sqrt(3.0))


def exact(name, star, ring, place):
    """The objective, as a fraction; None where it is infinite."""
    found = [(d, FACTOR * ratio) for d, ratio in ratios(star, ring, place)]
    if name != "metric" and min(d for d, _ in found) <= 0:
        return None
    values = [1 - s if name == "metric" else 1 / s if name == "q" else 1 / s**2 for _, s in found]
    return sum(values) / len(values)


def differences(function, place):
    """Value, gradient and Hessian by central differences of exact values, which lose nothing to rounding."""
    x, y = (Fraction(float(v)) for v in place)
    at = {(i, j): function((x + i * STEP, y + j * STEP)) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    middle = at[0, 0]
    gradient = [(at[1, 0] - at[-1, 0]) / (2 * STEP), (at[0, 1] - at[0, -1]) / (2 * STEP)]
    xx, yy = (at[1, 0] - 2 * middle + at[-1, 0]) / STEP**2, (at[0, 1] - 2 * middle + at[0, -1]) / STEP**2
    xy = (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4 * STEP**2)
    return float(middle), np.array(gradient, dtype=float), np.array([[xx, xy], [xy, yy]], dtype=float)


def in_lanes(ring):
    return np.repeat(np.asarray(ring, dtype=float).ravel(), LANES)


@every_objective
@every_star
def test_value_gradient_and_hessian(name, kind):
    star, rng = STARS[kind], np.random.default_rng(3)
    ring = star.star(rng)[1]
    places = 0.05 * rng.normal(size=(LANES, 2))
    out, hessian = np.empty(objectives.OUT * LANES), np.empty(3 * LANES)
    code, n, at = objectives.NAMES.index(name), len(ring), places.T.ravel().copy()
    objectives.evaluate(code, in_lanes(ring), n, star.pattern, at, out, hessian)
    checked = 0
    for lane, place in enumerate(places[:12]):
        least = float(min(d for d, _ in ratios(star, ring, place.tolist())))
        value, gx, gy, found = out.reshape(-1, LANES)[:, lane]
        assert found == pytest.approx(least, rel=1e-10, abs=1e-14)
        if name != "metric" and least < 0.02:
            assert least > 0 or value == np.inf
            continue
        wanted, gradient, bent = differences(lambda p: exact(name, star, ring, p), place)
        xx, xy, yy = hessian.reshape(3, LANES)[:, lane]
        assert value == pytest.approx(wanted, rel=1e-11)
        np.testing.assert_allclose([gx, gy], gradient, atol=1e-6 * (1 + np.abs(bent).max()))
        np.testing.assert_allclose([[xx, xy], [xy, yy]], bent, atol=1e-5 * (1 + np.abs(bent).max() ** 2))
        checked += 1
    assert checked > 0


@every_objective
@every_star
@pytest.mark.parametrize("way", [adam, newton])
def test_no_proposal_makes_the_objective_larger_or_inverts(way, name, kind):
    star, rng = STARS[kind], np.random.default_rng(4)
    out, hessian, shift, other = (np.empty(rows * LANES) for rows in (objectives.OUT, 3, 2, 2))
    state, code, fell = np.empty(way.STATE * LANES), objectives.NAMES.index(name), 0
    for _ in range(12):
        ring = star.star(rng)[1]
        if way is adam:
            sizes = adam.STEP_SIZE / np.sqrt(np.arange(1, adam.STEPS + 1))
            adam.propose(code, in_lanes(ring), len(ring), star.pattern, sizes, state, out, shift, other)
        else:
            newton.propose(code, in_lanes(ring), len(ring), star.pattern, state, out, hessian, shift, other)
        there, here = (shift[0], shift[LANES]), (0.0, 0.0)
        if min(d for d, _ in ratios(star, ring, here)) <= 0:
            continue
        assert min(d for d, _ in ratios(star, ring, there)) > 0
        before, after = (float(exact(name, star, ring, p)) for p in (here, there))
        assert after <= before * (1 + 1e-12)
        fell += after < before
    assert fell > 5


@every_star
def test_derivatives_of_shape_and_size(kind):
    star, rng, weight = STARS[kind], np.random.default_rng(5), 4.0
    ring, count = star.star(rng)[1], len(star.simplices(0) if star.pattern else [])
    wanted = 0.05 + 0.5 * rng.random(count)
    state = np.zeros(sized.STATE * LANES)
    places = 0.02 * rng.normal(size=(LANES, 2))
    state[: 2 * LANES] = places.T.ravel()
    sized.derive(in_lanes(ring), len(ring), star.pattern, np.repeat(wanted, LANES), weight, state)
    rows = state.reshape(-1, LANES)

    def cost(place):
        total = Fraction(0)
        for (d, ratio), goal in zip(ratios(star, ring, place), wanted.tolist(), strict=True):
            goal = Fraction(goal)
            total += 1 / (FACTOR * ratio) ** 2 + Fraction(weight) / 2 * (d / goal + goal / d)
        return total

    checked = 0
    for lane in range(8):
        if rows[sized.LEAST, lane] < 0.02:
            continue
        value, gradient, bent = differences(cost, places[lane])
        assert rows[sized.VALUE, lane] == pytest.approx(value, rel=1e-11)
        scale = 1 + np.abs(bent).max()
        np.testing.assert_allclose(rows[[sized.GX, sized.GY], lane], gradient, atol=1e-6 * scale)
        xx, xy, yy = rows[[sized.XX, sized.XY, sized.YY], lane]
        np.testing.assert_allclose([[xx, xy], [xy, yy]], bent, atol=1e-5 * scale**2)
        checked += 1
    assert checked > 0
