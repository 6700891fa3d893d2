"""Generated shapes: closed, on the true surface, features exact, thrown along the surface."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import gmsnet
from gmsnet.cli import app
from gmsnet.constraints.shapes import Cone, Cylinder, Plane, Sphere, Star, Torus, units
from gmsnet.errors import InputError
from gmsnet.generate import (
    ball_volume,
    bracket,
    cone_surface,
    cylinder,
    disturb_on,
    organic_surface,
    sphere_surface,
    torus_surface,
)
from gmsnet.generate.surfaces import BUMPS, HEIGHTS, SHARPNESS

L = 0.3 + 0.21 - 2 * math.pi * 0.07**2  # what the fillet adds, the round corner takes
MADE = {  # maker, arguments, Euler's number, enclosed volume for the size 1
    "sphere": (sphere_surface, {}, 2, math.pi / 6),
    "sphere of quads": (sphere_surface, {"cells": "quad"}, 2, math.pi / 6),
    "torus": (torus_surface, {}, 0, 2 * math.pi**2 * 0.4**2 * (0.5 / 1.4) ** 3),
    "torus of quads": (torus_surface, {"cells": "quad"}, 0, 2 * math.pi**2 * 0.4**2 * (0.5 / 1.4) ** 3),
    "cylinder": (cylinder, {}, 2, math.pi / 4),
    "cylinder of quads": (cylinder, {"cells": "quad"}, 2, math.pi / 4),
    "cylinder of tetrahedra": (cylinder, {"cells": "tetra"}, 2, math.pi / 4),
    "cone": (cone_surface, {}, 2, math.pi / 24),
    "organic": (organic_surface, {}, 2, None),
    "bracket": (bracket, {}, -2, 0.3 * L),
    "bracket of tetrahedra": (bracket, {"cells": "tetra"}, -2, 0.3 * L),
    "ball": (ball_volume, {}, 2, math.pi / 6),
}


def split(rows):
    return rows if rows.shape[1] == 3 else np.concatenate([rows[:, [0, 1, 2]], rows[:, [0, 2, 3]]])


def check(shaped, euler, volume):
    """The boundary is closed, each facet lies on its face and is seen from outside. Returns the enclosed volume."""
    mesh, facets = shaped.mesh, shaped.mesh.cells[-1]
    rows, points = facets.nodes, mesh.points
    edges = np.concatenate([np.column_stack([rows[:, k - 1], rows[:, k]]) for k in range(rows.shape[1])])
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert np.array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
    assert len(np.unique(rows)) - len(edges) // 2 + len(rows) == euler
    assert len(np.unique(mesh.cells[0].nodes)) == len(points)
    for number, (name, shape) in enumerate(shaped.faces.items(), start=1):
        assert mesh.region_names[2, number] == name
        own = points[rows[facets.regions == number]]
        assert len(own)
        flat = own.reshape(-1, 3)
        assert abs(shape.project(flat) - flat).max() < 1e-14 * max(1.0, abs(points).max())
    a, b, c = (points[split(rows)[:, k]] for k in range(3))
    found = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    if volume is not None:
        assert found == pytest.approx(volume, rel=0.03)
    if mesh.has_volumes:
        report = gmsnet.quality(mesh)
        assert report.inverted == 0
        assert report.shape.sum() > 0
    return found


@pytest.mark.parametrize("name", MADE)
def test_shapes_are_closed_and_exact(name):
    make, arguments, euler, volume = MADE[name]
    for size in (1.0, 3.0):
        shaped = make(1500, **arguments, size=size)
        check(shaped, euler, None if volume is None else volume * size**3)
        assert 0.75 * 1500 < len(shaped.mesh.points) < 1.35 * 1500
        if name != "organic":
            assert np.ptp(shaped.mesh.points[:, 0]) == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("name", MADE)
def test_nodes_are_thrown_along_the_surface(name):
    make, arguments, euler, volume = MADE[name]
    shaped = make(1000, **arguments)
    thrown = disturb_on(shaped, 0.4, seed=2)
    check(thrown, euler, volume)
    mesh, facets = shaped.mesh, shaped.mesh.cells[-1]
    of = [np.unique(facets.nodes[facets.regions == k + 1]) for k in range(len(shaped.faces))]
    count = np.bincount(np.concatenate(of), minlength=len(mesh.points))
    moved = (thrown.mesh.points != mesh.points).any(axis=1)
    assert not moved[count > 1].any()
    assert moved[count <= 1].mean() > 0.99
    assert thrown.mesh.points.tobytes() == disturb_on(shaped, 0.4, seed=2).mesh.points.tobytes()
    assert thrown.mesh.points.tobytes() != disturb_on(shaped, 0.4, seed=3).mesh.points.tobytes()
    normal_ok(thrown)


def normal_ok(shaped):
    facets, points = shaped.mesh.cells[-1], shaped.mesh.points
    for number, shape in enumerate(shaped.faces.values(), start=1):
        a, b, c = points[split(facets.nodes[facets.regions == number])].transpose(1, 0, 2)
        centre = shape.project((a + b + c) / 3)
        if facets.nodes.shape[1] == 3:
            assert ((np.cross(b - a, c - a) * shape.normal(centre)).sum(axis=1) > 0).all()


def test_what_cannot_be_made():
    for make in (sphere_surface, torus_surface, cylinder, cone_surface, organic_surface, bracket, ball_volume):
        with pytest.raises(InputError, match="number of nodes"):
            make(3)
        with pytest.raises(InputError, match="size"):
            make(50, size=-1.0)
    with pytest.raises(InputError, match="cells"):
        sphere_surface(cells="hex")
    with pytest.raises(InputError, match="amount"):
        disturb_on(sphere_surface(50), -1.0)
    with pytest.raises(InputError, match="edge"):
        disturb_on(sphere_surface(50), 0.1, edge="longest")


def test_the_command_line(tmp_path):
    path = tmp_path / "part.mesh"
    call = ["generate", str(path), "--pattern", "bracket", "--cells", "tetra", "--nodes", "600", "--jitter", "0.2"]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output
    wanted = disturb_on(bracket(600, cells="tetra"), 0.2).mesh
    found = gmsnet.read(path)
    assert np.array_equal(found.points, wanted.points)
    assert f"{len(wanted.cells[1].nodes):,} boundary faces" in done.output
    done = CliRunner().invoke(app, ["generate", str(tmp_path / "s.obj"), "--pattern", "sphere", "--cells", "quad"])
    assert done.exit_code == 0, done.output
    assert "quads (seed 0)" in done.output


SHAPES = {
    "plane": Plane((0.1, 0.2, 0.3), (0.6, 0.0, 0.8)),
    "sphere": Sphere((0.1, 0.2, 0.3), 0.7),
    "cylinder": Cylinder((0.1, 0.2, 0.3), (0.0, 0.6, 0.8), 0.4),
    "cone": Cone((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), 0.5),
    "torus": Torus((0.0, 0.1, 0.0), (0.0, 0.0, 1.0), 1.0, 0.3),
    "star": Star(0.5, units(BUMPS), HEIGHTS, SHARPNESS),
}


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), name=st.sampled_from(sorted(SHAPES)))
def test_places_are_the_nearest_ones_and_normals_stand_on_the_surface(seed, name):
    shape, rng = SHAPES[name], np.random.default_rng(seed)
    points = rng.normal(size=(20, 3))
    at = shape.project(points)
    assert abs(shape.project(at) - at).max() < 1e-12
    points, at = points[abs(at - [0, 0, 2]).max(axis=1) > 0.05], at[abs(at - [0, 0, 2]).max(axis=1) > 0.05]  # the apex
    normal = shape.normal(at)
    assert abs(np.linalg.norm(normal, axis=1) - 1).max() < 1e-12
    near = shape.project(at + 1e-5 * rng.normal(size=at.shape)) - at
    assert abs((near * normal).sum(axis=1)).max() < 1e-6 * np.linalg.norm(near, axis=1).max() * 50 + 1e-9
    if name != "star":
        others = shape.project(rng.normal(size=(200, 3)))
        far = np.linalg.norm(points[:, None] - others, axis=2).min(axis=1)
        assert (np.linalg.norm(points - at, axis=1) <= far + 1e-12).all()
