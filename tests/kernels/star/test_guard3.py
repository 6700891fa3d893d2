"""What is certified of stars in space holds in exact arithmetic, for every reading of the coordinates."""

from __future__ import annotations

import math
import os
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.space import above, as_written, exact, exact_margins, see, simplices_of, stars

from gmsnet.kernels.methods.barrier3 import Power3
from gmsnet.kernels.simplex import mean_ratio3
from gmsnet.kernels.simplex.orientation3 import count_signs, determinant_and_bound, signs
from gmsnet.kernels.star import guard3
from gmsnet.kernels.star.guard import Precision, plain_guard, unit_of_steps
from gmsnet.kernels.star.space import MARGIN
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import WIDER, allowed3

measured, moved = as_written(mean_ratio3.measured), as_written(mean_ratio3.moved)
READINGS = 3
EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "6"))
POWER = Power3.of(-1)
some_stars = given(
    seed=st.integers(0, 2**32 - 1),
    flat=st.sampled_from([0.0, 0.0, 2.0, 4.0, 6.0]),
    spiky=st.sampled_from([0.0, 0.5, 2.0, 4.0]),
    where=st.sampled_from([(1.0, 0.0), (1.0, 1e3), (1.0, 1e6), (1e-30, 0.0), (1e20, 0.0), (1e-7, 1.0), (1e-5, 300.0)]),
    single=st.booleans(),
)


def spiky_ball(rng, around, spiky=0.0, flat=0.0):
    """A ball with each node of its ring drawn along its ray, then flattened along one axis; the free node inside."""
    points, cells = volumes.ball(rng, around, off=0.0)
    factors = 10.0 ** rng.uniform(-spiky, spiky, len(points) - 1)
    points[1:] *= (factors / factors.max())[:, None]
    points[:, rng.integers(3)] *= 10.0**-flat
    return points, cells


def readings(rng, place, ring, delta, worst=None):
    """The star as it is, and as it may be read: each coordinate off by up to delta; worst: the signs that hurt most."""
    here, around, delta = exact(place)[0], exact(ring), Fraction(delta)
    yield here, around
    for k in range(READINGS):
        sign = rng.choice([-1, 1], (len(ring) + 1, 3)) if k or worst is None else worst
        moved = [
            [v + delta * int(s) for v, s in zip(row, turn, strict=True)]
            for row, turn in zip([here, *around], sign, strict=True)
        ]
        yield moved[0], moved[1:]


def most_harmful(place, ring, rows, floor):
    """The signs of changes by which the least D − c·S^(3/2) falls the most; rows: (F, 3) of the ring."""
    at = np.vstack([place, ring])

    def margin(points, row):
        double, lengths, *_ = measured(*(points[row + 1] - points[0]).ravel().tolist())
        return double - floor * lengths**1.5

    row = min(rows, key=lambda row: margin(at, row))
    size, found = np.abs(ring - place).max(), np.zeros(at.shape, dtype=int)
    for node in (-1, *row):
        for axis in range(3):
            away = at.astype(complex)
            away[node + 1, axis] += 1j * 1e-20 * size
            found[node + 1, axis] = -1 if margin(away, row).imag >= 0 else 1
    return found


def floor_near(place, ends, share):
    """A share of the least D/S^(3/2) over the star."""
    ratios = [
        float(double) / float(lengths) ** 1.5 if double > 0 else 0.0 for double, lengths in exact_margins(place, ends)
    ]
    return min(ratios) * share


@pytest.mark.parametrize("exactly", [False, True])
@pytest.mark.parametrize("landed", [False, True])
@some_stars
@settings(max_examples=4 * EXAMPLES)
def test_steps_that_are_certified_in_lanes(landed, exactly, seed, flat, spiky, where, single):
    """And the float32 margin is never off by more than its bound. landed: nodes go to places that steps only round.

    exactly: is the file known so?
    """
    rng = np.random.default_rng(seed)
    size, away = where
    points, topology = stars(
        rng, rng.integers(4, 9, 4), spiky_ball, size, away * size, spiky=spiky, flat=flat
    )  # fmt: skip
    if single:
        points = np.float64(np.float32(points))
    precision = Precision.of(single=single, exponent=0, exact=exactly)
    blocks = topology.stars.blocks
    step = (rng.normal(size=(3, LANES3)) * 10.0 ** rng.uniform(-6, -0.5, LANES3)).astype(np.float32)
    step[:, rng.random(LANES3) < 0.3] = 0
    share = rng.choice([0.0, 0.5, 0.99, 1.0001])
    see_them(rng, points, topology, blocks, step, share, precision, landed)


