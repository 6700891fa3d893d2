"""Cells that are stretched on purpose are found; those that happen to be thin are not."""

from __future__ import annotations

import numpy as np
import pytest
from support.layer_meshes import grid, heights, shaken

import gmsnet
from gmsnet.generate import disturb
from gmsnet.generate.layered import layered_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.paper.cases import CASES
from gmsnet.preserve.layers import Layers, stretched_layers
from gmsnet.topology.topology import Topology

WIDTH = 0.05
ACROSS = np.linspace(0.0, 2.0, 41)


def found(mesh):
    return stretched_layers(mesh, Topology.of(mesh))


def assert_nothing(mesh):
    layers = found(mesh)
    assert not layers
    assert not layers.nodes.any()
    assert not layers.cells.any()
    assert (layers.median, layers.largest, layers.damaged, layers.summary) == (1.0, 1.0, 0, "")


@pytest.mark.parametrize("kind", ["even", "random"])
@pytest.mark.parametrize("spacing", [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("nodes", [20, 60, 300, 1000])
def test_random_squares_have_none(nodes, spacing, kind):
    """However the nodes on the boundary are spaced: a row of needles, or of flat cells, is not a layer."""
    for seed in range(3):
        assert_nothing(gmsnet.random_mesh(nodes, boundary=kind, boundary_spacing=spacing, seed=seed))


def test_large_random_squares_have_none():
    for seed in range(3):
        assert_nothing(gmsnet.random_mesh(20_000, seed=seed))


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_papers_cases_have_none(case):
    for run in range(5):
        assert_nothing(case.mesh(run))


@pytest.mark.parametrize("keep_valid", [True, False])
@pytest.mark.parametrize("amount", [0.0, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("case", ["airfoil", "pipe"])
def test_disturbed_good_meshes_have_none(case, amount, keep_valid):
    """Graded ones, too; tangled ones, too."""
    good = CASES[case].good()
    for seed in range(3):
        assert_nothing(disturb(good, Topology.of(good).free, amount, seed=seed, keep_valid=keep_valid))


@pytest.mark.parametrize("name", ["mesh_NACA0012_inv.su2", "japan_sea.msh", "osteonT1_11.mesh",
                                  "helmholtz_apartment.vtk", "insulated.msh", "internal.msh"])  # fmt: skip
def test_real_isotropic_meshes_have_none(real_meshes, name):
    assert_nothing(gmsnet.read(real_meshes / name))


def test_squares_halved_have_none():
    for ratio in (1.0, 1.5, 2.0):
        assert_nothing(grid(np.linspace(0.0, ratio, 21), np.linspace(0.0, 1.0, 21)))


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("alternate", [False, True])
@pytest.mark.parametrize("aspect", [5, 10, 50, 200, 1000])
def test_boundary_layers_are_found_through_noise(aspect, alternate, noise):
    """All nodes of rows of an aspect of 3 or more, but for single ones under noise; next to nothing beyond all rows."""
    y = heights(aspect, WIDTH)
    layers = found(shaken(grid(ACROSS, y, alternate), ACROSS, y, noise))
    rows = layers.nodes.reshape(len(y), len(ACROSS)).mean(axis=1)
    stretched = int((WIDTH / np.diff(y) >= 3.0).sum())
    plain = int((WIDTH / np.diff(y) > 1.01).sum()) + 2
    assert rows[:stretched].min() == 1.0
    assert rows[stretched] >= 0.9
    assert rows[plain:].max() <= (0.0 if noise == 0.0 else 0.15)
    assert layers.damaged == 0
    assert layers.largest >= 0.9 * aspect
    assert "anisotropic on purpose" in layers.summary


def test_a_layer_goes_around_corners():
    """A plate's end: rows along three sides, mitred, where the directions change by 90° from cell to cell."""
    y = heights(100, WIDTH)
    rows = int((WIDTH / np.diff(y) >= 3.0).sum()) + 1
    offset = y[:, None, None]
    side = np.linspace(0.0, 1.0, 21)[:-1, None]
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    outward = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    ring = np.concatenate([a + side * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
    away = np.concatenate([a + side * (b - a) for a, b in zip(outward, np.roll(outward, -1, axis=0), strict=True)])
    points = (ring + offset * away).reshape(-1, 2)
    node = np.arange(len(points)).reshape(len(y), -1)
    a, b, d, c = node[:-1], np.roll(node[:-1], -1, axis=1), node[1:], np.roll(node[1:], -1, axis=1)
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    layers = found(Mesh(points, (CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=int)),)))
    assert layers.nodes.reshape(len(y), -1)[:rows].all()


@pytest.mark.parametrize("interface", [False, True])
def test_wakes_and_interfaces(interface):
    """Rows that are thin in the middle, which is an interface or nothing that the connectivity would tell."""
    half = heights(100, WIDTH)
    y = np.concatenate([-half[:0:-1], half])
    mesh = grid(ACROSS, y, region=(lambda centre: (centre[:, 1] > 0).astype(int)) if interface else None)
    assert ("interface between regions" in Topology.of(mesh).held) == interface
    rows = found(mesh).nodes.reshape(len(y), len(ACROSS)).all(axis=1)
    thin = np.abs(y) < half[int((WIDTH / np.diff(half) >= 3.0).sum())]
    assert rows[thin].all()
    assert not rows[np.abs(y) > 0.6].any()


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
def test_a_front_away_from_boundaries(turn):
    """A random mesh pressed together across a curved front, as adaptation to a shock does; slivers stay free."""
    mesh = gmsnet.random_mesh(6000, seed=2)
    x, y = mesh.points.T - 0.5
    u = np.cos(turn) * x + np.sin(turn) * y - 0.2 * (np.cos(turn) * y - np.sin(turn) * x) ** 2
    near = np.abs(u) < 0.15
    pressed = np.where(near, u / 8.0, u - np.sign(u) * 0.15 * 7.0 / 8.0) - u
    front = mesh.with_points(mesh.points + pressed[:, None] * [np.cos(turn), np.sin(turn)])
    layers = found(front)
    assert layers.nodes[np.abs(u) < 0.1].mean() > 0.92
    assert layers.nodes[np.abs(u) > 0.25].mean() < 0.01


@pytest.mark.parametrize("factor", [5.0, 8.0, 100.0])
def test_a_mesh_stretched_as_a_whole(factor):
    mesh = gmsnet.random_mesh(1500, seed=1)
    layers = found(mesh.with_points(mesh.points * [factor, 1.0]))
    assert layers.nodes.mean() > 0.95  # the other nodes are those of slivers
    good = CASES["pipe"].good()
    layers = found(good.with_points(good.points * [factor, 1.0]))
    assert layers.nodes.all()
    assert layers.cells.all()
    assert "all cells" in layers.summary
    assert layers.median == pytest.approx(factor, rel=0.05)


def test_the_layered_mesh():
    mesh = layered_mesh()
    layers = found(mesh)
    rows = layers.nodes[: 21 * 120].reshape(21, 120).mean(axis=1)
    assert rows.min() == 1.0  # the last row has an aspect of 1.4
    assert not layers.nodes[21 * 120 :].any()
    assert layers.damaged == 0
    assert 1000 < layers.largest < 2000


@pytest.mark.parametrize("tangled", [False, True])
def test_damaged_cells_of_a_layer_are_not_held(tangled):
    y = heights(100, WIDTH)
    mesh = grid(ACROSS, y)
    node = 5 * len(ACROSS) + 20
    points = mesh.points.copy()
    points[node, 1] = y[4] + (y[5] - y[4]) * (-0.5 if tangled else 0.01)
    layers = found(mesh.with_points(points))
    assert layers.damaged >= 2
    assert not layers.nodes[node]
    whole = found(mesh).nodes
    lost = np.flatnonzero(whole & ~layers.nodes)
    assert len(lost) <= 6
    assert f"{layers.damaged} of them are damaged" in layers.summary


def test_where_it_lies_how_large_it_is_and_how_it_is_numbered_do_not_matter():
    y = heights(20, WIDTH)
    mesh = shaken(grid(ACROSS, y), ACROSS, y, 0.2)
    one = found(mesh)
    cosine, sine = np.cos(0.7), np.sin(0.7)
    turned = mesh.points @ [[cosine, sine], [-sine, cosine]] * 1e-7 + 1e-4
    other = found(mesh.with_points(turned))
    assert one.nodes.tolist() == other.nodes.tolist()
    assert one.cells.tolist() == other.cells.tolist()
    assert one.median == pytest.approx(other.median, rel=1e-6)
    rng = np.random.default_rng(0)
    order, cells = rng.permutation(len(mesh.points)), rng.permutation(len(mesh.cells[0].nodes))
    place = np.argsort(order)
    mixed = np.array([t[:: rng.choice([1, -1])] for t in place[mesh.cells[0].nodes[cells]]])
    other = found(Mesh(mesh.points[order], (CellBlock("triangle", mixed, mesh.cells[0].regions[cells]),)))
    assert other.nodes.tolist() == one.nodes[order].tolist()
    assert other.cells.tolist() == one.cells[cells].tolist()


def test_what_a_user_holds_has_no_influence():
    y = heights(20, WIDTH)
    mesh = grid(ACROSS, y)
    fixed = np.random.default_rng(0).random(len(mesh.points)) < 0.3
    assert stretched_layers(mesh, Topology.of(mesh, fixed)).nodes.tolist() == found(mesh).nodes.tolist()


def test_no_cells_and_points_without_extent():
    assert_nothing(Mesh(np.zeros((0, 2)), ()))
    mesh = gmsnet.random_mesh(100, seed=0)
    assert_nothing(mesh.with_points(np.zeros_like(mesh.points)))


@pytest.mark.parametrize("amount", [0.3, 0.6])
def test_disturbed_cells_next_to_layers_are_not_taken_for_layers(amount):
    mesh = layered_mesh()
    free = Topology.of(mesh).free
    disturbed = disturb(mesh, free[free >= 21 * 120], amount, seed=1)
    layers = found(disturbed)
    assert layers.nodes[: 20 * 120].all()
    assert layers.nodes[20 * 120 : 21 * 120].mean() > 0.8
    assert layers.nodes[21 * 120 :].mean() < 0.01


def test_figures_of_layers_are_plain():
    """Almost all of a thousand cells, stretched by more than a thousand."""
    cells = np.arange(1000) > 3
    layers = Layers(np.zeros(9, dtype=bool), cells, 1257.3, 123456.0, 0)
    assert layers.summary == (
        "the mesh looks anisotropic on purpose: 996 cells (100 %) are stretched alike, "
        "by 1,260 in the median and 123,000 at most"
    )
