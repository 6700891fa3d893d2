"""Normals from two rings against NumPy's least squares, and on surfaces that are known."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.constraints.facets import surface_itself
from gmsnet.constraints.patches import patches_of
from gmsnet.constraints.smooth_patches import fit_normals, vertices_of
from gmsnet.generate import cylinder, disturb_on, organic_surface, sphere_surface, torus_surface
from gmsnet.kernels.whole import jets, skin
from gmsnet.measure.report import connectivity_of


def listed(own, count):
    start, facets = np.zeros(count + 2, dtype=np.int64), np.empty(own.size, dtype=np.int32)
    jets.list_facets(own, start, facets)
    return start, facets


def rough(points, own):
    """Unit normals as they are before: weighted so that they are exact on spheres."""
    normal = np.cross(points[own[:, 1]] - points[own[:, 0]], points[own[:, 2]] - points[own[:, 0]])
    area = np.linalg.norm(normal, axis=1)
    total = np.zeros_like(points)
    skin.add_normals(points, own, normal / area[:, None], area, own, total)
    return total / np.linalg.norm(total, axis=1)[:, None]


def fitted(points, own, chosen=None):
    normal = rough(points, own)
    chosen = np.ones(len(points), dtype=bool) if chosen is None else chosen
    jets.fit_normals(points, own, *listed(own, len(points)), chosen, normal)
    return normal


def surface(make, nodes, amount=0.3, seed=1):
    """Points, facets, and the true unit normals at the nodes."""
    shaped = disturb_on(make(nodes), amount, seed=seed)
    points, own = shaped.mesh.points.copy(), shaped.mesh.cells[0].nodes.astype(np.int64)
    (face,) = shaped.faces.values()
    return points, own, face.normal(points)


def degrees(normal, true):
    cosine = abs((normal * true).sum(axis=1))
    return np.degrees(np.arccos(np.minimum(cosine, 1.0)))


def test_each_number_has_its_facets():
    own = np.random.default_rng(1).integers(0, 30, (50, 3))
    start, facets = listed(own, 30)
    assert start[0] == 0
    assert start[30] == 150
    for v in range(30):
        expected = [f for f in range(50) for k in range(3) if own[f, k] == v]
        assert facets[start[v] : start[v + 1]].tolist() == expected


def rings(v, own):
    """The nodes of the first two rings."""
    near = set(own[(own == v).any(axis=1)].ravel().tolist()) - {v}
    far = set(own[np.isin(own, list(near)).any(axis=1)].ravel().tolist()) - near - {v}
    return sorted(near), sorted(far)


def by_least_squares(points, own, v, normal):
    """The same cubic by NumPy, in a frame of its own, turned until nothing changes."""
    near, far = rings(v, own)
    away = points[near + far] - points[v]
    away = away / np.sqrt((away[: len(near)] ** 2).sum(axis=1).mean())
    for _ in range(8):
        u = np.linalg.svd(normal[None])[2][1]
        w = np.cross(normal, u)
        x, y, z = away @ u, away @ w, away @ normal
        square = (away**2).sum(axis=1)
        terms = [x, y, square, x * x - y * y, 2 * x * y, square * x, square * y]
        terms += [x**3 - 3 * x * y * y, 3 * x * x * y - y**3]
        found = np.linalg.lstsq(np.stack(terms, axis=1) / square[:, None], z / square, rcond=None)[0]
        normal = normal - found[0] * u - found[1] * w
        normal = normal / np.linalg.norm(normal)
    return normal


def test_normals_are_those_of_least_squares():
    points, own, _ = surface(organic_surface, 800)
    found, before = fitted(points, own), rough(points, own)
    for v in range(0, len(points), 40):
        expected = by_least_squares(points, own, v, before[v])
        assert degrees(found[v : v + 1], expected[None])[0] < 0.02 + 0.1 * degrees(before[v : v + 1], expected[None])[0]


@pytest.mark.parametrize("nodes", [60, 2000])
def test_spheres_are_exact(nodes):
    points, own, true = surface(sphere_surface, nodes)
    assert degrees(fitted(points, own), true).max() < 1e-5


def test_uneven_nodes_cost_little():
    for make, times in ((torus_surface, 20.0), (organic_surface, 10.0)):
        points, own, true = surface(make, 3000)
        before, after = degrees(rough(points, own), true), degrees(fitted(points, own), true)
        assert times * after.mean() < before.mean()
        assert after.max() < before.max()


@pytest.mark.parametrize("amount", [0.3, 0.6])
def test_in_lanes_they_are_the_same(amount):
    """Where nodes are thrown far their frames turn, and two rings do not always tell enough."""
    for make in (torus_surface, organic_surface):
        points, own, _ = surface(make, 1500, amount)
        expected, found = fitted(points, own), rough(points, own)
        fit_normals(points, own.astype(np.int32), np.ones(len(points), dtype=bool), found)
        assert degrees(found, expected).max() < 1e-5
        chosen = np.arange(len(points)) % 3 == 0
        before = rough(points, own)
        fit_normals(points, own.astype(np.int32), chosen, before)
        assert np.array_equal(before[chosen], found[chosen])
        assert np.array_equal(before[~chosen], rough(points, own)[~chosen])


def test_in_lanes_rims_hubs_and_nodes_in_one_place_do_no_harm():
    rng = np.random.default_rng(2)
    points = np.vstack([np.zeros((1, 3)), rng.normal(size=(90, 3))])
    points[7] = points[8] = points[9]
    k = np.arange(1, 91)
    own = np.stack([np.zeros(90, dtype=np.int64), k, k % 90 + 1], axis=1)
    own = np.vstack([own, [[4, 5, 6], [7, 8, 9], [1, 1, 2]]])
    start = np.tile([0.0, 0.0, 1.0], (91, 1))
    expected, found = start.copy(), start.copy()
    jets.fit_normals(points, own, *listed(own, 91), np.ones(91, dtype=bool), expected)
    fit_normals(points, own.astype(np.int32), np.ones(91, dtype=bool), found)
    assert np.allclose(found, expected, atol=1e-7)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0)


def test_what_is_not_chosen_stays():
    points, own, _ = surface(torus_surface, 600)
    chosen = np.arange(len(points)) % 2 == 0
    found, before = fitted(points, own, chosen), rough(points, own)
    assert np.array_equal(found[~chosen], before[~chosen])
    assert (found[chosen] != before[chosen]).any(axis=1).all()


def test_rows_of_nodes_that_do_not_tell_enough_do_no_harm():
    """A strip of two rows: no node tells how it bends across; and a single triangle."""
    x = np.arange(12.0)
    points = np.vstack([np.stack([x, 0 * x, 0.1 * x * x], axis=1), np.stack([x, 0 * x + 1.0, 0.2 * x], axis=1)])
    low = np.arange(11)
    own = np.vstack([np.stack([low, low + 1, low + 12], axis=1), np.stack([low + 1, low + 13, low + 12], axis=1)])
    found, before = fitted(points, own), rough(points, own)
    assert degrees(found, before).max() < 60.0
    corners, alone = np.eye(3), np.array([[0, 1, 2]])
    assert np.array_equal(fitted(corners, alone), rough(corners, alone))


def test_a_hub_and_nodes_in_one_place_do_no_harm():
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(2 * angle)], axis=1)
    points = np.vstack([[0.0, 0.0, 0.0], rim])
    k = np.arange(200)
    own = np.stack([np.zeros(200, dtype=np.int64), 1 + k, 1 + (k + 1) % 200], axis=1)
    normal = np.tile([0.0, 0.0, 1.0], (201, 1))
    points[5] = points[4]
    jets.fit_normals(points, own, *listed(own, 201), np.ones(201, dtype=bool), normal)
    assert np.isfinite(normal).all()
    assert np.allclose(np.linalg.norm(normal, axis=1), 1.0)
    assert normal[0, 2] > 0.99


def test_planes_keep_their_normals_and_patches_end_at_sharp_edges():
    shaped = disturb_on(cylinder(1500), 0.3, seed=2)
    mesh = shaped.mesh
    topology = connectivity_of(mesh)
    facets = surface_itself(mesh, topology)
    patches = patches_of(facets, mesh.points, 30.0, False, np.ones(len(mesh.points), dtype=bool))
    normals = vertices_of(patches, mesh.points).normals
    faces, regions = list(shaped.faces.values()), mesh.cells[0].regions
    for number, face in enumerate(faces, start=1):
        rows = regions == number
        true = face.normal(mesh.points[patches.rows[rows]].reshape(-1, 3)).reshape(-1, 3, 3)
        apart = np.degrees(np.arccos(np.minimum(abs((normals[rows] * true).sum(axis=2)), 1.0)))
        if np.ptp(true.reshape(-1, 3), axis=0).max() < 1e-9:  # a cap
            assert apart.max() < 1e-5
        else:
            assert apart[patches.slides[patches.rows[rows]]].max() < 0.1
            assert apart.max() < 2.5
