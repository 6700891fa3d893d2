"""Whole runs on surfaces in space: what gets better, what stays, and what never gets worse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.surface_meshes import ball, box, surface_mesh, wavy

import gmsnet
from gmsnet.constraints.shell import FEATURE
from gmsnet.errors import InputError
from gmsnet.generate import disturb_on, sphere_surface
from gmsnet.run import outcome
from gmsnet.run.account import Account


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("method", ["auto", "laplacian", "barrier", "worst-first"])
def test_a_sphere_gets_better_and_stays_one(method, guard):
    mesh = ball()
    result = gmsnet.smooth(mesh, method, guard=guard)
    assert result.moved.sum() > 0
    assert result.after.shape.mean() > result.before.shape.mean()
    if guard != "valid":
        assert result.after.shape.min() >= result.before.shape.min()
    off = abs(np.linalg.norm(result.points, axis=1) - 1.0)
    assert off.max() < 0.006  # of a sagitta of 0.01
    assert np.array_equal(mesh.points[~result.moved], result.points[~result.moved])


@pytest.mark.parametrize("kind", ["quad", "triangle", "mixed"])
@pytest.mark.parametrize("guard", ["worst", "star"])
def test_no_cell_becomes_worse_than_the_worst_was(kind, guard):
    mesh = wavy(kind=kind)
    result = gmsnet.smooth(mesh, guard=guard)
    assert result.after.shape.min() > result.before.shape.min() + 0.1
    assert result.after.shape.mean() > result.before.shape.mean()
    assert not result.moved[result.held["boundary"]].any()


def test_each_star_keeps_its_worst_cell():
    mesh = ball(amount=0.6)
    rows = mesh.cells[0].nodes
    result = gmsnet.smooth(mesh, "barrier", guard="star", max_sweeps=3)
    for node in range(len(mesh.points)):
        around = (rows == node).any(axis=1)
        assert result.after.shape[around].min() >= result.before.shape[around].min()


def test_the_same_bits_for_any_number_of_threads():
    mesh = ball(6000, seed=3)
    one, two = (gmsnet.smooth(mesh, threads=threads).points for threads in (1, 2))
    assert np.array_equal(one, two)


def test_nodes_of_features_are_held_and_plane_sides_stay_plane():
    mesh, inner = box()
    result = gmsnet.smooth(mesh)
    assert result.held[FEATURE].tolist() == np.flatnonzero(~inner).tolist()
    assert result.after.shape.min() > result.before.shape.min()
    on_side = (mesh.points == 0.0) | (mesh.points == 6.0)
    assert np.array_equal(mesh.points[on_side], result.points[on_side])


def test_nodes_of_features_slide_along_them():
    mesh, inner = box()
    result = gmsnet.smooth(mesh, slide=True)
    corners = ((mesh.points == 0.0) | (mesh.points == 6.0)).all(axis=1)
    assert result.held[FEATURE].tolist() == np.flatnonzero(corners).tolist()
    on_side = (mesh.points == 0.0) | (mesh.points == 6.0)
    assert np.array_equal(mesh.points[on_side], result.points[on_side])
    assert result.moved[~inner].any()
    assert result.after.shape.mean() > gmsnet.smooth(mesh).after.shape.mean()


def test_nodes_of_an_open_edge_slide_where_they_are_let():
    mesh = wavy(kind="triangle")
    still, slid = gmsnet.smooth(mesh), gmsnet.smooth(mesh, slide=True)
    rim = still.held["boundary"]
    assert not still.moved[rim].any()
    assert slid.moved[rim].any()
    x, y = slid.points[:, 0], slid.points[:, 1]
    assert ((x[rim] == 0) | (x[rim] == 16) | (y[rim] == 0) | (y[rim] == 16)).all()


def test_the_tolerance_is_kept():
    mesh = ball(100, amount=0.5)
    loose, tight = (gmsnet.smooth(mesh, surface_tolerance=tolerance) for tolerance in (0.2, 0.005))
    sagitta = [1.0 - np.linalg.norm(result.points, axis=1).min() for result in (loose, tight)]
    assert sagitta[0] < sagitta[1]
    for value in (0.0, -1.0, math.nan, "near"):
        with pytest.raises(InputError, match="surface_tolerance"):
            gmsnet.smooth(mesh, surface_tolerance=value)


def test_flipped_faces_are_read_alike_and_stay_as_written():
    mesh = ball(400, amount=0.1)
    rows = mesh.cells[0].nodes.copy()
    rows[::3] = rows[::3, ::-1]
    flipped = surface_mesh(mesh.points, {"triangle": rows})
    result = gmsnet.smooth(flipped)
    assert result.moved.all()
    assert np.array_equal(result.mesh.cells[0].nodes, rows)


def test_a_node_of_a_non_manifold_edge_is_held():
    mesh = wavy(kind="triangle")
    rows, points = mesh.cells[0].nodes, mesh.points
    edge = rows[len(rows) // 3][:2]
    points = np.vstack([points, points[edge].mean(axis=0) + np.array([0.0, 0.0, 5.0])])
    rows = np.vstack([rows, [*edge, len(points) - 1]])
    fin = surface_mesh(points, {"triangle": rows})
    result = gmsnet.smooth(fin)
    assert not result.moved[edge].any()
    assert result.moved.any()


def test_far_from_the_origin_nodes_slide_that_are_apart_by_as_much_as_there():
    """A survey of 5 m in UTM coordinates: two millionths of these are 10 m."""
    mesh = wavy(kind="triangle")
    here = gmsnet.smooth(mesh.with_points(5.0 * mesh.points), slide=True)
    there = gmsnet.smooth(mesh.with_points(5.0 * mesh.points + (5e5, 5.4e6, 0.0)), slide=True)
    assert here.moved[here.held["boundary"]].sum() == there.moved[there.held["boundary"]].sum()
    assert here.moved.sum() == there.moved.sum()
    assert there.after.shape.mean() == pytest.approx(here.after.shape.mean(), abs=1e-3)
    assert "another one" not in " ".join(there.notes)


def test_what_is_not_joined_stays_together_and_is_told():
    mesh = wavy(kind="triangle")
    rows, points = mesh.cells[0].nodes.copy(), mesh.points
    cut = np.unique(rows[points[rows][:, :, 0].mean(axis=1) > 8.0])
    cut = cut[np.isin(cut, rows[points[rows][:, :, 0].mean(axis=1) < 8.0])]
    copy = np.arange(len(points))
    copy[cut] = len(points) + np.arange(len(cut))
    beyond = points[rows][:, :, 0].mean(axis=1) > 8.0
    rows[beyond] = copy[rows[beyond]]
    points = np.vstack([points, points[cut] * (1.0 + 1e-7)])
    result = gmsnet.smooth((points, rows), slide=True)
    assert not result.moved[[*cut, *copy[cut]]].any()
    assert result.moved[result.held["boundary"]].sum() == 0
    assert result.moved.any()
    assert f"{2 * len(cut)} nodes of the boundary have another one in their place" in " ".join(result.notes)
    assert "another one" not in " ".join(gmsnet.smooth(mesh, slide=True).notes)
    points = points[rows].reshape(-1, 3)
    points = points + 1e-7 * np.random.default_rng(0).uniform(-1, 1, points.shape)
    result = gmsnet.smooth((points, np.arange(len(points)).reshape(-1, 3)), slide=True)
    assert not result.moved.any()
    assert "Make equal points one point first" in " ".join(result.notes)


def test_isolated_nodes_and_doubled_and_flat_faces_are_no_trouble():
    mesh = ball(200)
    rows, points = mesh.cells[0].nodes, np.vstack([mesh.points, [[9.0, 9.0, 9.0]]])
    doubled = np.vstack([rows, rows[:1]])
    result = gmsnet.smooth((points, doubled))
    assert not result.moved[[*rows[0], len(points) - 1]].any()
    assert result.moved.any()
    points = mesh.points.copy()
    points[rows[0, 0]] = points[rows[0, 1]]  # two facets without area
    result = gmsnet.smooth((points, rows))
    assert np.isfinite(result.points).all()
    assert result.after.inverted <= result.before.inverted


def test_what_cannot_be_asked_of_surfaces_is_told():
    mesh = ball(100)
    for options, message in (
        ({"target_dihedral": 20.0}, "target_dihedral"),
        ({"method": "getme"}, "not for surfaces"),
        ({"method": "laplacian", "variant": "area"}, "not for surfaces"),
        ({"size": np.ones(100)}, "metric"),
        ({"preserve": "size"}, "preserve='size' is of meshes in a plane"),
        ({"preserve": "metric"}, "preserve='metric' is of meshes in a plane"),
        ({"best_by": "aspect"}, "best_by"),
    ):
        with pytest.raises(InputError, match=message):
            gmsnet.smooth(mesh, **options)


def test_cells_of_second_order_are_held_and_named():
    mesh = ball()
    (block,) = [block for block in mesh.cells if block.dimension == 2]
    ends = np.stack([block.nodes, np.roll(block.nodes, -1, axis=1)], axis=2)
    edges, number = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middles = mesh.points[edges].mean(axis=1)
    nodes = np.column_stack([block.nodes, len(mesh.points) + number.reshape(block.nodes.shape)])
    points = np.concatenate([mesh.points, middles])
    result = gmsnet.smooth((points, [("triangle6", nodes)]))
    assert not result.moved.any()
    assert f"on a surface they are held: {len(nodes):,} triangle6 cells" in " ".join(result.notes)


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("method", ["auto", "barrier", "laplacian", "worst-first"])
def test_single_precision_far_from_the_origin(method, guard, monkeypatch):
    """New places are rounded before they are judged, so that their rounding costs no room."""
    mesh = ball()
    far = replace(mesh, points=(1000.0 + mesh.points).astype(np.float32).astype(float), single=True)
    exact, put_back = [], outcome.put_back

    def seen(best, *others):
        exact.append((best.astype(np.float32) == best).all())
        return put_back(best, *others)

    monkeypatch.setattr(outcome, "put_back", seen)
    result = gmsnet.smooth(far, method, guard=guard)
    assert exact == [True]
    assert result.judged.after.shape_min > result.judged.before.shape_min + 0.05
    assert result.after.inverted == 0
    assert (result.points == result.points.astype(np.float32)).all()


def test_a_quad_that_is_folded_over_is_not_said_to_have_no_area():
    """One corner of a square in a tilted plane lies beyond the opposite edge."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.3, 0.2], [0.0, 1.0]])
    points = np.column_stack([points, points[:, 0]])
    mesh = surface_mesh(points, {"quad": [[0, 1, 2, 3]]})
    result = gmsnet.smooth(mesh)
    assert result.after.inverted == 1
    told = Account(mesh, result).tangle()
    assert "it is folded over" in told
    assert "no area" not in told


