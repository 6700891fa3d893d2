"""Sums of powers of q over a mesh, and the weights that give their gradient."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import hybrid_mesh
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.whole import powers
from gmsnet.methods import Field
from gmsnet.methods.whole_mesh import Problem
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def problem_of(mesh, doublings):
    topology = Topology.of(mesh)
    field = Field(planar_points(mesh)[topology.memory], topology, Precision())
    return Problem.of(field, doublings), field.points


def plain_q(problem, points):
    a, b = (points[problem.cells[:, k]] - points[problem.cells[:, 0]] for k in (1, 2))
    table = np.ones((len(a), 3)) if problem.table is None else problem.table
    lengths = np.column_stack([(each * each).sum(axis=1) for each in (a, b, b - a)])
    return (table * lengths).sum(axis=1) / (2.0 * 3**0.5) / (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@pytest.mark.parametrize("doublings", [1, 2, 3])
@pytest.mark.parametrize(
    "mesh", [gmsnet.random_mesh(100, seed=1), hybrid_mesh(100, seed=2)], ids=["triangles", "mixed"]
)
def test_value_and_gradient_are_those_of_the_power(mesh, doublings):
    problem, points = problem_of(mesh, doublings)
    q = plain_q(problem, points)
    assert problem.top == pytest.approx(q.max(), rel=1e-12)
    assert powers.shapes(points, problem.cells, problem.table) == pytest.approx((1.0 / q.max(), (1.0 / q).mean()))
    gradient = np.empty_like(points)
    value = problem.value(points, gradient)
    assert value == pytest.approx(((q / problem.top) ** 2**doublings).sum(), rel=1e-12)
    node, size = int(np.abs(gradient).sum(axis=1).argmax()), 1e-7
    for axis in range(2):
        ends, unused = [], np.empty_like(points)
        for sign in (-1.0, 1.0):
            there = points.copy()
            there[node, axis] += sign * size
            ends.append(problem.value(there, unused))
        scale = np.abs(gradient[node]).max()
        assert (ends[1] - ends[0]) / (2.0 * size) == pytest.approx(gradient[node, axis], rel=1e-4, abs=1e-4 * scale)


def test_without_area_it_is_more_than_any_mesh_has():
    problem, points = problem_of(gmsnet.random_mesh(100, seed=1), 3)
    there = points.copy()
    there[problem.moved[0]] += 10.0
    assert problem.value(there, np.empty_like(points)) == np.inf
