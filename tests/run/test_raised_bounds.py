"""The lowest bounds of ten-node tetrahedra rise by their middles, and corners that lose quality go back."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb, lattice_volume
from gmsnet.generate.curved_volumes import second_order_volume
from gmsnet.measure.report import connectivity_of
from gmsnet.measure.solid import judge_volumes
from gmsnet.methods.solid_cells import SolidCells
from gmsnet.run import room_stage, second_order, stages


def signs(mesh, points):
    nodes = mesh.cells[0].nodes.astype(np.int32)
    return judge_volumes(points, nodes, "tetra10", np.ones(len(nodes), dtype=np.int8))[0]


def assert_sound(mesh, result):
    """All cells are valid by exact arithmetic, and what is held has its bits."""
    assert (signs(mesh, result.points) == 1).all()
    assert result.after.inverted == 0
    changed = (result.points != mesh.points).any(axis=1)
    np.testing.assert_array_equal(changed, result.moved)
    for ids in result.held.values():
        assert not changed[ids].any()


def bent_tetrahedra(seed):
    """Valid tetrahedra with middles out of place, of which some have low bounds."""
    base = lattice_volume(4)
    mesh = second_order_volume(disturb(base, connectivity_of(base).free, 0.1, seed=seed), bend=0.06, seed=seed)
    assert (signs(mesh, mesh.points) == 1).all()
    return mesh


def least_bound(mesh):
    return gmsnet.quality(mesh).cells.curved_bounds().min()


@pytest.mark.parametrize("seed", range(3))
def test_the_lowest_bounds_of_tetrahedra_rise(seed, monkeypatch):
    mesh = bent_tetrahedra(seed)
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    assert result.after.shape.min() >= result.before.shape.min()
    risen = least_bound(mesh.with_points(result.points))
    monkeypatch.setattr(room_stage, "ENOUGH", 0.0)
    without = least_bound(mesh.with_points(gmsnet.smooth(mesh).points))
    assert risen > without + 0.05
    assert risen >= least_bound(mesh)


def test_a_move_of_all_corners_that_costs_quality_is_taken_back(monkeypatch):
    """What a method gains can be lost where cells are refused and their corners go half of the way."""
    mesh, advance = bent_tetrahedra(5), SolidCells.advance

    def astray(cells, places, guard, room, valid):
        away = 0.02 * np.random.default_rng(1).normal(size=(len(places), 3))
        moved = advance(cells, cells.points[:, :3] + away, guard, room, valid)
        assert len(moved)
        return moved

    monkeypatch.setattr(SolidCells, "advance", astray)
    result = gmsnet.smooth(mesh)
    corners = np.unique(mesh.cells[0].nodes[:, :4])
    np.testing.assert_array_equal(result.points[corners], mesh.points[corners])
    assert result.moved.any()
    assert least_bound(mesh.with_points(result.points)) > least_bound(mesh)


def test_raising_moves_no_corner_and_lowers_no_bound_below_the_least(monkeypatch):
    mesh = bent_tetrahedra(5)
    some = (second_order.untangle_second_order, room_stage.raise_bounds)
    monkeypatch.setattr(stages.carry_out, "__defaults__", (some,))
    result = gmsnet.smooth(mesh, "laplacian")
    corners = np.unique(mesh.cells[0].nodes[:, :4])
    np.testing.assert_array_equal(result.points[corners], mesh.points[corners])
    assert result.moved.any()
    assert_sound(mesh, result)
    assert least_bound(mesh.with_points(result.points)) > least_bound(mesh)
