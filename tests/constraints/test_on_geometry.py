"""Nodes in space that slide on the true shape: spheres, tori, cylinders and their rims; geometries that do not fit."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.constraints.geometry import Entity, Shapes
from gmsnet.constraints.shapes import Plane, Sphere
from gmsnet.errors import InputError
from gmsnet.generate import ball_volume, cylinder, disturb_on, sphere_surface, torus_surface

SHAPED = {
    "sphere": lambda: sphere_surface(700),
    "torus": lambda: torus_surface(700),
    "cylinder": lambda: cylinder(900, cells="tetra"),
    "ball": lambda: ball_volume(500),
}


def off(shaped, points):
    """How far the nodes of each face are off it, at most."""
    facets = shaped.mesh.cells[-1]
    nodes = [np.unique(facets.nodes[facets.regions == k]) for k in range(1, 1 + len(shaped.faces))]
    pairs = zip(shaped.faces.values(), nodes, strict=True)
    return max(abs(shape.project(points[ids]) - points[ids]).max() for shape, ids in pairs)


@pytest.mark.parametrize("name", SHAPED)
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_nodes_are_nearer_to_the_true_shape_than_without(name, size):
    shaped = disturb_on(SHAPED[name](), 0.35, seed=1)
    mesh = shaped.mesh.with_points(shaped.mesh.points * size)
    exact = {key: type(shape)(**_scaled(shape, size)) for key, shape in shaped.faces.items()}
    shaped = type(shaped)(mesh, exact)
    plain, near = gmsnet.smooth(mesh, slide=True), gmsnet.smooth(mesh, slide=True, geometry=Shapes(exact))
    edge = plain.surface_change.edge
    assert near.moved.sum() > 0.9 * plain.moved.sum()
    assert off(shaped, near.points) < 1e-3 * edge
    assert off(shaped, near.points) < 0.2 * off(shaped, plain.points)
    assert near.after.shape.min() > near.before.shape.min()
    assert near.after.inverted == 0


def _scaled(shape, size):
    found = dict(vars(shape))
    for key in ("centre", "point", "apex"):
        if key in found:
            found[key] = tuple(size * value for value in found[key])
    for key in ("radius", "ring", "tube"):
        if key in found:
            found[key] = size * found[key]
    return found


class Asked(Shapes):
    """Notes what it is asked."""

    def __init__(self, shapes):
        super().__init__(shapes)
        self.entities = []

    def project(self, entity, points):
        self.entities.append(entity)
        return super().project(entity, points)


def test_entities_name_regions_and_their_curves():
    shaped = disturb_on(cylinder(900, cells="tetra"), 0.3)
    geometry = Asked(shaped.faces)
    gmsnet.smooth(shaped.mesh, slide=True, geometry=geometry)
    assert {(entity.dimension, frozenset(entity.markers)) for entity in geometry.entities} == {
        (2, frozenset({"side"})),
        (1, frozenset({"bottom", "side"})),
        (1, frozenset({"top", "side"})),
    }


class Wrong(Shapes):
    def __init__(self, places=None, tangents=None):
        super().__init__({"sphere": Sphere((0.0, 0.0, 0.0), 0.5)})
        self.places, self.tangents = places, tangents

    def project(self, entity, points):
        places, parameters = super().project(entity, points)
        return (places if self.places is None else self.places(places)), parameters

    def tangent(self, entity, parameters):
        tangents = super().tangent(entity, parameters)
        return tangents if self.tangents is None else self.tangents(tangents)


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        (Shapes({"ball": Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))}), "there is no shape for the patch 0"),
        (Wrong(places=lambda p: p[:-1]), "the places that geometry gives"),
        (Wrong(places=lambda p: p * np.nan), "finite numbers"),
        (Wrong(places=lambda p: 3 * p), "of its longest edge away"),
        (Wrong(places=lambda p: p + 0.1 * np.sin(40 * p[:, ::-1])), "pieces of its facets"),
        (Wrong(tangents=lambda t: t[:, 0]), "the tangents that geometry gives"),
        (Wrong(tangents=lambda t: t[:, [0, 0]]), "span no plane"),
    ],
)
def test_geometries_that_do_not_fit(geometry, message):
    with pytest.raises(InputError, match=message):
        gmsnet.smooth(sphere_surface(100).mesh, geometry=geometry)


def test_shapes_want_a_mapping():
    with pytest.raises(InputError, match="mapping"):
        Shapes({})
    with pytest.raises(InputError, match="the curve 3"):
        Shapes({"a": Sphere((0.0, 0.0, 0.0), 1.0)}).tangent(Entity(1, 3, ("a",)), np.zeros((1, 3)))
