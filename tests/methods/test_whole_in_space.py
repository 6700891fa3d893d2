"""All nodes of a volume at once: the sum and its slopes, what is taken, and what is given back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.hard_volumes import spiked

import gmsnet
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON, REGULAR, TETRAHEDRON, WEIGHTS3
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import WORST
from gmsnet.kernels.whole.powers3 import largest, powered
from gmsnet.methods import Field
from gmsnet.methods.auto import WHOLE_WORST
from gmsnet.methods.whole_in_space import WholeInSpace
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import near_points

KINDS = ("pyramid", "mixed")


def turns(result):
    return [sweep for sweep in result.history if WHOLE_WORST in sweep.stage]


def naive(spokes, shape):
    """η of a corner with the spokes (3, 3)."""
    double = np.linalg.det(spokes)
    if shape == HEXAHEDRON:
        return 3.0 * double ** (2.0 / 3.0) / (spokes**2).sum()
    edges = [*spokes, spokes[1] - spokes[0], spokes[2] - spokes[1], spokes[0] - spokes[2]]
    return 12.0 * (double / 2.0) ** (2.0 / 3.0) / sum(edge @ edge for edge in edges)


@pytest.mark.parametrize("shape", [TETRAHEDRON, HEXAHEDRON])
def test_the_sum_is_that_of_powers_of_mean_ratios(shape):
    rng = np.random.default_rng(shape)
    points = np.concatenate([np.zeros((1, 3)), np.eye(3) + 0.2 * rng.uniform(-1.0, 1.0, (3, 3))])
    rows, sign, shapes = (
        np.array([[0, 1, 2, 3]], dtype=np.int32),
        np.ones(1, dtype=np.int8),
        np.array([shape], np.uint8),
    )
    ratio = (REGULAR / naive(points[1:], shape)) ** 1.5
    assert largest(points, rows, sign, shapes) == pytest.approx(ratio, rel=1e-12)
    total = powered(points, rows, sign, shapes, 2.0 * ratio, 3, np.empty((4, 3)), np.empty(1))
    assert total == pytest.approx(0.5**8, rel=1e-11)


@pytest.mark.parametrize("shape", range(len(WEIGHTS3)))
@pytest.mark.parametrize("sign", [1, -1])
def test_slopes_are_differences_of_the_sum(shape, sign):
    rng = np.random.default_rng(shape)
    points = np.concatenate([np.zeros((1, 3)), np.eye(3), rng.uniform(0.0, 1.0, (1, 3)) + 1.0])
    points[1:4] += 0.2 * rng.uniform(-1.0, 1.0, (3, 3))
    rows = np.array([[0, 1, 2, 3]], dtype=np.int32) if sign > 0 else np.array([[0, 2, 1, 3]], dtype=np.int32)
    given = rows, np.array([sign], dtype=np.int8), np.array([shape], dtype=np.uint8), 5.0, 2

    def sum_at(points):
        return powered(points, *given, np.empty_like(points), np.empty(1))

    slopes = np.empty_like(points)
    powered(points, *given, slopes, np.empty(1))
    for node in range(5):
        for axis in range(3):
            step = np.zeros_like(points)
            step[node, axis] = 1e-6
            difference = (sum_at(points + step) - sum_at(points - step)) / 2e-6
            assert slopes[node, axis] == pytest.approx(difference, rel=1e-6, abs=1e-9 * abs(slopes).max())


@pytest.mark.parametrize("kind", KINDS)
def test_the_worst_cells_of_a_small_volume_gain_together(kind, monkeypatch):
    mesh = spiked(kind)
    result = gmsnet.smooth(mesh, preserve="none", threads=1)
    assert any(sweep.moved for sweep in turns(result))
    monkeypatch.setattr(WholeInSpace, "_taken", lambda self, field: False)
    without = gmsnet.smooth(mesh, preserve="none", threads=1)
    assert not any(sweep.moved for sweep in turns(without))
    gain = result.judged.after.shape_min - without.judged.after.shape_min
    assert gain > 0.02
    assert gain > 0.2 * (without.judged.after.shape_mean - result.judged.after.shape_mean)
    assert not result.after.inverted


@pytest.mark.parametrize("slide", [False, True])
def test_what_costs_too_much_of_the_mean_is_given_back(slide, monkeypatch):
    mesh = spiked("pyramid")
    monkeypatch.setattr("gmsnet.methods.trial.TRADE", 50.0)
    dear = gmsnet.smooth(mesh, slide=slide, preserve="none", threads=1)
    monkeypatch.setattr(WholeInSpace, "_taken", lambda self, field: False)
    without = gmsnet.smooth(mesh, slide=slide, preserve="none", threads=1)
    assert (dear.points == without.points).all()
    assert dear.sweeps > without.sweeps


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_change_no_bit(threads):
    one, more = (gmsnet.smooth(spiked("mixed"), preserve="none", threads=count) for count in (1, threads))
    assert (one.points == more.points).all()


def test_nodes_that_slide_stay_on_their_surface():
    mesh = spiked("pyramid")
    result = gmsnet.smooth(mesh, slide=True, preserve="none", threads=1)
    assert not result.after.inverted
    for axis, side in ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0), (2, 0.0)):
        on = mesh.points[:, axis] == side
        assert (result.points[on, axis] == side).all()


def test_the_precision_is_that_of_the_file():
    mesh = spiked("mixed")
    single = replace(mesh, points=mesh.points.astype(np.float32).astype(np.float64), single=True)
    result = gmsnet.smooth(single, preserve="none", threads=1)
    assert any(sweep.moved for sweep in turns(result))
    assert (result.points == result.points.astype(np.float32)).all()
    assert not result.after.inverted


def test_the_room_of_nodes_that_have_moved_at_once_is_not_taken_for_known():
    """Slack tells how far nodes may go from where they were until cells are looked at between their corners."""
    mesh = gmsnet.smooth(spiked("mixed"), "barrier", preserve="none", threads=1).mesh
    topology = volume_of(wound_of(mesh))
    field = Field(near_points(mesh, topology), topology, precision_of(mesh), WORST)
    topology.lend_slack(field)
    topology.slack[:] = 1.0
    tally = WholeInSpace((3, 2)).sweep(field, serial, lambda: True)
    assert tally[MOVED]
    topology.lend_slack(field)
    assert not topology.slack.any()
