"""The transformation of GETMe by what it is for: whatever triangle goes in, an equilateral one comes out in the end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.kernels.methods import getme_elements as kernels
from gmsnet.paper import plain_getme

ANGLES = {"paper": (math.pi / 3, 0.0), "book": (math.pi / 4, 0.5)}  # θ, λ
RATIO = {"paper": 7 / 13, "book": (2 - math.sqrt(3)) / (2 + math.sqrt(3))}  # of the eigenvalues
TURN = np.exp(2j * np.pi / 3)


def compiled(z, name):
    """The compiled transformation, unrelaxed, of a triangle of complex numbers."""
    theta, weight = ANGLES[name]
    setting = kernels.Transformation.of(theta, weight, 1.0)
    p, q = z[1] - z[0], z[2] - z[0]
    g, *new = np.reshape(
        kernels.transformed(p.real, p.imag, q.real, q.imag, setting.straight, setting.across), (4, 2)
    ) @ np.array([1, 1j])
    return z[0] + g + np.array(new)


def plainly(z, name, rho=1.0):
    theta, weight = ANGLES[name]
    return np.array(
        [complex(*p) for p in plain_getme.transformed(tuple((p.real, p.imag) for p in z), theta, weight, rho)]
    )


def parts(z):
    """The equilateral and the clockwise part of a triangle: z_k = g + a ωᵏ + b ω⁻ᵏ."""
    k = np.arange(3)
    return (z * TURN**-k).mean(), (z * TURN**k).mean()


@pytest.mark.parametrize("name", ANGLES)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_triangle_becomes_equilateral_also_an_inverted_one(name, seed):
    rng = np.random.default_rng(seed)
    z = rng.normal(size=3) + 1j * rng.normal(size=3)
    before, around = z.mean(), abs(z - np.roll(z, 1)).sum()
    a, b = parts(z)
    for _ in range(100):
        if abs(a) < 1e-9 * abs(b):
            return  # clockwise and equilateral to the last bits: nothing says which way to turn over
        z = compiled(z, name)
        new_a, new_b = parts(z)
        assert abs(new_b / new_a - RATIO[name] * b / a) <= 1e-9 * (1 + abs(b / a))
        assert abs(z.mean() - before) <= 1e-12 * around
        assert abs(z - np.roll(z, 1)).sum() == pytest.approx(around, rel=1e-12)
        a, b = new_a, new_b
    sides = abs(z - np.roll(z, 1))
    np.testing.assert_allclose(sides, around / 3, rtol=1e-9)
    assert ((z[1] - z[0]).conjugate() * (z[2] - z[0])).imag > 0


@pytest.mark.parametrize("name", ANGLES)
def test_the_compiled_transformation_is_the_plain_one(name):
    rng = np.random.default_rng(0)
    for _ in range(200):
        z = rng.normal(size=3) + 1j * rng.normal(size=3)
        np.testing.assert_allclose(compiled(z, name), plainly(z, name), rtol=0, atol=1e-12)
        np.testing.assert_allclose(plainly(z, name, 0.3), 0.7 * z + 0.3 * compiled(z, name), rtol=0, atol=1e-12)


def test_an_equilateral_triangle_stays_and_no_extent_gives_no_nonsense():
    z = 2.0 + TURN ** np.arange(3)
    for name in ANGLES:
        np.testing.assert_allclose(compiled(z, name), z, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(compiled(np.full(3, 1 + 2j), name), np.full(3, 1 + 2j))
        np.testing.assert_array_equal(plainly(np.full(3, 1 + 2j), name), np.full(3, 1 + 2j))
