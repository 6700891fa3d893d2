"""Is det J of a volume cell positive everywhere? Compared with polynomials over fractions, made otherwise."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import solid, solid_kernels

from gmsnet.cells.jacobian import form_of, has_form
from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex import validity3
from gmsnet.kernels.simplex.jacobian3 import DEPTH
from gmsnet.measure.solid import exact_signs_of, judge_volumes

KINDS = tuple(name for name in CELLS if has_form(name))
COUNTS = {"tetra": 1, "tetra10": 20, "hexahedron": 27, "hexahedron20": 216, "hexahedron27": 216, "wedge": 9,
          "wedge15": 90, "wedge18": 90, "pyramid": 9}  # fmt: skip
LINEAR = ("hexahedron", "wedge", "pyramid")
U64, U32 = 2.0**-53, 2.0**-24
ONE = np.ones(1, dtype=np.int8)


def delta_of(nodes, unit=U64):
    return unit * float(np.abs(nodes).max())


def exact(nodes, name):
    """The sign of one cell in whole numbers, and the place."""
    sign, place = exact_signs_of(np.asarray(nodes)[None], form_of(name), ONE)
    return int(sign[0]), place[0]


def test_all_kinds_but_curved_pyramids_have_a_form():
    assert set(KINDS) == set(COUNTS)
    for name in ("pyramid13", "pyramid14", "triangle", "quad", "polyhedron", "no cell"):
        assert not has_form(name)
        with pytest.raises(KeyError):
            form_of(name)


@pytest.mark.parametrize("name", KINDS)
def test_coefficients_are_those_of_the_polynomial(name):
    """Both are polynomials: they are the same where each power has the same factor."""
    rng, form = np.random.default_rng(1), form_of(name)
    assert form.terms == COUNTS[name] == len(solid.indices(name))
    for bend in (0.0, 0.3):
        nodes = np.round(solid.random_cell(rng, name, bend) * 64) / 64  # few bits: what is computed is nearly exact
        found, bound, _ = solid_kernels.coefficients_of_solid(nodes, form, 1.0, 0.0)
        wanted = solid.determinant(nodes, name)
        have = solid.from_bernstein([Fraction(float(c)) for c in found], name)
        scale = max(abs(float(v)) for v in found)
        for key in set(wanted) | set(have):
            assert float(abs(wanted.get(key, 0) - have.get(key, 0))) <= 1e4 * bound + 1e-11 * scale
        assert bound < 1e-9 * max(scale, 1.0)


@pytest.mark.parametrize("name", LINEAR)
def test_of_whole_numbers_coefficients_are_exact(name):
    rng, form = np.random.default_rng(2), form_of(name)
    for _ in range(5):
        nodes = rng.integers(-9, 10, (form.nodes, 3)).astype(float)
        found, _, _ = solid_kernels.coefficients_of_solid(nodes, form, 1.0, 0.0)
        many = form.floats[form.multinomial : form.multinomial + form.terms]
        whole = [Fraction(round(float(c * m)), int(m)) for c, m in zip(found, many, strict=True)]
        assert {k: v for k, v in solid.from_bernstein(whole, name).items() if v} == {
            k: v for k, v in solid.determinant(nodes, name).items() if v
        }


@pytest.mark.parametrize("name", KINDS)
def test_at_corners_coefficients_are_the_values_there(name):
    rng, form = np.random.default_rng(3), form_of(name)
    nodes = solid.random_cell(rng, name, 0.2)
    found, bound, _ = solid_kernels.coefficients_of_solid(nodes, form, 1.0, 0.0)
    polynomial = solid.determinant(nodes, name)
    corners = form.ints[form.corner : form.corner + form.corners]
    for corner, place in zip(corners, solid.REFERENCE[name], strict=False):
        assert abs(float(solid.value(polynomial, place)) - found[corner]) <= bound


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("offset", [0.0, 1e5])
def test_errors_of_coefficients_are_within_the_bound(name, offset):
    rng, form = np.random.default_rng(4), form_of(name)
    for _ in range(3):
        nodes = solid.random_cell(rng, name, 0.2) * np.array([1.0, 1.0, 1e-3]) + offset
        found, bound, _ = solid_kernels.coefficients_of_solid(nodes, form, 1.0, 0.0)
        polynomial = solid.determinant(nodes, name)
        have = solid.from_bernstein([Fraction(float(c)) for c in found], name)
        for place in solid.samples(name, 2):
            assert abs(float(solid.value(polynomial, place) - solid.value(have, place))) <= bound


@pytest.mark.parametrize("name", KINDS)
def test_what_is_said_of_random_cells_is_true(name):
    rng, form = np.random.default_rng(5), form_of(name)
    cells, said = 100 if name in LINEAR else 12, {-1: 0, 0: 0, 1: 0}
    for k in range(cells):
        nodes = solid.random_cell(rng, name, (0.1, 0.25, 0.7)[k % 3])
        sign, place = solid_kernels.judge_solid(nodes, form, 1.0, delta_of(nodes), DEPTH)
        said[sign] += 1
        polynomial = solid.determinant(nodes, name)
        if sign == validity3.INVALID:
            assert solid.value(polynomial, [Fraction(float(v)) for v in place]) < 0
        if sign == validity3.VALID:
            assert min(solid.value(polynomial, p) for p in solid.samples(name, 4)) > 0
        assert sign == validity3.UNDECIDED or sign == exact(nodes, name)[0]
    assert said[1] > cells / 10
    assert name == "tetra" or said[-1] > cells / 20


def between_corners(name):
    """A cell all of whose corners are positive, and which is not valid between them."""
    rng = np.random.default_rng(6)
    for _ in range(100_000):
        nodes = solid.random_cell(rng, name, 0.45)
        found, bound, _ = solid_kernels.coefficients_of_solid(nodes, form_of(name), 1.0, 0.0)
        corners = found[form_of(name).ints[form_of(name).corner :][: form_of(name).corners]]
        if corners.min() > bound and solid_kernels.judge_solid(nodes, form_of(name), 1.0, 0.0, 18)[0] < 0:
            return nodes
    raise AssertionError("none was found")


@pytest.mark.parametrize("name", ["hexahedron", "wedge", "tetra10"])
def test_cells_with_positive_corners_and_a_negative_inside_are_found(name):
    nodes = between_corners(name)
    sign, place = solid_kernels.judge_solid(nodes, form_of(name), 1.0, 0.0, 18)
    polynomial = solid.determinant(nodes, name)
    assert sign == validity3.INVALID
    assert solid.value(polynomial, [Fraction(float(v)) for v in place]) < 0
    assert all(solid.value(polynomial, corner) > 0 for corner in solid.REFERENCE[name][: form_of(name).corners])
    undecided, _ = solid_kernels.judge_solid(nodes, form_of(name), 1.0, 0.0, 0)
    assert undecided == validity3.UNDECIDED


@pytest.mark.parametrize("name", KINDS)
def test_the_lower_bound_is_below_every_value_and_near_the_least(name):
    rng, form = np.random.default_rng(7), form_of(name)
    nodes = solid.random_cell(rng, name, 0.15)
    found, _, lower = solid_kernels.coefficients_of_solid(nodes, form, 1.0, delta_of(nodes))
    polynomial = solid.determinant(nodes, name)
    least = min(solid.value(polynomial, place) for place in solid.samples(name, 4))
    assert lower <= least
    assert float(least) - lower < 0.1 * float(np.abs(found).max())


@given(
    st.integers(0, 2**32 - 1), st.sampled_from(LINEAR), st.sampled_from([U64, U32]), st.sampled_from([0.0, 1.0, 1e3])
)
def test_what_is_certified_holds_for_all_coordinates_within_delta(seed, name, unit, offset):
    rng = np.random.default_rng(seed)
    nodes = solid.random_cell(rng, name, rng.choice([0.1, 0.4])) * rng.choice([1.0, 1e-3, 1e-5]) + offset
    delta = delta_of(nodes, unit)
    sign, _ = solid_kernels.judge_solid(nodes, form_of(name), 1.0, delta, DEPTH)
    readings = [nodes + delta * rng.choice([-1.0, 1.0], nodes.shape) * (1 - 1e-9) for _ in range(3)]
    readings += [nodes] + [np.float64(np.float32(nodes))] * (unit == U32)
    for reading in readings:
        assert sign in (0, exact(reading, name)[0])


@pytest.mark.parametrize("name", KINDS)
def test_near_the_limit_what_is_certified_is_true(name):
    rng, form, undecided = np.random.default_rng(8), form_of(name), 0
    for _ in range(6 if name in LINEAR else 2):
        while True:
            good, bad = solid.random_cell(rng, name, 0.0), solid.random_cell(rng, name, 0.6)
            if solid_kernels.judge_solid(bad, form, 1.0, 0.0, 18)[0] == -1:
                break
            if name == "tetra":
                bad = good[[1, 0, 2, 3]]
                break
        low, high = 0.0, 1.0
        for _ in range(52):
            middle = 0.5 * (low + high)
            sign, _ = solid_kernels.judge_solid(good + middle * (bad - good), form, 1.0, 0.0, 18)
            low, high = (middle, high) if sign > 0 else (low, middle)
        for nudge in (-1e-9, -1e-14, 0.0, 1e-15, 1e-12, 1e-9):
            nodes = good + (low + nudge) * (bad - good)
            sign, _ = solid_kernels.judge_solid(nodes, form, 1.0, 0.0, 18)
            assert sign in (0, exact(nodes, name)[0])
            undecided += sign == 0
    assert undecided > 0  # else the test has not come near enough


@pytest.mark.parametrize("name", KINDS)
def test_values_that_are_no_numbers_and_collapsed_cells_are_not_certified(name):
    form, nodes = form_of(name), solid.reference_nodes(name)
    for bad in (np.nan, np.inf):
        spoilt = nodes.copy()
        spoilt[-1, 1] = bad
        assert solid_kernels.judge_solid(spoilt, form, 1.0, 0.0, 18)[0] == 0
    assert solid_kernels.judge_solid(0 * nodes, form, 1.0, 0.0, 18)[0] == 0
    assert exact(0 * nodes, name)[0] == -1
    assert exact(nodes, name)[0] == 1


@pytest.mark.parametrize("name", KINDS)
def test_a_cell_inside_out_is_valid_with_the_other_orientation(name):
    nodes = solid.reference_nodes(name) * np.array([1.0, 1.0, -1.0])
    assert solid_kernels.judge_solid(nodes, form_of(name), 1.0, 0.0, 18)[0] == -1
    assert solid_kernels.judge_solid(nodes, form_of(name), -1.0, 0.0, 18)[0] == 1


@pytest.mark.parametrize("name", LINEAR)
def test_with_a_node_at_another_place_a_cell_is_as_if_it_were_there(name):
    rng, form = np.random.default_rng(9), form_of(name)
    count = 40
    nodes = np.array([solid.random_cell(rng, name, 0.1) for _ in range(count)])
    cells = rng.permutation(count * form.nodes).reshape(count, -1).astype(np.int32)
    points = np.empty((count * form.nodes, 4))
    points[cells.ravel(), :3] = nodes.reshape(-1, 3)
    which = rng.integers(0, form.nodes, count)
    moved = cells[np.arange(count), which].astype(np.int64)
    places = points[moved, :3] + rng.normal(size=(count, 3)) * 0.3
    out, turn = np.zeros(count, dtype=bool), np.ones(count, dtype=np.int8)
    solid_kernels.certified_cells(points, cells, form, turn, U64, 0.0, moved, places, out)
    nodes[np.arange(count), which] = places
    for c in range(count):
        assert out[c] == (solid_kernels.judge_solid(nodes[c], form, 1.0, delta_of(nodes[c]), 18)[0] == 1)
    assert 0 < out.sum() < count


@pytest.mark.parametrize("name", KINDS)
def test_judging_a_table_of_cells_is_judging_each_and_what_is_left_is_exact(name):
    rng, form, count = np.random.default_rng(10), form_of(name), 20
    nodes = np.array([solid.random_cell(rng, name, 0.2) for _ in range(count)])
    nodes[3] = 0.0  # collapsed: float64 does not tell
    cells = np.arange(count * form.nodes, dtype=np.int32).reshape(count, -1)
    turn = np.ones(count, dtype=np.int8)
    sign, place = judge_volumes(np.ascontiguousarray(nodes.reshape(-1, 3)), cells, name, turn)
    for c in range(count):
        one, where = exact(nodes[c], name)
        assert sign[c] == one
        assert np.isnan(place[c]).all() == (one == 1)
        if one == -1:
            assert solid.value(solid.determinant(nodes[c], name), [Fraction(float(v)) for v in place[c]]) <= 0
        assert one != -1 or solid.value(solid.determinant(nodes[c], name), [Fraction(float(v)) for v in where]) <= 0
    assert sign[3] == -1
