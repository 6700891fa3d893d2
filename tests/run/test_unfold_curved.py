"""Curved surfaces whose nodes were thrown along them: folds are mended, those that are there on purpose stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.surface_meshes import surface_mesh

import gmsnet
from gmsnet.constraints.facets import edge_lengths
from gmsnet.constraints.shapes import Shape
from gmsnet.constraints.shell import FEATURE, patches_of_surface
from gmsnet.generate.extruded import cylinder
from gmsnet.generate.shaped import Shaped, disturb_on
from gmsnet.generate.surfaces import sphere_surface, torus_surface
from gmsnet.measure.surface_change import Grid
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.flat_part import FlatPart
from gmsnet.run.options import SmoothOptions
from gmsnet.run.unfold import Unfolded, unfolded
from gmsnet.topology.topology import Topology

SHAPES = {
    "sphere of triangles": sphere_surface(1000),
    "sphere of quads": sphere_surface(1000, cells="quad"),
    "torus of triangles": torus_surface(4000),
    "torus of quads": torus_surface(4000, cells="quad"),
}


def thrown(shaped: Shaped, amount: float, seed: int = 3) -> Mesh:
    """All of a surface in one region, its nodes thrown along it."""
    mesh = disturb_on(shaped, amount, seed=seed, keep_valid=False).mesh
    cells = tuple(replace(each, regions=np.ones_like(each.regions)) for each in mesh.cells)
    return replace(mesh, cells=cells, region_names={})


def turned(mesh: Mesh, points: np.ndarray, shape: Shape) -> int:
    """How many cells have a corner that is turned against the true surface."""
    count = 0
    for block in mesh.cells:
        rows, wrong = block.nodes, np.zeros(len(block.nodes), dtype=bool)
        normal = shape.normal(shape.project(points[rows].mean(axis=1)))
        for k in range(rows.shape[1]):
            here, ahead, behind = points[rows[:, k]], points[np.roll(rows, -1, axis=1)[:, k]], points[rows[:, k - 1]]
            wrong |= (np.cross(ahead - here, behind - here) * normal).sum(axis=1) <= 0.0
        count += int(wrong.sum())
    return count


def mended(mesh: Mesh, **options: object) -> Unfolded:
    """What comes of it before any sweep."""
    topology, nothing = Topology.of(mesh), np.zeros(len(mesh.points), dtype=bool)
    facets, patches = patches_of_surface(mesh, topology, None, 30.0, nothing)
    return unfolded(mesh, facets, patches, nothing, SmoothOptions(**options))


@pytest.mark.parametrize("amount", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("name", SHAPES)
def test_nodes_that_were_thrown_along_a_surface_find_back(name, amount):
    shaped = SHAPES[name]
    mesh, shape = thrown(shaped, amount), *shaped.faces.values()
    was = turned(mesh, mesh.points, shape)
    result = gmsnet.smooth(mesh)
    left = turned(mesh, result.points, shape)
    assert left <= 0.01 * was
    assert any("where the surface is folded over, untangling" in note for note in result.notes) == (was > 0)
    size = np.linalg.norm(
        mesh.points[mesh.cells[0].nodes[:, 0]] - mesh.points[mesh.cells[0].nodes[:, 1]], axis=1
    ).mean()
    off = np.linalg.norm(result.points - shape.project(result.points), axis=1) / size
    assert off.mean() < 0.02
    assert len(result.held.get(FEATURE, ())) < 0.05 * len(mesh.points)


@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_a_facet_that_is_upright_alone_is_no_step(seed):
    shaped = torus_surface(450)
    mesh, shape = thrown(shaped, 0.7, seed), *shaped.faces.values()
    result = gmsnet.smooth(mesh)
    assert turned(mesh, mesh.points, shape) > 50
    assert turned(mesh, result.points, shape) == 0
    assert result.judged.after.shape_min > 0.1


def test_folds_that_are_left_are_told_though_no_other_is_near_any_more():
    shaped = torus_surface(450)
    mesh, shape = thrown(shaped, 0.7, seed=5), *shaped.faces.values()
    result = gmsnet.smooth(mesh)
    assert turned(mesh, result.points, shape) == 1
    assert any("untangling: 1 of 55 cells that are folded over are left" in note for note in result.notes)


def test_folds_stay_where_untangling_is_off():
    mesh, shape = thrown(SHAPES["sphere of quads"], 0.9), *SHAPES["sphere of quads"].faces.values()
    result = gmsnet.smooth(mesh, untangle=False)
    assert turned(mesh, result.points, shape) > 100
    assert not any("untangling" in note for note in result.notes)


@pytest.mark.parametrize("tolerance", [0.01, 0.05])
def test_mended_nodes_are_within_the_tolerance_from_the_facets_of_the_input(tolerance):
    mesh = thrown(SHAPES["torus of triangles"], 0.9)
    found = mended(mesh, surface_tolerance=tolerance)
    moved = (found.mesh.points != mesh.points).any(axis=1)
    assert moved.sum() > 100
    facets, _ = patches_of_surface(mesh, Topology.of(mesh), None, 30.0, ~moved)
    far, _ = Grid(mesh.points[facets.rows]).nearest(found.mesh.points[moved])
    assert (far <= (1 + 1e-9) * tolerance * edge_lengths(facets, mesh.points, mesh)[moved]).all()
    assert found.laid.any()


def test_nodes_that_are_to_be_held_stay():
    mesh = thrown(SHAPES["sphere of triangles"], 0.7)
    fixed = np.arange(0, len(mesh.points), 7)
    result = gmsnet.smooth(mesh, fixed=fixed)
    assert not result.moved[fixed].any()


@pytest.mark.parametrize("single", [False, True])
def test_a_bound_of_facets_is_kept(single):
    mesh = thrown(SHAPES["sphere of quads"], 0.6)
    mesh = replace(mesh, points=mesh.points.astype(np.float32).astype(float), single=single)
    for bound in (0.02, 0.001):
        result = gmsnet.smooth(mesh, hausdorff=bound)
        if single:
            assert np.array_equal(result.points, result.points.astype(np.float32))
        share = result.surface_change.hausdorff / result.surface_change.diagonal
        untangled, told = (any(word in note for note in result.notes) for word in ("untangling", "is not kept"))
        assert untangled == (bound > 0.01)
        # Where folds stay, places are over facets that face the other way, which nodes come nearer to.
        assert share <= bound if untangled else share <= 1.5 * bound
        assert told == (share > bound)


def test_rims_and_planes_of_a_cylinder_stay():
    shaped = cylinder(1400, cells="quad")
    mesh = thrown(shaped, 0.7)
    result = gmsnet.smooth(mesh)
    flat = np.isin(mesh.points[:, 2], [mesh.points[:, 2].min(), mesh.points[:, 2].max()])
    assert np.array_equal(result.points[flat, 2], mesh.points[flat, 2])
    assert abs(np.linalg.norm(result.points[~flat, :2], axis=1) - 0.5).max() < 0.01
    rim = flat & (np.linalg.norm(mesh.points[:, :2], axis=1) > 0.5 - 1e-9)
    assert rim.sum() > 50
    assert not result.moved[rim].any()


def grid(place, nu, nv, kind, amount, around=False):
    """A grid of nu by nv cells whose nodes ``place(u, v)`` puts into space; inner ones off folds are thrown.

    around: v is closed."""
    mv = nv if around else nv + 1
    u, v = (axis.ravel().astype(float) for axis in np.meshgrid(np.arange(nu + 1), np.arange(mv), indexing="ij"))
    rng, inner = np.random.default_rng(1), (u > 0) & (u < nu) & (around | ((v > 0) & (v < nv)))
    inner &= ~np.isin(u, FOLDS)
    shift = amount * rng.uniform(-1, 1, (2, len(u))) * inner
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij"))
    quads = np.column_stack([(i + a) * mv + (j + b) % mv for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))])
    halves = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    return surface_mesh(place(u + shift[0], v + shift[1]), {"quad": quads} if kind == "quad" else {"triangle": halves})


FOLDS = (10, 13)  # the rows of nodes along which sheets are folded


def hem(u, v):
    """A bent sheet whose last rows lie below the others."""
    x = np.where(u > 13, 26 - u, u)
    return np.column_stack([x, v, 1.5 * np.sin(x / 5) * np.cos(v / 6) - 0.02 * np.maximum(u - 13, 0)])


def pleat(u, v):
    """A bent sheet that goes forth, back, and forth."""
    x = np.where(u <= 10, u, np.where(u <= 13, 20 - u, u - 6))
    return np.column_stack([x, v, 1.5 * np.sin(x / 5) * np.cos(v / 6) + 0.02 * np.clip(u - 10, 0, 3)])


def tube(u, v):
    """A tube with such a pleat around."""
    x, r = np.where(u <= 10, u, np.where(u <= 13, 20 - u, u - 6)), 6.0 + 0.02 * np.clip(u - 10, 0, 3)
    return np.column_stack([x, r * np.cos(np.pi * v / 16), r * np.sin(np.pi * v / 16)])


def blade(u, v):
    """A thin blade with an edge like a knife's."""
    z = 0.08 * np.where(u <= 13, 1.0, -1.0) * abs(13 - u)
    return np.column_stack([abs(13 - u), v, z + 0.3 * np.sin(v / 3)])


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize(("place", "nu", "nv"), [(hem, 16, 16), (pleat, 30, 16), (tube, 30, 32), (blade, 26, 12)])
def test_sheets_that_are_folded_on_purpose_stay(place, nu, nv, kind):
    mesh = grid(place, nu, nv, kind, 0.2, place is tube)
    found = mended(mesh)
    assert found.mesh is mesh
    assert not found.notes
    tangled = grid(place, nu, nv, kind, 0.45, place is tube)  # with folds that are not on purpose, too
    folds = np.isin(np.arange(len(mesh.points)) // (nv + (place is not tube)), FOLDS)
    assert np.array_equal(mended(tangled).mesh.points[folds], tangled.points[folds])


def test_a_surface_without_folds_is_what_it_was():
    mesh = thrown(SHAPES["sphere of quads"], 0.2)
    found = mended(mesh)
    assert found.mesh is mesh
    assert not found.laid.any()


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_noise_is_no_surface_to_put_nodes_back_on(kind, monkeypatch):
    mesh = sphere_surface(3000, cells=kind).mesh
    rng = np.random.default_rng(0)
    noise = mesh.with_points(mesh.points + 0.02 * rng.uniform(-1, 1, mesh.points.shape))
    tried = []
    monkeypatch.setattr(FlatPart, "untangled", lambda *given: tried.append(given))
    assert mended(noise).mesh is noise
    assert len(tried) <= 20


def strip(around: int, rows: int, height: float, amount: float, seed: int) -> Mesh:
    """A low cylinder whose facets are much wider than high, its inner nodes thrown along it."""
    rng = np.random.default_rng(seed)
    turn, up = np.meshgrid(np.arange(around) / around, np.linspace(0.0, 1.0, rows))
    turn[1:-1] += rng.uniform(-amount, amount, turn[1:-1].shape) / around
    up[1:-1] += rng.uniform(-amount, amount, up[1:-1].shape) / (rows - 1)
    points = np.stack([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn), height * up], axis=-1).reshape(-1, 3)
    row, column = np.divmod(np.arange((rows - 1) * around), around)
    a, b = row * around + column, row * around + (column + 1) % around
    halves = np.stack([a, b, b + around], axis=1), np.stack([a, b + around, a + around], axis=1)
    return gmsnet.mesh_from_arrays(points, np.concatenate(halves))


@pytest.mark.parametrize("seed", range(3))
def test_no_facet_ends_worse_than_the_worst_where_folds_are_mended(seed: int) -> None:
    mesh = strip(40, 8, 0.01, 0.4, seed)
    done = gmsnet.smooth(mesh)
    assert any("parts laid flat" in note for note in done.notes)
    assert done.after.shape.min() >= done.before.shape.min() * (1 - 1e-6)
