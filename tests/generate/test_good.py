from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import Curve, good_mesh
from gmsnet.generate.good import apart

TURN = np.linspace(0.0, 2.0 * np.pi, 721)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])


def ring(*corners):
    around = np.array([*corners, corners[0]], dtype=float)
    return [Curve(around[k : k + 2], f"side_{k}") for k in range(len(corners))]


def graded(points):
    return 0.06 + 0.15 * (np.linalg.norm(points, axis=1) - 0.3).clip(0.0)


DOMAINS = {
    "square": ([ring((0, 0), (1, 0), (1, 1), (0, 1))], 0.07, 0),
    "oblique": ([ring((0, 0), (3, 1), (2, 3), (1.5, 1.2), (-0.7, 1.7))], 0.15, 0),  # with an inward corner
    "graded ring": ([[Curve(CIRCLE, "far")], [Curve(0.3 * CIRCLE, "near")]], graded, 1),
}


def edges_of(mesh):
    return np.unique(np.sort(mesh.cells[0].nodes[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def inner(mesh):
    return np.setdiff1d(np.arange(len(mesh.points)), mesh.cells[1].nodes)


@pytest.fixture(scope="module", params=DOMAINS)
def domain(request):
    rings, size, holes = DOMAINS[request.param]
    return good_mesh(rings, size), size, holes


def test_the_domain_is_filled(domain):
    mesh, _, holes = domain
    triangles, lines = mesh.cells
    report = gmsnet.quality(mesh)
    assert report.inverted == 0
    assert len(mesh.points) - len(edges_of(mesh)) + len(triangles.nodes) == 1 - holes
    (ax, ay), (bx, by), (cx, cy) = (mesh.points[triangles.nodes[:, k]].T for k in range(3))
    area = 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    assert (area > 0).all()
    a, b = mesh.points[lines.nodes[:, 0]], mesh.points[lines.nodes[:, 1]]
    assert area.sum() == pytest.approx(0.5 * np.sum(a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]))


def test_the_mesh_is_good(domain):
    mesh, _, _ = domain
    report = gmsnet.quality(mesh)
    assert report.aspect.mean() > 0.92
    assert report.min_angle.mean() > 53.0
    assert report.min_angle.min() > 28.0  # the best are near 60°, random points have 0°
    degree = np.bincount(edges_of(mesh).ravel())[inner(mesh)]
    assert degree.min() >= 5
    assert degree.max() <= 7


def test_edges_have_the_length_that_was_asked_for(domain):
    mesh, size, _ = domain
    start, end = (mesh.points[edges_of(mesh)[:, k]] for k in range(2))
    wanted = size((start + end) / 2) if callable(size) else size
    relative = np.linalg.norm(end - start, axis=1) / wanted
    assert 0.9 < relative.mean() < 1.1
    assert relative.min() > 0.6
    assert relative.max() < 1.6


def test_markers_are_the_curves():
    rings, size, _ = DOMAINS["graded ring"]
    markers = good_mesh(rings, size).markers
    assert set(markers) == {"far", "near", "domain"}
    assert set(markers["far"]).isdisjoint(markers["near"])


def test_nothing_is_drawn_at_random():
    rings, size, _ = DOMAINS["square"]
    first, second = good_mesh(rings, size), good_mesh(rings, size)
    assert np.array_equal(first.points, second.points)
    assert np.array_equal(first.cells[0].nodes, second.cells[0].nodes)


def test_a_domain_smaller_than_an_edge_gets_its_corners_alone():
    mesh = good_mesh([ring((0, 0), (1, 0), (1, 1), (0, 1))], 5.0)
    assert len(mesh.points) == 4
    assert len(mesh.cells[0].nodes) == 2


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan, lambda points: points[:, 0], lambda points: 0.1])
def test_bad_sizes_are_named(size):
    with pytest.raises(InputError, match="the size of edges must be a positive number at every point"):
        good_mesh([ring((-1, 0), (1, 0), (1, 1), (-1, 1))], size)


def test_chosen_edges_share_no_node_and_none_could_be_added():
    rng = np.random.default_rng(3)
    edges = np.sort(np.array([rng.choice(40, 2, replace=False) for _ in range(150)]), axis=1)
    candidates = rng.permutation(150)[:90]
    chosen = apart(edges, candidates, 40)
    nodes = edges[chosen].ravel()
    assert len(np.unique(nodes)) == len(nodes)
    assert chosen[0] == candidates[0]
    assert all(np.isin(edges[k], nodes).any() for k in candidates)
