"""Thin facets: their edges are no features on smooth surfaces, and take none away from rims beside them."""

from __future__ import annotations

import numpy as np
import pytest
from support.surface_meshes import box, surface_mesh

import gmsnet
from gmsnet import generate
from gmsnet.constraints.shell import FEATURE
from gmsnet.errors import InputError
from gmsnet.generate import disturb_on


def with_needle(mesh, row, height, lift):
    """The mesh with a node near the middle of an edge of a cell: so high above it in the cell, and lifted out of it."""
    rows, points = mesh.cells[0].nodes, mesh.points
    a, b, c = rows[row].tolist()
    p, q, r = points[[a, b, c]]
    normal = np.cross(q - p, r - p)
    inward = np.cross(normal, q - p)
    place = (p + q) / 2 + height * inward / np.linalg.norm(inward) + lift * normal / np.linalg.norm(normal)
    new = len(points)
    cells = np.vstack([np.delete(rows, row, axis=0), [[a, b, new], [b, c, new], [c, a, new]]])
    return surface_mesh(np.vstack([points, place]), {"triangle": cells}), (a, b, new)


def test_a_needle_on_a_ball_is_held_unless_it_is_freed():
    mesh, nodes = with_needle(generate.sphere_surface(600).mesh, 7, 0.001, 0.002)
    held = gmsnet.smooth(mesh)
    assert set(nodes) <= set(held.held[FEATURE].tolist())
    free = gmsnet.smooth(mesh, free_needles=True)
    assert FEATURE not in free.held
    assert free.after.shape.min() > 0.3 > 0.1 > held.after.shape.min()


@pytest.mark.parametrize("lift", [0.0, 0.01])
def test_a_rim_stays_one_where_a_needle_lies_along_it(lift):
    mesh, inner = box()
    rows = mesh.cells[0].nodes
    on_rim = [k for k, row in enumerate(rows) if not inner[row[:2]].any() and inner[row[2]]]
    for row in on_rim[:6]:
        thin, (a, b, _) = with_needle(mesh, row, 0.02, lift)
        held = gmsnet.smooth(thin, free_needles=True).held[FEATURE]
        assert set(np.flatnonzero(~inner)) <= set(held.tolist())
        assert {a, b} <= set(held.tolist())


def test_a_fan_of_needles_keeps_the_rim():
    k = np.arange(60)
    circle = np.column_stack([np.cos(k * np.pi / 30), np.sin(k * np.pi / 30)])
    low, high = (np.column_stack([circle, np.full(60, z)]) for z in (0.0, 0.1))
    rows = [(0, j + 1, j) for j in range(1, 59)] + [(60, 60 + j, 61 + j) for j in range(1, 59)]
    rows += [(j, (j + 1) % 60, 60 + j) for j in range(60)] + [((j + 1) % 60, 60 + (j + 1) % 60, 60 + j) for j in k]
    disc = surface_mesh(np.vstack([low, high]), {"triangle": rows})
    assert len(gmsnet.smooth(disc, free_needles=True).held[FEATURE]) == 120


def test_a_narrow_ledge_stays_one():
    """Two halves of a plane, one higher by a twentieth of an edge: the facets between them are all thin."""
    k = np.arange(9)
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(k, k, indexing="ij"))
    low = np.column_stack([x, y, np.zeros(81)])
    high = low + np.array([8.0, 0.0, 0.05])
    corner = (9 * k[:-1, None] + k[None, :-1]).ravel()
    quads = np.column_stack([corner, corner + 9, corner + 10, corner + 1])
    ledge = np.column_stack([72 + k[:-1], 81 + k[:-1], 82 + k[:-1], 73 + k[:-1]])
    quads = np.concatenate([quads, quads + 81, ledge])
    rows = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    rng = np.random.default_rng(0)
    points = np.vstack([low, high])
    inner = (points[:, 0] % 8 > 0) & (points[:, 1] % 8 > 0)
    points[inner, :2] += rng.uniform(-0.3, 0.3, (inner.sum(), 2))
    result = gmsnet.smooth(surface_mesh(points, {"triangle": rows}), free_needles=True)
    assert not result.moved[72:90].any()
    assert result.moved[inner].all()


@pytest.mark.parametrize("name", ["cylinder", "bracket", "cone_surface"])
def test_features_of_parts_are_held_whatever_needles_lie_at_them(name):
    good = getattr(generate, name)(1500)
    mesh = disturb_on(good, 0.4, seed=1).mesh
    rows = np.concatenate([block.nodes for block in mesh.cells if block.kind == "triangle"])
    plain = surface_mesh(mesh.points, {"triangle": rows})
    features = gmsnet.smooth(surface_mesh(good.mesh.points, {"triangle": rows}), max_sweeps=0, feature_angle=60).held[
        FEATURE
    ]
    held, free = gmsnet.smooth(plain), gmsnet.smooth(plain, free_needles=True)
    assert not free.moved[features].any()
    assert len(features) <= len(free.held[FEATURE]) < len(held.held[FEATURE])
    assert free.after.shape.min() >= held.after.shape.min()
    assert free.after.shape.mean() >= held.after.shape.mean() - 1e-3


def test_volumes_and_meshes_in_a_plane_have_no_needles():
    for mesh in (generate.random_mesh(30), generate.ball_volume(50).mesh):
        for option in ({"free_needles": True}, {"hausdorff": 0.1}):
            with pytest.raises(InputError, match=r"is of surfaces in space|is of facets whose nodes move"):
                gmsnet.smooth(mesh, **option)
    with pytest.raises(InputError, match="is of surfaces in space"):
        gmsnet.smooth(generate.ball_volume(50).mesh, free_needles=True, slide=True)
