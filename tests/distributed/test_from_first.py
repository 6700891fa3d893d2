"""Meshes that the first rank has, as the command line does under mpiexec: all that is told is that of one process."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gmsnet
import gmsnet.generate
from gmsnet.mesh.rounding import Rounding

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.ranks import from_first
from support.surface_meshes import ball

from gmsnet.run.options import SmoothOptions


def told(result):
    return (
        result.points.tobytes(), result.moved.tobytes(), repr(result.after.totals), repr(result.judged),
        {reason: len(ids) for reason, ids in result.held.items()}, result.stop_reason, result.notes,
    )  # fmt: skip


def compared(mesh, ranks=2, **options):
    """The result of several ranks, which is that of one process."""
    serial = gmsnet.smooth(mesh, threads=1, **options)
    found = from_first(mesh, SmoothOptions(threads=1, **options), ranks)
    for one, other in zip(told(found), told(serial), strict=True):
        assert one == other
    return found


@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("dimension", [2, 3])
def test_coordinates_that_pass_a_power_of_two(dimension, ranks):
    """Sweeps and what is written go by the exponent of the input: else all is half, or twice, as large."""
    if dimension == 2:
        mesh = gmsnet.random_mesh(200, "circle", seed=1)
        angle = np.pi / 40
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        points = (mesh.points[:, :2] - mesh.points[:, :2].mean(axis=0)) @ turn
    else:
        mesh = gmsnet.generate.ball_volume(300).mesh
        points = mesh.points @ np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    mesh = replace(mesh, points=points * (0.99999 / abs(points).max()), cells=mesh.cells)
    found = compared(mesh, ranks, slide="all", method="barrier")
    assert (mesh.exponent, found.mesh.exponent) == (0, 1)


def test_nodes_near_walls_that_are_let_go_at_the_end():
    mesh = gmsnet.generate.c_grid_mesh(8, 30.0, 60)
    for method in ("barrier", "auto"):
        found = compared(mesh, method=method)
        assert any("refined towards its walls" in note for note in found.notes)


@pytest.mark.parametrize("ranks", [2, 3])
def test_facets_at_the_ends_of_ellipsoids_are_bound(ranks):
    mesh = gmsnet.generate.sphere_surface(100).mesh
    mesh = mesh.with_points(mesh.points * [3.0, 1.0, 1.0])
    found = compared(mesh, ranks)
    assert repr(found.surface_change) == repr(gmsnet.smooth(mesh).surface_change)


def in_four_digits(points, _):
    return np.round(points, 4)


@pytest.mark.parametrize("method", ["auto", "barrier", "laplacian"])
def test_files_of_few_digits(method):
    """What a file rounds is part of what the guard proves on each rank."""
    for mesh in (gmsnet.random_mesh(400, seed=2), gmsnet.generate.random_volume(300, seed=3)):
        points = np.round(mesh.points, 4)
        rounding = Rounding(2.0**-53, 0.5e-4, in_four_digits, "four digits")
        mesh = replace(mesh, points=points, rounding=rounding)
        exact = gmsnet.smooth(replace(mesh, rounding=None), method, threads=1, guard="star")
        found = compared(mesh, 3, method=method, guard="star")
        assert (found.points != exact.points).any()


@pytest.mark.parametrize("fix_layers", [False, True])
def test_layers_are_told_as_they_are_once_cells_are_mended(fix_layers):
    """Those of the tangled input are none, or others."""
    mesh = gmsnet.generate.layered_mesh(8, 100, 40, cells="quad", body="circle")
    free = np.setdiff1d(np.arange(len(mesh.points)), gmsnet.smooth(mesh, max_sweeps=0).held["boundary"])
    tangled = gmsnet.generate.disturb(mesh, free, 1.0, seed=1, keep_valid=False)
    found = compared(tangled, fix_layers=fix_layers)
    assert found.before.inverted > 0
    assert "mended" in " ".join(found.notes)


def test_layers_in_space_are_told_as_they_are_once_cells_are_mended():
    mesh = gmsnet.generate.layered_volume(6, 4, seed=1)
    inner = ((mesh.points > mesh.points.min(axis=0)) & (mesh.points < mesh.points.max(axis=0))).all(axis=1)
    low = np.flatnonzero(inner)
    thrown = low[np.argsort(mesh.points[low, 2])[-len(low) // 4 :]]
    found = compared(gmsnet.generate.disturb(mesh, thrown, 1.0, seed=2, keep_valid=False))
    assert found.before.inverted > 0


@pytest.mark.parametrize("seed", [0, 2, 4])
def test_how_far_nodes_of_a_surface_are_from_it_is_told_alike(seed):
    """From the facets that the sweeps have followed them on, which need not be the nearest ones now."""
    found = compared(ball(60, seed=seed), ranks=3, hausdorff=0.001)
    assert any("of an edge from the input's facets" in note for note in found.notes)


def test_nodes_without_cells_stay_where_they_are():
    mesh = gmsnet.random_mesh(80, seed=3)
    points = np.vstack([mesh.points[:40], [[5.0, 5.0]], mesh.points[40:]])
    block = mesh.cells[0]
    nodes = block.nodes + (block.nodes >= 40)
    found = compared(gmsnet.Mesh(points, (gmsnet.CellBlock("triangle", nodes, block.regions),)))
    assert found.points[40].tolist() == [5.0, 5.0]