def landing(step, first, inverse, single):
    """A place (3,) that a step nearly leads to, and the step to it as ``land3`` rounds it: by nearly half a unit."""
    off = 1.0 + 0.999 * 2.0**-24 * np.array([1.0, -1.0, 1.0])
    place = first + step.astype(float) * off / float(inverse)
    if single:
        place = np.float64(np.float32(place))
    return place, ((place - first) * float(inverse)).astype(np.float32)


def see_them(rng, points, topology, blocks, step, share, precision, landed=False):
    """Each lane's star by itself, against a floor of its own. Returns how many are certified, and the largest error."""
    certified, error = 0, 0.0
    for lane in range(int(blocks.filled[0])):
        centre, ends = simplices_of(topology, 0, lane)
        nodes, rows = np.unique(ends, return_inverse=True)
        rows = rows.reshape(ends.shape)
        ring, first = points[nodes, :3], points[centre, :3]
        inverse = see(points, blocks, 0, -1, POWER.constants, step.ravel(), 0.0, 1.0, 0.0).inverse[lane]
        place = first + step[:, lane].astype(float) / float(inverse)
        if landed:
            place, step[:, lane] = landing(step[:, lane], first, inverse, precision.single)
        elif precision.single:
            place = np.float64(np.float32(place))
        floor = floor_near(exact(place)[0], [exact(ring[row]) for row in rows], share) if share else 0.0
        unit = unit_of_steps(plain_guard(precision))
        work = see(points, blocks, 0, -1, POWER.constants, step.ravel(), floor, unit, precision.grain)
        far = float(np.abs(step[:, lane]).max())
        m = max(float(work.width[lane]), far)
        reach = np.abs(first).max() + work.size[lane] * m
        delta = WIDER * (unit * reach + precision.grain) / work.size[lane]
        bound = WIDER * guard3.error_bound3(m, delta)
        margin = float(work.sums[MARGIN * LANES3 + lane])
        assert work.allowed[lane] == (margin > bound)
        known = precision.unit * np.abs(np.vstack([ring, [place]])).max() + precision.grain
        scale = float(inverse)
        for here, around in readings(rng, place, ring, known, most_harmful(place, ring, rows, floor)):
            found = exact_margins(here, [[around[k] for k in row] for row in rows])
            if work.allowed[lane]:
                assert all(above(double, lengths, floor) for double, lengths in found)
            least = min(float(d) * scale**3 - floor * (float(s) * scale**2) ** 1.5 for d, s in found)
            if math.isfinite(margin):
                assert abs(margin - least) <= bound
                error = max(error, abs(margin - least) / bound)
        certified += bool(work.allowed[lane])
    return certified, error


@pytest.mark.parametrize("landed", [False, True])
def test_most_stars_of_ordinary_meshes_are_certified(landed):
    """Else the test above would be of nothing."""
    rng = np.random.default_rng(0)
    certified, errors = 0, []
    for _ in range(5):
        points, topology = stars(rng, rng.integers(4, 9, 8), spiky_ball, spiky=0.3)
        step = np.float32(0.02 * landed) * rng.normal(size=(3, LANES3)).astype(np.float32)
        found, error = see_them(rng, points, topology, topology.stars.blocks, step, 0.5, Precision(), landed)
        certified += found
        errors.append(error)
    assert certified >= 36  # of 40
    assert 1e-4 < max(errors) < 0.5


def some_simplex(seed, flat, where, single):
    """Spokes as computed, the nodes, and how far each coordinate may be off."""
    rng = np.random.default_rng(seed)
    nodes = rng.normal(size=(4, 3)) * 10.0 ** rng.uniform(-2, 0, 4)[:, None]
    nodes[:, rng.integers(3)] *= 10.0 ** (-4 * flat)
    if seed % 3 == 0:
        nodes[:, rng.integers(3)] = 0.5  # without any volume
    nodes = where[0] * (nodes + where[1])
    if single:
        nodes = np.float64(np.float32(nodes))
    precision = Precision.of(single=single, exponent=0)
    return rng, nodes, precision.unit * np.abs(nodes).max() + precision.grain


some_simplices = given(
    seed=st.integers(0, 2**32 - 1),
    flat=st.sampled_from([0, 1, 2, 3, 4]),
    where=st.sampled_from([(1.0, 0.0), (1.0, 1e3), (1.0, 1e6), (1e-30, 0.0), (1e20, 0.0), (1e-7, 1.0)]),
    single=st.booleans(),
)