def test_surfaces_are_compared_by_their_least_and_not_by_qhat():
    """q̂ likes the right angles of thin facets: of a flat box it falls where the least and the mean 1/q rise."""
    mesh = box(8, 1, 0.2)[0]
    flat = replace(mesh, points=mesh.points * [1.0, 1.0, 0.05])
    result = gmsnet.smooth(flat, slide="all", threads=1)
    before, after = result.judged
    assert after.qhat < before.qhat
    assert after.shape_min > 2.0 * before.shape_min
    assert result.moved.any()
    assert all(np.isnan(sweep.qhat) for sweep in result.history)


def test_long_waves_are_evened_out_in_one_call():
    """A grid in a tilted plane whose columns are drawn together on one side: sweeps creep, and must not end early."""
    columns, rows = 80, 40
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 2, columns + 1), np.linspace(0, 1, rows + 1)))
    x = x + 0.25 * np.sin(np.pi * x / 2) * np.sin(np.pi * y)
    y = y + 0.12 * np.sin(np.pi * x) * np.sin(np.pi * y)
    at = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    cells = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    mesh = surface_mesh(np.column_stack([x, y, 0.3 * x + 0.2 * y]), {"triangle": cells})
    result = gmsnet.smooth(mesh, threads=1)
    again = gmsnet.smooth(result.mesh, threads=1)
    assert result.before.shape.min() < 0.65
    assert result.after.shape.min() > 0.8
    assert again.after.shape.min() < result.after.shape.min() + 0.01


