"""Corners of second-order cells that curved cells have stopped go on once these have room."""

from __future__ import annotations

import numpy as np
import pytest
from support import curved_meshes, rings

import gmsnet
from gmsnet.generate import block_volume, disturb, lattice_volume
from gmsnet.generate.curved_volumes import second_order_volume
from gmsnet.run import second_order, second_order_turns, stop
from gmsnet.run.second_order import AS_FAR


def thrown(volume, amount, seed):
    """Second-order cells of a cube in which all nodes within are thrown, middles by themselves."""
    mesh = second_order_volume(volume, seed=seed)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    within = ((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9)).all(axis=1)
    return disturb(mesh, np.flatnonzero(within), amount, seed=seed)


# Of most of them a second call made the least larger by .03 to .3 after a call of one turn.
MESHES = {
    **{f"plane {seed}": (lambda seed=seed: curved_meshes.thrown(seed)) for seed in (0, 1, 16, 27)},
    **{f"tetra10 {seed}": (lambda seed=seed: thrown(lattice_volume(4), 0.3, seed)) for seed in range(4)},
    "hexahedron27": lambda: thrown(block_volume(3), 0.6, 1),
}
ROOMY = ((lambda: lattice_volume(4), 0.3, 7, 0.78), (lambda: block_volume(3, "wedge"), 0.4, 0, 0.89))


def least_of_two_calls(mesh):
    first = gmsnet.smooth(mesh)
    second = gmsnet.smooth(first.mesh)
    assert first.invalid_curved == second.invalid_curved == 0
    return first.judged.after.shape_min, second.judged.after.shape_min


@pytest.mark.parametrize("name", MESHES)
def test_a_second_call_gains_little(name):
    first, second = least_of_two_calls(MESHES[name]())
    assert second < first + 0.012


@pytest.mark.parametrize("name", ["plane 16", "tetra10 1", "hexahedron27"])
def test_turns_are_what_makes_it_so(name, monkeypatch):
    several, _ = least_of_two_calls(MESHES[name]())
    monkeypatch.setattr(second_order_turns, "TURNS", 1)
    one, second = least_of_two_calls(MESHES[name]())
    assert second > one + 0.05
    assert several >= second


@pytest.mark.parametrize(("volume", "amount", "seed", "least"), ROOMY)
def test_corners_use_the_room_that_the_first_turn_has_made(volume, amount, seed, least):
    """Cells that were to keep all of it stopped corners at .70 and .76."""
    result = gmsnet.smooth(thrown(volume(), amount, seed))
    assert result.after.shape.min() > least


@pytest.mark.parametrize(("volume", "amount", "seed", "least"), ROOMY)
def test_turns_go_on_where_straight_cells_alone_meet_the_target(volume, amount, seed, least):
    result = gmsnet.smooth(thrown(volume(), amount, seed), target_quality=least)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= least
    assert result.invalid_curved == 0


@pytest.mark.parametrize(
    ("volume", "amount", "seed", "share"),
    [
        (lattice_volume(2), 0.8, 8, 0.999),
        (block_volume(2, "wedge"), 1.2, 0, 0.9),
        (block_volume(2, "hexahedron"), 1.2, 2, 0.999),
        (block_volume(2, "wedge"), 1.2, 4, 0.999),
    ],
)
def test_a_target_below_what_a_run_without_one_reaches_is_met(volume, amount, seed, share):
    """Sweeps around the cells that miss it end where curved cells are in their way."""
    mesh = thrown(volume, amount, seed)
    full = gmsnet.smooth(mesh).judged.after.shape_min
    result = gmsnet.smooth(mesh, target_quality=share * full)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= share * full
    assert result.invalid_curved == 0
    assert [look.index for look in result.history] == sorted(look.index for look in result.history)


def test_where_corners_are_stopped_is_a_stage_of_its_own():
    """The sweeps before it tell of the straight cells that the method saw."""
    history = gmsnet.smooth(MESHES["tetra10 1"]()).history
    at = [k for k, look in enumerate(history) if look.stage == AS_FAR]
    assert at
    for k in at:
        assert history[k].index == history[k - 1].index
        assert history[k].min_shape < history[k - 1].min_shape


@pytest.mark.parametrize("look", [2, 4, 8])
def test_a_callback_that_stops_is_obeyed_in_every_turn(look):
    mesh, looks = MESHES["plane 16"](), []
    result = gmsnet.smooth(mesh, callback=lambda sweep: bool(looks.append(sweep)) or len(looks) == look)
    assert len(looks) == look
    assert result.stop_reason == stop.CALLBACK
    assert result.invalid_curved == 0


def test_the_last_look_is_at_the_cells_as_they_are():
    mesh = MESHES["tetra10 1"]()
    result = gmsnet.smooth(mesh, max_sweeps=6)
    assert result.history[-1].min_shape == result.judged.after.shape_min


