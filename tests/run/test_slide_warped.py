"""Nodes on warped quadrilaterals of a boundary slide within the tolerance of their halves, or stay."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from support import blocks

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.constraints.sliding_in_space import patches_to_slide_on
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.mixed_volume import wound_of

TOLERANCE, SIZE = 0.05, 5
FACETS = CELLS["hexahedron"].facets


def warped(amount, seed, bulge=0.15):
    """A block whose top is a bulge, its nodes thrown upwards and aside."""
    mesh = blocks.block(SIZE, SIZE, SIZE, jitter=0.2, seed=seed)
    points, rng = mesh.points.copy(), np.random.default_rng(seed)
    x, y, z = (points / SIZE - 0.5).T
    points[:, 2] += bulge * SIZE * (z + 0.5) * (1 - 2 * x * x - 2 * y * y)
    top = (z == 0.5) & (abs(x) < 0.5) & (abs(y) < 0.5)
    points[top] += rng.uniform(-1, 1, (top.sum(), 3)) * (0.25, 0.25, amount)
    return Mesh(points, mesh.cells)


def outside(mesh):
    """(Q, 4) the facets of one cell."""
    every = np.concatenate([block.nodes[:, list(facet)] for block in mesh.cells for facet in FACETS])
    seen = Counter(tuple(sorted(row)) for row in every.tolist())
    return np.array([row for row in every.tolist() if seen[tuple(sorted(row))] == 1])


def distance(point, corners):
    """Of a point from the nearest of some triangles (T, 3, 3), one by one."""
    least = np.inf
    for a, b, c in corners:
        candidates = [a, b, c]
        for p, q in ((a, b), (b, c), (c, a)):
            candidates.append(p + np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1) * (q - p))
        matrix = np.column_stack([b - a, c - a])
        s, t = np.linalg.lstsq(matrix, point - a, rcond=None)[0]
        if s >= 0 and t >= 0 and s + t <= 1:
            candidates.append(a + matrix @ (s, t))
        least = min(least, *(np.linalg.norm(point - each) for each in candidates))
    return least


def mean_edges(mesh):
    """(N,) of all edges at each node."""
    pairs = {
        tuple(sorted(p)) for block in mesh.cells for e in CELLS[block.kind].edges for p in block.nodes[:, e].tolist()
    }
    total, count = np.zeros(len(mesh.points)), np.zeros(len(mesh.points))
    for pair in pairs:
        length = np.linalg.norm(mesh.points[pair[0]] - mesh.points[pair[1]])
        total[list(pair)] += length
        count[list(pair)] += 1
    return total / count


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("amount", [0.0, 0.05, 0.3])
def test_the_halves_from_the_lowest_node_keep_the_tolerance(amount, seed):
    """From the others a node is further by what quadrilaterals are warped by, at most."""
    mesh = warped(amount, seed)
    result = gmsnet.smooth(mesh, slide=True, surface_tolerance=TOLERANCE)
    quads, local = outside(mesh), mean_edges(mesh)
    quads = np.array([np.roll(quad, -int(np.argmin(quad))) for quad in quads])
    halvings = [
        np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]),
        np.concatenate([quads[:, [1, 2, 3]], quads[:, [1, 3, 0]]]),
    ]
    apart = np.zeros(len(mesh.points))
    for quad in quads:
        a, b, c, d = mesh.points[quad]
        normal = np.cross(c - a, d - b)
        apart[quad] = np.maximum(apart[quad], abs((b - a) @ normal) / np.linalg.norm(normal))
    moved = np.intersect1d(np.unique(quads), np.flatnonzero(result.moved))
    for node in moved.tolist():
        point = result.points[node]
        one, other = (distance(point, mesh.points[rows]) for rows in halvings)
        assert one <= TOLERANCE * local[node] + 1e-12
        assert other <= one + apart.max() + 1e-12
    beyond = np.flatnonzero(apart > TOLERANCE * local * (1 + 1e-9))
    assert not np.isin(beyond, moved).any()
    assert len(moved) > (10 if amount < 0.1 else 0)
    assert amount < 0.1 or len(beyond) > 5


def test_a_tolerance_of_next_to_nothing_leaves_planes_to_slide_on():
    mesh = blocks.block(SIZE, SIZE, SIZE, scale=0.1)
    points = mesh.points.copy()
    low, high = points.min(axis=0), points.max(axis=0)
    throw = np.random.default_rng(0).uniform(-0.03, 0.03, points.shape)
    points += throw * ((points > low) & (points < high))  # on sides, along these
    mesh = Mesh(points, mesh.cells)
    result = gmsnet.smooth(mesh, slide=True, surface_tolerance=1e-15)
    faces = np.unique(outside(mesh))
    assert result.moved[faces].sum() > 6 * (SIZE - 1) ** 2
    np.testing.assert_array_equal(result.points.min(axis=0), low)
    np.testing.assert_array_equal(result.points.max(axis=0), high)


def test_an_edge_is_sharp_by_the_normals_of_whole_quadrilaterals():
    """Two square facets bent by 20°: halves of them are bent by more than 30° where one is warped."""
    mesh = blocks.block(2, 1, 1)
    points = mesh.points.copy()
    end = points[:, 0] == 2
    points[end, 2] -= np.tan(np.radians(20.0))
    points[np.flatnonzero(end & (points[:, 1] == 0)), 2] += 0.5
    points[np.flatnonzero(end & (points[:, 1] == 1)), 2] -= 0.5
    mesh = Mesh(points, mesh.cells)
    middle = np.flatnonzero((mesh.points[:, 0] == 1) & (mesh.points[:, 2] == 1))
    quads = outside(mesh)
    (one, other) = (
        quad
        for quad in quads
        if np.isin(middle, quad).all()
        and mesh.points[quad, 2].min() > -1
        and np.ptp(mesh.points[quad, 0]) == 1
        and np.ptp(mesh.points[quad, 1]) == 1
    )
    p = mesh.points
    normals = [np.cross(p[q[2]] - p[q[0]], p[q[3]] - p[q[1]]) for q in (one, other)]
    turn = np.degrees(np.arccos(np.dot(*normals) / np.prod([np.linalg.norm(n) for n in normals])))
    for angle, sharp in ((turn + 0.1, False), (turn - 0.1, True)):
        facets, patches = patches_to_slide_on(mesh, wound_of(mesh), None, angle)
        pairs = {
            tuple(sorted(pair))
            for pair in zip(patches.curves.nodes[:-1].tolist(), patches.curves.nodes[1:].tolist(), strict=True)
        }
        assert (tuple(sorted(middle.tolist())) in pairs) == sharp
        assert facets.halves == 2 * len(quads)
