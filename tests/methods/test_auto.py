"""The stages of the default method, and what the whole is measured against."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import gmsnet
from gmsnet.methods.auto import VARIANTS, Auto
from gmsnet.run import Run
from gmsnet.topology import Topology


def runs(mesh, stages, guard="worst"):
    run = Run(mesh, Topology.of(mesh), Auto(stages), 1, "shape", guard)
    run.to_the_end(200, None, None)
    return run


def test_stages_come_in_their_order_and_are_told():
    run = runs(gmsnet.random_mesh(2000, seed=1), VARIANTS["full"])
    names = [sweep.stage for sweep in run.history]
    assert list(dict.fromkeys(names)) == ["smart Laplacian, Newton on q²", "Newton on q²", "worst first", "Newton on q"]
    assert [sweep.index for sweep in run.history] == sorted({sweep.index for sweep in run.history})
    assert run.history[0].index == 4
    assert runs(gmsnet.random_mesh(500, seed=1), VARIANTS["patch"]).history[0].stage == "Newton on q²"


def test_each_stage_is_worth_something():
    """Leaving a stage out gives a worse mesh, as a mean over squares."""
    found = {}
    full = VARIANTS["full"]
    for left_out in (None, "Newton on q²", "worst first", "Newton on q"):
        stages = [stage for stage in full if stage.name != left_out]
        found[left_out] = np.mean([runs(gmsnet.random_mesh(1000, seed=s), stages).best_standing.qhat for s in range(4)])
    assert found[None] > found["worst first"] + 0.005
    assert found[None] > found["Newton on q²"]
    assert found[None] > found["Newton on q"]


def test_the_default_is_better_than_every_other_method_in_the_worst_cell():
    mesh = gmsnet.random_mesh(1000, seed=3)
    best = gmsnet.smooth(mesh)
    for method in ("gmsnet", "laplacian", "angle", "cpt", "optimize", "barrier", "gmsnet2", "nn"):
        other = gmsnet.smooth(mesh, method, max_sweeps=40)
        assert best.after.shape.min() > other.after.shape.min()
        assert best.after.qhat > other.after.qhat


def test_a_slow_change_of_the_whole_mesh_takes_many_newton_sweeps_but_not_all():
    """All free nodes pressed to one side: sweeps go on, and leave time for the worst cells."""
    mesh = gmsnet.smooth(gmsnet.random_mesh(2000, seed=5)).mesh
    free, points = Topology.of(mesh).free, mesh.points.copy()
    points[free, 0] **= 3
    pressed = mesh.with_points(points)
    result = gmsnet.smooth(pressed, preserve="none")
    assert result.before.inverted > 0
    assert result.after.inverted == 0
    newton = [sweep for sweep in result.history if sweep.stage == "Newton on q²"]
    assert len(newton) == VARIANTS["full"][1].rounds
    assert all(b.mean_shape > a.mean_shape for a, b in pairwise(newton))
    assert newton[-1].mean_shape > newton[0].mean_shape + 0.2
    assert result.history[-1].stage == "Newton on q"
    assert result.history[-1].min_shape > newton[-1].min_shape


@pytest.mark.parametrize("seed", range(3))
def test_it_is_near_what_many_more_sweeps_reach(seed):
    mesh = gmsnet.random_mesh(800, seed=seed)
    quick = gmsnet.smooth(mesh)
    slow = gmsnet.smooth(gmsnet.smooth(gmsnet.smooth(mesh, "barrier", objective="q4").mesh, "worst-first").mesh)
    assert quick.after.qhat > slow.after.qhat - 0.005
