"""The quality in a metric is that of matrices, and the gradient of its sum that of differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import naive_metric as naive

from gmsnet.kernels.metric.quality import energy, qualities
from gmsnet.kernels.simplex.mean_ratio2 import WEIGHTS

SIMPLEX = np.array([[0, 1, 2]], dtype=np.int32)
numbers = st.floats(-2.0, 2.0)
logs = st.tuples(numbers, numbers, numbers)


def draw(seed, count=30):
    """Triangles of positive area around nodes, and logarithms with slopes."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 2))
    cells = np.array([rng.choice(count, 3, replace=False) for _ in range(40)], dtype=np.int32)
    a, b = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    cells[area < 0] = cells[area < 0][:, [0, 2, 1]]
    return points, cells[np.abs(area) > 0.2], 0.7 * rng.standard_normal((count, 3)), rng.standard_normal((count, 3, 2))


@given(
    logs, logs, logs, st.lists(st.integers(-8, 8), min_size=6, max_size=6), st.sampled_from(["equilateral", "square"])
)
def test_the_quality_is_that_of_matrices(one, two, three, places, ideal):
    points, at_nodes = 0.25 * np.array(places).reshape(3, 2), np.array([one, two, three])
    table = None if ideal == "equilateral" else WEIGHTS[[1]]
    out = np.empty(1)
    qualities(points, SIMPLEX, table, at_nodes, out)
    wanted = naive.quality(points, at_nodes, ideal)
    assert out[0] <= 1.0 + 1e-12
    if wanted > 1e-6:
        assert out[0] == pytest.approx(wanted, rel=1e-6)
    else:
        assert out[0] < 1e-5


def test_the_unit_simplex_of_a_metric_has_the_quality_1():
    log = np.array([0.3, 1.1, -0.8])
    for ideal, table in (("equilateral", None), ("square", WEIGHTS[[1]])):
        root = np.real(naive.sqrtm(naive.tensor(log)))
        corners = (np.linalg.inv(root) @ np.column_stack([[0.0, 0.0], naive.IDEAL[ideal]])).T
        out = np.empty(1)
        qualities(np.ascontiguousarray(corners), SIMPLEX, table, np.tile(log, (3, 1)), out)
        assert out[0] == pytest.approx(1.0, abs=1e-12)
        qualities(np.ascontiguousarray(corners[::-1]), SIMPLEX, table, np.tile(log, (3, 1)), out)
        assert out[0] <= 0.0


@pytest.mark.parametrize(("floor", "doublings"), [(0.0, 0), (0.5, 0), (0.0, 3)])
@pytest.mark.parametrize("square", [False, True])
def test_the_gradient_is_that_of_differences(floor, doublings, square):
    points, cells, at_nodes, slopes = draw(3)
    table = WEIGHTS[np.arange(len(cells)) % 2] if square else None
    values, share = np.empty(len(cells)), np.empty(len(cells))
    qualities(points, cells, table, at_nodes, values)
    gradient = np.empty_like(points)
    floor *= values.min()

    def at(shift):
        logs = at_nodes + np.einsum("ncx,nx->nc", slopes, shift)
        return energy(
            points + shift, cells, table, logs, slopes, floor, doublings, 1.0 / values.min(), gradient, share
        )  # fmt: skip

    rng = np.random.default_rng(0)
    for _ in range(5):
        way = rng.standard_normal(points.shape)
        step = 1e-6
        difference = (at(step * way) - at(-step * way)) / (2 * step)
        total = at(np.zeros_like(points))
        assert difference == pytest.approx((gradient * way).sum(), rel=1e-5)
    if not (floor or doublings):
        assert total == pytest.approx((1.0 / values).sum(), rel=1e-12)


def test_there_is_no_sum_where_a_simplex_is_flat_or_below_the_floor():
    points, cells, at_nodes, slopes = draw(1)
    gradient, share, values = np.empty_like(points), np.empty(len(cells)), np.empty(len(cells))
    qualities(points, cells, None, at_nodes, values)
    above = 1.01 * values.min()
    assert energy(points, cells, None, at_nodes, slopes, above, 0, 1.0, gradient, share) == np.inf
    points[cells[0, 2]] = 0.5 * (points[cells[0, 0]] + points[cells[0, 1]])
    assert energy(points, cells[:1], None, at_nodes, slopes, 0.0, 0, 1.0, gradient, share) == np.inf
