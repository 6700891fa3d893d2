"""All nodes at once: meshes that are deformed as a whole come to their optimum, and the guard allows what is taken."""

from __future__ import annotations

import numpy as np
import pytest
from support import quads as naive

import gmsnet
from gmsnet.generate import (
    disturb,
    hybrid_mesh,
    kershaw_mesh,
    moved_hole_mesh,
    random_quad_mesh,
    sheared_mesh,
    structured_mesh,
    swirled_mesh,
    zigzag_mesh,
)
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import VALID, WORST, Precision
from gmsnet.kernels.whole.powers import shapes
from gmsnet.methods import Field
from gmsnet.methods.auto import EXACT, WHOLE, WHOLE_WORST
from gmsnet.methods.creep import Creep
from gmsnet.methods.phases import SMALL
from gmsnet.methods.whole_mesh import TRADE, Problem, WholeMesh
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

HALVES = 3**0.5 / 2  # 1/q of the halves of a square
DEFORMED = {
    "sheared": lambda: sheared_mesh(40, amplitude=0.9, waves=2),
    "swirled": lambda: swirled_mesh(40),
    "zigzag": lambda: zigzag_mesh(30),
}
QUADS = {
    "sheared quads": lambda: sheared_mesh(40, amplitude=0.9, waves=2, cells="quad"),
    "swirled quads": lambda: swirled_mesh(40, cells="quad"),
    "zigzag quads": lambda: zigzag_mesh(30, cells="quad"),
}


def field_of(mesh, level=WORST):
    topology = Topology.of(mesh)
    return Field(planar_points(mesh)[topology.memory], topology, precision_of(mesh), level)


@pytest.mark.parametrize("name", [*DEFORMED, *QUADS])
def test_a_grid_that_was_deformed_is_even_again(name):
    mesh = {**DEFORMED, **QUADS}[name]()
    result = gmsnet.smooth(mesh, preserve="none")
    assert any(WHOLE in sweep.stage for sweep in result.history)
    best = HALVES if name in DEFORMED else 1.0
    assert result.after.shape.min() > best - 0.005
    assert not result.after.inverted


@pytest.mark.parametrize("level", [VALID, WORST])
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("name", ["sheared", "swirled quads", "mixed"])
def test_what_is_taken_keeps_the_guard(name, single, level):
    makers = {**DEFORMED, **QUADS, "mixed": lambda: disturb(m := hybrid_mesh(600, seed=1), Topology.of(m).free, 0.3)}
    mesh = makers[name]()
    points = np.float64(np.float32(mesh.points)) if single else mesh.points
    mesh = gmsnet.Mesh(points, mesh.cells, single=single)
    field = field_of(mesh, level)
    before = field.points.copy()
    tally = WholeMesh().sweep(field, serial, lambda: False)
    assert tally[MOVED] > 0
    held = ~field.topology.near_free
    assert field.points[held].tobytes() == before[held].tobytes()
    after = np.empty_like(field.points)
    after[field.topology.memory] = np.ldexp(field.points, mesh.exponent)
    moved = mesh.with_points(after)
    if single:
        assert (np.float64(np.float32(after)) == after).all()
    was, now = naive.figures(mesh), naive.figures(moved)
    assert now["invalid"] == 0
    assert now["mean"] > was["mean"]
    if level == WORST:
        assert now["min"] >= was["min"]


def test_cells_that_are_inverted_stay_as_they_are():
    mesh = sheared_mesh(20, amplitude=0.5)
    topology = Topology.of(mesh)
    points = mesh.points.copy()
    points[topology.free[150]] += 0.3
    field = field_of(mesh.with_points(points))
    before = field.points.copy()
    tally = WholeMesh().sweep(field, serial, lambda: False)
    assert tally[MOVED] > 0
    bad = gmsnet.quality(mesh.with_points(points)).sign < 0
    nodes = np.isin(field.topology.memory, mesh.cells[0].nodes[bad])
    assert bad.any()
    assert field.points[nodes].tobytes() == before[nodes].tobytes()


def test_nothing_is_moved_where_nothing_can_be():
    mesh = sheared_mesh(2)
    field = field_of(mesh)
    field.topology = field.topology.holding(np.ones(len(mesh.points), dtype=bool), "test")
    assert WholeMesh().sweep(field, serial, lambda: False)[MOVED] == 0


