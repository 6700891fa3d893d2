from __future__ import annotations

import numpy as np
import pytest

from gmsnet.errors import InputError
from gmsnet.generate import Curve
from gmsnet.generate.curves import boundary

TURN = np.linspace(0.0, 2.0 * np.pi, 2001)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])


def square(side=1.0, at=0.0):
    corners = at + side * np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=float)
    return [Curve(corners[k : k + 2], name) for k, name in enumerate(("bottom", "right", "top", "left"))]


def constant(length):
    return lambda points: np.full(len(points), length)


def lengths(found):
    return np.linalg.norm(found.points[found.segments[:, 1]] - found.points[found.segments[:, 0]], axis=1)


def test_even_nodes_for_a_constant_size():
    found = boundary([square()], constant(0.26))
    assert len(found.points) == 16
    assert lengths(found) == pytest.approx(0.25)
    # One side each: slivers between its nodes can be told from triangles.
    assert found.side.tolist() == np.repeat(range(4), 4).tolist()
    assert found.markers == ("bottom", "right", "top", "left")


def test_spacing_follows_the_size():
    def size(points):
        return 0.02 + 0.1 * points[:, 0]

    line = np.array([[0.0, 0.0], [1.0, 0.0]])
    found = boundary([[Curve(line, "a"), Curve(np.array([[1.0, 0.0], [0.5, 1.0], [0.0, 0.0]]), "b")]], size)
    on_line = np.sort(found.points[found.points[:, 1] == 0, 0])
    middle = np.column_stack([(on_line[1:] + on_line[:-1]) / 2, np.zeros(len(on_line) - 1)])
    # ∫ds/h = 10·log 6 = 17.9 edges: 18, each shorter than asked for by the same part.
    assert len(on_line) == 19
    assert np.diff(on_line) / size(middle) == pytest.approx(17.918 / 18, rel=1e-3)


def test_nodes_lie_on_the_curve_and_bends_are_told_from_straight_pieces():
    found = boundary([[Curve(CIRCLE, "round")]], constant(0.1))
    assert len(found.points) == 63
    assert np.linalg.norm(found.points, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert len(np.unique(found.side)) == 63
    assert set(found.markers) == {"round"}


@pytest.mark.parametrize("outer", [1, -1])
@pytest.mark.parametrize("hole", [1, -1])
def test_the_domain_is_on_the_left_whichever_way_the_rings_run(outer, hole):
    rings = [[Curve(2.0 * CIRCLE[::outer], "far")], [Curve(0.5 * CIRCLE[::hole], "near")]]
    found = boundary(rings, constant(0.2))
    a, b = found.points[found.segments[:, 0]], found.points[found.segments[:, 1]]
    enclosed = 0.5 * np.sum(a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1])
    assert enclosed == pytest.approx(np.pi * (4 - 0.25), rel=0.02)
    assert np.array_equal(np.unique(found.segments, return_counts=True)[1], np.full(len(found.points), 2))


@pytest.mark.parametrize(
    ("rings", "message"),
    [
        ([square()[:3]], "not closed: the curve 'top' ends at .0.0, 1.0., but 'bottom' starts"),
        ([[Curve(np.array([[0.0, 0.0]]), "dot")]], "the curve 'dot' must be an array of at least 2 finite points"),
        ([[Curve(np.array([[0, 0], [np.nan, 1], [0, 0]]), "gap")]], "the curve 'gap' must be"),
        ([[Curve(np.array([[0.0, 0], [0, 0], [1, 0], [0, 1], [0, 0]]), "twice")]], "'twice' has the same point twice"),
        ([square(), square(0.5, 2.0)], "must lie inside the first ring"),
        ([square(), square(0.5, 0.8)], "may only meet at their corners"),
        ([], "at least one ring"),
    ],
)
def test_bad_rings_are_named(rings, message):
    with pytest.raises(InputError, match=message):
        boundary(rings, constant(0.1))
