"""The cells of the smallest dihedral angles, found without a look at all, against a look at all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes

from gmsnet.measure import dihedral
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume


def of(points, cells):
    mesh = volumes.mesh_of(points, cells)
    topology = Volume.of(mesh)
    return space_points(mesh)[topology.memory], topology.simplices


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_no_tetrahedron_has_more_shape_than_its_angles_allow(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(400, 3)) * 10.0 ** rng.uniform(-2, 0, 3)
    cells = volumes.wound(points, np.arange(400).reshape(-1, 4))
    columns = dihedral.columns_of(points, of(points, cells)[1]._replace(rows=cells.astype(np.int32)))
    for low, high, shape in columns[:3].T:
        assert abs(shape) <= min(dihedral.most_shape_with(low), dihedral.most_shape_with(high)) * (1 + 1e-9)


def test_the_symmetric_one_has_it():
    for angle in (5.0, 28.5, dihedral.REGULAR, 120.0, 175.0):
        t = np.tan(np.radians(angle) / 2)
        a = np.sqrt((4 * t * t + 2) / 8)
        points = np.array([[-a, 0, 0], [a, 0, 0], [0, 1, t], [0, 1, -t]])
        low, high, shape, *_ = dihedral.columns_of(*of(points, volumes.wound(points, [[0, 1, 2, 3]])))[:, 0]
        assert min(abs(low - angle), abs(high - angle)) < 1e-9
        assert shape == pytest.approx(dihedral.most_shape_with(angle), rel=1e-12)
    assert dihedral.most_shape_with(dihedral.REGULAR) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("wide", [0.0, dihedral.WIDE])
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60))
@settings(max_examples=20, deadline=None)
def test_the_worst_of_all(wide, seed, count):
    points, cells = of(*volumes.cube(150, seed))
    every = dihedral.measures_of(dihedral.columns_of(points, cells), wide)
    found = dihedral.worst(points, cells, count, wide)
    np.testing.assert_array_equal(found.measure, np.sort(every)[:count])
    np.testing.assert_array_equal(found.measure, every[found.rows])
    limit = float(np.quantile(every, 0.1))
    below = dihedral.below(points, cells, limit, wide)
    np.testing.assert_array_equal(np.sort(below.rows), np.flatnonzero(every < limit))


def test_all_where_more_are_asked_for_and_inverted_cells_are_below_anything():
    points, cells = of(*volumes.lattice(2, 0.2, 1))
    assert len(dihedral.worst(points, cells, 10**6, 0.0).rows) == len(cells.rows)
    inverted = cells._replace(orientation=-cells.orientation)
    assert len(dihedral.below(points, inverted, 0.1, 0.0).rows) == len(cells.rows)
    assert len(dihedral.below(points, cells, 80.0, 0.0).rows) == len(cells.rows)  # no tetrahedron is above 70.53°


@pytest.mark.parametrize("few", [0, 1, 40, 400])
def test_ratios_are_renewed_where_nodes_have_moved_and_nowhere_else(few):
    rng = np.random.default_rng(few)
    mesh = volumes.mesh_of(*volumes.cube(600, 2))
    topology = Volume.of(mesh)
    points, cells = space_points(mesh)[topology.memory], topology.changeable
    ratios = dihedral.ratios_of(points, cells)
    nodes = rng.permutation(len(points))[:few].astype(np.int32)
    points[nodes, :3] += rng.normal(scale=0.02, size=(few, 3))
    ratios[~np.isin(cells.rows, nodes).any(axis=1)] += 0.5
    expected = dihedral.ratios_of(points, cells)
    expected[~np.isin(cells.rows, nodes).any(axis=1)] += 0.5
    dihedral.renew(ratios, points, cells, nodes)
    assert ratios.tobytes() == expected.tobytes()
