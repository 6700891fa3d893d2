"""What a run ends with: the input's very bits but for what has moved, and the measures of just that."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.measure.report import measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.outcome import outcome, rank_by
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

BEST = rank_by("shape")


def case(size=1.0, axis=None):
    mesh = gmsnet.random_mesh(300, seed=5)
    points = mesh.points * size
    points[Topology.of(mesh).free[0]] = [5e-324, -0.0]  # no scaled coordinate can hold these
    mesh = Mesh(points if axis is None else np.insert(points, axis, 0.1, axis=1), mesh.cells)
    return mesh, Topology.of(mesh)


@pytest.mark.parametrize("axis", [None, 0, 1, 2])
@pytest.mark.parametrize("size", [1.0, 4e-310, 1e-200, 3e200, 1.7e308])
def test_nodes_that_do_not_move_keep_their_bits(size, axis):
    mesh, topology = case(size, axis)
    start = near_points(mesh, topology)
    best = start.copy()
    chosen = np.flatnonzero(topology.near_free)[5:50]
    best[chosen, 1] += 0.01
    points, moved, after, _ = outcome(mesh, topology, best, measure(mesh, topology), lambda report, totals: 0)
    ids = topology.memory[chosen]
    assert sorted(np.flatnonzero(moved)) == sorted(ids)
    assert points[~moved].tobytes() == mesh.points[~moved].tobytes()
    plane = list(mesh.plane)
    wanted = np.ldexp(best[chosen], mesh.exponent)
    assert points[np.ix_(ids, plane)].tobytes() == wanted.tobytes()
    if axis is not None:
        assert (points[:, axis] == 0.1).all()
    again = measure(mesh.with_points(points), topology)
    assert after.totals == again.totals
    np.testing.assert_array_equal(after.shape, again.shape)
    np.testing.assert_array_equal(after.sign, again.sign)


def test_what_is_not_better_is_not_taken():
    mesh, topology = case()
    before = measure(mesh, topology)
    start = near_points(mesh, topology)
    worse = start.copy()
    worse[topology.near_free] += 0.3 * np.random.default_rng(0).random((len(topology.free), 2))
    points, moved, after, _ = outcome(mesh, topology, worse, before, BEST, start)
    assert points is mesh.points
    assert not moved.any()
    assert after is before


def test_nothing_moved():
    mesh, topology = case()
    before = measure(mesh, topology)
    points, moved, after, _ = outcome(mesh, topology, near_points(mesh, topology), before, BEST)
    assert points is mesh.points
    assert not moved.any()
    assert after is before


def test_cells_whose_nodes_are_held_do_not_decide_which_mesh_is_the_better_one():
    """The worst cell is held, and what the others gain in the least is a loss in the mean."""
    mesh = gmsnet.smooth(gmsnet.random_mesh(600, seed=2)).mesh
    held = mesh.cells[0].nodes[np.random.default_rng(3).integers(len(mesh.cells[0].nodes))]
    points = mesh.points.copy()
    centre = points[held].mean(axis=0)
    points[held] = centre + (points[held] - centre) * (1.0, 0.25)
    result = gmsnet.smooth(mesh.with_points(points), fixed=held.tolist())
    before, after = result.judged
    assert result.moved.any()
    assert after.qhat > before.qhat
    assert after.shape_min > before.shape_min + 0.1
    assert result.after.shape.min() == result.before.shape.min() < before.shape_min
    assert sum(note.startswith("of the cells with a free node: 1/q, least ") for note in result.notes) == 1


def test_figures_of_the_cells_with_a_free_node_are_those_of_all_where_no_cell_is_held():
    mesh = gmsnet.random_mesh(50, seed=1)
    result = gmsnet.smooth(mesh)
    held = ~np.isin(mesh.cells[0].nodes, result.topology.free).any(axis=1)
    for judged, report in zip(result.judged, (result.before, result.after), strict=True):
        assert judged.shape_min == pytest.approx(report.shape[~held].min(), abs=1e-12)
        assert judged.shape_mean == pytest.approx(report.shape[~held].mean(), abs=1e-12)
    assert not any("free node:" in note for note in result.notes) or held.any()
