"""Generated quads and mixed meshes: valid in exact arithmetic, wound alike, marked, the same for the same seed."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import quads as twin

from gmsnet.errors import InputError
from gmsnet.generate import (
    disturb,
    hybrid_mesh,
    kershaw_mesh,
    layered_mesh,
    random_mesh,
    random_quad_mesh,
    recombine,
    settle,
    split_into_quads,
    structured_mesh,
)
from gmsnet.generate.recombine import corner_quality
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

seeds = st.integers(0, 10_000)
SQUARE = ["bottom", "right", "top", "left"]


def kinds(mesh):
    return {block.kind: len(block.nodes) for block in mesh.cells}


def check(mesh, markers, area, rel=1e-12):
    """What all generators promise."""
    at, cells = twin.plane(mesh), twin.faces(mesh)
    assert all(twin.valid(at, cell) for cell in cells)
    assert twin.wound(mesh) == cells
    assert float(sum(twin.doubled_area(at, cell) for cell in cells)) / 2 == pytest.approx(area, rel=rel)
    assert mesh.region_names == {(1, k): name for k, name in enumerate(markers, start=1)} | {(2, 1): "domain"}
    count = Counter(frozenset(edge) for cell in cells for edge in twin.sides(cell))
    lines = mesh.cells[-1]
    assert lines.kind == "line"
    assert sorted(map(sorted, lines.nodes.tolist())) == sorted(sorted(edge) for edge, n in count.items() if n == 1)
    assert {edge for cell in cells for edge in twin.sides(cell)} >= {tuple(edge) for edge in lines.nodes.tolist()}
    assert max(count.values()) <= 2  # no hanging nodes: the area is the square's, each inner edge has two cells
    assert sorted(set(lines.regions.tolist())) == list(range(1, len(markers) + 1))


def same(one, two):
    return one.points.tobytes() == two.points.tobytes() and all(
        np.array_equal(a.nodes, b.nodes) and np.array_equal(a.regions, b.regions)
        for a, b in zip(one.cells, two.cells, strict=True)
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 80), st.sampled_from(["quad", "mixed"]), st.integers(0, 3), seeds)
def test_random_quads_are_valid_and_bounded_by_the_square(nodes, cells, settled, seed):
    arguments = {"cells": cells, "settled": settled, "seed": seed, "size": 2.0}
    mesh = random_quad_mesh(nodes, **arguments)
    check(mesh, SQUARE, 4.0)
    assert set(kinds(mesh)) <= ({"quad", "line"} if cells == "quad" else {"quad", "triangle", "line"})
    assert same(mesh, random_quad_mesh(nodes, **arguments))


@pytest.mark.parametrize("cells", ["quad", "mixed"])
@pytest.mark.parametrize("shape", ["circle", "plate", "lshape"])
def test_random_quads_take_every_shape(shape, cells):
    triangles = random_mesh(300, shape, seed=5)
    area = float(np.sum([twin.doubled_area(twin.plane(triangles), cell) for cell in twin.faces(triangles)])) / 2
    names = [triangles.region_names[1, k] for k in range(1, len(triangles.region_names))]
    mesh = random_quad_mesh(300, shape, cells=cells, seed=5)
    check(mesh, names, area, 1e-12 if cells == "mixed" else 0.02)


def test_about_as_many_nodes_as_asked_for():
    mesh = random_quad_mesh(5000, seed=1)
    assert len(twin.free(mesh)) == pytest.approx(5000, rel=0.05)


@settings(max_examples=20, deadline=None)
@given(st.integers(5, 80), seeds)
def test_pairs_are_those_of_the_greedy_matching(nodes, seed):
    mesh = random_mesh(nodes, seed=seed)
    triangles = [tuple(cell) for cell in mesh.cells[0].nodes.tolist()]
    at = twin.plane(mesh)
    left, expected = set(range(len(triangles))), []
    offers = []
    for i, j in itertools.combinations(range(len(triangles)), 2):
        shared = set(triangles[i]) & set(triangles[j])
        if len(shared) == 2:
            (far,), (near,) = set(triangles[i]) - shared, set(triangles[j]) - shared
            k = triangles[i].index(far)
            quad = (far, triangles[i][(k + 1) % 3], near, triangles[i][(k + 2) % 3])
            if twin.valid(at, quad):
                offers.append((twin.shape(at, quad), i, j, quad))
    for _, i, j, quad in sorted(offers, key=lambda offer: -offer[0]):
        if {i, j} <= left:
            left -= {i, j}
            expected.append(quad)
    found = recombine(mesh)
    assert {frozenset(cell) for cell in twin.faces(found) if len(cell) == 4} == set(map(frozenset, expected))
    assert {frozenset(cell) for cell in twin.faces(found) if len(cell) == 3} == {frozenset(triangles[k]) for k in left}


def test_pairs_stay_within_regions_and_off_line_cells_and_above_the_bound():
    mesh = random_mesh(400, seed=3)
    triangles, lines = mesh.cells
    left = mesh.points[triangles.nodes].mean(axis=1)[:, 0] < 0.5
    regions = Mesh(mesh.points, (CellBlock("triangle", triangles.nodes, 1 + left), lines))
    found = recombine(regions, least=0.5)
    quads = found.cells[0]
    for cell, region in zip(quads.nodes, quads.regions, strict=True):
        owners = np.isin(triangles.nodes, cell).all(axis=1)
        assert set((1 + left)[owners]) == {region}
        assert owners.sum() == 2
    assert corner_quality(mesh.points, quads.nodes).min() >= 0.5
    assert len(quads.nodes) < len(recombine(mesh).cells[0].nodes)
    edge = triangles.nodes[:, :2]
    fenced = Mesh(mesh.points, (triangles, CellBlock("line", edge, np.ones(len(edge), dtype=int))))
    joined = {frozenset(pair) for cell in recombine(fenced).cells[0].nodes.tolist() for pair in (cell[::2], cell[1::2])}
    assert not joined & {frozenset(pair) for pair in edge.tolist()}


def test_clockwise_triangles_make_clockwise_quads():
    mesh = random_mesh(100, seed=3)
    turned = Mesh(mesh.points, (CellBlock("triangle", mesh.cells[0].nodes[:, ::-1], mesh.cells[0].regions),))
    quads = recombine(turned).cells[0].nodes
    assert len(quads) > 50
    assert (corner_quality(mesh.points, quads[:, ::-1]) > 0).all()


def test_every_corner_quality_is_that_of_the_twin():
    mesh = disturb(structured_mesh(6), np.arange(49), 0.7, seed=1, keep_valid=False)
    at = twin.plane(mesh)
    expected = [twin.shape(at, cell) for cell in twin.faces(mesh)]
    assert corner_quality(mesh.points, mesh.cells[0].nodes) == pytest.approx(expected, rel=1e-12)


def test_splitting_keeps_regions_lines_and_vertices():
    points = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2], [3, 1]])
    mesh = Mesh(
        points,
        (
            CellBlock("triangle", np.array([[1, 4, 2]]), np.array([7])),
            CellBlock("line", np.array([[1, 2]]), np.array([3])),
            CellBlock("quad", np.array([[0, 1, 2, 3]]), np.array([5])),
            CellBlock("vertex", np.array([[4]]), np.array([9])),
        ),
        {(2, 7): "roof", (1, 3): "eaves"},
    )
    fine = split_into_quads(mesh)
    assert kinds(fine) == {"quad": 7, "line": 2, "vertex": 1}
    assert fine.cells[0].regions.tolist() == [7] * 3 + [5] * 4
    assert fine.cells[1].regions.tolist() == [3, 3]
    assert fine.region_names == mesh.region_names
    middle = int(np.flatnonzero((fine.points == [2, 1]).all(axis=1))[0])
    assert fine.cells[1].nodes.tolist() == [[1, middle], [middle, 2]]
    at = twin.plane(fine)
    assert all(twin.valid(at, cell) for cell in twin.faces(fine))
    assert len(fine.points) == 5 + 6 + 2


@pytest.mark.parametrize("make", [structured_mesh, kershaw_mesh])
def test_grids_have_rows_and_columns(make):
    mesh = make(5, 3, size=2.0)
    check(mesh, SQUARE, 4.0)
    assert kinds(mesh) == {"quad": 15, "line": 16}
    assert len(mesh.points) == 24
    assert mesh.markers["left"].tolist() == [0, 6, 12, 18]
    assert kinds(make(4))["quad"] == 16
    x, y = mesh.points.T
    assert sorted(set(mesh.markers["top"])) == np.flatnonzero(y == 2.0).tolist()
    assert sorted(set(mesh.markers["right"])) == np.flatnonzero(x == 2.0).tolist()


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 30), st.integers(1, 30), st.floats(1e-3, 1.0))
def test_zigzags_are_valid(columns, rows, flatness):
    check(kershaw_mesh(columns, rows, flatness=flatness), SQUARE, 1.0)


def test_zigzag_levels():
    y = kershaw_mesh(12, 4, flatness=0.2).points[:, 1].reshape(5, 13)
    assert y[2] == pytest.approx([0.1] * 3 + [0.5] + [0.9, 0.7, 0.5, 0.3, 0.1, 0.5] + [0.9] * 3)
    assert y[1] == pytest.approx(y[2] / 2)
    assert np.allclose(kershaw_mesh(7, 5, flatness=1.0).points, structured_mesh(7, 5).points)


@settings(max_examples=30, deadline=None)
@given(st.integers(30, 150), st.floats(0.01, 0.8), st.booleans(), seeds)
def test_patches_meet_triangles_edge_to_edge(nodes, share, interface, seed):
    mesh = hybrid_mesh(nodes, share=share, interface=interface, seed=seed)
    assert list(kinds(mesh)) == ["quad", "triangle", "line"]
    assert same(mesh, hybrid_mesh(nodes, share=share, interface=interface, seed=seed))
    quads = mesh.cells[0].nodes
    at = twin.plane(mesh)
    assert float(sum(twin.doubled_area(at, cell) for cell in quads.tolist())) / 2 == pytest.approx(share)
    if not interface:
        check(mesh, SQUARE, 1.0)
        return
    between = mesh.cells[2].nodes[mesh.cells[2].regions == 5]
    assert len(between) == 4 * round(len(quads) ** 0.5)
    assert set(between.ravel()) == set(quads.ravel()) & set(mesh.cells[1].nodes.ravel())
    assert mesh.region_names[2, 2] == "patch"
    assert mesh.markers["interface"].tolist() == sorted(set(between.ravel()))
    plain = hybrid_mesh(nodes, share=share, seed=seed)
    assert plain.points.tobytes() == mesh.points.tobytes()


@pytest.mark.parametrize("body", ["airfoil", "circle"])
@pytest.mark.parametrize("cells", ["mixed", "quad"])
def test_o_grids_have_quad_layers_of_the_wanted_aspect(cells, body):
    mesh = layered_mesh(6, 200.0, 80, cells=cells, body=body)
    at = twin.plane(mesh)
    area = float(sum(twin.doubled_area(at, cell) for cell in twin.faces(mesh))) / 2
    check(mesh, [body, "farfield"], area)
    assert kinds(mesh)["quad"] == 6 * 80 if cells == "mixed" else kinds(mesh)["quad"] > 6 * 80
    assert set(kinds(mesh)) == ({"quad", "triangle", "line"} if cells == "mixed" else {"quad", "line"})
    assert mesh.markers[body].tolist() == list(range(80))
    assert np.ptp(mesh.points[:80, 0]) == pytest.approx(1.0)
    far = np.linalg.norm(mesh.points[mesh.markers["farfield"]] - [0.5, 0.0], axis=1)
    assert far == pytest.approx(np.full(len(far), 3.0), rel=0.1)
    rows = mesh.points[: 7 * 80].reshape(7, 80, 2)
    across = np.linalg.norm(np.diff(rows, axis=0), axis=-1)
    along = np.linalg.norm(rows - np.roll(rows, 1, axis=1), axis=-1)[:-1]
    wanted = 200.0 ** (1.0 - np.arange(6) / 6)
    np.testing.assert_allclose((along / across)[:, 20], wanted, rtol=0.1)
    if cells == "mixed":
        halved = layered_mesh(6, 200.0, 80, body=body)
        assert halved.points.tobytes() == mesh.points.tobytes()
        assert np.array_equal(halved.cells[0].nodes[2 * 6 * 80 :], mesh.cells[1].nodes)


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 12), st.floats(0, 3), st.sampled_from(["mean", "shortest"]), seeds)
def test_disturbed_quads_stay_valid_unless_they_may_tangle(columns, amount, edge, seed):
    mesh = structured_mesh(columns, 5)
    free = sorted(twin.free(mesh))
    thrown = disturb(mesh, free, amount, seed=seed, edge=edge)
    assert twin.figures(thrown)["invalid"] == 0
    assert np.array_equal(np.delete(thrown.points, free, axis=0), np.delete(mesh.points, free, axis=0))
    loose = disturb(mesh, free, amount, seed=seed, edge=edge, keep_valid=False)
    length = min(1 / columns, 0.2) if edge == "shortest" else (1 / columns + 0.2) / 2
    step = np.linalg.norm(loose.points - mesh.points, axis=1)
    assert step.max() <= amount * length * (1 + 1e-12)


@pytest.mark.parametrize("edges", [1.0, 3.0])
def test_free_throws_tangle_quads(edges):
    mesh = structured_mesh(20)
    thrown = disturb(mesh, sorted(twin.free(mesh)), edges, seed=2, keep_valid=False, edge="shortest")
    assert twin.figures(thrown)["invalid"] > 100


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: random_quad_mesh(0), "number of nodes must be a whole number of at least 1, got 0"),
        (lambda: random_quad_mesh(10, cells="hex"), "cells must be 'quad' or 'mixed', got 'hex'"),
        (lambda: random_quad_mesh(10, settled=-1), "number of sweeps must be a whole number of at least 0"),
        (lambda: random_quad_mesh(10, size=0.0), "size"),
        (lambda: recombine(structured_mesh(2)), "only triangles in a plane can be joined to quads, got 'quad' cells"),
        (lambda: recombine(random_mesh(5), least=2.0), "least quality of a quad must lie between 0 and 1, got 2"),
        (lambda: split_into_quads(Mesh(np.eye(6, 2), (CellBlock("triangle6", np.arange(6)[None], [0]),))), "triangle6"),
        (lambda: structured_mesh(0), "number of columns must be a whole number of at least 1, got 0"),
        (lambda: structured_mesh(2, 1.5), "number of rows must be a whole number of at least 1, got 1.5"),
        (lambda: structured_mesh(2, size=float("nan")), "the size must be a positive number, got nan"),
        (lambda: kershaw_mesh(2, flatness=0.0), "flatness must lie between 0.001 and 1, got 0.0"),
        (lambda: hybrid_mesh(10, share=0.9), "share must lie between 0.01 and 0.8, got 0.9"),
        (lambda: hybrid_mesh(4), "too close to the patch, whose edges cannot be split; take more nodes or less share"),
        (lambda: hybrid_mesh(True), "number of nodes must be a whole number"),
        (lambda: hybrid_mesh(10, seed=-1), "a seed must be"),
        (lambda: layered_mesh(cells="hex"), "cells must be 'triangle' or 'mixed' or 'quad', got 'hex'"),
        (lambda: layered_mesh(body="plate"), "body must be 'airfoil' or 'circle', got 'plate'"),
        (lambda: disturb(structured_mesh(2), [4], 1.0, edge="long"), "edge must be 'mean' or 'shortest', got 'long'"),
    ],
)  # fmt: skip
def test_bad_arguments_of_quads_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_what_rounding_makes_flat_is_refused():
    points = np.array([[1.0, 1.0], [np.nextafter(1.0, 2.0), 1.0], [1.0, np.nextafter(1.0, 2.0)]])
    with pytest.raises(InputError, match="too flat to be split"):
        split_into_quads(Mesh(points, (CellBlock("triangle", np.array([[0, 1, 2]]), np.array([0])),)))


def test_settled_triangles_make_better_quads():
    mesh = random_mesh(500, seed=1)
    rough, smooth = (twin.figures(recombine(each)) for each in (mesh, settle(mesh, 5)))
    assert smooth["mean"] > rough["mean"] + 0.1
