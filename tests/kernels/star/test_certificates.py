"""What a block of stars is certified for holds in exact arithmetic, for every reading of the coordinates."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.exact import whole
from support.patterns import FAN, Linked
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import barrier, barrier_lanes, laplacian, laplacian_plain
from gmsnet.kernels.methods.barrier_star import Power
from gmsnet.kernels.simplex.mean_ratio2 import Weights
from gmsnet.kernels.star import block, certificate
from gmsnet.kernels.star import stars as kernels
from gmsnet.kernels.star.guard import LARGEST, Precision, permitted, plain_guard, ratio_upper_bound
from gmsnet.topology.links import AT_A, AT_B, AT_NODE

READINGS = 6


def exact_least(place, ring, star=FAN):
    return read_least(np.ravel(place).tolist(), np.asarray(ring).tolist(), star)


def readings(rng, place, ring, guard):
    """The star as it is, and as it may be read: each coordinate off by what a written number may be off by."""
    yield place, ring
    points = np.vstack([place, ring])
    delta = guard.unit * np.abs(points).max() + guard.grain
    for _ in range(READINGS):
        read = [[Fraction(float(v)) + Fraction(delta) * int(rng.choice([-1, 1])) for v in point] for point in points]
        yield read[0], read[1:]


def read_least(place, ring, star=FAN):
    """The minimum D/L, exactly; floats of weights are what they are."""
    place, ratios = place[0] if len(place) == 1 else place, []
    numbers, _ = whole(v for point in (place, *ring) for v in point)
    (x, y), *ring = zip(numbers[::2], numbers[1::2], strict=True)
    for i, j, weights in star.simplices(len(ring)):
        ax, ay, bx, by = ring[i][0] - x, ring[i][1] - y, ring[j][0] - x, ring[j][1] - y
        squares = ax**2 + ay**2, bx**2 + by**2, (ax - bx) ** 2 + (ay - by) ** 2
        parts, common = whole(weights)
        lengths = sum(w * square for w, square in zip(parts, squares, strict=True))
        ratios.append(Fraction(common * (ax * by - ay * bx), lengths))
    return min(ratios)


def from_shifts(place, ring, shift, guard, star=FAN):
    """Margin and target by certificate.certify; the shift is over the star's size."""
    n, pairs, work = *block_of(place, ring), np.zeros((block.FLOORS + len(star.simplices(len(ring)))) * LANES)
    local, sums, shifts = np.empty(2 * n * LANES), np.empty(2 * LANES, dtype=np.float32), np.repeat(shift, LANES)
    kernels.localise(pairs, n, work, local)
    kernels.aim(work, shifts, guard.single)
    certificate.certify(local, n, star.pattern, shifts, max(guard.floor, 0.0), guard.unit, guard.grain, work, sums)
    return results(work)


def from_coordinates(place, ring, shift, guard, star=FAN):
    """The same by certificate.certify_stars."""
    n, pairs, work = *block_of(place, ring), np.zeros((block.FLOORS + len(star.simplices(len(ring)))) * LANES)
    kernels.localise(pairs, n, work, np.empty(2 * n * LANES))
    kernels.aim(work, np.repeat(shift, LANES), guard.single)
    work[block.FLOORS * LANES :] = guard.floor
    certificate.certify_stars(pairs, n, star.pattern, 1.0, guard.unit, guard.grain, work)
    return results(work)


def from_sums(place, ring, shift, guard, star=FAN):
    """Margin and target by kernels.methods.barrier; the shift is over the star's size."""
    n, pairs, work = *block_of(place, ring), np.zeros((block.FLOORS + len(star.simplices(len(ring)))) * LANES)
    local, flat = np.empty(2 * n * LANES, dtype=np.float32), np.empty(2 * LANES, dtype=np.float32)
    sums = np.zeros(barrier_lanes.SUMS * LANES, dtype=np.float32)
    barrier.relate(pairs, n, guard, work, flat, local, sums)
    step = np.repeat(shift, LANES).astype(np.float32)
    barrier_lanes.judge(local, n, star.pattern, Power.of(1), step, max(guard.floor, 0.0), sums)
    doubtful = barrier.certify(sums, step, guard.unit, work)
    assert doubtful == (~(work[block.MARGIN * LANES :][:LANES] > 0)).sum()
    kernels.aim(work, step.astype(float), guard.single)
    return results(work)


