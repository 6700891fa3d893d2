"""Places on surfaces in space: nearest facets, exact corners and planes, how near the cubics are to what is smooth."""

from __future__ import annotations

from itertools import pairwise
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.surfaces import constraint, cylinder, sphere, turned

from gmsnet.constraints.smooth_patches import across, handles
from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.star.cubics import over_facet, walk
from gmsnet.kernels.star.off_surface import farthest
from gmsnet.kernels.star.pieces import follow_curve
from gmsnet.kernels.star.surface import (
    CURVE,
    CURVED,
    FLAT,
    LINE,
    directions_at,
    locate3,
    snap3,
)


@kernel
def snap_all(surface, rows, wanted, places):
    """Where the nodes of rows (K,) go that would go to wanted (K, 3); into places (K, 3)."""
    for i in range(len(rows)):
        places[i, 0], places[i, 1], places[i, 2], _ = snap3(surface, rows[i], wanted[i, 0], wanted[i, 1], wanted[i, 2])


def corners(surface):
    """(F, 3, 3) the points of its facets."""
    return surface.vertex[surface.facet[:, :3], :3]


def on_segments(p, a, b):
    """The distance of a point from each of some segments (K, 3)."""
    edge = b - a
    share = np.clip(((p - a) * edge).sum(axis=1) / (edge * edge).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(a + share[:, None] * edge - p, axis=1)


def from_facets(p, corners):
    """The distance of a point from each of some triangles (K, 3, 3)."""
    a, b, c = (corners[:, k] for k in range(3))
    found = np.min([on_segments(p, a, b), on_segments(p, b, c), on_segments(p, c, a)], axis=0)
    normal = np.cross(b - a, c - a)
    height = ((p - a) * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    foot = p - height[:, None] * normal / np.linalg.norm(normal, axis=1)[:, None]
    inside = np.ones(len(corners), dtype=bool)
    for u, v in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(v - u, foot - u) * normal).sum(axis=1) >= 0.0
    return np.where(inside, abs(height), found)


@given(seed=st.integers(0, 2**32 - 1), count=st.sampled_from([40, 300]))
@settings(max_examples=40, deadline=None)
def test_a_walk_ends_at_the_nearest_facet(seed, count):
    rng = np.random.default_rng(seed)
    points, rows = sphere(count, seed % 99)
    _, surface = constraint(points, rows, 80.0)
    for f in rng.integers(0, len(rows), 10):
        place = (
            rng.dirichlet([1.0, 1.0, 1.0])
            @ points[rows[f]]
            * rng.uniform(*((0.97, 1.06) if count == 40 else (1.0, 1.005)))
        )
        begin = rng.choice(np.flatnonzero(np.isin(rows, rows[f]).any(axis=1)))
        g, *shares = walk(surface.vertex, surface.facet, int(begin), *place)
        assert min(shares) >= 0.0
        assert sum(shares) == pytest.approx(1.0, abs=1e-15)
        away, least = np.linalg.norm(shares @ corners(surface)[g] - place), from_facets(place, points[rows]).min()
        assert away >= least - 1e-13
        assert away <= 1.5 * least + 1e-13  # far outside of a peak, the foot on one of its ridges counts
        if count > 40:
            assert away <= least + 1e-13


def test_a_walk_stops_at_the_rim():
    points, rows = cylinder(24, 5)
    patches, surface = constraint(points, rows)
    side = int(patches.patch[0])
    for z, wanted in ((-1.0, 0.0), (3.0, 2.0)):
        g, *shares = walk(surface.vertex, surface.facet, 0, 0.999, 0.01, z)
        assert (np.array(shares) @ corners(surface)[g])[2] == wanted
        x, y, height, _ = snap3(surface, surface.row[30], 0.999, 0.01, z)
        assert height == wanted
        assert np.hypot(x, y) == pytest.approx(1.0, abs=1e-4)
    assert (patches.patch[np.abs(points[rows][:, :, 2] - 1.0).max(axis=1) < 0.9] == side).all()


@given(seed=st.integers(0, 2**32 - 1), single=st.booleans())
@settings(max_examples=20, deadline=None)
def test_nodes_are_where_they_are(seed, single):
    """To the bit, from each facet at them."""
    points, rows = sphere(60, seed % 999) if seed % 2 else cylinder(20, 3)
    points = points * 10.0 ** (seed % 7 - 3) @ turned(seed % 5).T + seed % 11
    points = np.float64(np.float32(points)) if single else points
    _, surface = constraint(points, rows, 40.0, single)
    for node in np.flatnonzero(surface.row >= 0):
        row = surface.row[node]
        if surface.kind[row] == CURVED:
            for f in np.flatnonzero((corners(surface) == points[node]).all(axis=2).any(axis=1)):
                surface.place[row] = f
                assert snap3(surface, row, *points[node])[:3] == tuple(points[node])
        elif surface.kind[row] == CURVE:
            assert snap3(surface, row, *points[node])[:3] == tuple(points[node])
        else:
            away = np.abs(snap3(surface, row, *points[node])[:3] - points[node]).max()
            assert away <= 2.0 ** (-22 if single else -50) * np.abs(points).max()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_common_coordinates_keep_their_bits(axis):
    points, rows = cylinder(24, 5)
    points = np.roll(points * 0.7 + 0.1, axis, axis=1)  # along z, x, y
    patches, surface = constraint(points, rows)
    along = (2 + axis) % 3
    kinds = set()
    for node in np.flatnonzero(surface.row >= 0):
        row, wanted = surface.row[node], points[node] + 0.03
        placed = np.array(snap3(surface, row, *wanted)[:3])
        kinds.add(int(surface.kind[row]))
        if surface.kind[row] != CURVED:
            assert placed[along] == points[node, along]
        if surface.kind[row] == FLAT:
            assert (np.delete(placed, along) == np.delete(wanted, along)).all()
    assert kinds == {FLAT, CURVED, CURVE}
    assert not (patches.slides & patches.curves.slides).any()


def box_surface(n):
    """(points, rows) of a unit cube with n² squares a side."""
    grid = np.linspace(0.0, 1.0, n + 1)
    points = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    number, rows = {tuple(p): k for k, p in enumerate(points.tolist())}, []
    for axis in range(3):
        for level, way in ((0.0, -1), (1.0, 1)):
            for u in range(n):
                for v in range(n):
                    quad = [(grid[u + i], grid[v + j]) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    ids = [number[tuple(np.roll([level, *q], axis).tolist())] for q in quad][::way]
                    rows += [[ids[0], ids[1], ids[2]], [ids[0], ids[2], ids[3]]]
    return points, np.array(rows)


@pytest.mark.parametrize("turn", [None, 3])
def test_planes_and_lines(turn):
    points, rows = box_surface(4)
    matrix = np.eye(3) if turn is None else turned(turn)
    moved = points @ matrix.T
    patches, surface = constraint(moved, rows)
    assert (patches.slides.sum(), patches.curves.slides.sum()) == (6 * 9, 12 * 3)
    assert set(surface.kind.tolist()) == {FLAT, LINE}
    rng = np.random.default_rng(0)
    for node in np.flatnonzero(surface.row >= 0):
        wanted = points[node] + rng.uniform(-0.1, 0.1, 3)
        found = np.array(snap3(surface, surface.row[node], *(wanted @ matrix.T))[:3])
        on = (points[node] == 0.0) | (points[node] == 1.0)
        expected = np.where(on, points[node], wanted)
        if turn is None:
            assert (found == expected).all()
        assert abs(found - expected @ matrix.T).max() < 4e-16
        direction = directions_at(surface, surface.row[node], *found)
        axis = np.flatnonzero(on if on.sum() == 1 else ~on)[0]
        assert abs(np.array(direction) @ matrix[:, axis]) == pytest.approx(1.0, abs=1e-15)


def off_radius(points, rows, kind, reach):
    """How far places of random wishes are from the unit circle around z, or from the unit sphere, at most."""
    _, surface = constraint(points, rows, 60.0)
    rng, most = np.random.default_rng(0), 0.0
    spherical = np.allclose(np.linalg.norm(points, axis=1), 1.0)
    for node in np.flatnonzero(surface.row >= 0):
        if surface.kind[surface.row[node]] == kind:
            for _ in range(1 + 2000 // len(points)):
                wanted = points[node] + rng.uniform(-reach, reach, 3)
                found = np.array(snap3(surface, surface.row[node], *wanted)[:3])
                most = max(most, abs(np.linalg.norm(found[: 3 if spherical else 2]) - 1.0))
    return most


def test_cubics_are_of_fourth_order_on_spheres_and_of_sixth_on_circles():
    found = [off_radius(*sphere(count), CURVED, 2.0 / np.sqrt(count)) for count in (100, 400, 1600)]
    assert found[0] < 0.02 * 0.0368  # of what the facets are off
    assert all(a > 12 * b for a, b in pairwise(found))
    found = [off_radius(*cylinder(count, 3), CURVE, 3.0 / count) for count in (12, 24, 48)]
    assert found[0] < 2e-5 * 0.034
    assert all(a > 50 * b for a, b in pairwise(found))
    found = [off_radius(*cylinder(count, 3), CURVED, 3.0 / count) for count in (12, 24, 48)]
    assert all(a > 12 * b for a, b in pairwise(found))


def test_neighbouring_facets_agree_along_their_edge():
    points, rows = sphere(80)
    patches, surface = constraint(points, rows, 80.0)
    for f in range(len(rows)):
        for k in range(3):
            g = patches.beside[f, k]
            middle = 0.3 * points[rows[f, k]] + 0.7 * points[rows[f, (k + 1) % 3]]
            row = surface.row[rows[f, k]]
            places = []
            for begin in (f, g):
                surface.place[row] = begin
                places.append(snap3(surface, row, *middle)[:3])
            assert np.abs(np.subtract(*places)).max() < 1e-15


def test_places_are_those_of_cubics_with_the_handles_of_arcs():
    """Against the control points of each facet, by NumPy."""
    points, rows = sphere(60, 5)
    rng = np.random.default_rng(1)
    normals = points + rng.normal(size=points.shape) * 0.1
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    vertex, facet = np.column_stack([points, normals]), np.column_stack([rows, rows]).astype(np.int32)
    for f, (p, n) in enumerate(zip(points[rows], normals[rows], strict=True)):
        a, b, c = share = rng.dirichlet([1.0, 1.0, 1.0])
        control, edges = {(k, k, k): p[k] for k in range(3)}, []
        for k in range(3):
            for j in ((k + 1) % 3, (k + 2) % 3):
                edge = (p[j] - p[k])[None]
                edges.append(p[k] + handles(edge, across(edge, n[k][None]))[0])
                control[tuple(sorted((k, k, j)))] = edges[-1]
        middle = np.mean(edges, axis=0)
        control[0, 1, 2] = middle + 0.5 * (middle - p.mean(axis=0))
        wanted = sum(
            factorial(3) / np.prod([factorial(i.count(k)) for k in range(3)]) * np.prod(share[list(i)]) * at
            for i, at in control.items()
        )
        assert np.array(over_facet(vertex, facet, np.inf, f, a, b, c)) == pytest.approx(wanted, abs=1e-14)
        flat, limit = share @ p, 0.3 * np.linalg.norm(wanted - share @ p)
        near = np.array(over_facet(vertex, facet, limit, f, a, b, c))
        assert near == pytest.approx(flat + 0.3 * (wanted - flat), abs=1e-14)


def test_directions():
    points, rows = sphere(400)
    _, surface = constraint(points, rows)
    for node in range(0, 400, 7):
        normal = np.array(directions_at(surface, surface.row[node], *points[node]))
        assert normal == pytest.approx(points[node], abs=1e-3)
    points, rows = cylinder(48, 3)
    patches, surface = constraint(points, rows)
    for node in np.flatnonzero(patches.curves.slides):
        x, y, _ = points[node]
        tangent = np.array(directions_at(surface, surface.row[node], *points[node]))
        assert abs(tangent @ [-y, x, 0.0]) == pytest.approx(1.0, abs=1e-12)


def test_curves_end():
    """At a line cell across: what would go on beyond it stays there."""
    points, rows = cylinder(24, 5)
    _, surface = constraint(points, rows, still=[3, 15])
    row = surface.row[4]
    p, t = follow_curve(surface.piece, surface.before, surface.after, surface.place[row], *(points[2] * 1.1))
    assert tuple(snap3(surface, row, *points[2])[:3]) == tuple(points[3])
    assert (surface.piece[p, 0] == points[3]).all() or (surface.piece[p, 3] == points[3]).all()
    assert t in (0.0, 1.0)
    closed = constraint(points, rows)[1]
    assert np.array(snap3(closed, closed.row[4], *points[2])[:3]) == pytest.approx(points[2], abs=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_nodes_that_stay_are_located_once(seed):
    """Off a ridge or a peak the nearest place is on several facets: which one is told does not depend on how often."""
    points, rows = sphere(300, seed)
    _, surface = constraint(points, rows)
    start, rng, other = surface.place.copy(), np.random.default_rng(seed), 0
    for _ in range(20):
        moved = points + rng.normal(size=points.shape) * 0.05
        surface.place[:] = start
        locate3(surface, moved)
        once = surface.place.copy()
        for _ in range(3):
            locate3(surface, moved)
            assert np.array_equal(surface.place, once)
        for row in range(len(start)):
            x, y, z = moved[np.flatnonzero(surface.row == row)[0]]
            other += walk(surface.vertex, surface.facet, once[row], x, y, z)[0] != once[row]
    assert other > 20  # a walk alone goes on


def test_kernels_over_all_nodes():
    points, rows = cylinder(24, 5)
    _, surface = constraint(points, rows)
    nodes = np.flatnonzero(surface.row >= 0)
    wanted = points[nodes] + np.random.default_rng(0).uniform(-0.2, 0.2, (len(nodes), 3))
    places = np.empty_like(wanted)
    snap_all(surface, surface.row[nodes], wanted, places)
    found = [snap3(surface, surface.row[node], *w) for node, w in zip(nodes, wanted, strict=True)]
    assert places.tolist() == [list(f[:3]) for f in found]
    moved = points.copy()
    moved[nodes] = places
    before = surface.place.copy()
    every, curved = np.ones(len(points), dtype=bool), np.isin(surface.kind, (CURVED, CURVE))
    away = farthest(surface, moved, every)
    assert (surface.place == before).all()
    locate3(surface, moved)
    assert (surface.place[surface.row[nodes]] != before[surface.row[nodes]]).any()
    assert farthest(surface, moved, every) == away
    assert farthest(surface, moved, ~every) == 0.0
    truth = []
    for node in nodes[curved[surface.row[nodes]]]:
        place = surface.place[surface.row[node]]
        if surface.kind[surface.row[node]] == CURVED:
            facet = corners(surface)[place]
            sides = np.linalg.norm(facet - np.roll(facet, 1, axis=0), axis=1)
            truth.append(from_facets(moved[node], corners(surface)).min() / sides.mean())
        else:
            a, b = surface.piece[place][[0, 3]]
            truth.append(on_segments(moved[node], a[None], b[None])[0] / np.linalg.norm(b - a))
    assert away == pytest.approx(max(truth), rel=1e-9)
    assert 0.01 < away < 0.05  # the sagitta of 15° over its edge is 0.033
