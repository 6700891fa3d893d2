from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.measure.report import measure
from gmsnet.measure.signs import exact_signs
from gmsnet.measure.summary import percentile
from gmsnet.measure.totals import totals_of
from gmsnet.parallel.threads import Serial
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


def triangles_mesh(points, triangles, **kwargs):
    triangles = np.asarray(triangles)
    return Mesh(points, (CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=int)),), **kwargs)


def soup(rng, count):
    """Triangles that share no node, of all shapes."""
    points = rng.normal(size=(3 * count, 2)) * rng.choice([1e-3, 1.0, 1e3], size=(3 * count, 1))
    return points, np.arange(3 * count).reshape(-1, 3)


def test_every_measure_equals_its_twin():
    points, triangles = soup(np.random.default_rng(0), 500)
    report = measure(triangles_mesh(points, triangles))
    for t, corners in enumerate(triangles):
        low, high, shape, aspect = naive.quality(*points[corners])
        sine = math.sin(math.radians(low))
        assert report.min_angle[t] == pytest.approx(low, abs=1e-10 / sine)
        assert report.max_angle[t] == pytest.approx(high, abs=1e-10 / sine)
        # A triangle that shares no edge is a part of its own, and its own area is the positive one.
        assert report.shape[t] == pytest.approx(abs(shape), rel=1e-12)
        assert report.aspect[t] == pytest.approx(abs(aspect), rel=1e-12)