def from_the_mean(place, ring, _, guard, star=FAN):
    """The same by kernels.methods.laplacian_plain, which has a shift of its own."""
    n, pairs, work = *block_of(place, ring), np.zeros((block.FLOORS + len(star.simplices(len(ring)))) * LANES)
    local, sums = np.empty(2 * n * LANES, dtype=np.float32), np.empty(2 * LANES, dtype=np.float32)
    laplacian_plain.aim(pairs, n, star.pattern, guard.single, np.empty(2 * LANES), work)
    laplacian_plain.relate(pairs, n, work, np.empty(2 * LANES, dtype=np.float32), local)
    doubtful = laplacian_plain.certify(
        local, n, star.pattern, max(guard.floor, 0.0), guard.unit, guard.grain, work, sums
    )
    assert doubtful == (~(work[block.MARGIN * LANES :][:LANES] > 0)).sum()
    targets = work[laplacian_plain.TARGETS * LANES :][: 2 * LANES].reshape(LANES, 2)
    work[block.TARGET * LANES :][: 2 * LANES] = targets.T.ravel()
    return results(work)


def from_judgement(place, ring, _, guard, star=FAN):
    """The same by kernels.methods.laplacian in its smart form, which goes to the mean or stays."""
    n, pairs, work = *block_of(place, ring), np.zeros((block.FLOORS + len(star.simplices(len(ring)))) * LANES)
    local, row, shifts = np.empty(2 * n * LANES), np.empty(laplacian.ROWS * LANES), np.empty(2 * LANES)
    kernels.localise(pairs, n, work, local)
    laplacian.smart_mean(local, n, star.pattern, max(guard.floor, 0.0), row, shifts)
    kernels.aim(work, shifts, guard.single)
    laplacian.certify_smart(row, guard.unit, guard.grain, work)
    return results(work)


def block_of(place, ring):
    """Degree, and the star in all lanes."""
    return len(ring), np.vstack([place, ring]).repeat(LANES, axis=0).ravel()


def results(work):
    margin = work[block.MARGIN * LANES :][:LANES]
    target = work[block.TARGET * LANES :][: 2 * LANES].reshape(2, LANES)
    np.testing.assert_array_equal(margin, margin[0])  # one star in all lanes
    np.testing.assert_array_equal(target, target[:, :1].repeat(LANES, axis=1))
    return margin[0], target[:, 0]


OF_SHIFTS = [from_shifts, from_coordinates, from_sums]
STARS = {"fan": FAN, "4 quads": Linked(0, 4), "3 quads": Linked(0, 3), "2 triangles, 2 quads": Linked(2, 2)}


@pytest.mark.parametrize("certify", [*OF_SHIFTS, from_the_mean, from_judgement])
@pytest.mark.parametrize("kind", STARS)
@given(
    seed=st.integers(0, 2**32 - 1), degree=st.integers(3, 9), scale=st.sampled_from([2.0**-40, 1e-3, 1.0]),
    offset=st.sampled_from([0.0, 1.0, 1e5]), digits=st.integers(2, 12), above=st.booleans(), single=st.booleans(),
    squeeze=st.sampled_from([1.0, 1e-2, 1e-5]),
)  # fmt: skip
@settings(max_examples=300)
def test_what_is_certified_is_so(certify, kind, seed, degree, scale, offset, digits, above, single, squeeze):
    """The floor lies just below, or just above, what the star has at the target."""
    rng = np.random.default_rng(seed)
    shape = STARS[kind]
    centre, ring = star(rng, degree) if shape is FAN else shape.star(rng)
    place, ring = (np.asarray(v) * (scale, squeeze * scale) + scale * offset for v in (centre, ring))
    guard = plain_guard(Precision(2.0**-24, 2.0**-150, single=True) if single else Precision())
    if single:
        place, ring = (v.astype(np.float32).astype(float) for v in (place, ring))
    shift = 10.0 ** rng.uniform(-4, 0) * rng.normal(size=2) * (1.0, squeeze)
    _, target = certify(place, ring, shift, guard, shape)
    least = exact_least(target, ring, shape) if np.ptp(np.vstack([target, ring]), axis=0).all() else Fraction(0)
    floor = float(least * (1 + (1 if above else -1) * Fraction(1, 10**digits)))
    margin, again = certify(place, ring, shift, guard._replace(floor=floor), shape)
    np.testing.assert_array_equal(again, target)
    if margin > 0:
        for read_place, read_ring in readings(rng, target, ring, guard):
            exact = [Fraction(v) for v in read_place], [[Fraction(v) for v in point] for point in read_ring]
            assert read_least(*exact, shape) > max(Fraction(floor), 0)