def test_the_best_is_left_as_it_is():
    field = field_of(sheared_mesh(20, amplitude=0.0))
    before = field.points.copy()
    WholeMesh().sweep(field, serial, lambda: False)
    assert np.abs(field.points - before).max() < 1e-6


def test_nodes_that_slide_wait():
    mesh = swirled_mesh(24)
    points = mesh.points.copy()
    side = np.flatnonzero((points[:, 1] == 0.0) & (points[:, 0] > 0.0) & (points[:, 0] < 1.0))
    points[side, 0] **= 1.2
    result = gmsnet.smooth(mesh.with_points(points), slide=True, preserve="none")
    assert any(WHOLE in sweep.stage for sweep in result.history)
    assert not result.after.inverted
    assert (result.points[side, 1] == 0.0).all()
    assert result.after.shape.min() > HALVES - 0.02


@pytest.mark.parametrize("seed", range(3))
def test_random_meshes_do_not_creep(seed):
    for mesh in (gmsnet.random_mesh(2000, seed=seed), gmsnet.random_mesh(8000, seed=seed)):
        assert not any(WHOLE in sweep.stage for sweep in gmsnet.smooth(mesh).history)


def test_random_quads_are_left_to_sweeps():
    for mesh in (random_quad_mesh(6000, seed=1), random_quad_mesh(6000, cells="mixed", seed=2)):
        result = gmsnet.smooth(mesh)
        assert len(result.topology.free) > SMALL
        assert not any(WHOLE in sweep.stage for sweep in result.history)
        assert result.after.shape.min() > 0.3


def test_nearly_ideal_quads_come_to_the_minimum():
    mesh = structured_mesh(80)
    free = Topology.of(mesh).free
    assert SMALL < len(free) <= EXACT
    held = np.isin(np.arange(len(mesh.points)), free)
    result = gmsnet.smooth(disturb(mesh, held, 0.4, seed=1, edge="shortest"))
    assert WHOLE in result.history[-1].stage
    assert "worst kept" not in " ".join(sweep.stage for sweep in result.history)
    assert 1.0 - result.after.shape.min() < 1e-8
    assert np.abs(result.points - mesh.points).max() < 1e-4 / 80


def test_coherent_shifts_are_creep_and_others_are_not():
    field, rng = field_of(sheared_mesh(60, amplitude=0.0)), np.random.default_rng(1)
    creep = Creep.of(field)

    def crept(shifts):
        creep.start(field.points)
        return creep.is_one(field.points + shifts)

    assert not creep.is_one(field.points)
    assert not crept(0.0)
    assert crept(0.002)
    assert not crept(1e-7)
    assert not crept(rng.normal(0.0, 0.002, field.points.shape))
    assert not creep.is_one(field.points + 0.002)  # no sweep has begun
    assert Creep.of(field_of(gmsnet.random_mesh(100, seed=1))) is None


def test_harmonic_places_are_made_more_exact_only_where_cells_are_inverted(monkeypatch):
    """Of a mesh at its optimum they are worse, and would be as exact ones."""
    mesh = gmsnet.smooth(gmsnet.random_mesh(300, seed=1)).mesh
    field, exact, tried = field_of(mesh), Problem.harmonic, []
    problem, points = Problem.of(field), field.points
    monkeypatch.setattr(Problem, "harmonic", lambda self, at: (tried.append(each) or each for each in exact(self, at)))
    assert problem.start(points) is points
    assert len(tried) == 1
    assert problem.value(tried[0], np.empty_like(points)) < np.inf


def test_harmonic_places_with_inverted_cells_are_made_more_exact(monkeypatch):
    """Of a grid folded 200 times a first guess has inverted cells; sweeps alone leave a q̂ of -0.6."""
    exact, tried = Problem.harmonic, []
    monkeypatch.setattr(Problem, "harmonic", lambda self, at: (tried.append(each) or each for each in exact(self, at)))
    result = gmsnet.smooth(zigzag_mesh(200))
    assert len(tried) == 2
    assert result.after.qhat > 0.36


def test_the_level_star_does_without():
    mesh = sheared_mesh(40, amplitude=0.9)
    assert not any(WHOLE in sweep.stage for sweep in gmsnet.smooth(mesh, guard="star", preserve="none").history)


LIKE_CELLS = {  # and the least 1/q of whole-mesh L-BFGS on q⁸
    "sheared": (lambda: sheared_mesh(49, 66, amplitude=0.836, waves=1.57), 0.728),
    "stretched": (lambda: stretched(40, 2.5), 0.596),
    "hole moved": (lambda: moved_hole_mesh(0.034, shift=1.34, turn=4.19), 0.66),
    "Kershaw": (lambda: kershaw_mesh(48), 0.508),
}


