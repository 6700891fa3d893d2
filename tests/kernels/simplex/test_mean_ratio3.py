"""The mean ratio in space against its definition, and its derivatives against exact ones."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.space import as_written

from gmsnet.cells.tetrahedron import TETRAHEDRON
from gmsnet.kernels.methods.barrier3 import K3, Power3
from gmsnet.kernels.simplex import mean_ratio3 as kernels
from gmsnet.kernels.star.guard3 import LARGEST3

IDEAL = np.array(TETRAHEDRON.ideal[0])  # W⁻¹
measured, derivatives, moved, normal, determinant = map(
    as_written, (kernels.measured, kernels.derivatives, kernels.moved, kernels.normal, kernels.determinant)
)
seeds = st.integers(0, 2**32 - 1)
whole = st.lists(st.integers(-9, 9), min_size=12, max_size=12)


def spokes(seed, size=1.0):
    """Of positive volume; the rows a, b, c."""
    rng = np.random.default_rng(seed)
    found = rng.normal(size=(3, 3)) * size * 10.0 ** rng.uniform(-3, 0, 3)[:, None]
    return found if np.linalg.det(found) > 0 else found[[1, 0, 2]]


@given(seed=seeds, size=st.sampled_from([1e-60, 1e-5, 1.0, 1e7, 1e60]))
@settings(max_examples=60)
def test_the_value_is_that_of_the_definition(seed, size):
    """η = 3·Δ^(2/3)/‖T‖², T the edges from one corner, in columns, times W⁻¹."""
    abc = spokes(seed, size)
    t = abc.T @ IDEAL
    expected = 3 * np.linalg.det(t / size) ** (2 / 3) / (np.sum((t / size) ** 2))
    double, lengths, *_ = measured(*abc.ravel().tolist())
    assert kernels.shape_of(double, lengths) == pytest.approx(expected, rel=1e-9)
    assert kernels.shape_of(-double, lengths) == -kernels.shape_of(double, lengths)
    double, lengths, *_ = measured(*(abc / size).ravel().tolist())
    assert (double * double * K3 / lengths**3) ** (1 / 3) == pytest.approx(expected, rel=1e-9)


def test_a_regular_tetrahedron_has_one_and_nothing_has_more():
    regular = np.linalg.inv(IDEAL).T.ravel()
    double, lengths, *_ = measured(*regular.tolist())
    assert kernels.shape_of(double, lengths) == pytest.approx(1.0, abs=1e-15)
    assert double / lengths**1.5 == pytest.approx(K3**-0.5, rel=1e-14)
    assert double / lengths**1.5 < LARGEST3 < 1.00001 * K3**-0.5
    assert pytest.approx(12 * 0.5 ** (2 / 3), rel=1e-15) == kernels.REGULAR
    assert kernels.shape_of(0.0, 0.0) == 0.0
    assert kernels.shape_of(0.0, 3.0) == 0.0


@given(numbers=whole)
@settings(max_examples=100)
def test_sums_and_normals_are_exact_for_whole_numbers(numbers):
    places = np.array(numbers, dtype=float).reshape(4, 3)
    abc = places[1:] - places[0]
    double, lengths, *rest = measured(*abc.ravel().tolist())
    w, s = rest[:3], rest[3:]
    assert double == determinant(*abc.ravel().tolist()) == round(np.linalg.det(abc))
    assert lengths == sum(float((p - q) @ (p - q)) for k, p in enumerate(places) for q in places[:k])
    assert w == np.cross(abc[1] - abc[0], abc[2] - abc[0]).tolist() == list(normal(*abc.ravel().tolist()))
    assert s == abc.sum(axis=0).tolist()


@given(numbers=whole)
@settings(max_examples=60)
def test_all_corners_see_the_same(numbers):
    """The even permutations of the nodes leave D, the odd ones turn its sign, and S is the same for all."""
    places = np.array(numbers, dtype=float).reshape(4, 3)
    double, lengths, *_ = measured(*(places[1:] - places[0]).ravel().tolist())
    for order in permutations(range(4)):
        sign = round(np.linalg.det(np.eye(4)[list(order)]))
        seen = places[list(order)]
        again, same, *_ = measured(*(seen[1:] - seen[0]).ravel().tolist())
        assert (again, same) == (sign * double, lengths)


@given(numbers=whole, step=st.tuples(*[st.integers(-9, 9)] * 3))
@settings(max_examples=100)
def test_what_is_kept_tells_d_and_s_after_any_step(numbers, step):
    places = np.array(numbers, dtype=float).reshape(4, 3)
    kept = measured(*(places[1:] - places[0]).ravel().tolist())
    there = measured(*(places[1:] - (places[0] + step)).ravel().tolist())
    assert moved(*kept, *map(float, step)) == there[:2]


def value(v, ends, p):
    """f = S^p/D^(2p/3) of the vertex v, for complex numbers too."""
    double, lengths, *_ = measured(*(ends - v).ravel().tolist())
    return lengths**p / double ** (2 * p / 3)


def gradient_and_hessian(v, ends, p):
    kept = measured(*(ends - v).ravel().tolist())
    double, lengths, w, s = kept[0], kept[1], kept[2:5], kept[5:]
    m, f = 2 * p / 3, lengths**p / double ** (2 * p / 3)
    x, y, z, xx, yy, zz, xy, xz, yz = derivatives(f, 2 * p / lengths, m / double, *w, *s, 0.5 * (1 + 1 / m), 1 - 1 / p)
    isotropic = f / lengths * 2 * p * 3
    hessian = np.array([[2 * xx, xy, xz], [xy, 2 * yy, yz], [xz, yz, 2 * zz]]) + isotropic * np.eye(3)
    return -np.array([x, y, z]), hessian


@pytest.mark.parametrize("p", [1.0, 1.5, 3.0, 6.0, 12.0])
@given(seed=seeds)
@settings(max_examples=25)
def test_gradient_and_hessian_are_those_of_steps_along_the_imaginary_axis(p, seed):
    """Im f(v + ih)/h has no cancellation: it is the derivative up to rounding."""
    ends = spokes(seed)
    v = np.random.default_rng(seed).uniform(-0.01, 0.01, 3) * np.abs(ends).min()
    assume(measured(*(ends - v).ravel().tolist())[0] > 1e-6 * np.prod(np.linalg.norm(ends, axis=1)))
    gradient, hessian = gradient_and_hessian(v, ends, p)
    h = 1e-30
    steps = 1j * h * np.eye(3)
    np.testing.assert_allclose(gradient, [value(v + e, ends, p).imag / h for e in steps], rtol=1e-8, atol=0)
    columns = [gradient_and_hessian(v + e, ends, p)[0].imag / h for e in steps]
    np.testing.assert_allclose(hessian, columns, rtol=1e-7, atol=1e-9 * np.abs(hessian).max())
    if p >= 1:  # convex
        assert np.linalg.eigvalsh(hessian).min() > -1e-9 * np.abs(hessian).max()


@pytest.mark.parametrize(("steep", "weight"), [(12.0, 1.0), (24.0, 0.3), (48.0, 0.05)])
@given(seed=seeds)
@settings(max_examples=25)
def test_gradient_of_the_mean_with_a_wall(steep, weight, seed):
    """As of powers; the Hessian is that of a power p of q, which is 3/16 where the wall is far and P at the wall."""
    ends, walled = spokes(seed), as_written(kernels.walled)
    v = np.random.default_rng(seed).uniform(-0.01, 0.01, 3) * np.abs(ends).min()
    assume(measured(*(ends - v).ravel().tolist())[0] > 1e-6 * np.prod(np.linalg.norm(ends, axis=1)))

    def q_of(v):
        kept = measured(*(ends - v).ravel().tolist())
        return (kept[1] ** 1.5 / kept[0] / math.sqrt(K3)) ** (2 / 3)

    at_wall = q_of(v)

    def found(v):
        ratio = q_of(v) ** 1.5
        return walled(ratio, weight * (q_of(v) / at_wall) ** steep, steep)

    f, part, two_p, m, mixed, squared, first = found(v)
    double, lengths, wx, wy, wz, sx, sy, sz = measured(*(ends - v).ravel().tolist())
    x, y, z, *_ = derivatives(part, two_p / lengths, m / double, wx, wy, wz, sx, sy, sz, mixed, squared)
    slopes = [found(v + 1j * 1e-30 * axis)[0].imag / 1e-30 for axis in np.eye(3)]
    np.testing.assert_allclose([-x, -y, -z], slopes, rtol=1e-8, atol=1e-12 * np.abs(slopes).max())
    p = two_p / 2
    assert f == pytest.approx(at_wall**1.5 / (1 + at_wall**1.5) + weight)
    assert (m, mixed, squared, part * p) == pytest.approx((2 * p / 3, 0.5 * (1 + 1.5 / p), 1 - 1 / p, first))
    assert 3 / 16 < p < steep
    assert walled(2.0, 0.0, steep)[2] == pytest.approx(3 / 8)
    assert walled(2.0, 1e6, steep)[2] == pytest.approx(2 * steep, rel=1e-5)


@pytest.mark.parametrize("number", range(-1, 6))
def test_powers_are_of_what_a_regular_tetrahedron_has_one_of(number):
    power = Power3.of(number)
    p = 1.5 if number < 0 else 3 * 2**number
    scale, root, two_p, m, mixed, squared = power.constants.astype(float)
    assert scale * K3 == pytest.approx(1, rel=1e-6)
    assert root**2 == pytest.approx(scale, rel=1e-6)
    assert (two_p, m) == (2 * p, 2 * p / 3)
    assert mixed == pytest.approx(0.5 * (1 + 1 / m), rel=1e-6)
    assert squared == pytest.approx(1 - 1 / p, rel=1e-6)
    assert power.isotropic == 6 * p
    assert power.ratio == 1 + 1 / m
    assert Power3.of(number, 8.0).constants[0] * 8 == pytest.approx(scale, rel=1e-6)


def test_fractions_go_through_the_formulas_as_well():
    """So that other tests may ask them for exact numbers."""
    ends = [Fraction(v, 7) for v in (1, 0, 0, 0, 2, 0, 0, 0, 3)]
    assert determinant(*ends) == Fraction(6, 343)


def test_some_of_the_simplices():
    every = kernels.Tetrahedra(np.arange(20, dtype=np.int32).reshape(5, 4), np.array([1, -1, 1, 1, -1], dtype=np.int8))
    some = every.take(np.array([4, 1], dtype=np.int32))
    assert some.rows.tolist() == [[16, 17, 18, 19], [4, 5, 6, 7]]
    assert some.orientation.tolist() == [-1, -1]
    assert (every.cell_count, some.cell_count) == (5, 2)
