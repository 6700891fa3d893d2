from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate.graded import graded_mesh
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize("ratio", [2.0, 100.0])
def test_density_falls_from_left_to_right_by_the_ratio(ratio):
    mesh = graded_mesh(20_000, ratio, seed=1)
    inner = mesh.points[Topology.of(mesh).free]
    assert len(inner) == 20_000
    left, right = (np.count_nonzero((inner[:, 0] > low) & (inner[:, 0] < low + 0.2)) for low in (0.0, 0.8))
    assert left / right == pytest.approx(ratio**0.8, rel=0.2)


def test_the_boundary_is_as_dense_as_the_inside():
    mesh = graded_mesh(20_000, seed=2)
    x = np.sort(mesh.points[mesh.markers["bottom"], 0])
    assert (x[0], x[-1]) == (0, 1)
    assert np.diff(x)[-1] / np.diff(x)[0] == pytest.approx(10, rel=0.1)
    left, right = (len(mesh.markers[side]) - 1 for side in ("left", "right"))
    assert left / right == pytest.approx(10, rel=0.1)
    spacing = np.sqrt(1 / (20_000 * np.log(100) / 0.99))  # 1/√density at the left
    assert 1 / left == pytest.approx(spacing, rel=0.01)
    assert np.diff(x)[0] == pytest.approx(spacing, rel=0.05)


def test_cells_are_valid_and_the_same_arguments_give_the_same_mesh():
    one, other, third = graded_mesh(500, seed=3), graded_mesh(500, seed=3), graded_mesh(500, seed=4)
    assert gmsnet.quality(one).inverted == 0
    assert one.points.tobytes() == other.points.tobytes() != third.points.tobytes()
    assert graded_mesh(1).points.shape[1] == 2


@pytest.mark.parametrize("nodes", [0, 2.5, True])
def test_bad_numbers_of_nodes_are_named(nodes):
    with pytest.raises(InputError, match="a graded mesh needs a whole number of nodes"):
        graded_mesh(nodes)


@pytest.mark.parametrize("ratio", [1.0, np.nan, np.inf, 1e7])
def test_bad_ratios_are_named(ratio):
    with pytest.raises(InputError, match="the ratio of densities must lie between 1 and 1e6"):
        graded_mesh(10, ratio)
