"""Facets, their edges and planes against plain Python, and the mean length of edges at nodes."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.constraints.features import dot, lengths_of
from gmsnet.kernels.whole import facets
from gmsnet.kernels.whole.edges import mean_edges


def surface(seed, nodes=40, count=70):
    rng = np.random.default_rng(seed)
    rows = np.array([rng.choice(nodes, 3, replace=False) for _ in range(count)])
    rows[0, 1] = rows[0, 0]  # one without an area
    return rng.normal(size=(nodes, 3)), rows


def test_normals_are_those_of_numpy():
    points, rows = surface(1)
    normal, area, unit = np.empty((70, 3)), np.empty(70), np.empty((70, 3))
    facets.facet_normals(points, rows, normal, area, unit)
    expected = np.cross(points[rows[:, 1]] - points[rows[:, 0]], points[rows[:, 2]] - points[rows[:, 0]])
    assert np.array_equal(normal, expected)
    assert np.array_equal(area, lengths_of(expected))
    assert np.array_equal(unit[1:], expected[1:] / lengths_of(expected)[1:, None])
    assert not unit[0].any()


@pytest.mark.parametrize("hub", [False, True])
def test_edges_are_listed_by_their_nodes(hub):
    for seed in range(20):
        _, rows = surface(seed, 12 if seed % 2 else 60)
        if hub:  # one node with more sides than are sorted one by one
            rows[:, 0] = 0
            rows[:, 1:] += 1
        found, count, one, other = np.empty((4, rows.size), dtype=np.int64)
        edges = facets.list_edges(rows, 61, found, count, one, other)
        sides = {}
        for f, row in enumerate(rows.tolist()):
            for k in range(3):
                sides.setdefault(tuple(sorted((row[k], row[(k + 1) % 3]))), []).append(3 * f + k)
        assert found[:edges].tolist() == [a * 61 + b for a, b in sorted(sides)]
        each = [sides[edge] for edge in sorted(sides)]
        assert count[:edges].tolist() == [len(s) for s in each]
        assert one[:edges].tolist() == [s[0] for s in each]
        assert other[:edges].tolist() == [s[1] if len(s) == 2 else s[0] for s in each]


def test_what_lies_across_an_edge():
    points, rows = surface(3)
    points[:, 2] = np.where(np.arange(40) < 36, 0.0, points[:, 2])
    rng = np.random.default_rng(4)
    unit = rng.normal(size=(70, 3))
    unit[::2] = [0.0, 0.0, 1.0]
    one, other = rng.permutation(210)[:100].reshape(2, 50)
    smooth, cosine = rng.uniform(size=50) < 0.7, np.empty(50)
    facets.cosines(unit, one, other, cosine)
    assert np.array_equal(cosine, dot(unit[one // 3], unit[other // 3]))
    beside, flat = np.full(210, -1, dtype=np.int64), np.zeros(210, dtype=bool)
    facets.find_level(points, rows, unit, one, other, smooth, cosine, 1e-9, 1e-12, beside, flat)
    beyond = points[rows[other // 3, (other + 2) % 3]] - points[rows[one // 3, 0]]
    level = smooth & (cosine > 0.0) & (abs(dot(beyond, unit[one // 3])) <= 1e-9 * lengths_of(beyond) + 1e-12)
    for a, b in ((one, other), (other, one)):
        assert np.array_equal(beside[a], np.where(smooth, b // 3, -1))
        assert np.array_equal(flat[a], level)
    assert level.any()
    assert not level.all()


def test_parts_are_numbered_in_the_order_of_their_facets():
    rng = np.random.default_rng(6)
    for count in (1, 5, 60):
        beside, joins = np.full((count, 3), -1), np.zeros((count, 3), dtype=bool)
        for _ in range(count):
            f, g, i, k = *rng.integers(0, count, 2), *rng.integers(0, 3, 2)
            if not (joins[f, i] or joins[g, k]) and f != g:
                beside[f, i], beside[g, k] = g, f
                joins[f, i] = joins[g, k] = rng.uniform() < 0.7
        part = np.full(count, -1, dtype=np.int64)
        facets.link(beside, joins, np.empty(count, dtype=np.int64), part)
        expected = list(range(count))
        for _ in range(count):
            for f, k in zip(*np.nonzero(joins), strict=True):
                expected[f] = expected[beside[f, k]] = min(expected[f], expected[beside[f, k]])
        assert np.array_equal(np.unique(expected, return_inverse=True)[1], part)


def test_planes_are_parts_with_a_vertex_of_their_own():
    for seed in range(20):
        _, own = surface(seed, 30)
        part = np.random.default_rng(seed).integers(0, 4, 70)
        plane = np.full(30, -1, dtype=np.int64)
        facets.find_planes(own, part, np.empty_like(plane), np.empty_like(plane), plane)
        parts = [{int(part[f]) for f in range(70) if v in own[f]} for v in range(30)]
        inner = [any(len(parts[v]) == 1 for v in row) for row in own.tolist()]
        expected = [{int(part[f]) for f in range(70) if inner[f] and v in own[f]} or {-1} for v in range(30)]
        assert all(p in e for p, e in zip(plane.tolist(), expected, strict=True))


def test_the_side_of_a_facet_is_its_normal_or_that_of_its_vertices():
    rng = np.random.default_rng(5)
    _, own = surface(5, 30)
    table = rng.normal(size=(30, 6))
    unit = rng.normal(size=(70, 3))
    unit[3] = 0.0
    out = np.empty((70, 3))
    facets.own_sides(unit, own, table, out)
    mean = table[own[3], 3:].sum(axis=0)
    unit[3] = mean / lengths_of(mean[None])[0]
    assert np.allclose(out, unit, atol=1e-15)


def test_edges_count_once_in_the_mean():
    for seed in range(5):
        rng = np.random.default_rng(seed)
        points, pairs, mean = rng.normal(size=(20, 3)), rng.integers(0, 18, (120, 2)), np.zeros(20)
        mean_edges(pairs, points, mean)
        edges = {tuple(sorted(pair)) for pair in pairs.tolist()}
        for i in range(20):
            at = [np.linalg.norm(points[a] - points[b]) for a, b in edges for end in (a, b) if end == i]
            assert mean[i] == pytest.approx(np.mean(at) if at else 0.0, abs=1e-14)
