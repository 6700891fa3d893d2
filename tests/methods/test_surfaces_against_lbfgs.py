"""`auto` on spheres beside a slow obvious twin: L-BFGS on all nodes at once, whose places are on the sphere itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import gmsnet
from gmsnet import generate
from gmsnet.generate import disturb_on

ROOT_12 = 2.0 * np.sqrt(3.0)


def lbfgs(points, rows, power, steps=400):
    """The minimum of Σqᵖ over directions of nodes from the origin."""
    radius = np.linalg.norm(points, axis=1).mean()

    def objective(y):
        y = y.reshape(-1, 3)
        size = np.linalg.norm(y, axis=1)[:, None]
        unit = y / size
        a, b, c = (radius * unit[rows[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        double = np.linalg.norm(normal, axis=1)
        lengths = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
        if not (double > 0.0).all() or ((normal * (a + b + c)).sum(axis=1) <= 0.0).any():
            return 1e3 * len(rows), np.zeros(y.size)
        q = lengths / (ROOT_12 * double)
        m, gradient = normal / double[:, None], np.zeros_like(y)
        share = power * q**power
        for k, (v, p, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
            each = 2.0 * (2.0 * v - p - r) / lengths[:, None] - np.cross(p - r, m) / double[:, None]
            np.add.at(gradient, rows[:, k], share[:, None] * each)
        gradient -= (gradient * unit).sum(axis=1)[:, None] * unit
        return float((q**power).sum()), (radius / size * gradient).ravel()

    found = minimize(
        objective, points.ravel(), jac=True, method="L-BFGS-B", options={"maxiter": steps, "maxcor": 20, "maxls": 60}
    )
    y = found.x.reshape(-1, 3)
    return radius * y / np.linalg.norm(y, axis=1)[:, None], objective


def shapes(points, rows):
    p = points[rows]
    double = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return ROOT_12 * double / sum(((p[:, k] - p[:, k - 1]) ** 2).sum(axis=1) for k in range(3))


@pytest.mark.parametrize("seed", [1, 2])
def test_the_least_is_no_lower_and_the_mean_no_further_than_a_little(seed):
    mesh = disturb_on(generate.sphere_surface(600), 0.25, seed=seed).mesh
    rows = mesh.cells[0].nodes
    ours = shapes(gmsnet.smooth(mesh).points, rows)
    for power in (1, 8):
        points, _ = lbfgs(mesh.points, rows, power)
        theirs = shapes(points, rows)
        assert ours.min() >= theirs.min() - 0.001
        assert ours.mean() >= theirs.mean() - 0.001


def test_the_twin_has_the_gradient_of_its_objective():
    mesh = disturb_on(generate.sphere_surface(50), 0.2, seed=0).mesh
    _, objective = lbfgs(mesh.points, mesh.cells[0].nodes, 2, steps=1)
    y = mesh.points.ravel().copy()
    _, gradient = objective(y)
    for k in (0, 7, 20):
        step = np.zeros(y.size)
        step[k] = 1e-6
        slope = (objective(y + step)[0] - objective(y - step)[0]) / 2e-6
        assert abs(slope - gradient[k]) < 1e-5 * abs(gradient).max()
