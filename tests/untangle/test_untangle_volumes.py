"""Untangling meshes of tetrahedra: what is mended, and the promises where not all can be."""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from support import volumes
from support.hard_volumes import delaunay

import gmsnet
from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.volumes import exact_signs3
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume
from gmsnet.untangle.result import NOTHING
from gmsnet.untangle.space import untangle_volume


def cube(side, seed=0):
    """A random Delaunay cube with about side³ nodes: a Mesh."""
    random, line = np.random.default_rng(seed), np.linspace(0.0, 1.0, side)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    sides = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
    points = np.concatenate([sides, random.uniform(0.08, 0.92, (side**3 - len(sides), 3))])
    cells = Delaunay(points, qhull_options="QJ").simplices
    a, b, c = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2, 3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    cells[volume < 0.0] = cells[volume < 0.0][:, [0, 2, 1, 3]]
    cells = cells[np.abs(volume) > 1e-9]
    return Mesh(points, (CellBlock("tetra", cells, np.zeros(len(cells), dtype=np.int64)),))


def thrown(mesh, how, seed=0):
    """The same, its free nodes elsewhere."""
    points, free = mesh.points.copy(), Volume.of(mesh).free
    random, edge = np.random.default_rng(seed + 100), len(points) ** (-1.0 / 3.0)
    if how == "anywhere":
        points[free] = random.random((len(free), 3))
    elif how == "one point":
        points[free] = 0.5
    elif how == "mirrored":
        points[free, 0] = 1.0 - points[free, 0]
    else:
        points[free] += how * edge / np.sqrt(3.0) * random.standard_normal((len(free), 3))
    return mesh.with_points(points)


@pytest.mark.parametrize("how", [0.5, 1.0, 3.0, 6.0, "anywhere", "one point", "mirrored"])
@pytest.mark.parametrize("seed", [0, 1])
def test_scattered_and_folded_meshes_are_mended(how, seed):
    mesh = thrown(cube(9, seed), how, seed)
    result = gmsnet.smooth(mesh)
    assert result.before.inverted > 0
    assert result.after.inverted == 0
    assert result.after.shape.min() > 0.1
    held = np.concatenate([*result.held.values()])
    assert (result.points[held] == mesh.points[held]).all()
    assert any("untangling: all" in note for note in result.notes)


def test_each_thread_count_gives_the_same_bits():
    mesh = thrown(cube(12), 2.0)
    one, two = (gmsnet.smooth(mesh, threads=count) for count in (1, 2))
    assert one.points.tobytes() == two.points.tobytes()


@pytest.mark.parametrize("seed", range(6))
def test_what_cannot_be_mended_costs_no_valid_cell(seed):
    """A held node beyond the opposite facet of one of its cells: some cell stays inverted whatever the others do."""
    mesh = cube(6, seed)
    volume = Volume.of(mesh)
    node = int(volume.free[seed])
    around = volume.cells[(volume.cells == node).any(axis=1)]
    points = mesh.points.copy()
    points[node] = points[around[0]].mean(axis=0) * 4.0 - 3.0 * points[node]
    points[volume.free[seed + 3]] += 0.3
    mesh = mesh.with_points(points)
    fixed = np.zeros(len(points), dtype=bool)
    fixed[np.unique(around)] = True
    before = gmsnet.quality(mesh)
    result = gmsnet.smooth(mesh, fixed=fixed)
    assert before.inverted > 0
    assert 0 < result.after.inverted <= before.inverted
    assert (result.after.valid | ~before.valid).all()
    assert {cell.cell for cell in result.unmended} <= set(result.after.cell[~result.after.valid].tolist())


def test_valid_meshes_and_meshes_without_free_nodes_are_left_alone():
    mesh = cube(5)
    volume, points = Volume.of(mesh), space_points(mesh)
    near = points[volume.memory]
    done = untangle_volume(near, volume, Precision(), serial, 0)
    assert done.taken == NOTHING
    assert (done.points == near).all()
    tangled = thrown(mesh, 2.0)
    volume = Volume.of(tangled, np.ones(len(points), dtype=bool))
    near = space_points(tangled)[volume.memory]
    done = untangle_volume(near, volume, Precision(), serial, 1)
    assert done.why == "no inverted cell has a node that may move"
    assert (done.points == near).all()
    assert done.after == (exact_signs3(near, volume.near, volume.near_orientation) <= 0).sum()


def test_coordinates_of_single_precision_stay_so():
    mesh = thrown(cube(8), 2.0)
    points = mesh.points.astype(np.float32).astype(np.float64)
    result = gmsnet.smooth(Mesh(points, mesh.cells, single=True))
    assert result.after.inverted == 0
    assert (result.points == result.points.astype(np.float32)).all()


def test_untangling_can_be_off():
    result = gmsnet.smooth(thrown(cube(6), 2.0), untangle=False)
    assert result.after.inverted > 0
    assert not any("untangling" in note for note in result.notes)


@pytest.mark.parametrize("seed", range(3))
def test_what_cannot_be_mended_takes_little_else_back(seed):
    """A node that is held far from its place inverts cells around; those elsewhere are mended all the same."""
    mesh = volumes.mesh_of(*volumes.cube(3000, seed))
    random, points = np.random.default_rng(seed), mesh.points.copy()
    inner = [node for node in Volume.of(mesh).free if (abs(points[node] - 0.5) < 0.35).all()]
    thrown = random.choice(inner, 12, replace=False)
    points[thrown] += 0.12 * random.normal(size=(12, 3))
    points[thrown[0]] = mesh.points[thrown[0]] + 0.25
    result = gmsnet.smooth(mesh.with_points(points), fixed=thrown[:1], method="barrier", max_sweeps=1)
    at_held = (mesh.cells[0].nodes == thrown[0]).any(axis=1).sum()
    assert result.before.inverted > 80
    assert 0 < result.after.inverted <= at_held
    assert result.after.shape.min() >= result.before.shape.min()


@pytest.mark.parametrize("seed", range(2))
def test_what_is_left_is_tried_again_in_the_same_call(seed):
    """Points with heavy tails, all thrown by an edge: one go leaves more than half of the inverted cells."""
    rng = np.random.default_rng(seed)
    mesh = delaunay(rng.normal(size=(500, 3)) ** 3)
    volume = Volume.of(mesh)
    pairs = mesh.cells[0].nodes[:, [[a, b] for a in range(4) for b in range(4) if a != b]].reshape(-1, 2)
    points, length = mesh.points.copy(), np.full(len(mesh.points), np.inf)
    np.minimum.at(length, pairs[:, 0], np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1))
    away = rng.normal(size=(len(volume.free), 3))
    points[volume.free] += away / np.linalg.norm(away, axis=1)[:, None] * length[volume.free, None]
    result = gmsnet.smooth(mesh.with_points(points))
    assert result.before.inverted > 100
    assert result.after.inverted == 0
