"""How far facets go from a surface, where they are bound to it."""

from __future__ import annotations

import numpy as np
import pytest
from support.surface_meshes import ball, wavy

import gmsnet
from gmsnet import generate
from gmsnet.constraints.geometry import Shapes
from gmsnet.constraints.grid import Grid
from gmsnet.constraints.shapes import Sphere
from gmsnet.errors import InputError
from gmsnet.generate import disturb_on


def thrown(name):
    return disturb_on(getattr(generate, name)(700), 0.35, seed=2).mesh


def between(one, other, side=12):
    """The largest distance of places on triangles (T, 3, 3) from others, many more than kernels look at."""
    shares = np.array([(i, j, side - i - j) for i in range(side + 1) for j in range(side + 1 - i)]) / side
    places = np.einsum("pk,tkx->tpx", shares, one).reshape(-1, 3)
    return Grid(other).nearest(places)[0].max()


@pytest.mark.parametrize("asked", [0.004, 0.002])
@pytest.mark.parametrize("name", ["torus_surface", "cone_surface", "organic_surface", "cylinder"])
def test_so_do_all_places_between_those_that_are_looked_at(name, asked):
    mesh = thrown(name)
    rows = np.concatenate([block.nodes for block in mesh.cells if block.kind == "triangle"])
    result = gmsnet.smooth(mesh, hausdorff=asked, slide="all")
    was, now = mesh.points[rows], result.points[rows]
    dense = max(between(was, now), between(now, was))
    assert dense <= 1.02 * asked * result.surface_change.diagonal
    assert dense <= 1.1 * result.surface_change.hausdorff  # which is told


@pytest.mark.parametrize("asked", [0.01, 0.004, 0.002])
@pytest.mark.parametrize("name", ["torus_surface", "cone_surface", "organic_surface"])
def test_facets_stay_within_what_is_asked(name, asked):
    result = gmsnet.smooth(thrown(name), hausdorff=asked)
    change = result.surface_change
    assert result.moved.any()
    assert change.largest <= 0.8 * asked * change.diagonal * (1.0 + 1e-9)
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


def ellipsoid(mesh, length):
    return mesh.with_points(mesh.points * [length, 1.0, 1.0])


@pytest.mark.parametrize(("nodes", "length"), [(100, 2.0), (300, 3.0), (3000, 3.0)])
def test_the_ends_of_ellipsoids_are_not_cut_off(nodes, length):
    """Of 300 nodes, three times as long as wide, a tenth of the volume was lost."""
    mesh = ellipsoid(generate.sphere_surface(nodes).mesh, length)
    result, free = gmsnet.smooth(mesh), gmsnet.smooth(mesh, hausdorff=1.0)
    change, unbound = result.surface_change, free.surface_change
    assert change.hausdorff <= 0.02 * change.diagonal < unbound.hausdorff
    assert abs(change.volume) < abs(unbound.volume)
    assert result.after.shape.min() > result.before.shape.min() + 0.2


@pytest.mark.parametrize(("nodes", "thrown", "length"), [(150, False, 3.0), (300, True, 2.0)])
def test_the_ends_of_volumes_are_not_cut_off(nodes, thrown, length):
    shaped = generate.ball_volume(nodes)
    mesh = ellipsoid((disturb_on(shaped, 0.3, seed=1) if thrown else shaped).mesh, length)
    result, free = (gmsnet.smooth(mesh, slide=True, hausdorff=bound) for bound in (None, 1.0))
    change, unbound = result.surface_change, free.surface_change
    assert change.hausdorff <= 0.0105 * change.diagonal < unbound.hausdorff
    assert abs(change.volume) < abs(unbound.volume)
    assert result.after.shape.min() > result.before.shape.min()


@pytest.mark.parametrize("asked", [0.02, 0.005, 0.002])
def test_facets_of_volumes_stay_within_what_is_asked(asked):
    mesh = disturb_on(generate.ball_volume(600), 0.3, seed=3).mesh
    result = gmsnet.smooth(mesh, slide=True, hausdorff=asked)
    assert result.moved.any()
    assert result.surface_change.hausdorff <= 1.05 * asked * result.surface_change.diagonal


def test_a_geometry_is_trusted_unless_a_bound_is_asked_for():
    ball = disturb_on(generate.ball_volume(300), 0.3, seed=3).mesh
    mesh, exact = ball, Shapes({"sphere": Sphere((0.0, 0.0, 0.0), 0.5)})
    free, wide, bound = (
        gmsnet.smooth(mesh, slide=True, geometry=exact, hausdorff=value) for value in (None, 1.0, 0.003)
    )
    assert np.array_equal(free.points, wide.points)
    assert bound.surface_change.hausdorff < free.surface_change.hausdorff


@pytest.mark.parametrize("value", [0.0, -1.0, 1.5, float("nan"), "0.1"])
def test_what_is_no_share_is_refused(value):
    with pytest.raises(InputError, match="hausdorff"):
        gmsnet.smooth(ball(50), hausdorff=value)