@some_simplices
@settings(max_examples=200)
def test_bounds_of_one_simplex(seed, flat, where, single):
    rng, nodes, delta = some_simplex(seed, flat, where, single)
    spokes = (nodes[1:] - nodes[0]).ravel().tolist()
    value, bound = determinant_and_bound(*spokes, delta)
    lengths, error = guard3.length_bounds(*spokes, delta)
    ratio = guard3.ratio_upper_bound3(*spokes, delta)
    near = abs(value) / max(lengths, 1e-300) ** 1.5
    floors = [0.0, 0.5 * near, near * (1 - 1e-13), near, near * (1 + 1e-13)]
    passed = [floor for floor in floors if guard3.certified(*spokes, delta, floor)]
    for here, around in readings(
        rng, nodes[0], nodes[1:], delta, most_harmful(nodes[0], nodes[1:], [np.arange(3)], near)
    ):
        ((d, s),) = exact_margins(here, [around])
        assert abs(d - Fraction(value)) <= Fraction(bound)
        assert abs(s - Fraction(lengths)) <= Fraction(error)
        assert all(above(d, s, floor) for floor in passed)
        assert not above(d, s, ratio)  # an upper bound: as a floor it keeps what this simplex has


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_an_ordinary_simplex_is_certified_up_to_its_own_ratio(seed):
    """The bounds are good for something."""
    _, nodes, _ = some_simplex(3 * seed + 1, 0, (1.0, 0.0), False)
    spokes = (nodes[1:] - nodes[0]).ravel().tolist()
    if determinant_and_bound(*spokes, 0.0)[0] < 0:
        spokes = spokes[3:6] + spokes[:3] + spokes[6:]
    value, lengths, *_ = measured(*spokes)
    own = value / lengths**1.5
    if own > 1e-6:
        assert guard3.certified(*spokes, 1e-17, 0.999999 * own)
        assert not guard3.certified(*spokes, 1e-17, 1.000001 * own)
        assert own <= guard3.ratio_upper_bound3(*spokes, 1e-17) <= 1.000001 * own


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_never_certified(bad):
    for k in range(9):
        spokes = [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
        spokes[k] = bad
        assert not guard3.certified(*spokes, 0.0, 0.0)
        assert not guard3.certified(*spokes, 0.0, 0.01)


@some_simplices
@settings(max_examples=60)
def test_signs_are_those_of_fractions_or_left_open(seed, flat, where, single):
    _, nodes, _ = some_simplex(seed, flat, where, single)
    points = np.hstack([nodes, np.zeros((4, 1))])
    rows = np.array([[0, 1, 2, 3], [1, 0, 2, 3], [2, 1, 0, 3]], dtype=np.int32)
    turn = np.array([1, 1, -1], dtype=np.int8)
    out = np.empty(3, dtype=np.int8)
    doubts = signs(points, rows, turn, 0.0, out)
    truth = volumes.exact_signs(points, rows, turn)
    assert doubts == (out == 0).sum()
    assert all(o in (0, t) for o, t in zip(out, truth, strict=True))
    assert truth == [truth[0], -truth[0], truth[0]]
    assert count_signs(points, rows) == (sum(out * turn > 0), sum(out * turn < 0)) or doubts


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_places_that_are_allowed_in_float64(seed):
    """By every simplex of the star, at floors of the mesh and of stars alike; also in single precision."""
    rng = np.random.default_rng(seed)
    points, topology = stars(rng, rng.integers(4, 12, 3), spiky_ball, spiky=0.5)
    blocks = topology.stars.blocks
    for lane in range(3):
        centre, ends = simplices_of(topology, 0, lane)
        place = points[centre, :3] + rng.normal(size=3) * 10.0 ** rng.uniform(-4, 0)
        found = exact_margins(exact(place)[0], [exact(points[row, :3]) for row in ends])
        ratios = [float(d) / float(s) ** 1.5 for d, s in found]
        for floor in (-math.inf, 0.0, 0.5 * abs(min(ratios)), 2.0 * abs(min(ratios))):
            guard = plain_guard()._replace(floor=floor)
            truth = min(ratios) > max(floor, 0.0)
            if abs(min(ratios)) > 1e-9:
                assert allowed_here(points, blocks, 0, lane, *place, guard) == truth


def allowed_here(*arguments):
    """``allowed3`` for Python to call."""
    return bool(allowed3(*arguments))