def test_valid_is_a_mask_and_sign_is_apart():
    """Wound alike by their shared edges: one cell folded over, one of no area."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.9, 0.5], [2.0, 0.0]])
    report = measure(triangles_mesh(points, [[0, 1, 2], [0, 2, 3], [1, 4, 2], [0, 5, 1]]))
    assert report.valid.dtype == bool
    assert report.sign.dtype == np.int8
    assert report.sign.tolist() == [1, 1, -1, 0]
    assert report.valid.tolist() == [True, True, False, False]
    assert not report.valid.all()
    assert report.inverted == (~report.valid).sum() == 2
    whole = measure(gmsnet.random_mesh(50, seed=0))
    assert whole.valid.dtype == bool
    assert whole.valid.all()
    assert whole.sign.tolist() == [1] * len(whole.cell)


def true_measures(mpmath, a, b, c):
    """Smallest and largest angle, 1/q, 1/q_V to 50 digits, and the ratio of the longest to the shortest side."""
    corners = [[mpmath.mpf(float(v)) for v in p] for p in (a, b, c)]
    (ax, ay), (bx, by), (cx, cy) = corners
    double = abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    angles, sides = [], []
    for k in range(3):
        (px, py), (qx, qy), (rx, ry) = (corners[(k + m) % 3] for m in range(3))
        dot = (qx - px) * (rx - px) + (qy - py) * (ry - py)
        angles.append(mpmath.degrees(mpmath.atan2(double, dot)))
        sides.append(mpmath.sqrt((qx - px) ** 2 + (qy - py) ** 2))
    shape = 2 * mpmath.sqrt(3) * double / sum(side**2 for side in sides)
    aspect = 2 * mpmath.sqrt(3) * double / (max(sides) * sum(sides))
    return min(angles), max(angles), shape, aspect, float(max(sides) / min(sides))


@pytest.mark.parametrize("kind", ["any", "thin at b and c", "thin at a and b", "flat", "far from the origin"])
def test_measures_err_by_few_units_in_the_last_place(kind):
    """Of 180° and of 1, times the ratio of the sides: so far the rounding of the area alone may turn an angle."""
    mpmath = pytest.importorskip("mpmath")
    rng = np.random.default_rng(1)
    count = 300
    corners, small = rng.normal(size=(count, 3, 2)), 10.0 ** rng.uniform(-8, 0, (count, 1))
    if kind == "thin at b and c":
        corners[:, 2] = corners[:, 1] + corners[:, 2] * small
    elif kind == "thin at a and b":
        corners[:, 1] = corners[:, 0] + corners[:, 1] * small
    elif kind == "flat":
        corners[:, :, 1] *= small
    elif kind == "far from the origin":
        corners = 1e-3 * corners + rng.normal(size=(count, 1, 2))
    report = measure(triangles_mesh(corners.reshape(-1, 2), np.arange(3 * count).reshape(-1, 3)))
    with mpmath.workdps(50):
        for t in range(count):
            low, high, shape, aspect, ratio = true_measures(mpmath, *corners[t])
            assert abs(report.min_angle[t] - low) <= 1.5e-14 * ratio
            assert abs(report.max_angle[t] - high) <= 3e-14 * ratio
            assert abs(report.shape[t] - shape) <= 5e-16 * ratio
            assert abs(report.aspect[t] - aspect) <= 5e-16 * ratio


def test_round_angles_are_exact():
    root = math.sqrt(3.0)
    points = np.array([[0, 0], [1, 0], [0, 1], [2, 0], [0.5, root / 2], [1.5, root / 2], [0, 0.5]])
    report = measure(triangles_mesh(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 5], [0, 3, 6]]))
    assert report.max_angle[[0, 1, 4]].tolist() == [90.0, 180.0, 90.0]
    assert report.min_angle[[0, 1]].tolist() == [45.0, 0.0]
    # The coordinates of the others are rounded themselves.
    np.testing.assert_allclose(report.max_angle[[2, 3]], [60.0, 120.0], rtol=0, atol=1.5e-14)
    np.testing.assert_allclose(report.min_angle[[2, 3]], [60.0, 30.0], rtol=0, atol=1.5e-14)


@pytest.mark.parametrize("count", [1, 2, 63, 64, 65, 500])
def test_the_totals_are_those_of_the_columns(count):
    points, triangles = soup(np.random.default_rng(count), count)
    report = measure(triangles_mesh(points, triangles))
    totals = report.totals
    for name, column in (("low", report.min_angle), ("high", report.max_angle), ("shape", report.shape),
                         ("aspect", report.aspect)):  # fmt: skip
        assert getattr(totals, f"{name}_mean") == math.fsum(column) / count
    assert totals.low_min == report.min_angle.min()
    assert totals.high_max == report.max_angle.max()
    assert totals.shape_min == report.shape.min()
    assert totals.aspect_min == report.aspect.min()


def test_the_order_of_nodes_and_triangles_does_not_change_a_bit_of_the_totals():
    mesh = gmsnet.random_mesh(3000, seed=7)
    triangles = Topology.of(mesh).triangles
    one = measure(triangles_mesh(mesh.points, triangles))
    rng = np.random.default_rng(0)
    order = rng.permutation(len(mesh.points))
    other = measure(triangles_mesh(mesh.points[order], np.argsort(order)[rng.permutation(triangles)]))
    assert one.totals == other.totals
    assert (one.qhat, one.qhat_aspect) == (other.qhat, other.qhat_aspect)


def test_how_the_work_is_shared_out_does_not_change_a_bit_of_the_totals():
    mesh = gmsnet.random_mesh(3000, seed=7)
    topology = Topology.of(mesh)
    given = near_points(mesh, topology), topology.simplices

    class Parts(Serial):
        def __init__(self, ends):
            self.ends = ends

        def map(self, work, first, last):
            return [work(a, b) for a, b in zip([first, *self.ends], [*self.ends, last], strict=True)]

    whole = totals_of(*given)
    for ends in ([1], [17, 40], [40, 41, 42, 90]):
        assert totals_of(*given, Parts(ends)) == whole


def test_what_is_changed_later_does_not_change_a_report():
    mesh = gmsnet.random_mesh(200, seed=1)
    points, triangles = mesh.points.copy(), np.array(Topology.of(mesh).triangles)
    report, result = gmsnet.quality((points, triangles)), gmsnet.smooth((points, triangles))
    wanted = [measure(mesh), measure(mesh.with_points(result.points))]
    points += 5.0 * np.random.default_rng(0).random(points.shape)
    result.points[:] = 0.0
    result.mesh[0][:] = 0.0
    triangles[:] = 0
    for made, known in ((report, wanted[0]), (result.before, wanted[0]), (result.after, wanted[1])):
        for name in ("min_angle", "max_angle", "shape", "aspect", "centre", "valid", "sign"):
            np.testing.assert_array_equal(getattr(made, name), getattr(known, name))
        assert made.summary() == known.summary()


def test_it_equals_vtk():
    pyvista = pytest.importorskip("pyvista")
    mesh = gmsnet.random_mesh(300, seed=4)
    report = gmsnet.quality(mesh)
    triangles = mesh.cells[0].nodes if mesh.cells[0].kind == "triangle" else mesh.cells[-1].nodes
    grid = pyvista.PolyData.from_regular_faces(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), triangles)
    vtk = grid.cell_quality(["shape", "aspect_ratio", "min_angle", "max_angle"])
    np.testing.assert_allclose(report.shape, vtk["shape"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(report.aspect, 1 / vtk["aspect_ratio"], rtol=0, atol=1e-12)
    tolerance = np.degrees(1e-12) / np.sin(np.radians(report.min_angle))
    assert (np.abs(report.min_angle - vtk["min_angle"]) <= tolerance).all()
    assert (np.abs(report.max_angle - vtk["max_angle"]) <= tolerance).all()


@pytest.mark.parametrize("best_by", ["shape", "aspect"])
def test_the_sums_of_a_sweep_equal_the_report(best_by):
    from gmsnet.run.options import SmoothOptions
    from gmsnet.run.run import Run, Start
    from gmsnet.topology.topology import Topology

    mesh = gmsnet.random_mesh(500, seed=1)
    movable = np.isin(mesh.cells[0].nodes, Topology.of(mesh).free).any(axis=1)
    block = mesh.cells[0]
    mesh = Mesh(mesh.points, (CellBlock("triangle", block.nodes[movable], block.regions[movable]),))
    report = measure(mesh)
    standing = Run(Start.of(mesh, Topology.of(mesh)), None, SmoothOptions(best_by=best_by)).best_score
    assert standing.inverted == report.inverted == 0
    qhat = report.qhat if best_by == "shape" else report.qhat_aspect
    assert standing.qhat == pytest.approx(qhat, abs=1e-13)
    assert standing.min_shape == pytest.approx(report.shape.min(), rel=1e-12)
    assert standing.mean_shape == pytest.approx(report.shape.mean(), rel=1e-12)


def test_qhat_is_equation_11():
    mesh = gmsnet.random_mesh(200, seed=2)
    report = measure(mesh)
    rows = zip(report.min_angle, report.max_angle, report.shape, strict=True)
    assert report.qhat == pytest.approx(naive.qhat(list(rows)), abs=1e-14)


def test_an_equilateral_triangle_is_perfect():
    mesh = triangles_mesh(np.array([[0, 0], [1, 0], [0.5, math.sqrt(3) / 2]]), [[0, 1, 2]])
    report = measure(mesh)
    assert report.qhat == pytest.approx(2 / 3, abs=1e-14)  # (60 + 60 + 120 − 60 − 60)/60 + 1 + 1 over 6
    assert report.shape[0] == pytest.approx(1, abs=1e-15)
    assert report.aspect[0] == pytest.approx(1, abs=1e-15)


@given(st.integers(-4, 4), st.integers(-4, 4), st.sampled_from([0.0, 1.0, 0.1, 1e6 / 3]))
def test_signs_are_exact_next_to_zero(i, j, offset):
    """A third point on the line through two others, moved by a few units in the last place."""
    a, b = (offset, offset), (offset + 12.0, offset + 12.0)
    x, y = offset + 24.0, offset + 24.0
    for _ in range(abs(i)):
        x = np.nextafter(x, math.copysign(math.inf, i))
    for _ in range(abs(j)):
        y = np.nextafter(y, math.copysign(math.inf, j))
    points = np.array([a, b, (x, y)])
    one = np.ones(1, dtype=np.int8)
    found = exact_signs(points, np.array([[0, 1, 2]], dtype=np.int32), one)
    assert found[0] == naive.exact_area_sign(*points)


def test_degenerate_triangles_are_measured_and_counted():
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1.0]])
    report = measure(triangles_mesh(points, [[0, 1, 2], [0, 0, 1], [0, 1, 3]]))
    assert report.inverted == 2
    np.testing.assert_array_equal(report.shape[:2], 0)
    np.testing.assert_array_equal(report.min_angle[:2], 0)
    np.testing.assert_array_equal(report.max_angle[:2], 180)


def test_tiny_and_huge_meshes_measure_alike():
    mesh = gmsnet.random_mesh(100, seed=3)
    report = measure(mesh)
    for scale in (2.0**-900, 2.0**900):
        scaled = measure(mesh.with_points(mesh.points * scale))
        np.testing.assert_array_equal(scaled.shape, report.shape)


def test_the_summary_counts():
    summary = measure(gmsnet.random_mesh(400, seed=5)).summary()
    report = measure(gmsnet.random_mesh(400, seed=5))
    assert summary["shape"]["below_0.3"] == int((report.shape < 0.3).sum())
    assert summary["max_angle"]["above_150"] == int((report.max_angle > 150).sum())
    assert summary["triangles"] == len(report.cell)


@given(st.integers(1, 60), st.integers(1, 99), st.integers(0, 2**32 - 1))
def test_percentiles(count, percent, seed):
    values = np.random.default_rng(seed).normal(size=count).round(1)
    assert percentile(values, percent) == pytest.approx(np.percentile(values, percent), rel=1e-14, abs=1e-15)


def test_the_worst_are_told_in_the_order_of_the_file_where_they_are_alike():
    x, y = np.meshgrid(np.arange(8.0), np.arange(8.0) ** 1.2)
    node = np.arange(64).reshape(8, 8)
    halves = [(node[:-1, :-1], node[:-1, 1:], node[1:, 1:]), (node[:-1, :-1], node[1:, 1:], node[1:, :-1])]
    triangles = np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])
    report = measure(triangles_mesh(np.column_stack([x.ravel(), y.ravel()]), triangles))
    wanted = np.argsort(report.shape, kind="stable").tolist()
    for count in (0, 1, 5, 20, len(triangles), 1000):
        assert report.worst(count).tolist() == wanted[:count]


def test_a_mesh_without_triangles_has_an_empty_report():
    mesh = Mesh(np.zeros((2, 2)), (CellBlock("line", np.array([[0, 1]]), np.zeros(1, dtype=int)),))
    report = measure(mesh)
    assert report.summary() == {"triangles": 0, "inverted": 0}
    assert math.isnan(report.qhat)


@settings(max_examples=300)
@given(seed=st.integers(0, 2**32 - 1), exponent=st.sampled_from([0, 0, -40, -130, -300, 200]), bits=st.integers(1, 52))
def test_signs_that_floats_leave_in_doubt_are_exact(seed, exponent, bits):
    rng = np.random.default_rng(seed)
    points = np.round(rng.random((30, 2)) * 2.0**bits) / 2.0**bits  # few bits: collinear, or nearly so
    points[10:20] = points[:10] + np.ldexp(rng.integers(-3, 4, size=(10, 2)).astype(float), -52)
    points[20:] = 0.5 * (points[:10] + points[10:20])
    points = points * 10.0**exponent
    triangles = rng.integers(30, size=(60, 3)).astype(np.int32)
    triangles[:10] = np.arange(10)[:, None] + (0, 10, 20)
    turn = rng.choice([-1, 1], size=60).astype(np.int8)
    assert exact_signs(points, triangles, turn).tolist() == naive.signs(points, triangles, turn)
