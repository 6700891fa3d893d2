"""A user's geometry: what it is asked, polylines as the first kind, and what it must not do."""

from __future__ import annotations

import numpy as np
import pytest
from support.sliding import constraint_by_ids, push

from gmsnet.constraints.features import curves_of
from gmsnet.constraints.geometry import Entity, Polylines
from gmsnet.errors import InputError
from gmsnet.generate.random import random_mesh
from gmsnet.topology.ordering import planar_points


class Circle:
    """Of radius ½ around (½, ½); ``turned`` tangents point backwards."""

    def __init__(self, turned: float = 1.0, away: float = 0.0) -> None:
        self.asked: list[Entity] = []
        self.turned, self.away = turned, away

    def project(self, entity, points):
        self.asked.append(entity)
        angle = np.arctan2(points[:, 1] - 0.5, points[:, 0] - 0.5) * (1.0 - self.away)
        return 0.5 + 0.5 * np.column_stack([np.cos(angle), np.sin(angle)]), angle

    def tangent(self, entity, parameters):
        return self.turned * np.column_stack([-np.sin(parameters), np.cos(parameters)])


def circle_points(count):
    angles = np.linspace(0.0, 2.0 * np.pi, count + 1)
    angles[-1] = 0.0
    return 0.5 + 0.5 * np.column_stack([np.cos(angles), np.sin(angles)])


@pytest.mark.parametrize("geometry", [Circle(), Circle(-7.0), Polylines({"circle": circle_points(50)})])
def test_nodes_slide_on_the_geometry(geometry):
    mesh = random_mesh(150, "circle", boundary="random", seed=3)
    curves, points = curves_of(mesh), planar_points(mesh)
    constraint = constraint_by_ids(mesh, curves, geometry)
    rng = np.random.default_rng(0)
    for _ in range(3):
        for node in np.flatnonzero(curves.slides).tolist():
            push(constraint, points, node, *(points[node] + 0.05 * rng.standard_normal(2)))
    radius = np.hypot(*(np.ldexp(points, mesh.exponent)[curves.slides] - 0.5).T)
    assert abs(radius - 0.5).max() < 1e-14
    if isinstance(geometry, Circle):
        assert geometry.asked == [Entity(1, 0, ("circle",))]


def test_a_polyline_finer_than_the_mesh_gives_back_its_shape():
    wave = np.linspace(0.0, 1.0, 301)
    fine = np.column_stack([wave, 0.05 * np.sin(2.0 * np.pi * wave)])
    spline = Polylines({"wave": fine})
    asked = np.column_stack([np.linspace(0.01, 0.99, 97), np.zeros(97)])
    places, parameters = spline.project(Entity(1, 0, ("wave",)), asked)
    assert abs(places[:, 1] - 0.05 * np.sin(2.0 * np.pi * places[:, 0])).max() < 2e-8
    slope = 0.1 * np.pi * np.cos(2.0 * np.pi * places[:, 0])
    tangent = spline.tangent(Entity(1, 0, ("wave",)), parameters)
    assert abs(tangent[:, 1] / tangent[:, 0] - slope).max() < 1e-4


@pytest.mark.parametrize("begin", [0, 1, 2, 3])
def test_corners_of_polylines_stay_sharp(begin):
    square = np.roll(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), begin, axis=0)
    polyline = Polylines({"square": np.vstack([square, square[:1]])})
    places, _ = polyline.project(Entity(1, 0, ("square",)), np.array([[0.5, 0.2], [1.1, 0.4], [2.0, 2.0]]))
    np.testing.assert_allclose(places, [[0.5, 0.0], [1.0, 0.4], [1.0, 1.0]], atol=1e-15)


def test_curves_without_a_polyline():
    mesh = random_mesh(20, "circle", seed=3)
    with pytest.raises(InputError, match=r"no polyline for the curve 0 \(circle\), only for 'airfoil'"):
        constraint_by_ids(mesh, curves_of(mesh), Polylines({"airfoil": circle_points(9)}))
    plate = random_mesh(2000, "plate", seed=3)
    hole = plate.points[curves_of(plate).nodes_of(curves_of(plate).names.index(("hole",)))]
    assert constraint_by_ids(plate, curves_of(plate, "hole"), Polylines({"hole": hole})).row.max() > 0


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0.0]], "two points or more"),
        ([[0.0, 0.0], [np.nan, 1.0]], "all finite"),
        ([[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]], "the points 1 and 2 of the polyline 'a'"),
        ([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]], "two points or more"),
    ],
)
def test_polylines_that_cannot_be_used(points, words):
    with pytest.raises(InputError, match=words):
        Polylines({"a": points})


def test_no_polylines():
    with pytest.raises(InputError, match="a mapping"):
        Polylines([[0.0, 0.0], [1.0, 1.0]])


def test_a_geometry_that_does_not_follow_the_nodes():
    mesh = random_mesh(20, "circle", seed=3)
    with pytest.raises(InputError, match="do not follow each other"):
        constraint_by_ids(mesh, curves_of(mesh), Circle(away=0.9))


def test_a_geometry_that_gives_something_else():
    class Wrong(Circle):
        def tangent(self, entity, parameters):
            return "north"

    mesh = random_mesh(20, "circle", seed=3)
    with pytest.raises(InputError, match=r"the tangents that geometry gives for the curve 0 \(circle\)"):
        constraint_by_ids(mesh, curves_of(mesh), Wrong())
