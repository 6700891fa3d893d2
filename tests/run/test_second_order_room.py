"""Room for second-order cells costs no quality of straight cells that would make the input the better mesh."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import block_volume, disturb, lattice_volume
from gmsnet.generate.curved_volumes import second_order_volume
from gmsnet.measure.report import connectivity_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.run import stages
from gmsnet.run.room_stage import make_room
from gmsnet.run.second_order import untangle_second_order

MADE = {
    "tetra10": (lambda: lattice_volume(4), False, 0.08, 1),
    "hexahedron27": (lambda: block_volume(4), False, 0.1, 2),
    "wedge18": (lambda: block_volume(3, "wedge"), False, 0.08, 5),
    "wedge15": (lambda: block_volume(3, "wedge"), True, 0.12, 2),
}


def volumes(mesh):
    return Mesh(mesh.points, tuple(block for block in mesh.cells if block.dimension == 3))


def best_but_bent(kind, seed=None):
    """Valid cells of low bounds, with straight cells that no method makes better."""
    made, serendipity, bend, usual = MADE[kind]
    seed = usual if seed is None else seed
    base = volumes(made())
    straight = gmsnet.smooth(disturb(base, connectivity_of(base).free, 0.1, seed=seed)).mesh
    return second_order_volume(straight, serendipity=serendipity, bend=bend, seed=seed)


def least_bound(mesh):
    return gmsnet.quality(mesh).cells.curved_bounds().min()


@pytest.mark.parametrize("guard", ["valid", "worst"])
@pytest.mark.parametrize("kind", MADE)
def test_cells_get_room_where_the_straight_ones_are_at_their_best(kind, guard):
    mesh = best_but_bent(kind)
    assert 0.0 < least_bound(mesh) < 0.4
    result = gmsnet.smooth(mesh, guard=guard)
    assert least_bound(result.mesh) > least_bound(mesh) + 0.1
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.after.inverted == 0


@pytest.mark.parametrize("bend", [0.2, 0.3])
def test_valid_cells_get_room_though_some_of_their_coefficients_are_negative(bend):
    result = gmsnet.smooth(second_order_volume(block_volume(4), bend=bend, seed=1))
    assert result.before.inverted > 20
    assert result.after.inverted == 0
    assert least_bound(result.mesh) > 0.45


@pytest.mark.parametrize("seed", [1, 8, 9, 11, 12])
def test_corners_stay_where_their_moves_would_have_the_input_taken(seed):
    """The worst straight cell cannot become better, so that a lower mean would."""
    mesh = best_but_bent("tetra10", seed)
    fixed = mesh.cells[0].nodes[np.argmin(gmsnet.quality(mesh).shape)]
    result = gmsnet.smooth(mesh, fixed=fixed)
    assert least_bound(result.mesh) > least_bound(mesh) + 0.1
    assert result.after.shape.min() >= result.before.shape.min()


@pytest.mark.parametrize("kind", MADE)
def test_room_costs_no_least_quality_without_floors_either(kind, monkeypatch):
    mesh = best_but_bent(kind)
    monkeypatch.setattr(stages.carry_out, "__defaults__", ((untangle_second_order, make_room),))
    result = gmsnet.smooth(mesh, guard="valid")
    assert result.moved.any()
    assert result.after.shape.min() >= result.before.shape.min()
    assert least_bound(result.mesh) > least_bound(mesh)
