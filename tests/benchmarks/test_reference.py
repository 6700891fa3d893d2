"""The reference of the benchmarks: its derivatives, its minima, and that it stays inside of the barrier."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import gmsnet

FOLDER = Path(__file__).parents[2] / "benchmarks"
sys.path.append(str(FOLDER))

barrier = importlib.import_module("barrier")


def loaded(name):
    """A script of the benchmarks under a name of its own: the tests have a module ``reference`` too."""
    spec = importlib.util.spec_from_file_location(f"benchmarks_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


reference = loaded("reference")


@pytest.fixture(scope="module")
def plane():
    return reference.Plane.of(gmsnet.random_mesh(60, seed=3))


def mean_power(problem, points, power, top):
    """The slow obvious twin: q from the lengths of the sides."""
    total = 0.0
    for i, j, k in problem.triangles.tolist():
        a, b, c = points[i], points[j], points[k]
        area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        sides = sum(float(np.sum((u - v) ** 2)) for u, v in ((a, b), (b, c), (c, a)))
        total += (sides / (4.0 * np.sqrt(3.0) * area) / top) ** power
    return total / len(problem.triangles)


def value_at(problem, points, power, top):
    gradient, blocks = np.empty_like(points), np.empty((len(points), 3))
    value = barrier.evaluate(points, problem.triangles, problem.right, top, power.bit_length() - 1, gradient, blocks)
    return value, gradient, blocks


@pytest.mark.parametrize("power", [1, 2, 4, 32])
def test_derivatives_are_those_of_the_plain_formula(plane, power):
    points = reference.minimise(plane.problem, plane.start, 1, tolerance=1e-2).points  # q too large for differences
    top = 3.0
    value, gradient, blocks = value_at(plane.problem, points, power, top)
    assert value == pytest.approx(mean_power(plane.problem, points, power, top), rel=1e-12)
    step = 1e-6
    for node in np.flatnonzero(plane.problem.free)[:12]:
        differences, bends = [], []
        for axis in range(2):
            there, back = points.copy(), points.copy()
            there[node, axis] += step
            back[node, axis] -= step
            differences.append((mean_power(plane.problem, there, power, top)
                                - mean_power(plane.problem, back, power, top)) / (2 * step))  # fmt: skip
            bends.append((value_at(plane.problem, there, power, top)[1][node]
                          - value_at(plane.problem, back, power, top)[1][node]) / (2 * step))  # fmt: skip
        scale = np.abs(gradient).max()
        np.testing.assert_allclose(gradient[node], differences, rtol=1e-6, atol=1e-7 * scale)
        xx, xy, yy = blocks[node]
        np.testing.assert_allclose([[xx, xy], [xy, yy]], bends, rtol=1e-5, atol=1e-6 * np.abs(blocks[node]).max())
        assert xx > 0.0
        assert xx * yy > xy * xy


def test_beyond_the_barrier_the_value_is_infinite(plane):
    points = plane.start.copy()
    i, j, k = plane.problem.triangles[0]
    points[i] = points[j] + points[k] - points[i]  # on the other side of the edge of the other two
    assert value_at(plane.problem, points, 1, 1.0)[0] == np.inf
    with pytest.raises(ValueError, match="no area"):
        barrier.minimise(plane.problem, points, 1)


def test_powers_are_powers_of_two(plane):
    with pytest.raises(ValueError, match="got 3"):
        barrier.minimise(plane.problem, plane.start, 3)


def test_the_largest_step_is_where_the_first_triangle_loses_its_area(plane):
    rng = np.random.default_rng(0)
    direction = rng.normal(size=plane.start.shape) * plane.problem.free[:, None]
    step = barrier.largest_step(plane.start, plane.problem.triangles, direction)

    def least(share):
        a, b, c = ((plane.start + share * step * direction)[plane.problem.triangles[:, k]] for k in range(3))
        return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).min()

    assert all(least(share) > 0.0 for share in np.linspace(0.0, 0.999, 50))
    assert least(1.001) < 0.0


@pytest.mark.parametrize("seed", range(4))
def test_the_minimum_is_stationary_and_inside(seed):
    plane = reference.Plane.of(gmsnet.random_mesh(120, seed=seed))
    for minimum, power in zip(reference.continuation(plane, plane.start), reference.POWERS, strict=True):
        assert minimum.converged
        _, gradient, blocks = value_at(plane.problem, minimum.points, power, 1.0)
        scale = np.sqrt(len(plane.start)) * np.abs(blocks).max()  # of a gradient one unit of length away
        assert np.abs(gradient[plane.problem.free]).max() < 1e-6 * scale
        found = plane.figures(minimum.points)
        assert found["inverted"] == 0
        assert (minimum.points[~plane.problem.free] == plane.start[~plane.problem.free]).all()
    assert found["qhat"] > plane.figures(plane.start)["qhat"]


def test_no_single_node_can_do_better_than_the_minimum(plane):
    minimum = barrier.minimise(plane.problem, plane.start, 2)
    rng = np.random.default_rng(1)
    for node in np.flatnonzero(plane.problem.free)[::5]:
        moved = minimum.points.copy()
        moved[node] += 1e-3 * rng.normal(size=2)
        assert value_at(plane.problem, moved, 2, 1.0)[0] > minimum.value


def test_a_part_moves_its_own_nodes_alone(plane):
    part, nodes = plane.problem.part(np.array([0, 1]), rings=1)
    corners = np.zeros(len(plane.start), dtype=bool)
    corners[plane.problem.triangles[[0, 1]]] = True
    around = plane.problem.triangles[corners[plane.problem.triangles].any(axis=1)]
    expected = np.isin(np.arange(len(corners)), around) & plane.problem.free
    assert set(nodes[part.free]) == set(np.flatnonzero(expected))
    touched = expected[plane.problem.triangles].any(axis=1)
    assert (nodes[part.triangles] == plane.problem.triangles[touched]).all()


@pytest.mark.parametrize("seed", range(2))
def test_reference_and_ceiling_as_points_of_the_mesh(seed):
    mesh = gmsnet.random_mesh(80, seed=seed)
    plane = reference.Plane.of(mesh)
    end = reference.lbfgs(mesh)
    single = reference.continuation(plane, plane.start)[-1].points
    assert reference.figures(mesh.with_points(end))["qhat"] >= plane.figures(single)["qhat"]
    top = reference.ceiling(mesh, [end])
    before, after = (reference.figures(mesh.with_points(points)) for points in (end, top))
    assert after["qhat"] >= before["qhat"]
    assert after["inverted"] == before["inverted"] == 0
    held = np.setdiff1d(np.arange(len(mesh.points)), plane.topology.free)
    assert (top[held] == mesh.points[held]).all()


def test_what_is_stored_is_not_computed_again(tmp_path, monkeypatch):
    file = tmp_path / "ceilings.json"
    first = reference.stored(file, [40], [0])
    assert set(first) == {"40/0"}
    assert first["40/0"]["ceiling"]["qhat"] >= first["40/0"]["reference"]["qhat"]
    monkeypatch.setattr(reference, "study", lambda nodes, seed: {"computed": [nodes, seed]})
    second = reference.stored(file, [40], [0, 1])
    assert second["40/0"] == first["40/0"]
    assert second["40/1"] == {"computed": [40, 1]}


def test_polishing_spares_the_worst_cells(plane):
    points = reference.best(plane, reference.road(plane, plane.start, 0)).points
    before = plane.figures(points)
    met = list(reference.polish(plane, points))
    assert len(met) == 1 + len(reference.ABOVE_WORST) * reference.POLISH_SWEEPS
    for each in met:
        after = plane.figures(each)
        assert after["min_shape"] >= before["min_shape"]
        assert after["inverted"] == 0
    assert reference.best(plane, met).figures["mean_shape"] > before["mean_shape"]
