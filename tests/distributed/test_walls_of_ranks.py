"""Cells near walls that a mesh is refined towards keep their areas over ranks, with the bits of the serial run."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import Curve, disturb, good_mesh, layered_mesh, recombine

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.layer_meshes import blunt
from support.ranks import parts_at_random, same

from gmsnet.distributed.on_first import LOOKED_AT
from gmsnet.methods.banded import PLAN
from gmsnet.preserve.protection import LAYER
from gmsnet.run.options import SmoothOptions
from gmsnet.run.wall_stage import PHASE
from gmsnet.topology.topology import Topology

WALL = "refined near a wall"


@cache
def plate(amount, corners=150, half=1.2):
    """With a hole that it is refined towards, its free nodes thrown. half: of the side of the square."""
    turn = np.linspace(0.0, 2.0 * np.pi, corners)
    hole = Curve(0.3 * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    side = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    found = good_mesh([[Curve(side, "side")], [hole]], lambda x: 0.01 + 0.25 * np.abs(np.linalg.norm(x, axis=1) - 0.3))
    return disturb(found, Topology.of(found).free, amount, seed=0) if amount else found


@pytest.mark.parametrize("how", ["interleaved", "strips", "lonely"])
@pytest.mark.parametrize("amount", [0.0, 0.2])
def test_the_stage_near_walls_is_shared_out(amount, how):
    mesh = plate(amount)
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 3, np.random.default_rng(1), how), 3)
    assert told.gathered == ""
    assert PHASE in [sweep.stage for sweep in told.history]
    assert WALL not in told.held
    assert LOOKED_AT in told.notes


@pytest.mark.parametrize("how", ["interleaved", "strips"])
def test_turns_are_shared_out(how):
    """Quads, of which the worst one is not near the wall."""
    mesh = recombine(plate(0.0, 200, 1.6))
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 3, np.random.default_rng(5), how), 3)
    assert told.gathered == ""
    assert [sweep.stage for sweep in told.history].count(PHASE) == 3 * len(PLAN)
    assert WALL not in told.held


@pytest.mark.parametrize("share", [0.02, 0.95])
@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_targets_near_walls_are_reached_alike(cells, share):
    mesh = layered_mesh(10, 50.0, 49, cells=cells, body="airfoil")
    free = gmsnet.smooth(mesh, threads=1).judged
    target = free.before.shape_min + share * (free.after.shape_min - free.before.shape_min)
    options = SmoothOptions(threads=1, target_quality=target)
    told = same(mesh, options, parts_at_random(mesh, 3, np.random.default_rng(7), "strips"), 3)
    assert told.gathered == ""
    assert told.judged.after.shape_min >= target
    assert (WALL not in told.held) == (PHASE in [sweep.stage for sweep in told.history])


def test_the_nodes_stay_where_the_sweeps_did_not_end_of_themselves():
    mesh, options = plate(0.2), SmoothOptions(method="barrier", max_sweeps=2, threads=1)
    told = same(mesh, options, parts_at_random(mesh, 2, np.random.default_rng(2), "strips"), 2)
    assert told.gathered == ""
    assert told.held[WALL] > 100


def test_bands_are_those_of_the_mended_mesh():
    mesh = plate(0.1)
    points = mesh.points.copy()
    away = np.flatnonzero(abs(np.linalg.norm(points - 0.7, axis=1)) < 0.2)
    points[away[:2]] += 0.3
    mesh = replace(mesh, points=points)
    assert gmsnet.quality(mesh).inverted
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 3, np.random.default_rng(3), "strips"), 3)
    assert told.gathered == ""
    assert PHASE in [sweep.stage for sweep in told.history]


def test_the_airfoil_of_the_real_meshes(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 3, np.random.default_rng(4), "strips"), 3)
    assert told.gathered == ""
    assert any("refined towards its walls" in note for note in told.notes)


def test_gaps_in_the_rows_of_layers_are_held():
    mesh, node = blunt()
    given = disturb(mesh, node[26:-1].ravel(), 0.5, seed=1, edge="shortest")
    told = same(given, SmoothOptions(threads=1), parts_at_random(given, 3, np.random.default_rng(4), "strips"), 3)
    assert told.gathered == ""
    held = gmsnet.smooth(given).held[LAYER]
    assert np.isin(node[12:20, :5], held).all()
    assert told.held[LAYER] == len(held)


def test_ranks_say_that_a_feature_angle_without_sliding_has_no_effect():
    mesh, options = plate(0.0), SmoothOptions(threads=1, feature_angle=20.0, max_sweeps=1)
    told = same(mesh, options, parts_at_random(mesh, 2, np.random.default_rng(6), "strips"), 2)
    assert any(note.startswith("feature angle: it has no effect") for note in told.notes)
