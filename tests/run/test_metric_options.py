"""What contradicts a metric is refused; what is said of one, and where it does not fit the mesh."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, layered_mesh, random_mesh, second_order, structured_mesh
from gmsnet.preserve.protection import LAYER
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.topology import Topology


def unit(points):
    return np.broadcast_to([1.0, 0.0, 1.0], (len(points), 3))


@pytest.mark.parametrize("given", [{"metric": unit}, {"size": [1.0]}, {"preserve": "metric"}])
@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"method": "barrier"}, "has a method of its own: leave out the method 'barrier'"),
        ({"target_quality": 0.3}, "a target and .* contradict each other"),
        ({"target_angle": 20}, "a target and .* contradict each other"),
        ({"guard": "star"}, "the guard 'star' cannot be had with"),
        ({"best_by": "aspect"}, "leave out best_by"),
    ],
)
def test_what_contradicts_a_metric_is_refused(given, more, message):
    with pytest.raises(InputError, match=message):
        SmoothOptions(**given, **more)


@pytest.mark.parametrize("name", ["metric", "size"])
@pytest.mark.parametrize("preserve", ["metric", "size"])
def test_a_metric_that_is_given_is_all_that_is_preserved(name, preserve):
    with pytest.raises(InputError, match=f"{name} and preserve='{preserve}' contradict each other"):
        SmoothOptions(**{name: unit}, preserve=preserve)
    SmoothOptions(**{name: unit}, preserve="none")


def test_metric_and_size_are_one_thing():
    with pytest.raises(InputError, match="metric and size contradict each other"):
        SmoothOptions(metric=unit, size=unit)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"metric": np.ones(9)}, r"it has the shape \(9,\)"),
        ({"size": np.ones(3)}, r"for 81 nodes it has the shape \(3,\)"),
        ({"size": lambda p: np.ones(3)}, r"points it has the shape \(3,\)"),
        ({"metric": lambda p: -np.ones((len(p), 3))}, "the metric at point 0"),
    ],
)
def test_values_that_do_not_fit_the_mesh_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        gmsnet.smooth(structured_mesh(8, 8), **given)


def test_values_at_nodes_have_no_meaning_between_inverted_cells():
    mesh = random_mesh(100, seed=1)
    tangled = disturb(mesh, Topology.of(mesh).free, 3.0, keep_valid=False)
    with pytest.raises(InputError, match=r"size is given at the nodes of a mesh with .* inverted cells"):
        gmsnet.smooth(tangled, size=np.ones(len(mesh.points)))
    assert not gmsnet.smooth(tangled, size=lambda p: np.ones(len(p))).after.inverted


def test_second_order_cells_are_refused():
    with pytest.raises(InputError, match="second-order cells"):
        gmsnet.smooth(second_order(random_mesh(50, seed=1)), preserve="metric")


def test_what_was_taken_for_meant_is_said():
    mesh = structured_mesh(8, 8)
    assert any("around 0 of 81 nodes" in note for note in gmsnet.smooth(mesh, preserve="metric").notes)
    thin = mesh.with_points(mesh.points * [3.0, 1.0])
    assert any("around 81 of 81 nodes" in note for note in gmsnet.smooth(thin, preserve="metric").notes)
    for h, words in ((1 / 8, "about as many"), (1 / 16, "too few"), (1 / 4, "too many")):
        notes = gmsnet.smooth(mesh, size=lambda p, h=h: np.full(len(p), h)).notes
        assert any(words in note for note in notes)
    assert gmsnet.smooth(mesh).conformity is None


def test_layers_are_kept_as_a_metric_and_held_by_fix_layers_alone():
    mesh = layered_mesh(6, 20.0, 60)
    free = gmsnet.smooth(mesh, preserve="metric")
    assert LAYER not in free.held
    assert not any("held for that" in note for note in free.notes)
    assert LAYER in gmsnet.smooth(mesh, preserve="metric", fix_layers=True).held


def test_a_mesh_without_free_nodes_or_without_cells_to_measure_is_left_as_it_is():
    triangle = (np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]))
    result = gmsnet.smooth(triangle, preserve="metric")
    assert result.stop_reason.startswith("nothing to move")
    assert result.conformity.after == result.conformity.before


def test_the_result_shows_how_the_mesh_conforms():
    text = repr(gmsnet.smooth(random_mesh(60, seed=1), preserve="metric"))
    assert "quality in the metric, least" in text
    assert "edges within 20 % of 1" in text


def test_an_interrupted_run_has_the_best_mesh_so_far():
    def stop(sweep):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(random_mesh(100, seed=1), preserve="metric", callback=stop)
    result = caught.value.result
    assert result.conformity.after.least >= result.conformity.before.least
    assert result.sweeps == 1
