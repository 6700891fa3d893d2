"""The guard against proposals that are garbage: only it stands between a network and a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star import block
from gmsnet.kernels.star import stars as kernels
from gmsnet.kernels.star.guard import Precision, plain_guard

U64, U32 = 2.0**-53, 2.0**-24


def commit(stars_, shifts, unit=U64, single=False):
    """Commits a shift per star of one degree; returns the new centres and the tally."""
    degree = len(stars_[0][1])
    points = np.vstack([[c for c, _ in stars_], *[r for _, r in stars_]]).astype(float)
    count = len(stars_)
    lanes = np.minimum(np.arange(LANES), count - 1)
    centre = lanes.astype(np.int32)
    rings = np.concatenate([count + lanes * degree + j for j in range(degree)]).astype(np.int32)
    room = kernels.workspace_for(degree)
    local = np.empty(2 * degree * LANES, dtype=np.float32)
    one = np.zeros(1, dtype=np.int64), np.array([degree], dtype=np.int32), np.array([count], dtype=np.int32)
    blocks = block.Blocks(centre, rings, *one, degree)
    assert kernels.fetch(points, blocks, 0, room, local) == degree
    shift = (np.asarray(shifts, dtype=float)[lanes].T / room.work[:LANES]).ravel()  # over the sizes of the stars
    tally = np.zeros(3, dtype=np.int64)
    kernels.commit(points, blocks, 0, room, local, shift, plain_guard(Precision(unit, 0.0, single)), tally)
    return points[:count], tally


def signs(centre, ring):
    return [naive.exact_area_sign(centre, ring[i - 1], ring[i]) for i in range(len(ring))]


def area(centre, ring, i):
    a, b = ring[i - 1] - centre, ring[i] - centre
    return a[0] * b[1] - a[1] * b[0]


@given(st.integers(0, 2**32 - 1), st.integers(3, 12), st.sampled_from([1e-6, 1e-2, 1.0, 1e3, 1e30]))
@settings(max_examples=200)
def test_no_valid_cell_becomes_invalid_and_inverted_ones_only_get_better(seed, degree, reach):
    rng = np.random.default_rng(seed)
    offset = rng.choice([0.0, 1.0, 1e6])
    stars_ = [star(rng, degree, offset=offset) for _ in range(20)]
    stars_ = [(c + rng.choice([0, 0, 0.5, 3]) * rng.normal(size=2), r) for c, r in stars_]  # some are tangled
    moved, tally = commit(stars_, (reach * rng.normal(size=(20, 2))).astype(np.float32))
    elsewhere = 0
    for (centre, ring), now in zip(stars_, moved, strict=True):
        before, after = signs(centre, ring), signs(now, ring)
        elsewhere += (now != centre).any()
        for i in range(degree):
            if before[i] > 0:
                assert after[i] > 0
            else:
                assert after[i] > 0 or area(now, ring, i) >= area(centre, ring, i)
    assert tally[block.MOVED] == elsewhere
    assert tally[block.MOVED] + tally[block.DROPPED] == 20


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_shift_that_is_no_number_is_dropped(bad):
    rng = np.random.default_rng(0)
    stars_ = [star(rng, 6) for _ in range(3)]
    moved, tally = commit(stars_, [(bad, 0.0), (0.0, bad), (bad, bad)])
    np.testing.assert_array_equal(moved, [c for c, _ in stars_])
    assert tally.tolist() == [0, 0, 3]


def test_shifts_are_halved_as_algorithm_1_says():
    angle = np.pi / 3 * np.arange(6)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    moved, tally = commit([(np.zeros(2), ring)], [(4.0, 0.0)])  # 4, 2, 1 and then 0.5, the first inside the hexagon
    np.testing.assert_array_equal(moved, [[0.5, 0.0]])
    assert tally.tolist() == [1, 1, 0]


@given(st.integers(0, 2**32 - 1), st.integers(3, 9))
@settings(max_examples=100)
def test_what_is_valid_stays_valid_in_float32_too(seed, degree):
    """Rings as single precision keeps them, or as decimals that a program may read in single or double precision."""
    rng = np.random.default_rng(seed)
    size = rng.choice([1.0, 1e-3, 1e-5])
    stars_ = [star(rng, degree, size=size) for _ in range(20)]
    where = rng.normal(size=2)
    stars_ = [(np.float64(np.float32(c + where)), r + where) for c, r in stars_]
    moved, _ = commit(stars_, (size * rng.normal(size=(20, 2))).astype(np.float32), unit=U32, single=True)
    np.testing.assert_array_equal(moved, np.float64(np.float32(moved)))
    for (centre, ring), now in zip(stars_, moved, strict=True):
        for kept in (ring, np.float64(np.float32(ring))):
            was, is_now = signs(centre, kept), signs(now, kept)
            assert all(b > 0 for a, b in zip(was, is_now, strict=True) if a > 0)
