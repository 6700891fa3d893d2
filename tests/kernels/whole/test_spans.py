"""How curved surfaces are near their nodes, and how long edges may be before their facets are looked at."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.constraints.facets import surface_itself
from gmsnet.constraints.patches import patches_of
from gmsnet.generate import sphere_surface, torus_surface
from gmsnet.kernels.whole import skin
from gmsnet.topology.topology import Topology


def patches(mesh):
    facets, may = surface_itself(mesh, Topology.of(mesh)), np.ones(len(mesh.points), dtype=bool)
    return patches_of(facets, mesh.points, 30.0, False, may)


def obvious(points, found):
    """The same as add_curvatures, facet by facet."""
    at = np.zeros(len(points))
    for f, row in enumerate(found.rows):
        for k in range(3):
            g = found.beside[f, k]
            if g < 0:
                continue
            edge = np.linalg.norm(points[row[k]] - points[row[(k + 1) % 3]])
            angle = np.arctan2(np.linalg.norm(np.cross(found.unit[f], found.unit[g])), found.unit[f] @ found.unit[g])
            sine = np.sin(angle) if angle < np.pi / 2 else 1.0
            bend = sine * edge / ((found.area[f] + found.area[g]) / 3.0)
            for node in (*row, *found.rows[g]):
                at[node] = max(at[node], bend)
    return at


@pytest.mark.parametrize("scale", [1e-3, 1.0, 50.0])
def test_the_curvature_of_a_sphere_is_the_inverse_of_its_radius(scale):
    mesh = sphere_surface(800).mesh
    mesh = mesh.with_points(scale * mesh.points)
    found, radius = patches(mesh), np.linalg.norm(mesh.points[0])
    at = np.zeros(len(mesh.points))
    skin.add_curvatures(mesh.points, found.rows, found.unit, found.area, found.beside, at)
    assert at * radius == pytest.approx(1.0, abs=0.2)
    assert at == pytest.approx(obvious(mesh.points, found), rel=1e-6)


def test_curvatures_spread_by_one_ring():
    mesh = torus_surface(300).mesh
    found, at = patches(mesh), np.zeros(len(mesh.points))
    at[7], most = 3.0, np.zeros(len(found.rows))
    skin.spread(found.rows, at, most)
    touching = (found.rows == 7).any(axis=1)
    assert np.array_equal(most, np.where(touching, 3.0, 0.0))
    assert np.array_equal(np.flatnonzero(at), np.unique(found.rows[touching]))


def test_the_least_growth_is_of_the_longest_edge():
    points = np.array([[0.0, 0, 0], [3, 0, 0], [0, 1, 0], [3, 1, 0]])
    rows = np.array([[0, 1, 2], [1, 3, 2]])
    assert skin.least_growth(points, rows, np.array([40.0, 20.0])) == pytest.approx(2.0)
    assert skin.least_growth(points, rows, np.full(2, np.inf)) == np.inf
