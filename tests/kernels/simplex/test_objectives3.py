"""Objectives of stars in space against plain sums, and their derivatives against differences."""

from __future__ import annotations

import itertools

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.naive_objectives3 import NAIVE, value_of

from gmsnet.kernels.simplex import objectives3
from gmsnet.kernels.simplex.objectives3 import DIHEDRAL, METRIC, Q2, SUMS, Aim3, Q

AIMS = {
    "metric": Aim3(METRIC),
    "q": Aim3(Q),
    "q2": Aim3(Q2),
    "dihedral": Aim3(DIHEDRAL, 3),
    "dihedral, wide": Aim3(DIHEDRAL, 2, 0.6),
    "dihedral, bound": Aim3(DIHEDRAL, 4, 0.6, bound=0.02),
}
every_aim = pytest.mark.parametrize("name", AIMS)


@numba.njit
def evaluate(aim, scale, ends, at, lowest, slopes):
    sums = np.empty(SUMS)
    inside = objectives3.evaluate3(aim, scale, ends, len(ends), at[0], at[1], at[2], lowest, slopes, sums)
    return inside, sums


def star(seed):
    """Where the spokes of each simplex of a star end, (F, 3, 3), and its node."""
    points, cells = volumes.ball(np.random.default_rng(seed), 12, off=0.4)
    rows = [list(cell) for cell in cells.tolist()]
    ends = []
    for row in rows:
        k = row.index(0)
        others = row[:k] + row[k + 1 :]
        if k % 2:
            others = [others[0], others[2], others[1]]
        ends.append(points[others])
    return np.array(ends), points[0]


@every_aim
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_values_and_derivatives(name, seed):
    ends, at = star(seed)
    aim, flat = AIMS[name], np.ascontiguousarray(ends.reshape(len(ends), 9))
    inside, sums = evaluate(aim, 0.3, flat, at, 0.0, True)
    assert inside
    expected, least = value_of(name, ends, at, aim, 0.3)
    assert sums[objectives3.VALUE] == pytest.approx(expected, rel=1e-9)
    if aim.kind == DIHEDRAL:
        assert sums[objectives3.LEAST] == pytest.approx(least, rel=1e-9)
    assert evaluate(aim, 0.3, flat, at, 0.0, False)[1][0] == sums[0]

    def slope_at(place):
        return evaluate(aim, 0.3, flat, place, 0.0, True)[1][1:4]

    away = 1e-6
    steps = away * np.eye(3)
    found = [(evaluate(aim, 0.3, flat, at + s, 0.0, False)[1][0] - evaluate(aim, 0.3, flat, at - s, 0.0, False)[1][0])
             for s in steps]  # fmt: skip
    np.testing.assert_allclose(sums[1:4], np.array(found) / (2 * away), rtol=1e-4, atol=1e-4 * np.abs(sums[1:4]).max())
    if aim.kind != DIHEDRAL:  # whose Hessian leaves a part out
        xx, yy, zz, xy, xz, yz = sums[4:10]
        rows = [(slope_at(at + s) - slope_at(at - s)) / (2 * away) for s in steps]
        expected = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        np.testing.assert_allclose(rows, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


@every_aim
def test_outside_of_the_star_there_is_no_value(name):
    ends, at = star(3)
    flat = np.ascontiguousarray(ends.reshape(len(ends), 9))
    assert not evaluate(AIMS[name], 0.3, flat, at + 10.0, 0.0, True)[0]
    least = min(np.linalg.det(e - at) for e in ends)
    assert evaluate(AIMS[name], 0.3, flat, at, 0.99 * least, True)[0]
    assert not evaluate(AIMS[name], 0.3, flat, at, 1.01 * least, True)[0]


def test_barriers_are_convex_and_so_is_the_hessian_of_angles():
    for name, seed in itertools.product(("q", "q2", "dihedral", "dihedral, wide"), range(30)):
        ends, at = star(seed)
        _, sums = evaluate(AIMS[name], 0.3, np.ascontiguousarray(ends.reshape(len(ends), 9)), at, 0.0, True)
        xx, yy, zz, xy, xz, yz = sums[4:10]
        assert np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).min() > -1e-9 * (xx + yy + zz)
    assert set(NAIVE) == {"metric", "q", "q2"}
