"""Measures of tetrahedra against their definitions, exact signs, totals, and reports."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes

import gmsnet
from gmsnet.cells.tetrahedron import TETRAHEDRON
from gmsnet.measure.bounds.bounds import limits
from gmsnet.measure.report import connectivity_of, measure
from gmsnet.measure.volumes import MeasuredTetrahedra, exact_signs3
from gmsnet.topology.volume import Volume

NAMES = ("min_dihedral", "max_dihedral", "shape", "scaled_jacobian", "volume")


def some_tetrahedra(seed, count=20):
    """Ordinary ones, slivers and needles of both orientations."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4 * count, 3)) * 10.0 ** rng.uniform(-3, 0, (4 * count, 1))
    return points, rng.permutation(4 * count).reshape(count, 4)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_columns_are_those_of_the_definitions(seed):
    points, cells = some_tetrahedra(seed)
    turn = np.random.default_rng(seed).choice([1, -1], len(cells)).astype(np.int8)
    measured = MeasuredTetrahedra(points, False, cells.astype(np.int32), turn)
    low, high, shape, scaled, volume = measured.columns()
    expected = volumes.measures(points, cells)
    # Angles near 0 and 180 degrees: what cancels in the twin is off by the root of the unit.
    np.testing.assert_allclose(low, expected[0], rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(high, expected[1], rtol=1e-6, atol=1e-5)
    signed = [(shape, expected[2]), (scaled, expected[3]), (volume, expected[4])]
    for found, twin in signed:
        np.testing.assert_allclose(found, turn * twin, rtol=1e-6, atol=1e-12)
    some = np.array([3, 0, 17], dtype=np.int32)
    np.testing.assert_array_equal(measured.columns(some), measured.columns()[:, some])
    np.testing.assert_allclose(measured.centres(), points[cells].mean(axis=1), atol=1e-15)


def test_known_tetrahedra():
    regular = np.linalg.inv(np.array(TETRAHEDRON.ideal[0])).T
    corner = np.eye(3)
    points = np.vstack([[[0, 0, 0]], regular, corner])
    measured = MeasuredTetrahedra(points, False, np.array([[0, 1, 2, 3], [0, 4, 5, 6], [0, 5, 4, 6]], dtype=np.int32),
                                  np.ones(3, dtype=np.int8))  # fmt: skip
    low, high, shape, scaled, volume = measured.columns()
    third = math.degrees(math.acos(1 / 3))
    np.testing.assert_allclose(low, [third, math.degrees(math.acos(3**-0.5)), math.degrees(math.acos(3**-0.5))])
    np.testing.assert_allclose(high, [third, 90, 90])
    np.testing.assert_allclose(shape, [1, 12 * 0.5 ** (2 / 3) / 9, -12 * 0.5 ** (2 / 3) / 9])
    np.testing.assert_allclose(scaled, [1, 2**0.5 / 2, -(2**0.5) / 2], rtol=1e-12)
    np.testing.assert_allclose(volume, [2**0.5 / 12, 1 / 6, -1 / 6])


@pytest.mark.parametrize("cell", [[0, 0, 0, 0], [0, 0, 1, 2], [0, 1, 2, 3], [0, 1, 4, 5]])
def test_cells_without_volume_have_finite_measures(cell):
    """A single point, a node twice, four in a plane, four in a line."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0], [3, 0, 0.0]])
    measured = MeasuredTetrahedra(points, False, np.array([cell], dtype=np.int32), np.ones(1, dtype=np.int8))
    columns = measured.columns()
    assert np.isfinite(columns).all()
    assert columns[2:].ravel().tolist() == [0, 0, 0]
    assert measured.signs().tolist() == [0]


@given(
    seed=st.integers(0, 2**32 - 1), grain=st.sampled_from([1.0, 2.0**-30, 2.0**-52]), away=st.sampled_from([0, 1, 1e6])
)
@settings(max_examples=60)
def test_signs_of_cells_that_are_nearly_or_quite_flat(seed, grain, away):
    """Nodes in planes, off them by a few units of the last place, and far from the origin."""
    rng = np.random.default_rng(seed)
    points = rng.integers(-3, 4, (40, 3)) * 0.1
    points[:, 2] = points[:, 0] + points[:, 1]
    points += grain * rng.integers(-1, 2, points.shape) + away
    cells = np.array([rng.permutation(40)[:4] for _ in range(40)], dtype=np.int32)
    turn = rng.choice([1, -1], 40).astype(np.int8)
    assert exact_signs3(points, cells, turn).tolist() == volumes.exact_signs(points, cells, turn)


def tangled(seed=0):
    """A random cube with some nodes thrown far enough for cells to be inverted."""
    points, cells = volumes.cube(200, seed)
    rng = np.random.default_rng(seed)
    inner = Volume.of(volumes.mesh_of(points, cells)).free
    points[inner[:5]] += rng.uniform(-0.6, 0.6, (5, 3))
    return volumes.mesh_of(points, cells)


def test_a_report_of_a_mesh_with_inverted_cells():
    mesh = tangled()
    report = gmsnet.quality(mesh)
    signs = np.array(volumes.exact_signs(mesh.points, mesh.cells[0].nodes))
    assert 5 < report.inverted == (signs <= 0).sum() < 80
    assert report.sign.tolist() == signs.tolist()
    assert report.valid.tolist() == (signs > 0).tolist()
    assert report.shape.min() < 0
    np.testing.assert_array_equal(np.sign(report.shape), signs)
    np.testing.assert_array_equal(np.sign(report.volume), signs)
    np.testing.assert_array_equal(np.sign(report.scaled_jacobian), signs)
    assert report.volume.sum() == pytest.approx(1)  # whatever is turned over is filled by its neighbours
    expected = volumes.measures(mesh.points, mesh.cells[0].nodes)
    for name, column in zip(NAMES, expected, strict=True):
        np.testing.assert_allclose(report.column(name), column, rtol=1e-7, atol=1e-7, err_msg=name)
    assert report.worst(3).tolist() == np.argsort(report.shape, kind="stable")[:3].tolist()


def test_totals_are_those_of_the_columns():
    for mesh in (volumes.mesh_of(*volumes.cube(300, 1)), tangled(2)):
        report = gmsnet.quality(mesh)
        assert report.totals.shape_min == report.shape.min()
        assert report.totals.shape_mean == pytest.approx(report.shape.mean(), abs=1e-12)
        assert report.totals.inverted == (report.shape <= 0).sum() or report.totals.uncertain
        assert len(report.cell) == len(mesh.cells[0].nodes)


def test_the_summary():
    report = gmsnet.quality(tangled(3))
    summary = report.summary()
    json.dumps(summary, allow_nan=False)
    assert summary["tetrahedra"] == len(report.cell)
    assert summary["inverted"] == report.inverted
    assert set(NAMES) <= set(summary)
    assert not {"min_angle", "aspect", "qhat", "triangles"} & set(summary)
    for name, limit in (("min_dihedral", 5), ("min_dihedral", 10), ("shape", 0.3)):
        assert summary[name][f"below_{limit}"] == (report.column(name) < limit).sum()
    assert summary["max_dihedral"]["above_165"] == (report.max_dihedral > 165).sum()
    for name in NAMES:
        assert summary[name]["min"] == report.column(name).min()
        assert summary[name]["max"] == report.column(name).max()
        assert summary[name]["mean"] == pytest.approx(report.column(name).mean(), abs=1e-12)
    assert "η, least" in repr(report)
    assert "1/q" not in repr(report)
    assert "dihedral angle, greatest" in report._repr_html_()


@pytest.mark.parametrize("name", ["min_angle", "max_angle", "aspect"])
def test_what_tetrahedra_do_not_have(name):
    report = gmsnet.quality(volumes.mesh_of(*volumes.lattice(2, 0.2)))
    with pytest.raises(AttributeError, match=f"have no {name}: they have min_dihedral"):
        getattr(report, name)
    planar = gmsnet.quality(gmsnet.random_mesh(50, seed=0))
    with pytest.raises(AttributeError, match="have no volume: they have min_angle"):
        _ = planar.volume


@pytest.mark.parametrize("power", [-300, -150, -10, 10, 150, 300])
def test_powers_of_two_change_nothing_but_the_volume(power):
    mesh = tangled(4)
    scaled = mesh.with_points(np.ldexp(mesh.points, power))
    one, other = gmsnet.quality(mesh), gmsnet.quality(scaled)
    for name in NAMES[:4]:
        assert one.column(name).tobytes() == other.column(name).tobytes()
    assert np.ldexp(one.volume, 3 * power).tobytes() == other.volume.tobytes()
    assert one.sign.tolist() == other.sign.tolist()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_turning_and_any_order_of_nodes_change_no_measure(seed):
    rng = np.random.default_rng(seed)
    mesh = volumes.mesh_of(*volumes.cube(60, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    cells = volumes.shuffled(rng, mesh.cells[0].nodes)
    one, other = gmsnet.quality(mesh), gmsnet.quality(volumes.mesh_of(mesh.points @ turn, cells))
    for name in NAMES:
        np.testing.assert_allclose(one.column(name), other.column(name), rtol=1e-6, atol=1e-7)


def test_faces_and_lines_of_a_volume_are_not_measured():
    points, cells = volumes.lattice(2, 0.2)
    mesh = volumes.mesh_of(points, cells, more=[("triangle", [[0, 1, 3]], 5), ("line", [[0, 1]]), ("tetra", cells[:0])])
    report = measure(mesh)
    assert report.summary()["tetrahedra"] == len(report.cell) == len(cells)
    assert isinstance(connectivity_of(mesh), Volume)
    only_others = gmsnet.Mesh(
        np.eye(4)[:, :3] + 1, (volumes.block("pyramid13", [[0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0]]),)
    )
    assert len(measure(only_others).cell) == 0
    assert measure(only_others).totals is None


def test_limits_are_those_of_cells_that_cannot_change():
    points, cells = volumes.cube(150, 6)
    mesh = volumes.mesh_of(points, cells)
    topology = Volume.of(mesh)
    report = gmsnet.quality(mesh)
    held = ~np.isin(cells, topology.free).any(axis=1)
    assert 0 < held.sum() < len(cells)
    for below in (0.9, 0.3):
        found = limits(mesh, topology, below)
        expected = held & (report.shape < below)
        assert len(found.bound) == expected.sum()
        assert found.ceiling == (report.shape[expected].min() if expected.any() else 1.0)
        assert sorted(found.rows.tolist()) == np.flatnonzero(expected).tolist()
        assert found.held.tolist() == held.tolist()
