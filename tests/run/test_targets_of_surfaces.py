"""Targets on surfaces in space: only what is around the cells below them moves, until none is."""

from __future__ import annotations

import numpy as np
import pytest
from support.surface_meshes import ball, wavy

import gmsnet
from gmsnet import generate
from gmsnet.generate import disturb_on


def worst(mesh):
    return float(gmsnet.quality(mesh).shape.min())


@pytest.mark.parametrize("kind", ["quad", "triangle", "mixed"])
def test_no_cell_is_left_below_a_target(kind):
    mesh = wavy(side=30, kind=kind, amount=0.25)
    asked = worst(mesh) + 0.1
    below = (gmsnet.quality(mesh).shape < asked).sum()
    result = gmsnet.smooth(mesh, target_quality=asked)
    assert worst(result.mesh) >= asked
    assert result.stop_reason == "target reached"
    assert 0 < result.moved.sum() < min(40 * below, len(mesh.points) / 2)


def test_no_angle_is_left_below_a_target():
    mesh = disturb_on(generate.sphere_surface(1500), 0.35, seed=1).mesh
    low = gmsnet.quality(mesh).min_angle.min()
    result = gmsnet.smooth(mesh, target_angle=float(low) + 8.0, free_needles=True)
    assert gmsnet.quality(result.mesh).min_angle.min() >= low + 8.0
    assert 0 < result.moved.sum() < len(mesh.points)


def test_a_mesh_that_meets_its_target_stays_as_it_is():
    mesh = ball(300)
    result = gmsnet.smooth(mesh, target_quality=worst(mesh) - 0.01)
    assert not result.moved.any()


def test_a_target_out_of_reach_is_told_and_no_cell_becomes_worse():
    mesh = disturb_on(generate.sphere_surface(300), 0.3, seed=1).mesh
    result = gmsnet.smooth(mesh, target_quality=0.999, free_needles=True)
    assert result.stop_reason != "target reached"
    assert worst(result.mesh) > worst(mesh)


@pytest.mark.parametrize("method", ["barrier", "worst-first", "laplacian"])
def test_other_methods_go_for_a_target_too(method):
    mesh = ball(800, amount=0.4)
    asked = worst(mesh) + 0.05
    result = gmsnet.smooth(mesh, method, target_quality=asked, free_needles=True)
    assert worst(result.mesh) > worst(mesh)


def test_the_same_bits_for_any_number_of_threads():
    mesh = ball(6000, seed=3)
    one, two = (gmsnet.smooth(mesh, threads=threads, target_quality=0.75).points for threads in (1, 2))
    assert np.array_equal(one, two)


def test_a_quad_with_one_free_node_opposite_to_its_worst_corner_is_not_held():
    """All four of its nodes give its normal, and so the 1/q of each corner."""
    grid = generate.structured_mesh(3)
    points = np.column_stack([grid.points[:, :2], np.zeros(16)])
    points[0] += (0.1, 0.1, 0.05)  # a corner of the sheet, whose quad opens wide there
    points[5, 2] = 0.12
    mesh = gmsnet.Mesh(points, grid.cells)
    before = gmsnet.quality(mesh).shape
    least = float(before.min())
    assert before.argmin() == 0
    # The free nodes are those of the only bump, which facets would leave by more than they may otherwise.
    result = gmsnet.smooth(mesh, target_quality=least + 0.002, hausdorff=1.0)
    assert result.stop_reason == "target reached"
    assert result.after.shape.min() >= least + 0.002
    assert not result.moved[result.held["boundary"]].any()


@pytest.mark.parametrize("seed", [3, 8, 16])
def test_a_run_that_begins_anew_has_its_nodes_on_the_facets_where_the_first_one_had_them(seed):
    """A node of the input lies on several facets: with another one of them sweeps ended 1e-4 below the target."""
    mesh = disturb_on(generate.organic_surface(220), 0.4, seed=seed).mesh
    least = gmsnet.smooth(mesh).judged.after.shape_min
    assert gmsnet.smooth(mesh, target_quality=0.9999 * least).judged.after.shape_min >= 0.9999 * least
