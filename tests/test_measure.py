from __future__ import annotations

import math

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.measure import exact_signs, measure


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
    from gmsnet.run import Run
    from gmsnet.topology import Topology

    mesh = gmsnet.random_mesh(500, seed=1)
    report = measure(mesh)
    standing = Run(mesh, Topology.of(mesh), None, 1, best_by, "valid").best_standing
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


def test_a_mesh_without_triangles_has_an_empty_report():
    mesh = Mesh(np.zeros((2, 2)), (CellBlock("line", np.array([[0, 1]]), np.zeros(1, dtype=int)),))
    report = measure(mesh)
    assert report.summary() == {"triangles": 0, "inverted": 0}
    assert math.isnan(report.qhat)
