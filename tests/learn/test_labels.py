from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import random_mesh
from gmsnet.learn import labels
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.losses import doubled_areas, metric_loss
from gmsnet.learn.optimum import optimal_position
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology


@pytest.fixture(scope="module")
def mesh():
    return random_mesh(300, seed=1, size=5.0)


def loss(stars, place):
    return metric_loss(torch.as_tensor(stars.ring), torch.as_tensor(stars.degree), torch.as_tensor(place)).numpy()


def test_own_optimum_is_nearly_the_least_loss_of_each_star(mesh):
    stars = Stars.of_mesh(mesh)
    place = labels.own_optimum(stars)
    exact = optimal_position(torch.as_tensor(stars.ring), torch.as_tensor(stars.degree)).numpy()
    distance = np.abs(place - exact).max(axis=1)
    assert (distance < 0.01).mean() > 0.97  # the others lie in another valley
    excess = loss(stars, place) - loss(stars, exact)
    assert excess.min() > -1e-6
    assert excess.mean() < 1e-3
    assert (doubled_areas(torch.as_tensor(stars.ring), torch.as_tensor(stars.degree), torch.as_tensor(place)) > 0).all()


def test_own_optimum_of_a_star_does_not_hang_on_the_others(mesh):
    stars = Stars.of_mesh(mesh)
    some = [3, 50, 51, 200]
    few = Stars(stars.ring[some], stars.degree[some], stars.size[some])
    np.testing.assert_allclose(labels.own_optimum(few), labels.own_optimum(stars)[some], rtol=0, atol=1e-9)


def test_optimised_meshes_are_those_of_the_engine(mesh):
    states = labels.optimised(mesh, (0, 1, 3))
    assert np.array_equal(states[0].points, mesh.points)
    same = gmsnet.smooth(mesh, "optimize", variant="adam", objective="metric", max_sweeps=3, threads=1, guard="valid")
    assert same.sweeps == 3
    for sweeps, state in zip((1, 3), states[1:], strict=True):
        wanted = same.history[sweeps - 1]
        shape = gmsnet.quality(state).shape[np.isin(mesh.cells[0].nodes, same.topology.free).any(axis=1)]
        assert shape.mean() == pytest.approx(wanted.mean_shape, rel=1e-13)
        assert shape.min() == pytest.approx(wanted.min_shape, rel=1e-10)


def test_labels_of_a_mesh_are_where_its_nodes_lie_in_the_end(mesh):
    given = labels.labelled(mesh, "mesh")
    (end,) = labels.optimised(mesh, (labels.END,))
    free = Topology.of(mesh).free
    moved = given.place * given.stars.size[:, None]
    np.testing.assert_allclose(mesh.points[free] + moved, end.points[free], rtol=0, atol=1e-12)
    assert gmsnet.quality(end).shape.mean() > gmsnet.quality(mesh).shape.mean() + 0.15


def test_labels_of_stars_come_from_all_states(mesh):
    given = labels.labelled(mesh, "star")
    states = labels.optimised(mesh, labels.STATES)
    count = len(Topology.of(mesh).free)
    assert len(given.stars) == len(given.place) == count * len(labels.STATES)
    assert given.raw == count
    for k, state in enumerate(states):
        stars = Stars.of_mesh(state)
        part = slice(k * count, (k + 1) * count)
        assert np.array_equal(given.stars.ring[part, : stars.ring.shape[1]], stars.ring)
        np.testing.assert_allclose(given.place[part], labels.own_optimum(stars), rtol=0, atol=1e-9)
    before, after = loss(given.stars, np.zeros_like(given.place)), loss(given.stars, given.place)
    assert (after <= before + 1e-9).all()


def test_a_mesh_in_another_plane_has_the_same_labels(mesh):
    lifted = np.column_stack([np.full(len(mesh.points), 4.0), mesh.points])
    for kind in ("star", "mesh"):
        one, other = (labels.labelled(m, kind) for m in (mesh, Mesh(lifted, mesh.cells)))
        np.testing.assert_allclose(one.place, other.place, rtol=0, atol=1e-12)
