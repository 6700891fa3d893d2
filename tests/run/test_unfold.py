"""Plane parts of surfaces whose cells lie over one another: mended as a mesh in a plane is, or left as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.surface_meshes import box, surface_mesh, wavy

import gmsnet
from gmsnet.constraints.facets import surface_itself
from gmsnet.constraints.folded_planes import folded_planes
from gmsnet.constraints.shell import FEATURE
from gmsnet.run.unfold import _rim_turns_back
from gmsnet.topology.topology import Topology

WAY = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
KINDS = ["quad", "triangle", "mixed"]


def tangled(kind, amount=0.9):
    """A square grid in the plane, its inner nodes thrown: (mesh in the plane, the same turned in space)."""
    mesh = wavy(12, 3, amount, kind)
    flat = np.column_stack([mesh.points[:, :2], np.zeros(len(mesh.points))])
    return mesh.with_points(flat), mesh.with_points(flat @ WAY)


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_a_plane_mesh_that_is_turned_becomes_what_it_does_in_the_plane(kind, single):
    flat, turned = tangled(kind)
    assert gmsnet.quality(flat).inverted > 20
    there = gmsnet.smooth(flat)
    result = gmsnet.smooth(replace(turned, points=turned.points.astype(np.float32).astype(float), single=single))
    assert (there.after.inverted, result.after.inverted) == (0, 0)
    assert not single or np.array_equal(result.points, result.points.astype(np.float32))
    assert FEATURE not in result.held
    assert result.after.shape.min() > there.after.shape.min() - 0.01
    back = result.mesh.with_points(np.column_stack([(result.points @ WAY.T)[:, :2], np.zeros(len(result.points))]))
    assert gmsnet.quality(back).inverted == 0
    assert abs((result.points @ WAY.T)[:, 2]).max() < 1e-5
    assert any(note.startswith("in a plane of the surface, untangling: all") for note in result.notes)


def test_without_untangling_it_stays_folded():
    result = gmsnet.smooth(tangled("quad")[1], untangle=False)
    assert result.after.inverted
    assert not any("untangling" in note for note in result.notes)


def test_nodes_that_are_to_be_held_stay():
    turned, fixed = tangled("quad")[1], [60, 61]
    result = gmsnet.smooth(turned, fixed=fixed)
    assert not result.moved[fixed].any()


def test_the_rest_keeps_its_place_where_the_outermost_node_moves():
    """Coordinates are over a power of two, which follows from the largest one."""
    turned = tangled("quad", 0.2)[1]
    points = turned.points.copy()
    points[84] = 100.0 * WAY[0]
    result = gmsnet.smooth(turned.with_points(points))
    assert (result.before.inverted, result.after.inverted) == (3, 0)
    assert abs(result.points).max() < 20.0
    assert np.array_equal(result.points[[0, 12, 156, 168]], points[[0, 12, 156, 168]])


@pytest.mark.parametrize("turned", [False, True])
def test_one_side_of_a_box_is_mended_and_others_are_not_touched_by_it(turned):
    mesh, inner = box(8)
    points, rng = mesh.points.copy(), np.random.default_rng(1)
    side = inner & (points[:, 2] == points[:, 2].max())
    points[side, :2] += rng.uniform(-0.8, 0.8, (side.sum(), 2))
    mesh = mesh.with_points(points @ WAY if turned else points)
    result = gmsnet.smooth(mesh)
    assert result.after.shape.min() > 0.8
    assert set(np.flatnonzero(inner)) == set(np.setdiff1d(np.arange(len(points)), result.held[FEATURE]))
    if not turned:
        assert np.array_equal(result.points[side, 2], points[side, 2])


def test_a_hem_that_lies_on_its_sheet_stays_folded():
    flat = wavy(12, 3, 0.2)
    x, y, fold = flat.points[:, 0].copy(), flat.points[:, 1], np.arange(len(flat.points)) // 13 == 9
    x[fold] = 9.0
    hem = np.column_stack([np.where(x > 9, 18 - x, x), y, np.zeros_like(x)]) @ WAY
    result = gmsnet.smooth(flat.with_points(hem))
    assert not any("untangling" in note for note in result.notes)
    assert result.after.shape.min() > result.before.shape.min()
    assert not result.moved[fold].any()


def test_a_closed_flat_bag_has_no_side_that_is_up():
    flat = wavy(8, 3, 0.0, "triangle")
    rim = np.isin(flat.points[:, :2], (0, 8)).any(axis=1)
    other = np.where(rim, np.arange(len(rim)), len(rim) + np.arange(len(rim)))
    points = np.column_stack([flat.points[:, :2], np.zeros(len(rim))])
    rows = flat.cells[0].nodes
    bag = surface_mesh(np.concatenate([points, points]) @ WAY, {"triangle": np.vstack([rows, other[rows][:, ::-1]])})
    result = gmsnet.smooth(bag)
    assert not any("untangling" in note for note in result.notes)


def test_folds_without_nodes_inside_are_not_looked_at():
    """Pairs of triangles that lie over one another: all of their nodes are at the rim, however many there are."""
    pair, many = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.7, 0.1], [0.3, 0.9, 0.9 / 7]]), 40
    points = np.concatenate([pair + np.array([2.0 * k, 0.0, 0.0]) for k in range(many)])
    rows = np.concatenate([np.array([[0, 1, 2], [1, 0, 3]]) + 4 * k for k in range(many)])
    mesh = surface_mesh(points, {"triangle": rows})
    facets = surface_itself(mesh, Topology.of(mesh))
    assert folded_planes(facets, mesh.points) == []
    _, turned = tangled("triangle")
    facets = surface_itself(turned, Topology.of(turned))
    assert len(folded_planes(facets, turned.points)) == 1


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_rims_that_go_back(angle):
    """A slit ends in an angle of 360 degrees, a sheet that is folded on purpose in one of 0."""
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(np.arange(7), np.arange(7), indexing="ij"))
    k = (np.arange(6)[:, None] * 7 + np.arange(6)).ravel()
    quads, none = np.column_stack([k, k + 7, k + 8, k + 1]), np.empty((0, 3), dtype=np.int64)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    flat = np.column_stack([x, y])
    assert not _rim_turns_back(flat @ turn, (none, quads))
    folded = np.column_stack([np.where(x > 4, 8 - x, x), y])
    assert _rim_turns_back(folded @ turn, (none, quads))
    lips = 7 * np.arange(3) + 3  # of a slit at y = 3, from x = 0 to 3; the quads above it have other nodes
    above = (y[quads] >= 3).all(axis=1)[:, None] & np.isin(quads, lips)
    slit = np.where(above, len(flat) + quads // 7, quads)
    assert above.sum() == 5
    assert not _rim_turns_back(np.concatenate([flat, flat[lips]]) @ turn, (none, slit))


@pytest.mark.parametrize("seed", range(4))
def test_concave_quads_in_a_side_of_a_box(seed):
    """Each is inverted, though its corners at the one or the other two opposite nodes are not."""
    mesh, inner = box(6, amount=0.0, kind="quad")
    points = mesh.points.copy()
    rng = np.random.default_rng(seed)
    side = np.flatnonzero(inner & (points[:, 2] == 0.0))
    points[rng.choice(side, 3, replace=False), :2] += np.array([0.7, 0.6])
    result = gmsnet.smooth(mesh.with_points(points))
    assert result.before.inverted > 0
    assert result.after.inverted == 0
