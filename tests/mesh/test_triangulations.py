"""Meshes of scikit-fem, Matplotlib and SciPy: the type that came in goes out, with its sets and its mask."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

import gmsnet
from gmsnet.errors import InputError
from gmsnet.mesh.adapters import to_mesh


def jittered(seed=0, count=150):
    points = np.random.default_rng(seed).random((count, 2))
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return np.vstack([corners, points])


@pytest.fixture
def skfem():
    return pytest.importorskip("skfem")


def test_delaunay_gives_arrays():
    given = Delaunay(jittered())
    points = given.points.copy()
    result = gmsnet.smooth(given, max_sweeps=3)
    new, triangles = result.mesh
    assert result.moved.any()
    assert new.tolist() == result.points.tolist()
    assert triangles.tolist() == given.simplices.tolist()
    assert given.points.tolist() == points.tolist()
    alike = gmsnet.smooth((points, given.simplices), max_sweeps=3)
    assert alike.points.tolist() == result.points.tolist()


def test_delaunay_of_space_is_a_volume():
    points = np.random.default_rng(0).random((20, 3))
    assert [block.kind for block in to_mesh(Delaunay(points))[0].cells] == ["tetra"]
    with pytest.raises(InputError, match="in 4 dimensions is no mesh"):
        to_mesh(Delaunay(np.random.default_rng(0).random((20, 4))))


@pytest.mark.parametrize("masked", [False, True])
def test_a_triangulation_keeps_its_triangles_and_its_mask(masked):
    tri = pytest.importorskip("matplotlib.tri")
    points = jittered()
    given = tri.Triangulation(*points.T)
    if masked:
        centre = points[given.triangles].mean(axis=1)
        given.set_mask(np.hypot(*(centre - 0.5).T) < 0.2)
    result = gmsnet.smooth(given, max_sweeps=3)
    assert type(result.mesh) is tri.Triangulation
    assert np.column_stack([result.mesh.x, result.mesh.y]).tolist() == result.points.tolist()
    assert result.mesh.triangles.tolist() == given.triangles.tolist()
    assert np.column_stack([given.x, given.y]).tolist() == points.tolist()
    assert result.moved.any()
    assert len(result.after.cell) == len(given.triangles) - (given.mask.sum() if masked else 0)
    if masked:
        assert result.mesh.mask.tolist() == given.mask.tolist()
        hidden = given.triangles[given.mask]
        assert len(hidden) > 5
        assert not result.moved[hidden].any()
    else:
        assert result.mesh.mask is None


def test_a_mesh_of_triangles_of_scikit_fem(skfem):
    points = jittered()
    given = skfem.MeshTri(points.T.copy(), Delaunay(points).simplices.T.copy())
    given = given.with_subdomains({"left": lambda x: x[0] < 0.5}).with_boundaries({"low": lambda x: x[1] == 0.0})
    result = gmsnet.smooth(given, max_sweeps=3)
    made = result.mesh
    assert type(made) is type(given)
    assert made.p.T.tolist() == result.points.tolist()
    assert made.t.tolist() == given.t.tolist()
    assert given.p.T.tolist() == points.tolist()
    assert {name: ids.tolist() for name, ids in made.subdomains.items()} == {"left": given.subdomains["left"].tolist()}
    assert {name: ids.tolist() for name, ids in made.boundaries.items()} == {"low": given.boundaries["low"].tolist()}
    left = np.isin(np.arange(given.t.shape[1]), given.subdomains["left"])
    between = np.intersect1d(given.t[:, left], given.t[:, ~left])
    assert result.moved.any()
    assert not result.moved[between].any()
    assert to_mesh(given)[0].markers["low"].tolist() == np.unique(given.facets[:, given.boundaries["low"]]).tolist()


def test_a_mesh_of_quads_of_scikit_fem(skfem):
    given = skfem.MeshQuad().refined(2)
    mesh, restore = to_mesh(given)
    assert [block.kind for block in mesh.cells] == ["quad"]
    made = restore(mesh.points + 1.0)
    assert type(made) is type(given)
    assert made.p.tolist() == (given.p + 1.0).tolist()
    assert made.t.tolist() == given.t.tolist()


def test_other_meshes_of_scikit_fem_are_refused_by_name(skfem):
    for given in (skfem.MeshHex2(), skfem.MeshLine()):
        with pytest.raises(InputError, match=type(given).__name__):
            gmsnet.smooth(given)


def test_tetrahedra_of_scikit_fem(skfem):
    mesh = skfem.MeshTet.init_tensor(*[np.linspace(0.0, 1.0, 5)] * 3)
    inner = mesh.interior_nodes()
    p = mesh.p.copy()
    p[:, inner] += 0.04 * np.random.default_rng(0).uniform(-1, 1, size=(3, len(inner)))
    given = skfem.MeshTet(p, mesh.t).with_boundaries({"left": lambda x: x[0] == 0.0})
    assert set(to_mesh(given)[0].node_sets) == {"left"}
    result = gmsnet.smooth(given)
    assert type(result.mesh) is type(given)
    assert result.after.shape.min() > result.before.shape.min()
    assert np.array_equal(result.mesh.p.T, result.points)
    assert np.array_equal(result.mesh.t, given.t)
    assert np.array_equal(result.mesh.boundaries["left"], given.boundaries["left"])
    outer = np.setdiff1d(np.arange(p.shape[1]), inner)
    assert np.array_equal(result.mesh.p[:, outer], p[:, outer])


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_tensors_come_back_as_tensors(precision):
    torch = pytest.importorskip("torch")
    points = jittered()
    cells = torch.from_numpy(Delaunay(points).simplices.astype(np.int64))
    given = torch.from_numpy(points).to(getattr(torch, precision))
    before = given.clone()
    result = gmsnet.smooth((given, cells), max_sweeps=3)
    new, same = result.mesh
    assert isinstance(new, torch.Tensor)
    assert same is cells
    assert new.dtype == given.dtype
    assert torch.equal(given, before)
    assert np.array_equal(new.numpy().astype(np.float64), result.points)
    told = gmsnet.smooth({"points": given, "cells": cells}, max_sweeps=3).mesh["points"]
    assert torch.equal(told, new)
