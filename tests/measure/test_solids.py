"""Measures of hexahedra, wedges, pyramids, and tetrahedra beside them; what is wrong with cells."""

from __future__ import annotations

import numpy as np
import pytest
from support import solid
from support.volumes import block

from gmsnet import Mesh, quality
from gmsnet.measure import defects
from gmsnet.measure.solids import MeasuredSolids

LINEAR = ("hexahedron", "wedge", "pyramid")
VTK = {"tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}
# The corners, and the neighbours of each in an order in which a good cell is positive: by hand.
CORNERS = {
    "hexahedron": ((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2),
                   (7, 6, 4, 3)),
    "wedge": ((0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)),
    "pyramid": ((0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)),
}  # fmt: skip
IDEAL = {
    "hexahedron": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "wedge": ((1, 0, 0), (0.5, 3**0.5 / 2, 0), (0, 0, 1)),
    "pyramid": ((1, 0, 0), (0, 1, 0), (0.5, 0.5, 0.5**0.5)),
}


def one(nodes, kind):
    return quality(Mesh(np.asarray(nodes, float), (block(kind, [range(len(nodes))]),)))


def ideal_cell(kind):
    """The cube, the prism on an equilateral triangle, the pyramid of equal edges."""
    a, b, c = np.array(IDEAL[kind], float)
    return np.array({
        "hexahedron": [0 * a, a, a + b, b, c, a + c, a + b + c, b + c], "wedge": [0 * a, a, b, c, a + c, b + c],
        "pyramid": [0 * a, a, a + b, b, c],
    }[kind])  # fmt: skip


def mean_ratio(nodes, kind):
    """η of the worst corner, by its definition."""
    found, ideal = [], ideal_cell(kind)
    for corner, *others in CORNERS[kind]:
        deviation = (nodes[others] - nodes[corner]).T @ np.linalg.inv((ideal[others] - ideal[corner]).T)
        value = np.linalg.det(deviation)
        found.append(np.sign(value) * 3 * abs(value) ** (2 / 3) / (deviation**2).sum())
    return min(found)


@pytest.mark.parametrize("kind", LINEAR)
def test_the_shape_is_that_of_the_worst_corner(kind):
    rng = np.random.default_rng(1)
    for bend in (0.05, 0.2, 0.5):
        nodes = solid.random_cell(rng, kind, bend)
        assert one(nodes, kind).shape[0] == pytest.approx(mean_ratio(nodes, kind), abs=1e-12)


@pytest.mark.parametrize("kind", LINEAR)
def test_of_the_ideal_cell_all_measures_are_best(kind):
    nodes = ideal_cell(kind)
    found = one(nodes, kind)
    assert found.shape[0] == pytest.approx(1.0)
    assert found.scaled_jacobian[0] == pytest.approx(1.0)
    low, high = {"hexahedron": (90, 90), "wedge": (60, 90),
                 "pyramid": (np.degrees(np.arccos(3**-0.5)), np.degrees(np.arccos(-1 / 3)))}[kind]  # fmt: skip
    assert found.min_dihedral[0] == pytest.approx(low)
    assert found.max_dihedral[0] == pytest.approx(high)
    assert found.valid.all()
    assert not found.remarks


@pytest.mark.parametrize("kind", ["tetra", *LINEAR])
@pytest.mark.parametrize("measure", ["scaled_jacobian", "volume"])
def test_measures_are_those_of_vtk(kind, measure):
    pyvista = pytest.importorskip("pyvista")
    rng, cells = np.random.default_rng(2), []
    for bend in (0.0, 0.1, 0.2, 0.3):
        cells += [solid.random_cell(rng, kind, bend) for _ in range(10)]
    points = np.concatenate(cells)
    rows = np.arange(len(points)).reshape(len(cells), -1)
    beside = block("hexahedron", [len(points) + np.arange(8)])  # so that tetrahedra are not measured alone
    mesh = Mesh(np.concatenate([points, solid.reference_nodes("hexahedron") + 9]), (block(kind, rows), beside))
    found = getattr(quality(mesh), measure)[:-1]
    grid = pyvista.UnstructuredGrid(
        np.column_stack([np.full(len(rows), rows.shape[1]), rows]).ravel(), np.full(len(rows), VTK[kind]), points
    )
    if measure == "volume":
        wanted = grid.compute_cell_sizes(length=False, area=False)["Volume"]
        near = 1e-9 if kind == "tetra" else 0.05  # VTK takes flat tetrahedra for cells with twisted faces
    else:
        wanted, near = grid.cell_quality("scaled_jacobian")["scaled_jacobian"], 1e-9
    good = found > 0.0  # of others Verdict says −∞ or cuts off
    assert good.sum() > 20
    assert found[good] == pytest.approx(wanted[good], rel=near, abs=near)


@pytest.mark.parametrize("kind", LINEAR)
def test_the_volume_is_the_integral_of_the_determinant(kind):
    """By Gauss's rule, exact for the powers that there are."""
    rng = np.random.default_rng(3)
    nodes = solid.random_cell(rng, kind, 0.2)
    polynomial = solid.determinant(nodes, kind)
    whole = 0.0
    for (a, b, c), value in polynomial.items():
        if kind == "hexahedron":
            integral = 1 / ((a + 1) * (b + 1) * (c + 1))
        elif kind == "wedge":
            integral = {0: 0.5, 1: 1 / 6}[a + b] / (c + 1)
        else:
            integral = 1 / ((a + 1) * (b + 1) * 3)
        whole += float(value) * integral
    assert one(nodes, kind).volume[0] == pytest.approx(whole)


def test_a_hexahedron_that_is_negative_between_its_corners_is_invalid_and_the_place_is_told():
    rng = np.random.default_rng(4)
    while True:
        nodes = solid.random_cell(rng, "hexahedron", 0.45)
        found = one(nodes, "hexahedron")
        if found.shape[0] > 0.0 and found.inverted:
            break
    assert found.summary()["invalid_inside"] == 1
    place = found.cells.judged[1][0]
    assert solid.value(solid.determinant(nodes, "hexahedron"), [solid.F(float(v)) for v in place]) < 0


def lattice(count=3):
    """Points and hexahedra of a cube."""
    place = np.arange((count + 1) ** 3).reshape((count + 1,) * 3)
    points = np.argwhere(place >= 0).astype(float)
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = [
        [place[i + a, j + b, k + c] for c in (0, 1) for a, b in ring]
        for i in range(count) for j in range(count) for k in range(count)
    ]  # fmt: skip
    return points, np.array(cells)


def test_a_file_whose_cells_are_inside_out_is_read_so_and_it_is_said():
    points, cells = lattice()
    mesh = Mesh(points * [1, 1, -1], (block("hexahedron", cells),))
    found = quality(mesh)
    assert found.inverted == 0
    assert found.shape == pytest.approx(1.0)
    assert found.summary()["read_inside_out"] == {"hexahedron": 27}
    assert "inside out" in found.remarks[0]


def test_defects_are_named():
    points, cells = lattice()
    hexes = cells.tolist()
    hexes[5] = [*hexes[5][:4], *hexes[5][4:7], hexes[5][6]]  # a node twice
    hexes[9] = hexes[9][4:] + hexes[9][:4]  # inside out
    base = [points[n] for n in (60, 61)]
    extra = np.array([[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9.5, 0.4, 0], [9.5, 0.5, -1]])
    more = np.concatenate([points, extra])
    n = len(points)
    flat = [n, n + 1, n + 2, n + 3, n + 4]  # the apex lies in the plane of the base
    wedge = [n, n + 1, n + 4, n + 3, n + 2, n + 5]
    mesh = Mesh(more, (block("hexahedron", hexes), block("pyramid", [flat]), block("wedge", [wedge])))
    found, numbers = MeasuredSolids.of(mesh)
    assert base
    named = {what: rows.tolist() for what, rows in defects.defects_of(found).items()}
    assert numbers.tolist() == list(range(29))
    assert named[defects.REPEATED] == [5]
    assert found.turned["hexahedron"].tolist() == [9]
    assert defects.TURNED not in named
    assert 27 in named[defects.FLAT]
    report = quality(mesh)
    assert not report.valid[[5, 27]].any()
    assert report.valid[9]
    assert report.summary()["defects"][defects.REPEATED] == {"count": 1, "cells": [5]}


def test_a_cell_that_is_folded_over_is_inside_out():
    points, cells = lattice(2)
    fold = points.copy()
    fold[cells[0][0]] = [3, 3, 3]  # a corner of the cube, beyond its other end
    mesh = Mesh(fold, (block("hexahedron", cells),))
    assert quality(mesh).inverted == 1
    alone = Mesh(points * [1, 1, -1], (block("hexahedron", cells[:1]), block("tetra", [cells[7][[0, 1, 3, 4]]])))
    assert quality(alone).inverted == 0


@pytest.mark.parametrize("diagonal", [0, 1])
def test_a_quad_that_meets_two_triangles_is_named(diagonal):
    points = solid.reference_nodes("hexahedron")
    apex = [[0.5, 0.5, 2.0]]
    halves = [[4, 5, 6, 8], [4, 6, 7, 8]] if diagonal == 0 else [[4, 5, 7, 8], [5, 6, 7, 8]]
    mesh = Mesh(np.concatenate([points, apex]), (block("hexahedron", [range(8)]), block("tetra", halves)))
    named = defects.defects_of(MeasuredSolids.of(mesh)[0])
    assert {what: rows.tolist() for what, rows in named.items()} == {defects.UNMATCHED: [0]}
    whole = Mesh(mesh.points, (block("hexahedron", [range(8)]), block("pyramid", [[4, 5, 6, 7, 8]])))
    assert defects.defects_of(MeasuredSolids.of(whole)[0]) == {}


def test_curved_cells_are_judged_by_all_of_their_nodes():
    nodes = solid.reference_nodes("tetra10")
    assert one(nodes, "tetra10").summary()["curved"] == {"min": pytest.approx(1.0), "mean": pytest.approx(1.0)}
    nodes[4] = [0.5, 0.6, 0.6]  # the middle of an edge, beyond the opposite one
    found = one(nodes, "tetra10")
    assert found.inverted == 1
    assert found.shape[0] == pytest.approx(quality_of_corners(nodes))
    assert found.summary()["curved"]["min"] < 0.0


def quality_of_corners(nodes):
    mesh = Mesh(np.concatenate([nodes[:4], solid.reference_nodes("hexahedron") + 5]),
                (block("tetra", [range(4)]), block("hexahedron", [range(4, 12)])))  # fmt: skip
    return quality(mesh).shape[0]


def test_a_table_of_cells_of_several_kinds_is_measured_as_the_blocks_are():
    rng = np.random.default_rng(5)
    kinds = ("tetra", "hexahedron", "wedge", "pyramid")
    blocks, points, first = [], [], 0
    for kind in kinds:
        for _ in range(3):
            nodes = solid.random_cell(rng, kind, 0.2)
            blocks.append((kind, [np.arange(first, first + len(nodes))]))
            points.append(nodes)
            first += len(nodes)
    chosen = rng.permutation(len(blocks))
    mesh = Mesh(np.concatenate(points), tuple(block(*blocks[k]) for k in chosen))
    wanted, numbers = MeasuredSolids.of(mesh)
    table = np.zeros((len(blocks), 8), dtype=np.int32)
    kind = np.array([kinds.index(each.kind) for each in mesh.cells])
    for k, each in enumerate(mesh.cells):
        table[k, : each.nodes.shape[1]] = each.nodes[0]
    turn = np.ones(len(blocks), dtype=np.int8)
    found, again = MeasuredSolids.of_table(mesh, table, kind, kinds, numbers, turn)
    assert numbers.tolist() == again.tolist()
    assert np.array_equal(found.columns(), wanted.columns())
    assert np.array_equal(found.signs(), wanted.signs())
    assert np.array_equal(found.centres(), wanted.centres())
