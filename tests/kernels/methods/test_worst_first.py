"""Newton on high powers at single stars: against automatic differentiation, and the guard against that of blocks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive_objectives
from support.one_block import block_of
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import worst_first as kernels
from gmsnet.kernels.methods import worst_first_cycles as cycles
from gmsnet.kernels.star import block, truncation
from gmsnet.kernels.star import stars as kernels_stars
from gmsnet.kernels.star.guard import STAR, VALID, WORST, MeshGuard, StarGuard, plain_guard
from gmsnet.kernels.star.pattern import Stars

DOUBLINGS = (3, 4, 6)
every_power = pytest.mark.parametrize("doublings", DOUBLINGS)


def valid_star(rng, degree):
    while True:
        place, ring = star(rng, degree)
        if naive_objectives.least_area(ring, place) > 0:
            return place, ring


def largest(ring, place):
    """The largest q, infinite where a triangle is not positive."""
    a, b = np.roll(ring, 1, axis=0) - place, ring - place
    d = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return ((a * a + b * b - a * b).sum(axis=1) / d).max() / math.sqrt(3) if (d > 0).all() else math.inf


@every_power
@pytest.mark.parametrize("degree", [3, 4, 5, 6, 7, 8, 12])
def test_value_and_step(doublings, degree):
    rng, p = np.random.default_rng(degree), 2**doublings
    for _ in range(5):
        place, ring = valid_star(rng, degree)
        most = largest(ring, place)
        inverse = 1 / (math.sqrt(3) * most)
        value, dx, dy, least = kernels.newton(ring.ravel(), degree, None, *place, inverse, doublings, None, 0)
        f, g, h = naive_objectives.derivatives_at(f"q{p}", ring, place)
        f, g, h = (degree * (x / most**p) for x in (f, g, h))
        newton = -np.linalg.solve(h, g)
        longer = 1 / max(1 - (1 + 1 / p) * (-g @ newton) / f, 1 / kernels.MOST)
        assert kernels.largest(ring.ravel(), degree, None, *place) == pytest.approx(1 / inverse, rel=1e-12)
        assert value == pytest.approx(f, rel=1e-10)
        assert kernels.value_at(ring.ravel(), degree, None, *place, inverse, doublings) == pytest.approx(f, rel=1e-10)
        assert least == pytest.approx(naive_objectives.least_area(ring, place), rel=1e-12)
        np.testing.assert_allclose([dx, dy], longer * newton, rtol=1e-5, atol=1e-12)


@every_power
@given(seed=st.integers(0, 2**32 - 1), degree=st.integers(3, 30))
@settings(max_examples=50)
def test_the_objective_never_rises(doublings, seed, degree):
    rng = np.random.default_rng(seed)
    place, ring = star(rng, degree)
    if naive_objectives.least_area(ring, place) <= 0:
        return
    inverse = 1 / (math.sqrt(3) * largest(ring, place))
    for _ in range(3):
        there = np.array(kernels.descend(ring.ravel(), degree, None, *place, inverse, doublings, None, 0))
        before, after = (kernels.value_at(ring.ravel(), degree, None, *x, inverse, doublings) for x in (place, there))
        assert after <= before * (1 + 1e-12)
        assert naive_objectives.least_area(ring, there) > 0
        place = there


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_the_scale_does_not_matter(scale):
    """Powers that under- or overflow with the scale that is given are taken with the star's own."""
    place, ring = valid_star(np.random.default_rng(4), 6)
    one = kernels.descend(ring.ravel(), 6, None, *place, 1 / (math.sqrt(3) * largest(ring, place)), 6, None, 0)
    np.testing.assert_allclose(
        kernels.descend(ring.ravel(), 6, None, *place, scale, 6, None, 0), one, rtol=0, atol=1e-9
    )


def test_high_powers_find_the_best_worst_triangle():
    rng = np.random.default_rng(5)
    for _ in range(10):
        place, ring = valid_star(rng, 5)
        for doublings in (3, 4, 5, 6, 7, 8, 8, 8):
            place = np.array(
                kernels.descend(ring.ravel(), 5, None, *place, 1 / largest(ring, place), doublings, None, 0)
            )
        around = place + 0.01 * rng.normal(size=(2000, 2))
        assert largest(ring, place) < 1.02 * min(largest(ring, other) for other in around)


