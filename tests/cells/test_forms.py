"""The quadratic forms of corner simplices against the definition of the mean ratio, and from vertex to vertex."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gmsnet.cells.forms import quadratic_form, rerooted
from gmsnet.cells.table import CELLS

PLANAR = [kind for kind in CELLS.values() if kind.dimension == 2 and kind.simplices]
COORDINATE = st.floats(-1e3, 1e3, allow_subnormal=False)
TRIANGLE = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=3).map(np.array)


def each(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=lambda kind: kind.name)


def value(form, p, q):
    return form[0] * (p @ p) + form[1] * (q @ q) + form[2] * (p @ q)


def test_triangles_and_squares_have_the_known_coefficients():
    alpha, beta, gamma = quadratic_form(CELLS["triangle"])[0].tolist()
    assert alpha == beta == -gamma == 0.57735026918962576451  # the same bits whichever vertex is the corner
    assert (rerooted(CELLS["triangle"])[0] == [alpha, beta, gamma]).all()
    assert quadratic_form(CELLS["quad"]).tolist() == [[0.5, 0.5, 0.0]] * 4
    assert rerooted(CELLS["quad"])[0].tolist() == [[0.5, 0.5, 0.0], [0.5, 1.0, -1.0], [1.0, 0.5, -1.0]]


@each(PLANAR)
def test_the_forms_cannot_be_changed(kind):
    for forms in (quadratic_form(kind), rerooted(kind)):
        with pytest.raises(ValueError, match="read-only"):
            forms[0] = 1.0


@each(PLANAR)
@given(points=TRIANGLE)
def test_the_form_is_the_mean_ratio_of_the_deviation_from_the_ideal(kind, points):
    a, b = points[1] - points[0], points[2] - points[0]
    assume(a @ a + b @ b > 1e-6)
    spokes = np.stack([a, b], axis=1)
    for form, inverse in zip(quadratic_form(kind), kind.ideal, strict=True):
        deviation = spokes @ np.array(inverse)
        mean_ratio = 2.0 * np.linalg.det(deviation) / (deviation**2).sum()
        assert np.linalg.det(spokes) / value(form, a, b) == pytest.approx(mean_ratio, abs=1e-12)


@each(PLANAR)
@given(points=TRIANGLE)
def test_the_form_has_the_same_value_from_each_vertex(kind, points):
    largest = sum(((points[k] - points[k - 1]) ** 2).sum() for k in range(3))
    for forms, form in zip(rerooted(kind), quadratic_form(kind), strict=True):
        expected = value(form, points[1] - points[0], points[2] - points[0])
        for vertex in range(3):
            p = points[(vertex + 1) % 3] - points[vertex]
            q = points[(vertex + 2) % 3] - points[vertex]
            # squares of lengths below 1e-154 lose digits to underflow
            assert value(forms[vertex], p, q) == pytest.approx(expected, rel=0, abs=1e-14 * largest + 1e-320)


@pytest.mark.parametrize("name", ["vertex", "line", "polygon", "tetra", "hexahedron27"])
def test_other_kinds_have_no_planar_forms(name):
    with pytest.raises(ValueError, match=f"{name!r} has no corner simplices in the plane"):
        quadratic_form(CELLS[name])
    with pytest.raises(ValueError, match=f"{name!r} has no corner simplices in the plane"):
        rerooted(CELLS[name])
