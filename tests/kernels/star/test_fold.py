"""Facets of a boundary that would turn over: against the normals of a true sphere, and in whole runs."""

from __future__ import annotations

import numpy as np
import pytest
from support import surfaces

import gmsnet
from gmsnet.constraints.on_surface import surface_of
from gmsnet.generate import ball_volume, cylinder, disturb_on
from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.star.fold import LEAST_COSINE, folds


@kernel
def folded(surface, node, points, place, x, y, z):
    return folds(surface, node, points, place, x, y, z)


def cosines(points, rows, node, place):
    """Of all facets around a node that is moved, with the sphere's normal at their middles."""
    moved = points.copy()
    moved[node] = place
    a, b, c = moved[rows[(rows == node).any(axis=1)]].transpose(1, 0, 2)
    normal, middle = np.cross(b - a, c - a), a + b + c
    return (normal * middle).sum(axis=1) / np.linalg.norm(normal, axis=1) / np.linalg.norm(middle, axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_turned_facets_are_told(seed):
    points, rows = surfaces.sphere(150, seed)
    found = surfaces.patches(points, rows, 60.0)
    surface = surface_of(found, points, np.arange(len(points), dtype=np.int32), False)
    rng, told = np.random.default_rng(seed), set()
    for node in rng.integers(len(points), size=150):
        at = points[node] + 0.25 * rng.normal(size=3)
        at /= np.linalg.norm(at)
        least = cosines(points, rows, node, at).min()
        if abs(least - LEAST_COSINE) < 0.1:
            continue
        place = np.int64(surface.place[surface.row[node]])
        assert folded(surface, node, points, place, *at) == (least < LEAST_COSINE)
        told.add(bool(least < LEAST_COSINE))
    assert told == {True, False}


def test_a_facet_that_is_turned_may_turn_back():
    points, rows = surfaces.sphere(150)
    surface = surface_of(surfaces.patches(points, rows, 60.0), points, np.arange(len(points), dtype=np.int32), False)
    node = 7
    ring = np.unique(rows[(rows == node).any(axis=1)])
    way = points[ring[ring != node][0]] - points[node]
    over = points.copy()
    over[node] += 1.5 * way
    over[node] /= np.linalg.norm(over[node])
    place = np.int64(surface.place[node])
    assert folded(surface, node, points, place, *over[node])
    assert cosines(over, rows, node, over[node]).min() < 0
    assert not folded(surface, node, over, place, *points[node])


@pytest.mark.parametrize("make", [cylinder, ball_volume])
def test_no_facet_of_a_boundary_turns_over(make):
    shaped = disturb_on(make(500, **({"cells": "tetra"} if make is cylinder else {})), 1.0, seed=4)
    mesh, facets = shaped.mesh, shaped.mesh.cells[1]
    result = gmsnet.smooth(mesh, slide=True, feature_angle=60)
    assert result.after.shape.min() > result.before.shape.min()
    for number, shape in enumerate(shaped.faces.values(), start=1):
        a, b, c = result.points[facets.nodes[facets.regions == number]].transpose(1, 0, 2)
        normal = shape.normal(shape.project((a + b + c) / 3))
        assert ((np.cross(b - a, c - a) * normal).sum(axis=1) > 0).all()
