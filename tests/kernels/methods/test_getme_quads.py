"""GETMe's transformation of quads, against its definition and by what it is for: squares in the end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.patterns import Linked

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import getme_elements as kernels
from gmsnet.kernels.methods import getme_simultaneous

SETTING = kernels.Transformation.of(math.pi / 3, 0.0, 1.0, 2)
seeds = st.integers(0, 2**32 - 1)


def compiled(z):
    """The transformed quad of complex numbers."""
    flat = np.column_stack([z.real, z.imag]).ravel()
    gx, gy = kernels.transformed_quad(flat, SETTING.quad_across, SETTING.quad_inward)
    return complex(gx, gy) + flat[::2] + 1j * flat[1::2]


def plainly(z, theta=math.pi / 4, weight=0.5):
    """Two passes of similar triangles on the sides, scaled about the centroid to the old perimeter."""
    w = complex(weight, (1 - weight) * math.tan(theta))
    one = np.array([(1 - w.conjugate()) * z[k] + w.conjugate() * z[(k + 1) % 4] for k in range(4)])
    new = np.array([(1 - w) * one[k] + w * one[k - 1] for k in range(4)])
    centre = z.mean()
    return centre + (new - centre) * perimeter(z) / perimeter(new)


def perimeter(z):
    return np.abs(np.roll(z, -1) - z).sum()


def quad(seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=4) + 1j * rng.normal(size=4)


@given(seeds)
def test_it_is_two_passes_of_similar_triangles_on_the_sides(seed):
    z = quad(seed)
    new = compiled(z)
    np.testing.assert_allclose(new, plainly(z), atol=1e-9 * np.abs(z).max())
    assert new.mean() == pytest.approx(z.mean(), abs=1e-9)
    assert perimeter(new) == pytest.approx(perimeter(z))


@given(seeds)
def test_what_is_not_square_is_halved_and_what_is_clockwise_goes_at_once(seed):
    z = quad(seed)
    parts, new = (np.fft.fft(each) / 4 for each in (z, compiled(z)))
    scale = new[1] / parts[1]
    assert abs(scale.imag) < 1e-9 * abs(scale)
    assert scale.real > 0
    np.testing.assert_allclose(new[2], scale * parts[2] / 2, atol=1e-9)
    np.testing.assert_allclose(new[3], 0, atol=1e-9)


@given(seeds)
def test_any_quad_becomes_a_square(seed):
    z = quad(seed)
    if abs(np.fft.fft(z)[1]) < 1e-6:
        return
    for _ in range(80):
        z = compiled(z)
    sides = np.roll(z, -1) - z
    np.testing.assert_allclose(np.roll(sides, -1) / sides, 1j, atol=1e-6)


@given(seeds)
def test_the_shape_of_a_quad_is_that_of_its_worst_corner(seed):
    z = quad(seed)
    corners = []
    for k in range(4):
        a, b = z[(k + 1) % 4] - z[k], z[k - 1] - z[k]
        corners.append(2 * (a.conjugate() * b).imag / (abs(a) ** 2 + abs(b) ** 2))
    points = np.column_stack([z.real, z.imag])
    nodes, free = np.arange(4, dtype=np.int32), np.ones(4, dtype=bool)
    around, start = np.zeros(4, dtype=np.int32), np.arange(5, dtype=np.int32)
    elements = kernels.Elements(nodes.reshape(1, 4), free, start, around, np.ones(1, dtype=bool))
    assert kernels.shape_of(points, elements, 0) == pytest.approx(min(corners), abs=1e-12)


@pytest.mark.parametrize(("triangles", "quads"), [(0, 4), (0, 3), (2, 2), (1, 3)])
def test_all_at_once_a_node_goes_to_the_weighted_mean_of_its_places(triangles, quads):
    star = Linked(triangles, quads)
    centre, around = star.star(np.random.default_rng(quads))
    ring = (around - centre) @ [1, 1j]
    own = star.table
    total, places = 0.0, 0.0
    for k, (i, j, weights) in enumerate(star.simplices(len(ring))):
        if weights[2] == 0:
            z = np.array([0, ring[i], ring[own.other[k]], ring[j]])
            worst = min(
                2 * ((z[m] - z[m - 1]).conjugate() * (z[m - 2] - z[m - 1])).imag
                / (abs(z[m] - z[m - 1]) ** 2 + abs(z[m - 2] - z[m - 1]) ** 2)
                for m in range(4)
            )  # fmt: skip
            new = plainly(z)[0]
        elif min(weights) > 0:
            z = np.array([0, ring[i], ring[j]])
            worst = 2 * math.sqrt(3) * (ring[i].conjugate() * ring[j]).imag / (np.abs(np.roll(z, 1) - z) ** 2).sum()
            new = triangle(z)[0]
        else:
            continue
        total += (1 - worst) ** 2
        places += (1 - worst) ** 2 * new
    local = np.repeat(np.column_stack([ring.real, ring.imag]).ravel(), LANES)
    shift = np.empty(2 * LANES)
    getme_simultaneous.mean_shifts(local, len(ring), star.pattern, SETTING, np.empty(8), np.empty(LANES), shift)
    assert complex(shift[0], shift[LANES]) == pytest.approx(places / total, abs=1e-12)


def triangle(z):
    """The transformed triangle with θ = π/3 and λ = 0; tests of its own are beside this file."""
    g, p, q = z[0], z[1] - z[0], z[2] - z[0]
    gx, gy, *new = kernels.transformed(p.real, p.imag, q.real, q.imag, SETTING.straight, SETTING.across)
    return g + complex(gx, gy) + np.array(new[::2]) + 1j * np.array(new[1::2])


def test_the_triangles_setting_would_leave_no_square():
    """With θ = π/3 and λ = 0 the part in which opposite corners come in grows faster than the square one."""
    across = math.tan(math.pi / 3)
    inward = -(across**2)
    square, zigzag = 1 - 2 * inward + 2 * across, 1 - 4 * inward
    assert zigzag > square