@pytest.mark.parametrize("certify", [*OF_SHIFTS, from_the_mean, from_judgement])
def test_a_sound_star_is_certified(certify):
    """With room to the floor, whatever the scale: the slow way is for the few."""
    angle = np.pi / 3 * np.arange(6)
    for scale in (2.0**-60, 1e-3, 1.0):
        ring = scale * np.column_stack([np.cos(angle), np.sin(angle)])
        for floor in (-np.inf, 0.0, 0.2, 0.28):
            guard = plain_guard()._replace(floor=floor)
            margin, _ = certify(np.zeros(2), ring, np.array([0.01, 0.0]), guard)
            assert margin > 0
        margin, _ = certify(np.zeros(2), ring, np.array([0.01, 0.0]), guard._replace(floor=0.28867))
        assert not margin > 0


@pytest.mark.parametrize("certify", OF_SHIFTS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30])
def test_what_is_no_number_is_not_certified(certify, bad):
    centre, ring = star(np.random.default_rng(0), 6)
    margin, _ = certify(np.asarray(centre, dtype=float), ring, np.array([bad, 0.0]), plain_guard())
    assert not margin > 0


@pytest.mark.parametrize("certify", [from_the_mean, from_judgement])
@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-300, 1e-200, 1e20, 1e160, 1e308])
@pytest.mark.parametrize("every", [True, False])
def test_what_float32_cannot_hold_is_not_certified_by_mistake(certify, size, every):
    """Rings of one point, too small or too large to be squared; not every: rings whose first spoke alone is so."""
    angle = np.pi / 3 * np.arange(6)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    ring[slice(None) if every else slice(1)] *= size
    margin, target = certify(np.zeros(2), ring, None, plain_guard())
    if margin > 0:
        assert exact_least(target, ring) > 0


def test_a_ring_that_crosses_itself_around_the_mean_is_not_certified():
    ring = np.array([(1.0, 0.0), (-1.0, 1.0), (1.0, 1.0), (-1.0, 0.0)])
    margin, _ = from_the_mean(np.array([0.1, 0.2]), ring, None, plain_guard())
    assert not margin > 0


@pytest.mark.parametrize("certify", [*OF_SHIFTS, from_the_mean, from_judgement])
def test_a_sound_star_of_squares_is_certified(certify):
    around = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], dtype=float)
    for scale in (2.0**-60, 1e-3, 1.0):
        for floor in (-np.inf, 0.0, 0.2, 0.28):
            guard = plain_guard()._replace(floor=floor)
            margin, _ = certify(np.zeros(2), scale * around, np.array([0.001, 0.0]), guard, STARS["4 quads"])
            assert margin > 0
        margin, _ = certify(np.zeros(2), scale * around, np.zeros(2), guard._replace(floor=0.28868), STARS["4 quads"])
        assert not margin > 0  # the square's own is 1/(2√3) = 0.288675…


CORNERS = {"v": AT_NODE, "a": AT_A, "b": AT_B}


def ratio(a, b, v, weights):
    """D/L of the simplex (v, a, b), exactly."""
    (ax, ay), (bx, by), (vx, vy) = ([Fraction(float(x)) for x in point] for point in (a, b, v))
    px, py, qx, qy = ax - vx, ay - vy, bx - vx, by - vy
    squares = px**2 + py**2, qx**2 + qy**2, (px - qx) ** 2 + (py - qy) ** 2
    return (px * qy - py * qx) / sum(Fraction(w) * square for w, square in zip(weights, squares, strict=True))


@pytest.mark.parametrize("corner", CORNERS)
@given(
    seed=st.integers(0, 2**32 - 1), offset=st.sampled_from([0.0, 1.0, 1e6]), squeeze=st.sampled_from([1.0, 1e-4, 1e-9]),
    digits=st.integers(2, 17), above=st.booleans(),
)  # fmt: skip
@settings(max_examples=300)
def test_the_guard_is_exact_about_square_corners_wherever_they_are(corner, seed, offset, squeeze, digits, above):
    """What ``permitted`` allows is above the floor, and ``ratio_upper_bound`` is never below D/L; slivers, too."""
    rng = np.random.default_rng(seed)
    a, b, v = rng.normal(size=(3, 2)) * (1.0, squeeze) @ np.linalg.qr(rng.normal(size=(2, 2)))[0] + offset
    weights = CORNERS[corner]
    exact = ratio(a, b, v, weights)
    delta = 2.0**-53 * float(np.abs([a, b, v]).max())
    floor = float(exact * (1 + (1 if above else -1) * Fraction(1, 10**digits)))
    four = Weights(*(float(w) for w in weights), 0.5)
    if permitted(np.concatenate([a, b, v]), np.concatenate([a, b, v]), delta, floor, four):
        assert exact > Fraction(floor)
        assert exact > 0
    p, q = a - v, b - v
    if exact < Fraction(LARGEST):
        assert Fraction(float(ratio_upper_bound(*p, *q, delta, four))) >= exact
