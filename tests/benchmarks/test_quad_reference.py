"""The reference for quads and mixed meshes: its corners and figures against the twin, its minima, its barrier."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from support import quads as twin

from gmsnet.generate import disturb, hybrid_mesh, random_mesh, random_quad_mesh, structured_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

import barrier
import corners
import reference

MESHES = {
    "grid": lambda: jittered(structured_mesh(7, 6)),
    "quads": lambda: random_quad_mesh(80, seed=1),
    "mixed": lambda: random_quad_mesh(60, cells="mixed", seed=2),
    "patch": lambda: jittered(hybrid_mesh(60, seed=3)),
    "regions": lambda: jittered(hybrid_mesh(60, seed=4, interface=True)),
    "triangles": lambda: random_mesh(60, seed=5),
}


def jittered(mesh, amount=0.4, **options):
    return disturb(mesh, sorted(twin.free(mesh)), amount, seed=1, edge="shortest", **options)


def shuffled(mesh, seed=0):
    """The mesh with some of its cells turned the other way round."""
    random = np.random.default_rng(seed)
    cells = []
    for block in mesh.cells:
        turned = random.random(len(block.nodes)) < 0.5
        cells.append(CellBlock(block.kind, np.where(turned[:, None], block.nodes[:, ::-1], block.nodes), block.regions))
    return Mesh(mesh.points, tuple(cells), mesh.region_names)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", MESHES)
def test_corners_and_figures_are_those_of_the_twin(name, turned):
    mesh = shuffled(MESHES[name]()) if turned else MESHES[name]()
    found = corners.Corners.of(mesh)
    cells = twin.wound(mesh)
    expected = sorted((k, *corner) for k, cell in enumerate(cells) if len(cell) == 4 for corner in twin.corners(cell))
    right = found.problem.right
    assert sorted(zip(found.cell[right], *found.problem.triangles[right].T, strict=True)) == expected
    three = {k: frozenset(twin.corners(cell)) for k, cell in enumerate(cells) if len(cell) == 3}
    assert found.cell[~right].tolist() == list(three)
    for k, simplex in zip(found.cell[~right], found.problem.triangles[~right].tolist(), strict=True):
        assert tuple(simplex) in three[k]
    assert set(np.flatnonzero(found.problem.free)) == twin.free(mesh)
    for points in (mesh.points, jittered(mesh, 2.0, keep_valid=False).points):
        expected = twin.figures(mesh.with_points(points))
        assert found.figures(points) == pytest.approx(expected, rel=1e-9)


def mean_power(problem, points, power, top):
    """The slow obvious twin: q from the lengths of edges."""
    total = 0.0
    for (i, j, k), right in zip(problem.triangles.tolist(), problem.right.tolist(), strict=True):
        a, b, c = points[i], points[j], points[k]
        area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        squares = [float(np.sum((u - v) ** 2)) for u, v in ((a, b), (a, c), (b, c))]
        q = sum(squares[:2]) / (4.0 * area) if right else sum(squares) / (4.0 * np.sqrt(3.0) * area)
        total += (q / top) ** power
    return total / len(problem.triangles)


def value_at(problem, points, power, top):
    gradient, blocks = np.empty_like(points), np.empty((len(points), 3))
    value = barrier.evaluate(points, problem.triangles, problem.right, top, power.bit_length() - 1, gradient, blocks)
    return value, gradient, blocks


@pytest.mark.parametrize("power", [1, 2, 8])
@pytest.mark.parametrize("name", ["quads", "patch"])
def test_derivatives_with_quads_are_those_of_the_plain_formula(name, power):
    mesh, top, step = MESHES[name](), 3.0, 1e-6
    problem = corners.Corners.of(mesh).problem
    points = barrier.minimise(problem, mesh.points.copy(), 1, tolerance=1e-2).points
    value, gradient, blocks = value_at(problem, points, power, top)
    assert value == pytest.approx(mean_power(problem, points, power, top), rel=1e-12)
    for node in np.flatnonzero(problem.free)[:12]:
        differences, bends = [], []
        for axis in range(2):
            there, back = points.copy(), points.copy()
            there[node, axis] += step
            back[node, axis] -= step
            differences.append(mean_power(problem, there, power, top) - mean_power(problem, back, power, top))
            bends.append(value_at(problem, there, power, top)[1][node] - value_at(problem, back, power, top)[1][node])
        scale, (xx, xy, yy) = np.abs(gradient).max(), blocks[node]
        np.testing.assert_allclose(gradient[node], np.array(differences) / (2 * step), rtol=1e-6, atol=1e-7 * scale)
        np.testing.assert_allclose([[xx, xy], [xy, yy]], np.array(bends) / (2 * step), rtol=1e-5,
                                   atol=1e-6 * np.abs(blocks[node]).max())  # fmt: skip
        assert xx > 0.0
        assert xx * yy > xy * xy


@pytest.mark.parametrize("name", ["grid", "quads", "mixed", "patch", "regions"])
def test_the_reference_is_valid_better_and_holds_what_is_held(name):
    mesh = MESHES[name]()
    points, figures = reference.quad_ceiling(mesh)
    before, after = twin.figures(mesh), twin.figures(mesh.with_points(points))
    assert figures == pytest.approx(after)
    assert after["invalid"] == 0
    assert after["min"] > before["min"]
    assert after["mean"] > before["mean"]
    still = sorted(twin.held(mesh))
    assert np.array_equal(points[still], mesh.points[still])


def test_a_jittered_grid_comes_back_to_squares():
    points, figures = reference.quad_ceiling(jittered(structured_mesh(8)))
    assert figures["min"] > 1.0 - 1e-6
    assert np.allclose(points, structured_mesh(8).points, atol=1e-6)


def test_scale_does_not_matter():
    mesh = random_quad_mesh(40, seed=6)
    points, figures = reference.quad_ceiling(mesh)
    large, same = reference.quad_ceiling(mesh.with_points(mesh.points * 2.0**700))
    assert np.array_equal(large, points * 2.0**700)
    assert same == pytest.approx(figures)


def test_what_has_no_corners_or_no_barrier_is_refused():
    with pytest.raises(ValueError, match="no area"):
        reference.quad_ceiling(jittered(structured_mesh(5), 3.0, keep_valid=False))
    six = Mesh(np.eye(6, 2), (CellBlock("triangle6", np.arange(6)[None], [0]),))
    with pytest.raises(ValueError, match="triangles and quads"):
        corners.Corners.of(six)


def test_the_unit_of_time_averages_neighbours_along_edges():
    mesh = shuffled(MESHES["patch"]())
    found = corners.Corners.of(mesh)
    matrix = found.averaging
    assert np.allclose(matrix @ np.ones(len(mesh.points)), 1.0)
    around = {node: set() for node in range(len(mesh.points))}
    for cell in twin.faces(mesh):
        for a, b in twin.sides(cell):
            around[a].add(b)
            around[b].add(a)
    free = twin.free(mesh)
    expected = sorted(len(around[node]) if node in free else 1 for node in around)
    assert sorted(np.diff(matrix.indptr).tolist()) == expected
    x = mesh.points.sum(axis=1)
    means = [np.mean([x[k] for k in around[node]]) if node in free else x[node] for node in around]
    assert np.allclose(sorted(matrix @ x[found.order]), sorted(means))
