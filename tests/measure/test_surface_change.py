"""Distances between two states of a surface, against slow obvious twins and against what is known."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.constraints.shapes import units
from gmsnet.generate import ball_volume, disturb_on, sphere_surface, torus_surface
from gmsnet.measure.surface_change import PLACES, Compared, Grid, surface_change


def slow_distance(point, triangle):
    """By all corners, all edges and the inside, one after the other."""
    found = [np.linalg.norm(point - corner) for corner in triangle]
    for k in range(3):
        a, b = triangle[k - 1], triangle[k]
        square = (b - a) @ (b - a)
        if square > 0 and 0 <= (point - a) @ (b - a) <= square:
            found.append(np.linalg.norm(point - a - (point - a) @ (b - a) / square * (b - a)))
    a, b, c = triangle
    matrix = np.column_stack([b - a, c - a])
    if np.linalg.matrix_rank(matrix, tol=1e-12) == 2:
        (s, t), *_ = np.linalg.lstsq(matrix, point - a, rcond=None)
        if s >= 0 and t >= 0 and s + t <= 1:
            found.append(np.linalg.norm(point - a - matrix @ [s, t]))
    return min(found)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 40), spread=st.sampled_from([0.01, 0.3, 2.0]))
def test_the_nearest_facet_is_found(seed, count, spread):
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(count, 1, 3)) + spread * rng.normal(size=(count, 3, 3))
    triangles[rng.random(count) < 0.1, 2] = triangles[0, 0]
    triangles[rng.random(count) < 0.1, 1:] = triangles[0, 0]
    if rng.random() < 0.2:
        triangles[..., 2] = 0.5
    points = 3 * rng.normal(size=(15, 3))
    points[:3] = triangles[:1].mean(axis=1)
    far, which = Grid(triangles).nearest(points)
    slow = np.array([[slow_distance(p, t) for t in triangles] for p in points])
    assert far == pytest.approx(slow.min(axis=1), rel=1e-9, abs=1e-9)
    assert slow[np.arange(len(points)), which] == pytest.approx(far, rel=1e-9, abs=1e-9)


def twin(rows, before, after):
    was, now = before[rows], after[rows]

    def one_sided(points, triangles):
        return max(min(slow_distance(p, t) for t in triangles) for p in points)

    def places(triangles):
        return np.concatenate([weights @ triangles for weights in PLACES])

    used = np.unique(rows)
    nodes = [min(slow_distance(p, t) for t in was) for p in after[used]]
    middles = now.mean(axis=1)
    sides = [one_sided(np.concatenate([after[used], places(now), middles]), was)]
    sides += [one_sided(np.concatenate([before[used], places(was)]), now)]
    return max(nodes), np.mean(nodes), max(sides)


@cache
def small_surface():
    """Its triangles, its points before and after, and what the twin says of them."""
    shaped = sphere_surface(30)
    rows = shaped.mesh.cells[0].nodes.astype(np.int64)
    before, after = shaped.mesh.points, disturb_on(shaped, 0.3, seed=1).mesh.points
    return rows, before, after, twin(rows, before, after)


@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e150])
def test_all_figures_of_a_small_surface(scale):
    rows, before, after, (largest, mean, hausdorff) = small_surface()
    change = surface_change(Compared(rows, scale * before, scale * after))
    assert change.largest / scale == pytest.approx(largest)
    assert change.mean / scale == pytest.approx(mean)
    assert change.hausdorff / scale == pytest.approx(hausdorff)
    assert change.diagonal / scale == pytest.approx(np.linalg.norm(np.ptp(before, axis=0)))

    def measures(points):
        a, b, c = (points[rows[:, k]] for k in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum(), np.linalg.det(np.stack([a, b, c], axis=1)).sum()

    (area, volume), (new_area, new_volume) = measures(before), measures(after)
    assert change.area == pytest.approx(new_area / area - 1)
    assert change.volume == pytest.approx(new_volume / volume - 1)
    assert 0 < change.normal < 60


def test_a_surface_that_stays_and_one_that_is_moved():
    mesh = torus_surface(300).mesh
    rows = mesh.cells[0].nodes.astype(np.int64)
    same = surface_change(Compared(rows, mesh.points, mesh.points))
    assert (same.area, same.volume) == (0, 0)
    assert max(same.largest, same.mean, same.hausdorff) < 1e-15
    assert same.normal < 1e-5
    grown = surface_change(Compared(rows, mesh.points, 1.1 * mesh.points))
    assert grown.area == pytest.approx(0.21)
    assert grown.volume == pytest.approx(0.331)
    turned = rows[:, ::-1]
    flipped = surface_change(
        Compared(np.where(np.arange(len(rows))[:, None] == 3, turned, rows), mesh.points, mesh.points)
    )
    assert flipped.volume is None
    assert surface_change(Compared(rows[:0], mesh.points, mesh.points)) is None
    fold = mesh.points.copy()
    far = np.unique(rows[(rows == rows[0, 0]).any(axis=1)])
    fold[rows[0, 0]] += 2.0 * (fold[far].mean(axis=0) - fold[rows[0, 0]]) + 3.0 * (fold[rows[0, 1]] - fold[rows[0, 0]])
    assert surface_change(Compared(rows, mesh.points, fold)).normal > 90


def spanned(area):
    """By an equilateral spherical triangle of this area and the centre."""
    cotangent = 1 / np.tan((np.pi + area) / 6)
    return cotangent * (3 - cotangent**2) / 12


def most_enclosed(nodes):
    """docs/surfaces.md: by a polyhedron with so many nodes on the unit sphere, seen once from its centre."""
    return (2 * nodes - 4) * spanned(2 * np.pi / (nodes - 2))


def test_no_polyhedron_in_a_sphere_encloses_more_than_the_bound():
    fifth, root = np.pi / 5, np.sqrt(145)
    regular = {4: 8 * np.sqrt(3) / 27, 6: 4 / 3, 12: 5 / 12 * (3 + np.sqrt(5)) / np.sin(2 * fifth) ** 3}
    largest = {5: np.sqrt(3) / 2, 7: 5 / 3 * np.sin(2 * fifth), 8: np.sqrt((475 + 29 * root) / 250)}
    assert [most_enclosed(n) for n in regular] == pytest.approx(list(regular.values()), rel=1e-14)
    assert all(volume < most_enclosed(n) for n, volume in largest.items())
    a, b, c = units(np.random.default_rng(5).normal(size=(3 * 10**5, 3))).reshape(3, -1, 3)
    double = abs((a * np.cross(b, c)).sum(axis=1))  # of what the triangle spans three times
    area = 2 * np.arctan2(double, 1 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1))
    assert (double / 6 <= spanned(area) + 1e-15).all()
    areas = np.linspace(0, 2 * np.pi, 1001)[1:-1]
    cotangent = 1 / np.tan((np.pi + areas) / 6)
    second = np.diff(spanned(areas), 2) / (areas[1] - areas[0]) ** 2
    assert second == pytest.approx(-(cotangent**3 * (1 + cotangent**2) / 36)[1:-1], rel=1e-3, abs=1e-6)


def test_what_a_sphere_encloses_hangs_on_how_even_its_facets_are():
    """docs/surfaces.md: less than the ball by √3/6R·ΣA²q, and by no less than Fejes Tóth's bound."""

    def missing(points, rows):
        """Of the unit ball, by the facets and by the formula."""
        a, b, c = points[rows].transpose(1, 0, 2)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        squares = sum((edge**2).sum(axis=1) for edge in (b - a, c - b, a - c))
        volume = abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
        return 4 * np.pi / 3 - volume, np.sqrt(3) / 6 * (area**2 * squares / (4 * np.sqrt(3) * area)).sum()

    mesh = disturb_on(sphere_surface(1500), 0.3, seed=1).mesh
    radius, rows = np.linalg.norm(mesh.points, axis=1).mean(), mesh.cells[0].nodes
    result = gmsnet.smooth(mesh)
    bound = 4 * np.pi / 3 - most_enclosed(len(mesh.points))
    before, after = (missing(points / radius, rows) for points in (mesh.points, result.mesh.points))
    for found, formula in (before, after):
        assert found == pytest.approx(formula, rel=0.01)
        assert found > bound
    assert after[0] < 1.05 * bound
    assert before[0] > 1.15 * bound
    assert result.surface_change.volume == pytest.approx((before[0] - after[0]) / (4 * np.pi / 3 - before[0]), rel=1e-6)


def test_results_tell_of_the_boundary_that_slid():
    mesh = disturb_on(ball_volume(300), 0.2, seed=1).mesh
    result = gmsnet.smooth(mesh, slide=True)
    rows = mesh.cells[1].nodes.astype(np.int64)
    wanted = surface_change(Compared(rows, mesh.points, result.points))
    found = result.surface_change
    assert found.largest == pytest.approx(wanted.largest, rel=1e-12)
    assert found.hausdorff == pytest.approx(wanted.hausdorff, rel=1e-12)
    assert 0 < found.largest < 0.1 * found.edge
    assert gmsnet.smooth(mesh).surface_change is None