def test_a_tangled_star_goes_to_the_mean():
    angles = 2 * np.pi * np.arange(5) / 5
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    np.testing.assert_allclose(kernels.descend(ring.ravel(), 5, None, 2.0, 0.0, 1.0, 5, None, 0), [0, 0], atol=1e-12)


@pytest.mark.parametrize("level", [VALID, WORST, STAR])
@pytest.mark.parametrize("single", [False, True])
def test_the_guard_is_that_of_blocks(level, single):
    """The same shifts, committed by stars.commit and one by one, lead to the same places, counted alike."""
    rng = np.random.default_rng(6)
    moved = []
    for degree in (3, 5, 6, 9):
        stars = [star(rng, degree) for _ in range(LANES)]
        stars = [(c + (rng.random() < 0.2) * rng.normal(size=2), r) for c, r in stars]  # some are tangled
        points, blocks = block_of(stars)
        points = np.float64(np.float32(points)) if single else points
        unit = 2.0**-24 if single else 2.0**-53
        floors = np.where(np.arange(len(points)) < LANES, rng.uniform(-0.1, 0.15, len(points)), -np.inf)
        floor = 0.05 if level == WORST else -np.inf
        guard = MeshGuard(unit, 0.0, single, floor)
        guard = StarGuard(*guard, floors) if level == STAR else guard
        shifts = rng.choice([0.1, 1.0, 5.0], LANES)[:, None] * rng.normal(size=(LANES, 2))
        targets = points[:LANES] + shifts

        shared, tally = kernels_stars.workspace_for(degree), np.zeros(3, dtype=int)
        local = np.empty(2 * degree * LANES)
        one, other = points.copy(), points.copy()
        kernels_stars.fetch(one, blocks, 0, shared, local)
        over_sizes = (shifts.T / shared.work[:LANES]).ravel()
        kernels_stars.commit(one, blocks, 0, shared, local, over_sizes, guard, tally)

        start = np.minimum(np.arange(len(points) + 1), LANES).astype(np.int32) * degree
        around = blocks.rings.reshape(degree, LANES).T.ravel().copy()
        room, counts = np.empty(3 * degree + 1), np.zeros(2, dtype=int)
        for i in range(LANES):
            n, _ = kernels.gather(points, i, Stars(start, around), guard, room)
            tx, ty, halvings = kernels.way_there(room, n, None, *points[i], *targets[i], guard, i)
            # In blocks fewer halvings are made where floors refuse a shift.
            given_up = halvings == kernels.HALVINGS or (
                halvings >= truncation.FEW_HALVINGS and (one[i] == points[i]).all()
            )
            other[i] = points[i] if given_up else (tx, ty)
            counts += not given_up, given_up
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-15)  # the target is a sum in one, a difference in both
        assert counts.tolist() == [tally[block.MOVED], tally[block.DROPPED]]
        moved.append(counts[0])
    assert 0 < sum(moved) < 4 * LANES


def test_the_order_within_a_colour_does_not_matter():
    stars = [star(np.random.default_rng(k), 6) for k in range(40)]  # apart from each other
    points, blocks = block_of(stars)
    start = np.minimum(np.arange(len(points) + 1), 40).astype(np.int32) * 6
    around = blocks.rings.reshape(6, LANES)[:, :40].T.ravel().copy()
    results = []
    for order in (np.arange(40), np.random.default_rng(7).permutation(40)):
        now, awake = points.copy(), np.zeros(len(points), dtype=np.bool_)
        cycles.visit(
            now, order.astype(np.int32), Stars(start, around), plain_guard(), 4, 5, 1.0, None, awake, None,
            np.zeros(3, dtype=np.int64),
        )  # fmt: skip
        assert not awake.any()
        results.append(now.tobytes())
    assert results[0] == results[1]
    assert now[:40].tobytes() != points[:40].tobytes()
