"""What the SIMD parts find in a block of stars in space, against loops over its simplices in float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.space import as_written, see, simplices_of, stars

from gmsnet.kernels.methods.barrier3 import K3, Power3
from gmsnet.kernels.simplex import mean_ratio3
from gmsnet.kernels.simplex.tetra_measures import cubed_ratios
from gmsnet.kernels.star.space import AFTER, KEPT, LEAST, MARGIN
from gmsnet.kernels.star.space_blocks import LANES3

measured, derivatives, moved = map(as_written, (mean_ratio3.measured, mean_ratio3.derivatives, mean_ratio3.moved))
walled = as_written(mean_ratio3.walled)
NUMBERS = range(-1, 6)
# Nodes around each star: stars of one block differ in their number of simplices, and lanes are left over.
some_rings = st.lists(st.integers(4, 24), min_size=1, max_size=LANES3)


def lanes(topology):
    """(block, lane, whether it holds a star of its own)."""
    blocks = topology.stars.blocks
    for block in range(len(blocks.filled)):
        for lane in range(LANES3):
            yield block, lane, lane < blocks.filled[block]


def twin(local, power, number):
    """The sums of one star, and the sums of the absolute terms, in float64, of gradients and Hessians the largest.

    local: (F, 9) spokes.
    """
    _, root, two_p, m, mixed, squared = power.constants.astype(float)
    terms = []
    for row in local:
        double, lengths, wx, wy, wz, sx, sy, sz = measured(*row.tolist())
        ratio = lengths**1.5 / double * root
        f = ratio if number < 0 else ratio ** (2.0 * 2.0**number)
        found = derivatives(f, two_p / lengths, m / double, wx, wy, wz, sx, sy, sz, mixed, squared)
        terms.append([f, *found, f / lengths])
    absolute = np.abs(terms).sum(axis=0)
    absolute[1:4], absolute[4:10] = absolute[1:4].max(), absolute[4:10].max()
    return np.sum(terms, axis=0), absolute


def twin_with_wall(local, shape, squarings, weight):
    """The same of the mean with a wall at an η."""
    terms = []
    for row in local:
        double, lengths, wx, wy, wz, sx, sy, sz = measured(*row.tolist())
        q = (lengths**1.5 / double / K3**0.5) ** (2 / 3)
        f, part, two_p, m, mixed, squared, even = walled(
            q**1.5, weight * (q * shape) ** (3.0 * 2.0**squarings), 3.0 * 2.0**squarings
        )  # fmt: skip
        found = derivatives(part, two_p / lengths, m / double, wx, wy, wz, sx, sy, sz, mixed, squared)
        terms.append([f, *found, even / lengths])
    absolute = np.abs(terms).sum(axis=0)
    absolute[1:4], absolute[4:10] = absolute[1:4].max(), absolute[4:10].max()
    return np.sum(terms, axis=0), absolute


def local_of(points, topology, block, lane, inverse):
    centre, ends = simplices_of(topology, block, lane)
    return ((points[ends] - points[centre])[..., :3] * float(inverse)).reshape(len(ends), 9)


@pytest.mark.parametrize("number", NUMBERS)
@given(seed=st.integers(0, 2**32 - 1), rings=some_rings)
@settings(max_examples=12)
def test_sums_of_a_star_and_after_a_step(number, seed, rings):
    rng = np.random.default_rng(seed)
    points, topology = stars(rng, rings, off=0.2)
    ratios = np.empty(len(topology.near))
    cubed_ratios(points, topology.near, topology.near_orientation, None, 0, len(ratios), ratios)
    power, blocks = Power3.of(number, max(1.0, ratios.max() / K3)), topology.stars.blocks
    assert len(blocks.filled) == -(-len(rings) // LANES3)
    step = rng.normal(scale=0.02, size=(3, LANES3)).astype(np.float32)
    floor = float(np.float32(0.01))
    for block, lane, _ in lanes(topology):
        work = see(points, blocks, block, number, power.constants, step.ravel(), floor, 2.0**-53, 0.0)
        sums = work.sums.reshape(-1, LANES3)[:, lane].astype(float)
        local = local_of(points, topology, block, lane, work.inverse[lane])
        assert np.abs(work.width[lane] - np.abs(local).max()) < 1e-6 * np.abs(local).max()
        expected, absolute = twin(local, power, number)
        rough = 1e-5 * (2.0 ** max(number, 0)) * 10
        lost = 1e-29 / max(absolute[0], 1e-300)  # of high powers: squares below 1e-30 count as zero
        assert (np.abs(sums[:LEAST] - expected) <= (rough + lost) * absolute).all()
        doubles = np.array([measured(*row.tolist())[0] for row in local])
        assert sums[LEAST] == pytest.approx(doubles.min(), abs=1e-5 * np.abs(local).max() ** 3)
        there = np.array([moved(*measured(*row.tolist()), *step[:, lane].tolist()) for row in local])
        again = np.array([measured(*(row - np.tile(step[:, lane], 3)).tolist())[:2] for row in local])
        np.testing.assert_allclose(there, again, rtol=1e-6, atol=1e-6 * np.abs(local).max() ** 3)
        margin = (there[:, 0] - floor * there[:, 1] ** 1.5).min()
        assert sums[MARGIN] == pytest.approx(margin, abs=1e-4 * max(1.0, np.abs(local).max()) ** 3)
        if there[:, 0].min() > 1e-3 and number < 3:
            after, _ = twin(local - np.tile(step[:, lane], 3), power, number)
            assert sums[AFTER] == pytest.approx(after[0], rel=1e-2)


@pytest.mark.parametrize(("squarings", "weight", "times"), [(2, 1.0, 2.0), (3, 1.0, 1.2), (4, 0.05, 1.0)])
@given(seed=st.integers(0, 2**32 - 1), rings=some_rings)
@settings(max_examples=12)
def test_sums_of_a_star_with_a_wall_and_after_a_step(squarings, weight, times, seed, rings):
    """Lanes that have fewer simplices than others get no share of those that they do not have."""
    rng = np.random.default_rng(seed)
    points, topology = stars(rng, rings, off=0.2)
    ratios = np.empty(len(topology.near))
    cubed_ratios(points, topology.near, topology.near_orientation, None, 0, len(ratios), ratios)
    shape = times * (K3 / ratios.max()) ** (1 / 3)
    power, blocks = Power3.above(shape, squarings, weight), topology.stars.blocks
    step = rng.normal(scale=0.02, size=(3, LANES3)).astype(np.float32)
    for block, lane, _ in lanes(topology):
        of_power = power.number, power.constants
        work = see(points, blocks, block, *of_power, step.ravel(), 0.0, 2.0**-53, 0.0, power.wall, squarings)
        sums = work.sums.reshape(-1, LANES3)[:, lane].astype(float)
        local = local_of(points, topology, block, lane, work.inverse[lane])
        expected, absolute = twin_with_wall(local, shape, squarings, weight)
        assert (np.abs(sums[:LEAST] - expected) <= 1e-4 * 2.0**squarings * absolute).all()
        there = np.array([moved(*measured(*row.tolist()), *step[:, lane].tolist()) for row in local])
        if there[:, 0].min() > 1e-3:
            after, _ = twin_with_wall(local - np.tile(step[:, lane], 3), shape, squarings, weight)
            assert sums[AFTER] == pytest.approx(after[0], rel=1e-2 * 2.0**squarings)


def test_what_is_kept_is_w_d_s_and_the_squared_edges():
    rng = np.random.default_rng(3)
    points, topology = stars(rng, [6, 9, 30])
    power, blocks = Power3.of(-1), topology.stars.blocks
    work = see(points, blocks, 0, -1, power.constants, np.zeros(3 * LANES3, dtype=np.float32), 0.0, 2.0**-53, 0.0)
    kept = work.kept.reshape(-1, KEPT, LANES3)
    for block, lane, _ in lanes(topology):
        local = local_of(points, topology, block, lane, work.inverse[lane])
        for k, row in enumerate(local):
            double, lengths, *rest = measured(*row.tolist())
            expected = [*rest[:3], double, *rest[3:], lengths]
            np.testing.assert_allclose(kept[k, :, lane], expected, rtol=0, atol=2e-5 * np.abs(local).max() ** 3)


def test_a_number_that_is_none_in_one_simplex_is_not_forgotten_over_the_others():
    """A step that is no number gives no margin, also in lanes with fewer simplices than the longest of the block."""
    rng = np.random.default_rng(4)
    points, topology = stars(rng, [4, 12, 30])
    power, blocks = Power3.of(-1), topology.stars.blocks
    step = np.full(3 * LANES3, np.nan, dtype=np.float32)
    work = see(points, blocks, 0, -1, power.constants, step, 0.0, 2.0**-53, 0.0)
    assert np.isnan(work.sums.reshape(-1, LANES3)[MARGIN]).all()
    assert not work.allowed.any()


@pytest.mark.parametrize("size", [1e12, 1e13, 1e15, 1e20])
def test_one_simplex_that_is_too_large_for_float32_does_not_vanish_behind_the_next(size):
    """The cubes of its edges overflow: such a star is left to float64, whichever of its simplices it is."""
    for far in range(1, 5):
        points, topology = stars(np.random.default_rng(5), [4, 30], off=0.0)
        node = topology.places[far]
        points[node] *= size
        power, blocks = Power3.of(-1), topology.stars.blocks
        step = np.zeros(3 * LANES3, dtype=np.float32)
        work = see(points, blocks, 0, -1, power.constants, step, 0.01, 2.0**-53, 0.0)
        lane = int(np.flatnonzero(blocks.centre[:2] == topology.places[0])[0])
        assert not work.allowed[lane]