def stretched(columns, factor):
    mesh = sheared_mesh(columns, amplitude=0.0)
    mesh = disturb(mesh, Topology.of(mesh).free, 0.4, seed=1)
    return mesh.with_points(mesh.points * (factor, 1.0))


@pytest.mark.parametrize("name", LIKE_CELLS)
def test_the_worst_of_many_like_cells_have_a_turn_all_at_once(name):
    make, least = LIKE_CELLS[name]
    result = gmsnet.smooth(make(), preserve="none")
    assert any(WHOLE_WORST in sweep.stage for sweep in result.history)
    assert result.after.shape.min() > least - 0.005


@pytest.mark.parametrize("doublings", [2, 3])
def test_for_the_worst_cells_the_mean_pays_at_most_so_much(doublings):
    field = field_of(kershaw_mesh(24))
    simplices = Problem.of(field)
    least, mean = shapes(field.points, simplices.cells, simplices.table)
    assert WholeMesh((doublings,)).sweep(field, serial, lambda: False)[MOVED]
    now_least, now_mean = shapes(field.points, simplices.cells, simplices.table)
    assert now_least - least >= TRADE * (mean - now_mean)
    assert now_least > least


def test_one_call_ends_where_two_end():
    for mesh in (sheared_mesh(60, amplitude=0.7), moved_hole_mesh(0.04, shift=1.2)):
        once = gmsnet.smooth(mesh, preserve="none")
        twice = gmsnet.smooth(once.mesh, preserve="none")
        assert twice.after.shape.mean() < once.after.shape.mean() + 0.01
        assert twice.after.shape.min() < once.after.shape.min() + 0.03


def test_threads_change_no_bit():
    mesh = swirled_mesh(50)
    one, two = (gmsnet.smooth(mesh, preserve="none", threads=threads).points for threads in (1, 2))
    assert one.tobytes() == two.tobytes()


def test_precision_is_that_of_the_mesh():
    assert Precision() == precision_of(sheared_mesh(4))


def test_where_sweeps_end_in_folds_all_nodes_move():
    """A zigzag in which single nodes settle between folds: what a second call would bring, the first one does."""
    result = gmsnet.smooth(zigzag_mesh(51, 30, height=0.185))
    assert any("whole mesh" in sweep.stage for sweep in result.history)
    assert result.after.shape.min() > 0.75
    assert gmsnet.smooth(result.mesh).after.qhat < result.after.qhat + 0.001


def test_worst_cells_of_small_meshes_have_a_turn_even_where_they_are_good():
    """Around a hole that moved, cells of 0.77 can come to more than 0.8 together."""
    result = gmsnet.smooth(moved_hole_mesh(0.0183, shift=0.904, turn=1.82))
    assert any(sweep.stage == WHOLE_WORST for sweep in result.history)
    assert result.after.shape.min() > 0.8
    assert result.after.qhat > 0.37


@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_boundary_nodes_slide_with_all_others(cells):
    """A grid pressed to one side with its boundary, far more rows than sweeps can even out, is even again."""
    mesh = sheared_mesh(100, amplitude=0.0, cells=cells)
    points = mesh.points.copy()
    points[:, 0] **= 2
    result = gmsnet.smooth(mesh.with_points(points), slide=True, preserve="none")
    assert not result.after.inverted
    assert result.after.shape.mean() > gmsnet.quality(mesh).shape.mean() - 0.001
    for axis in range(2):
        for side in (0.0, 1.0):
            on = points[:, axis] == side
            assert (result.points[on, axis] == side).all()
    corners = [0, 100, 101 * 100, 101 * 101 - 1]
    assert (result.points[corners] == points[corners]).all()


def test_nodes_that_slide_move_with_all_others_where_these_alone_gain_nothing(monkeypatch):
    turns = []

    def record(name):
        of_turn = getattr(WholeMesh, name)

        def recorded(self, *others):
            turns.append(of_turn(self, *others))
            return turns[-1]

        monkeypatch.setattr(WholeMesh, name, recorded)

    record("_taken")
    record("_slid")
    result = gmsnet.smooth(random_quad_mesh(200, seed=9), slide=True, preserve="none")
    assert turns[:2] == [(True, False), True]
    assert result.after.shape.min() > 0.685  # 0.683 without
