"""Near walls shapes get better, areas and heights stay in their bands, and nothing moves far from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import Curve, disturb, good_mesh, layered_mesh, recombine
from gmsnet.methods.banded import PLAN, Kept
from gmsnet.parallel.threads import serial
from gmsnet.run import stop, wall_stage
from gmsnet.run.options import SmoothOptions
from gmsnet.run.set_up import first_state
from gmsnet.run.wall_stage import PHASE, improve_near_walls, with_rings
from gmsnet.topology.topology import Topology

OPTIONS = SmoothOptions()


def state_of(mesh):
    """After sweeps that had nothing to gain."""
    return replace(first_state(mesh, None, OPTIONS.smoother(), OPTIONS, serial), stop_reason=stop.NO_PROGRESS)


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def heights(points, triangles, wall):
    """(k,) of the triangles with two corners on a wall, over these. wall: (N,) bool."""
    rows = triangles[wall[triangles].sum(axis=1) == 2]
    ends = rows[wall[rows]].reshape(-1, 2)
    return np.abs(doubles(points, rows)) / np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)


def plate(radius):
    """Refined towards a hole."""
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    hole = Curve(radius * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    side = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]) * 4.0 * radius
    return good_mesh(
        [[Curve(side, "side")], [hole]],
        lambda x: 0.02 * radius + 0.25 * np.abs(np.linalg.norm(x, axis=1) - radius),
    )


@pytest.mark.parametrize("slide", [False, True])
def test_cells_on_a_wall_keep_their_heights(slide):
    mesh = plate(0.3)
    wall = np.zeros(len(mesh.points), dtype=bool)
    wall[mesh.markers["hole"]] = True
    free = [gmsnet.smooth(mesh, slide=slide, preserve=preserve) for preserve in ("shape", "none")]
    triangles = Topology.of(mesh).triangles
    before = heights(mesh.points, triangles, wall)
    assert len(before) > 80
    change = [np.abs(heights(result.points, triangles, wall) / before - 1.0).max() for result in free]
    assert 0.01 < change[0] <= 0.02 < 0.05 < change[1]
    assert free[0].moved[wall].any() == slide


def quad_areas(points, quads):
    one, other = points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]]
    return 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


@pytest.mark.parametrize("slide", [False, True])
@pytest.mark.parametrize("radius", [0.15, 0.5])
def test_quads_keep_their_areas_and_their_heights_on_the_wall(radius, slide):
    """The area of a whole quad, and not of each of its corners, is what is kept: so its shape can get better."""
    mesh = recombine(plate(radius))
    topology, wall = Topology.of(mesh), np.zeros(len(mesh.points), dtype=bool)
    wall[mesh.markers["hole"]] = True
    walls = state_of(mesh).protection.walls
    calm = walls.nodes & (walls.blend == 0.0)
    calm[wall] &= walls.heights[wall] == 1.0
    quads, triangles = topology.quads, topology.triangles
    inside = quads[calm[quads].all(axis=1)]
    assert len(inside) > 200
    result = gmsnet.smooth(mesh, slide=slide)
    change = np.abs(quad_areas(result.points, inside) / quad_areas(mesh.points, inside) - 1.0)
    assert 0.05 < change.max() <= 0.1
    corners = [doubles(points, inside[:, [0, 1, 3]]) for points in (mesh.points, result.points)]
    assert np.abs(corners[1] / corners[0] - 1.0).max() > 0.2
    on_wall = np.concatenate([np.roll(inside, -k, axis=1)[:, :3] for k in range(4)])  # with the edge 01 or 12
    on_wall = on_wall[wall[on_wall].sum(axis=1) == 2]
    on_wall = on_wall[wall[on_wall[:, 1]]]
    assert len(on_wall) > 60
    before, after = (heights(points, on_wall, wall) for points in (mesh.points, result.points))
    assert 0.01 < np.abs(after / before - 1.0).max() <= 0.02
    near = quads[walls.nodes[quads].all(axis=1)]
    first, last = (gmsnet.quality(m).shape[len(triangles) :] for m in (mesh, result.mesh))
    chosen = walls.nodes[quads].all(axis=1)
    assert len(near) == chosen.sum()
    assert last[chosen].min() > first[chosen].min() + 0.1


def test_the_airfoil_of_the_real_meshes(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    first = state_of(mesh)
    topology, kept, start = first.topology, first.protection.walls.nodes, first.start
    last = improve_near_walls(first, OPTIONS, serial)
    best, history = last.points, last.history
    assert last.released
    assert len(history) == len(PLAN)
    inside = kept[topology.memory]
    zone = with_rings(kept, topology, serial)[topology.memory]
    assert (best[~zone] == start[~zone]).all()
    ratio = doubles(best, topology.near) / doubles(start, topology.near)
    cells = inside[topology.near].all(axis=1)
    assert cells.sum() > 1600
    assert np.abs(ratio[cells] - 1.0).max() <= 0.1
    wall = np.isin(topology.memory, mesh.markers["airfoil"])
    of_rows = [heights(points, topology.near, wall) for points in (start, best)]
    assert len(of_rows[0]) > 190
    assert np.abs(of_rows[1] / of_rows[0] - 1.0).max() <= 0.02
    points = mesh.points.copy()
    points[np.ix_(topology.memory, mesh.plane)] = np.ldexp(best, mesh.exponent)
    near = kept[topology.triangles].all(axis=1)
    before, after = (gmsnet.quality(m).shape[near] for m in (mesh, mesh.with_points(points)))
    assert before.min() < 0.56
    assert after.min() > 0.64
    assert after.mean() > before.mean()
    assert len(improve_near_walls(first, replace(OPTIONS, max_sweeps=2), serial).history) == 2
    again = improve_near_walls(last, OPTIONS, serial)
    assert again.history[: len(history)] == history
    assert np.abs((doubles(again.points, topology.near) / doubles(start, topology.near))[cells] - 1.0).max() <= 0.1


def test_the_default_is_better_than_sizes_weighed_and_keeps_them_better(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    topology, kept = Topology.of(mesh), state_of(mesh).protection.walls.nodes
    cells = kept[topology.triangles].all(axis=1)
    before = doubles(mesh.points, topology.triangles)[cells]
    qhat, change = {}, {}
    for preserve in ("shape", "size"):
        result = gmsnet.smooth(mesh, preserve=preserve)
        qhat[preserve] = result.after.qhat
        change[preserve] = np.abs(doubles(result.points, topology.triangles)[cells] / before - 1.0).max()
    assert qhat["shape"] > qhat["size"] > 0.39
    assert change["shape"] <= 0.1 < change["size"]


def test_sweeps_go_on_elsewhere_where_the_worst_cell_is(monkeypatch):
    """Of quads: while nodes near the wall stood still, one of their cells was the worst."""
    mesh = recombine(plate(0.3))
    several = gmsnet.smooth(mesh)
    stages = [sweep.stage for sweep in several.history]
    assert stages.count(PHASE) == 2 * len(PLAN)
    assert stages[-1] == PHASE
    assert stages[-1 - len(PLAN)] != PHASE
    assert several.after.inverted == 0
    monkeypatch.setattr(wall_stage, "TURNS", 0)
    one = gmsnet.smooth(mesh)
    assert one.judged.after.shape_min + 0.01 < several.judged.after.shape_min
    wall = np.zeros(len(mesh.points), dtype=bool)
    wall[mesh.markers["hole"]] = True
    near = one.moved & (np.linalg.norm(mesh.points, axis=1) < 0.34) & ~wall
    assert near.any()


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_sweeps_that_end_early_elsewhere_keep_what_is_near_walls(share):
    mesh = recombine(plate(0.3))
    ends = [sweep.index for sweep in gmsnet.smooth(mesh).history if sweep.stage == PHASE]
    assert len(ends) == 2 * len(PLAN)
    once, twice = ends[len(PLAN) - 1], ends[-1]
    most = once + 1 + int(share * (twice - once - 2))  # from one sweep after the first turn to one before the end
    first, last = gmsnet.smooth(mesh, max_sweeps=once), gmsnet.smooth(mesh, max_sweeps=most)
    assert [sweep.stage for sweep in first.history].count(PHASE) == len(PLAN)
    assert last.sweeps <= most
    assert last.judged.after.shape_min >= first.judged.after.shape_min
    assert not any("refined near" in reason for reason in last.topology.held)


def test_where_no_sweep_is_left_for_them_nodes_near_walls_are_held():
    mesh = recombine(plate(0.3))
    whole = gmsnet.smooth(mesh)
    sweeps = next(k for k, sweep in enumerate(whole.history) if sweep.stage == PHASE)
    most = whole.history[sweeps - 1].index
    for allowed, held in ((most, True), (most + 1, False)):
        result = gmsnet.smooth(mesh, max_sweeps=allowed)
        assert ("refined near a wall" in result.held) == held
        assert result.sweeps == allowed
        assert result.history[-1].min_shape == pytest.approx(result.judged.after.shape_min) or not held


GRIDS = ((10, 50.0, 49, "triangle"), (9, 50.0, 46, "mixed"), (4, 1000.0, 45, "quad"))


@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
@pytest.mark.parametrize(("rows", "aspect", "around", "cells"), GRIDS)
def test_a_target_that_defaults_reach_near_walls_is_reached(rows, aspect, around, cells, share):
    mesh = layered_mesh(rows, aspect, around, cells=cells, body="airfoil")
    free = gmsnet.smooth(mesh).judged
    target = free.before.shape_min + share * (free.after.shape_min - free.before.shape_min)
    result = gmsnet.smooth(mesh, target_quality=target)
    assert result.judged.after.shape_min >= target
    released = "refined near a wall" not in result.held
    assert released == (PHASE in [sweep.stage for sweep in result.history])
    assert released == (share > 0.9 or cells == "quad" or (cells, share) == ("triangle", 0.5))


def test_nodes_near_walls_stand_still_for_a_target_that_their_cells_reach():
    mesh = plate(0.3)
    held = first_state(mesh, None, OPTIONS.smoother(), OPTIONS, serial).protection.walls.nodes
    least = gmsnet.quality(mesh).shape[held[Topology.of(mesh).triangles].any(axis=1)].min()
    result = gmsnet.smooth(mesh, target_quality=0.9 * least)
    assert "refined near a wall" in result.held
    assert not result.moved[held].any()


def test_nodes_near_walls_go_back_where_that_is_no_closer_to_the_target(monkeypatch):
    mesh = layered_mesh(4, 1000.0, 45, cells="quad", body="airfoil")
    held = first_state(mesh, None, OPTIONS.smoother(), OPTIONS, serial).protection.walls.nodes
    closer = gmsnet.smooth(mesh, target_quality=0.76)
    assert closer.moved[held].any()
    monkeypatch.setattr(wall_stage, "closer_one", lambda state, other, *_: other)
    kept = gmsnet.smooth(mesh, target_quality=0.76)
    assert not kept.moved[held].any()
    assert "refined near a wall" in kept.held


@pytest.mark.parametrize("radius", [0.15, 0.5])
def test_worse_input_makes_no_better_mesh(radius):
    """Of a plate with a fine hole, thrown about more and more: protection goes by degrees."""
    made = plate(radius)
    free, found = Topology.of(made).free, []
    for amount in (0.0, 0.08, 0.16, 0.24, 0.32):
        mesh = disturb(made, free, amount, seed=0) if amount else made
        found.append(gmsnet.smooth(mesh).after.qhat)
    rises = np.diff(found)
    assert rises.max() < 0.01
    assert rises.min() > -0.02


@pytest.mark.parametrize("stop_reason", [stop.CALLBACK, stop.MAX_SWEEPS])
def test_it_is_left_out_where_the_sweeps_did_not_end_of_themselves(real_meshes, stop_reason):
    first = replace(state_of(gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")), stop_reason=stop_reason)
    assert improve_near_walls(first, OPTIONS, serial) is first


def test_nothing_to_move():
    first = state_of(gmsnet.random_mesh(100, seed=0))
    assert first.protection.walls is None
    assert improve_near_walls(first, OPTIONS, serial) is first
    count = len(first.start)
    nobody = replace(first.protection, walls=Kept.nothing(count))
    last = improve_near_walls(replace(first, protection=nobody), OPTIONS, serial)
    assert last.points.tobytes() == first.start.tobytes()
    assert last.stop_reason == stop.NOTHING_TO_MOVE
    assert last.history == ()


def test_the_airfoil_with_nodes_that_slide(real_meshes):
    """They are near their wall as those that are held would be, and their cells keep their areas, too."""
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    result = gmsnet.smooth(mesh, slide=True)
    first = first_state(mesh, None, OPTIONS.smoother(), replace(OPTIONS, slide=True), serial)
    kept, wall = first.protection.walls.nodes, mesh.markers["airfoil"]
    assert kept[wall].sum() > 0.9 * len(wall)
    assert result.moved[wall].sum() > 0.9 * len(wall)
    triangles = first.topology.triangles
    cells = kept[triangles].all(axis=1)
    assert cells.sum() > 1600
    ratio = doubles(result.points[:, :2], triangles) / doubles(mesh.points[:, :2], triangles)
    assert np.abs(ratio[cells] - 1.0).max() <= 0.1
    on_wall = np.isin(np.arange(len(mesh.points)), wall)
    before, after = (heights(points[:, :2], triangles, on_wall) for points in (mesh.points, result.points))
    assert np.abs(after / before - 1.0).max() <= 0.02