def test_a_turn_that_makes_the_mesh_worse_is_taken_back(monkeypatch):
    """The second turn is one that throws the nodes."""
    mesh, calls = MESHES["plane 16"](), []

    def spoiling(state, options, executor):
        calls.append(state)
        return second_order_turns.smooth_corners(state, options, executor) if len(calls) == 1 else calls[0]

    monkeypatch.setattr(second_order_turns, "TURN", (spoiling, *second_order_turns.TURN[1:]))
    result = gmsnet.smooth(mesh)
    assert len(calls) == 2
    monkeypatch.setattr(second_order_turns, "TURNS", 1)
    calls.clear()
    assert (gmsnet.smooth(mesh).points == result.points).all()


@pytest.mark.parametrize("patch", [1, 2, 3])
def test_an_interruption_leaves_the_patches_that_are_mended(patch, monkeypatch):
    """The first one mends all cells but one."""
    from gmsnet.untangle import curved
    from gmsnet.untangle.curved_patch import CurvedPatch

    mesh, search, begun = curved_meshes.thrown(12), CurvedPatch.untangle, []

    def interrupted(self, *arguments):
        begun.append(self)
        if len(begun) == patch:
            raise KeyboardInterrupt
        return search(self, *arguments)

    monkeypatch.setattr(curved, "_untangle_straight", lambda *_: None)
    monkeypatch.setattr(CurvedPatch, "untangle", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(mesh)
    result = caught.value.result
    assert result.stop_reason == "interrupted"
    assert result.invalid_curved == (60 if patch == 1 else 1)
    assert result.moved.any() == (patch > 1)
    told = [
        note for note in result.notes if note.startswith("second order: 60 invalid cells before, 1 invalid cell after")
    ]
    assert len(told) == (patch > 1)


@pytest.mark.parametrize("look", [3, 8])
def test_an_interruption_leaves_the_best_state_of_a_patch(look, monkeypatch):
    from gmsnet.untangle import curved
    from gmsnet.untangle.curved_patch import CurvedPatch

    mesh, judge, looks = curved_meshes.thrown(12), CurvedPatch.judge, []

    def interrupted(self):
        if len(looks) == look:
            raise KeyboardInterrupt
        looks.append(judge(self) or self.fewest)
        return looks[-1] is True

    monkeypatch.setattr(curved, "_untangle_straight", lambda *_: None)
    monkeypatch.setattr(CurvedPatch, "judge", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(mesh)
    assert caught.value.result.invalid_curved == min(looks)


@pytest.mark.parametrize("amount", [0.3, 0.6])
def test_held_middles_of_volumes_that_are_wrong_cost_only_cells_around_them(amount):
    """At 0.6 straight cells are inverted, too."""
    mesh, rng = thrown(lattice_volume(4), amount, 1), np.random.default_rng(1)
    block, low, high = mesh.cells[0], mesh.points.min(axis=0), mesh.points.max(axis=0)
    within = np.flatnonzero(((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9)).all(axis=1))
    wrong = rng.choice(np.setdiff1d(within, block.nodes[:, :4]), 4, replace=False)
    points = mesh.points.copy()
    points[wrong] += 0.3 * (high - low)[0] * rng.normal(size=(4, 3))
    result = gmsnet.smooth(mesh.with_points(points), fixed=wrong.tolist())
    assert result.before.inverted > 80
    assert result.after.inverted <= 5 < np.isin(block.nodes, wrong).any(axis=1).sum() < 20
    np.testing.assert_array_equal(result.mesh.points[wrong], points[wrong])


@pytest.mark.parametrize("seed", [21, 119])
@pytest.mark.parametrize("share", [0.5, 0.98])
def test_room_costs_no_quality_where_a_target_is_met(seed, share):
    """The input is valid, and has no cell below the target: so it is no worse afterwards."""
    mesh = curved_meshes.known_valid(seed)
    target = share * float(gmsnet.quality(mesh).shape.min())
    result = gmsnet.smooth(mesh, target_quality=target)
    assert result.stop_reason == "target reached"
    assert result.judged.after.shape_min >= result.judged.before.shape_min
    assert result.judged.after.shape_mean >= result.judged.before.shape_mean


@pytest.mark.parametrize(("around", "layers", "outer", "seed"), [(3, 3, 1.05, 1), (5, 5, 1.15, 1)])
def test_cells_that_are_left_are_tried_again_when_corners_have_moved(around, layers, outer, seed, monkeypatch):
    mesh = rings.thrown(around, layers, outer, 1.0, seed)
    assert gmsnet.smooth(mesh, threads=1).invalid_curved == 0
    monkeypatch.setattr(second_order_turns, "TURN", second_order_turns.TURN[:-1])
    assert gmsnet.smooth(mesh, threads=1).invalid_curved > 0


def test_what_was_tried_again_in_vain_is_not_tried_once_more(monkeypatch):
    tried = []

    def mended(*given, old=second_order._mended):
        tried.append(given[0].second_order.invalid[1])
        return old(*given)

    monkeypatch.setattr(second_order, "_mended", mended)
    result = gmsnet.smooth(rings.thrown(5, 5, 1.15, 0.6, 1), threads=1)
    assert tried[-1] == result.invalid_curved > 0
    assert len(tried) == len(set(tried))