NORMALS = {"stl": "of facets", "obj": "normals (vn)", "ply": "nx, ny, nz", "off": ""}


@pytest.mark.parametrize("suffix", NORMALS)
def test_normals_that_become_stale_are_told(suffix, tmp_path):
    mesh, path, said = ball(60, seed=1), tmp_path / f"a.{suffix}", NORMALS[suffix]
    if suffix == "ply":
        mesh = replace(mesh, point_data=dict(zip(("nx", "ny", "nz"), mesh.points.T, strict=True)))
    gmsnet.write(mesh, path)
    if suffix == "obj":
        path.write_text(path.read_text() + "vn 0 0 1\n")
    found = [note for note in gmsnet.smooth(gmsnet.read(path)).notes if note.startswith("normals")]
    note = f"normals in the file ({said}) stay as they are where nodes move: update_normals computes them anew"
    assert found == [note] * bool(said)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("nodes", [150, 400])
def test_quads_of_a_sphere_are_not_pulled_to_the_chords_of_their_halves(nodes, seed):
    mesh = disturb_on(sphere_surface(nodes, cells="quad"), 0.4, seed=seed).mesh
    result = gmsnet.smooth(mesh)
    assert result.judged.after.shape_min > 0.85
    away = np.abs(np.linalg.norm(result.points, axis=1) / np.linalg.norm(mesh.points, axis=1).mean() - 1.0)
    assert away.mean() < 0.003
    halves = mesh.cells[0].nodes[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    even = np.abs(volume(sphere_surface(nodes, cells="quad").mesh.points, halves))
    assert abs(abs(volume(result.points, halves)) / even - 1.0) < 0.01


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (a * np.cross(b, c)).sum() / 6.0
