"""Patches, curves and corners of surfaces: exact counts, and the same as by their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.surfaces import Twin, boundary, cylinder, ell, facets_of, patches, solid, sphere, turned

import gmsnet
from gmsnet.constraints.facets import boundary_of, facet_keys
from gmsnet.constraints.patches import FEW, NOTHING, alone_of, linked, patches_of
from gmsnet.constraints.sliding_in_space import enclosed
from gmsnet.constraints.smooth_patches import vertices_of
from gmsnet.generate import disturb_on, sphere_surface
from gmsnet.topology.wound import Wound


def of_mesh(mesh, angle=30.0):
    facets = boundary_of(mesh, Wound.of(mesh))
    return facets, patches_of(facets, mesh.points, angle, mesh.single, np.ones(len(mesh.points), dtype=bool))


def counts(found):
    """Patches, curves, nodes that slide inside patches, and those on curves."""
    return len(np.unique(found.patch)), len(found.curves), int(found.slides.sum()), int(found.curves.slides.sum())


@pytest.mark.parametrize("turn", [None, 1])
@pytest.mark.parametrize(
    ("keep", "wanted"),
    [
        (None, (6, 12, 6 * 5 * 5, 12 * 5)),
        (ell, (8, 18, 2 * (5 * 5 - 3 * 3) + 4 * 2 * 5 + 2 * 5 * 5, 6 * 5 + 8 * 2 + 4 * 5)),
        (lambda at: ~((at >= 2) & (at < 4)).all(axis=1), (12, 24, 6 * 25 + 6, 12 * 5 + 12)),  # a cavity of 2³ cubes
    ],
)
def test_solids_of_cubes(keep, turn, wanted):
    points, cells, _ = solid(6, keep, 0.3)
    mesh = volumes.mesh_of(points if turn is None else points @ turned(turn).T, cells)
    facets, found = of_mesh(mesh)
    assert counts(found) == wanted
    assert found.curves.straight.all()
    assert sorted(map(tuple, np.sort(facets.rows, axis=1).tolist())) == sorted(map(tuple, boundary(cells).tolist()))
    volume = volumes.volumes6(points, cells).sum() / 6
    assert enclosed(mesh.points, facets) == pytest.approx(volume)  # so they are seen from outside


def test_a_cylinder_with_caps():
    points, rows = cylinder(24, 5)
    found = patches(points, rows)
    assert counts(found) == (3, 2, 4 * 24 + 2 * 25, 2 * 24)
    assert found.curves.closed.all()
    assert counts(patches(points, rows, 14.0)) == (2 + 24, 3 * 24, 2 * 25, 24 * 4)  # the caps, the sides, their edges
    assert counts(patches(points, rows, 95.0)) == (1, 0, len(points), 0)


@pytest.mark.parametrize("digits", [17, 9, 7, 6])
@pytest.mark.parametrize("seed", range(3))
def test_edges_that_turn_by_just_the_feature_angle_are_features_with_any_digits(digits, seed):
    """Twelve sides of a cylinder turn by 30°."""
    points, rows = cylinder(12, 4)
    points = points @ turned(seed).T
    points = np.array([float(f"{value:.{digits}g}") for value in points.ravel()]).reshape(points.shape)
    slides = patches(points, rows).slides
    assert np.array_equal(slides, patches(*cylinder(12, 4)).slides)


def test_a_sphere_is_one_patch():
    points, rows = sphere(400)
    assert counts(patches(points, rows)) == (1, 0, 400, 0)
    assert counts(patches(points, rows, 0.1))[2:] == (0, 0)


@pytest.mark.parametrize(("height", "is_tip"), [(3.0, True), (1.0, True), (0.6, True), (0.55, False), (0.2, False)])
def test_the_tip_of_a_cone_of_many_facets_is_no_place_to_slide_from(height, is_tip):
    angle = 2 * np.pi * np.arange(24) / 24
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack(
        [[[0, 0, height]], *(np.column_stack([r * ring, np.full(24, height * (1 - r))]) for r in (0.5, 1))]
    )
    j, k = np.arange(24), (np.arange(24) + 1) % 24
    rows = np.concatenate(
        [np.column_stack(row) for row in ((0 * j, 1 + j, 1 + k), (1 + j, 25 + j, 25 + k), (1 + j, 25 + k, 1 + k))]
    )
    points = points @ turned(3).T
    found = patches(points, rows)
    assert len(np.unique(found.patch)) == 1
    assert np.flatnonzero(found.tips).tolist() == [0] * is_tip
    assert found.slides[0] != is_tip
    assert found.slides[1:25].all()
    assert not patches(points, rows, 89.0).tips.any()
    vertices = vertices_of(found, points)
    if is_tip:  # each facet there has its own normal at the tip, and so straight edges
        at, corner = np.nonzero(rows == 0)
        assert np.array_equal(vertices.normals[at, corner], found.unit[at])
        along = points[rows[at, 0]] - points[rows[at, 1]]
        normal = vertices.normals[at, 1]
        assert abs((along * normal).sum(axis=1)).max() < 0.01


def test_marks_and_lines_cut_a_plane():
    points, cells, _ = solid(6, None, 0.3)
    facets = boundary(cells)
    top = facets[(points[facets][:, :, 2] == 1).all(axis=1)]
    left = points[top].mean(axis=1)[:, 0] < 0.5
    left = np.isin(np.arange(len(top)), np.flatnonzero(left))
    mesh = volumes.mesh_of(points, cells, more=[("triangle", top, np.where(left, 7, 8))])
    _, found = of_mesh(mesh)
    assert len(np.unique(found.patch)) == 7
    assert {(), ("7",), ("8",), ("7", "8")} == set(found.curves.names)
    _, halves = of_mesh(volumes.mesh_of(points, cells, more=[("triangle", top[left], 7)]))
    assert counts(halves) == counts(found)
    edges = np.sort(top[:, :2], axis=1)[:1]
    _, cut = of_mesh(volumes.mesh_of(points, cells, more=[("line", edges, 9)]))
    assert not cut.slides[edges].any()
    assert len(np.unique(cut.patch)) == 6


def test_regions_part_patches():
    points, cells, _ = solid(6)
    half = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int)
    _, found = of_mesh(volumes.mesh_of(points, cells, half))
    assert len(np.unique(found.patch)) == 2 + 4 * 2
    assert len(found.curves) == 2 * 4 + 4 * 2 + 4


@pytest.mark.parametrize(
    "cell",
    [("triangle", [[0, 60, 61]]), ("quad", [[60, 61, 67, 66]]), ("vertex", [[60], [61]]), ("line", [[60, 200]]),
     ("line", [[60, 60]]), ("triangle6", [[60, 61, 62, 63, 64, 65]]), ("triangle", [[60, 60, 61]]),
     ("line3", [[60, 61, 62]])],
)  # fmt: skip
def test_nodes_of_cells_that_are_no_facets_stay(cell):
    points, cells, on = solid(6)
    nodes = np.flatnonzero(on.sum(axis=1) == 1)
    chosen = nodes[np.asarray(cell[1]) % len(nodes)]
    if cell[0] == "line":
        chosen[:, 1:] = np.where(chosen[:, :1] == chosen[:, 1:], chosen[:, 1:], np.flatnonzero(~on.any(axis=1))[0])
    mesh = volumes.mesh_of(points, cells, more=[(cell[0], chosen, 5)])
    _, found = of_mesh(mesh)
    assert not (found.slides | found.curves.slides)[chosen].any()
    assert counts(found)[0] == 6


def some_surface(rng):
    """Facets of random cells, so with edges of many facets and nodes where balls touch; some without area."""
    points, cells = volumes.cube(int(rng.integers(20, 60)), int(rng.integers(1000)))
    cells = cells[rng.random(len(cells)) < rng.choice([0.3, 0.9, 1.0])]
    if not len(cells):
        return points, np.zeros((0, 3), dtype=int)
    rows = boundary(cells)
    if rng.random() < 0.5:
        points[:, 2] *= 0.05
    if rng.random() < 0.3:
        points[rows[0, 0]] = points[rows[0, 1]]
    turn = rng.random(len(rows)) < 0.02  # seen from the wrong side
    rows[turn] = rows[turn][:, [0, 2, 1]]
    return points @ turned(int(rng.integers(99))).T, rows


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_as_by_definition(seed):
    rng = np.random.default_rng(seed)
    points, rows = some_surface(rng)
    label = rng.integers(0, 2, len(rows)) if rng.random() < 0.5 else 0
    lines = rows[rng.random(len(rows)) < 0.05][:, :2]
    if rng.random() < 0.3 and len(rows):
        lines = np.vstack([lines, rng.integers(0, len(points), (3, 2))])
    lines = np.unique(np.sort(lines[lines[:, 0] != lines[:, 1]], axis=1), axis=0)
    may, angle = rng.random(len(points)) < 0.9, float(rng.choice([10, 30, 60, 100, 170]))
    still = np.flatnonzero(rng.random(len(points)) < 0.05)
    facets = facets_of(rows, len(points), label, lines, 3, still)
    found, twin = patches_of(facets, points, angle, False, may), Twin(facets, points, angle, may)
    same = found.patch[:, None] == found.patch[None, :]
    assert (same == (np.array(twin.part)[:, None] == np.array(twin.part)[None, :])).all()
    for f, row in enumerate(rows.tolist()):
        for k in range(3):
            edge = frozenset((row[k], row[(k + 1) % 3]))
            across = [g for g in twin.owners[edge] if g != f]
            assert found.beside[f, k] == (NOTHING if edge in twin.sharp else across[0])
    assert set(np.flatnonzero(found.slides).tolist()) == twin.slides
    assert set(np.flatnonzero(found.tips).tolist()) == twin.tips
    on_curves = set(np.flatnonzero(found.curves.slides).tolist())
    assert on_curves <= twin.through
    ends = {int(v) for c in range(len(found.curves)) for v in found.curves.nodes_of(c)[[0, -1]]}
    assert twin.through - on_curves <= ends  # a straight run begins there
    assert not on_curves & twin.slides


def test_linked_counts_parts():
    points, rows = cylinder(12, 2)
    found = patches(points, rows, 95.0)
    assert len(np.unique(linked(found.beside))) == 1
    nothing = np.zeros(found.beside.shape, dtype=bool)
    assert len(np.unique(linked(found.beside, nothing))) == len(rows)
    flat = len(np.unique(linked(found.beside, found.flat)))
    assert flat == 2 + 12  # the caps, and the sides of two levels each


@given(st.lists(st.tuples(*[st.integers(0, 6)] * 3), max_size=30))
def test_numbers_of_facets(rows):
    keys = facet_keys(np.array(rows, dtype=np.int64).reshape(-1, 3), 7).tolist()
    for one, key in zip(rows, keys, strict=True):
        assert [k == key for k in keys] == [sorted(row) == sorted(one) for row in rows]


@given(st.lists(st.tuples(*[st.integers(0, 12)] * 2).filter(lambda edge: edge[0] < edge[1]), max_size=20), st.data())
def test_edges_that_hang_together_with_few_others(edges, data):
    little = data.draw(st.lists(st.booleans(), min_size=len(edges), max_size=len(edges)))
    found = set(alone_of(np.array(edges, dtype=np.int64).reshape(-1, 2), np.array(little, dtype=bool)).tolist())
    for edge in edges:
        part = set(edge)
        while any(part & set(other) and not set(other) <= part for other in edges):
            part |= {node for other in edges if part & set(other) for node in other}
        own = [k for k, other in enumerate(edges) if set(other) <= part]
        assert (set(edge) <= found) == (len(own) <= FEW and all(little[k] for k in own))
    assert found <= {node for edge in edges for node in edge}


def test_nodes_that_uneven_cells_hold_are_told():
    """A sphere has no features; of one that was thrown far some edges bend by more than the feature angle."""
    mesh = disturb_on(sphere_surface(300), 0.45, seed=1).mesh
    result, larger = gmsnet.smooth(mesh), gmsnet.smooth(mesh, feature_angle=45)
    note = next(note for note in result.notes if note.startswith("surface: "))
    assert note.endswith("a feature angle of 45 lets them")
    assert larger.after.shape.min() > 0.9 > 5 * result.after.shape.min()
    assert not any("lets them" in note for note in gmsnet.smooth(sphere_surface(300).mesh).notes)
