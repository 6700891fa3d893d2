"""The Laplacian of a mesh, and multigrid on it, against SciPy's sparse matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import spsolve

import gmsnet
from gmsnet.generate import disturb, hybrid_mesh, random_quad_mesh, sheared_mesh
from gmsnet.kernels.simplex.mean_ratio2 import WEIGHTS
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.whole import graph, multigrid
from gmsnet.methods import Field
from gmsnet.methods.multigrid import Multigrid
from gmsnet.methods.whole_mesh import Problem
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

MESHES = {
    "triangles": lambda: gmsnet.random_mesh(400, seed=1),
    "quads": lambda: random_quad_mesh(300, seed=2),
    "mixed": lambda: hybrid_mesh(300, seed=3),
    "sheared": lambda: sheared_mesh(30, amplitude=0.9),
    "tangled": lambda: disturb(
        gmsnet.random_mesh(200, seed=4), Topology.of(gmsnet.random_mesh(200, seed=4)).free[:9], 3
    ),
}
every_mesh = pytest.mark.parametrize("name", MESHES)


def problem_of(name):
    mesh = MESHES[name]()
    topology = Topology.of(mesh)
    field = Field(planar_points(mesh)[topology.memory], topology, Precision())
    return Problem.of(field), field


def plainly(problem, points, even=False):
    """The matrix of Σ κ·w/D·|edge|²/κ, edge by edge."""
    rows, columns, values = [], [], []
    for t, cell in enumerate(problem.cells.tolist()):
        a, b = points[cell[1]] - points[cell[0]], points[cell[2]] - points[cell[0]]
        share = 1.0 if even else 1.0 / (a[0] * b[1] - a[1] * b[0])
        weights = (1.0, 1.0, 1.0) if problem.table is None else problem.table[t]
        for (i, j), weight in zip(((0, 1), (0, 2), (1, 2)), weights, strict=True):
            p, q = problem.number[cell[i]], problem.number[cell[j]]
            for one, two in ((p, q), (q, p)):
                if one >= 0:
                    rows.append(one), columns.append(one), values.append(share * weight)
                    if two >= 0:
                        rows.append(one), columns.append(two), values.append(-share * weight)
    n = len(problem.moved)
    return csr_array(coo_array((values, (rows, columns)), shape=(n, n)))


def matrix_of(matrix):
    n = len(matrix.diagonal)
    off = csr_array((matrix.off, matrix.column, matrix.start), shape=(n, n))
    return csr_array(coo_array((matrix.diagonal, (np.arange(n), np.arange(n))), shape=(n, n))) - off


@every_mesh
@pytest.mark.parametrize("even", [True, False])
def test_the_laplacian_is_assembled_as_by_hand(name, even):
    problem, field = problem_of(name)
    graph.assemble(field.points, problem.cells, problem.table, problem.number, even, problem.matrix)
    found, wanted = matrix_of(problem.matrix), plainly(problem, field.points, even)
    np.testing.assert_allclose(found.toarray(), wanted.toarray(), rtol=1e-9, atol=1e-9 * abs(wanted).max())


@every_mesh
def test_rows_of_aggregates_are_sums_over_their_members(name):
    problem, field = problem_of(name)
    graph.assemble(field.points, problem.cells, problem.table, problem.number, False, problem.matrix)
    aggregate, smaller = multigrid.coarser(problem.matrix)
    n, m = len(aggregate), len(smaller.diagonal)
    assert set(aggregate.tolist()) == set(range(m))
    assert m <= 0.5 * n
    gather = csr_array((np.ones(n), (aggregate, np.arange(n))), shape=(m, n))
    wanted = (gather @ matrix_of(problem.matrix) @ gather.T).toarray()
    np.testing.assert_allclose(matrix_of(smaller).toarray(), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


@every_mesh
def test_a_cycle_leaves_less_than_three_quarters_of_the_error(name):
    problem, field = problem_of(name)
    inverse = problem.inverse(field.points)
    matrix = matrix_of(problem.matrix)
    rng = np.random.default_rng(5)
    x, b = np.zeros((len(problem.moved), 2)), rng.normal(size=(len(problem.moved), 2))
    exact = np.column_stack([spsolve(matrix.tocsc(), b[:, k]) for k in range(2)])

    def energy(error):
        return math.sqrt((error * (matrix @ error)).sum())

    errors = [energy(exact)]
    for _ in range(8):
        x = x + inverse(b - matrix @ x)
        errors.append(energy(exact - x))
    assert errors[-1] < 0.75**8 * errors[0]


def test_small_matrices_are_solved_by_sweeps_alone():
    problem, field = problem_of("triangles")
    inverse = problem.inverse(field.points)
    assert len(inverse.levels[-1][0].diagonal) > len(inverse.coarsest.diagonal)
    small = Multigrid(inverse.coarsest)
    assert not small.levels
    b = np.random.default_rng(0).normal(size=(len(inverse.coarsest.diagonal), 2))
    wanted = np.linalg.solve(matrix_of(inverse.coarsest).toarray(), b)
    assert np.abs(small(b) - wanted).max() < 0.2 * np.abs(wanted).max()


@every_mesh
def test_harmonic_places_are_means_of_the_neighbours(name):
    problem, field = problem_of(name)
    *_, found = problem.harmonic(field.points)
    held = problem.number < 0
    np.testing.assert_array_equal(found[held], field.points[held])
    pull = np.empty((len(problem.moved), 2))
    first = pull.copy()
    graph.pull_of_neighbours(field.points, problem.cells, problem.table, problem.number, first)
    graph.pull_of_neighbours(found, problem.cells, problem.table, problem.number, pull)
    assert np.linalg.norm(pull) < 1e-5 * np.linalg.norm(first)


def test_weights_of_right_corners_leave_diagonals_out():
    problem, _ = problem_of("quads")
    assert WEIGHTS[1, 2] == 0.0
    degree = np.diff(problem.matrix.start)
    assert degree.max() <= 8
