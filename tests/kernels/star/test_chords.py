"""How far facets go from a surface, where they are bound to it."""

from __future__ import annotations

import numpy as np
import pytest
from support.surface_meshes import ball, wavy

import gmsnet
from gmsnet import generate
from gmsnet.errors import InputError
from gmsnet.generate import disturb_on


def thrown(name):
    return disturb_on(getattr(generate, name)(700), 0.35, seed=2).mesh


@pytest.mark.parametrize("asked", [0.01, 0.004, 0.002])
@pytest.mark.parametrize("name", ["torus_surface", "cone_surface", "organic_surface"])
def test_facets_stay_within_what_is_asked(name, asked):
    result = gmsnet.smooth(thrown(name), hausdorff=asked)
    change = result.surface_change
    assert result.moved.any()
    assert change.largest <= 0.85 * asked * change.diagonal * (1.0 + 1e-9)
    assert change.hausdorff <= 1.05 * asked * change.diagonal


@pytest.mark.parametrize("name", ["cylinder", "bracket"])
def test_nodes_on_curves_keep_facets_within_it_too(name):
    """Edges of curved patches slide: facets on both sides of them are bound. They went eight times as far."""
    mesh = disturb_on(getattr(generate, name)(700), 0.2, seed=3).mesh
    result = gmsnet.smooth(mesh, hausdorff=0.0005, slide="all")
    change = result.surface_change
    assert result.moved.any()
    assert change.hausdorff <= 1.05 * 0.0005 * change.diagonal
    assert not any(note.startswith("hausdorff:") for note in result.notes)


def test_a_bound_that_is_not_kept_is_told():
    """Facets at a tip lie over one another."""
    result = gmsnet.smooth(generate.cone_surface(700).mesh, hausdorff=0.0005, slide="all")
    (said,) = (note for note in result.notes if note.startswith("hausdorff:"))
    change = result.surface_change
    assert f"the distance is {change.hausdorff / change.diagonal:.3g} of the diagonal, and 0.0005 was asked for" in said
    assert 1.0 < change.hausdorff / (0.0005 * change.diagonal) < 1.25


def test_facets_would_go_further_without_a_bound():
    mesh = thrown("torus_surface")
    free, bound = gmsnet.smooth(mesh), gmsnet.smooth(mesh, hausdorff=0.004)
    assert free.surface_change.hausdorff > 0.0045 * free.surface_change.diagonal > 1.15 * bound.surface_change.hausdorff
    assert bound.after.shape.mean() > bound.before.shape.mean() + 0.05


def test_quads_that_are_not_plane_move_too():
    mesh = wavy()
    result = gmsnet.smooth(mesh, hausdorff=0.002)
    assert result.moved.any()
    assert result.after.shape.min() > result.before.shape.min()
    assert result.surface_change.hausdorff < 0.002 * result.surface_change.diagonal


def test_the_bound_holds_for_any_number_of_threads():
    mesh = ball(6000, seed=3)
    one, two = (gmsnet.smooth(mesh, threads=threads, hausdorff=5e-4).points for threads in (1, 2))
    assert np.array_equal(one, two)


@pytest.mark.parametrize("value", [0.0, -1.0, 1.5, float("nan"), "0.1"])
def test_what_is_no_share_is_refused(value):
    with pytest.raises(InputError, match="hausdorff"):
        gmsnet.smooth(ball(50), hausdorff=value)
