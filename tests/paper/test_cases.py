from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.paper.cases import CASES, SEEDS_APART
from gmsnet.paper.domains import naca0012

# Table 2, Origin: least and mean smallest angle, greatest and mean greatest angle, mean 1/q_V.
ORIGIN = {
    "square": (0.04, 29.65, 179.82, 95.09, 0.58),
    "circle": (0.29, 30.38, 179.05, 94.60, 0.59),
    "airfoil": (0.25, 53.25, 178.91, 67.84, 0.92),
    "pipe": (4.10, 46.28, 170.48, 76.81, 0.82),
}
EXTREMES = {  # what the least and the greatest angle of a mean of ten runs may be
    "square": ((0.0, 0.5), (177.5, 180.0)),
    "circle": ((0.0, 0.5), (177.5, 180.0)),
    "airfoil": ((0.15, 0.35), (178.5, 179.9)),
    "pipe": ((2.0, 7.0), (160.0, 173.0)),
}


def row(report):
    low, high = report.min_angle, report.max_angle
    return np.array([low.min(), low.mean(), high.max(), high.mean(), report.aspect.mean()])


def test_names_and_order_are_those_of_the_table():
    assert list(CASES) == list(ORIGIN)
    assert [case.name for case in CASES.values()] == list(CASES)


@pytest.mark.parametrize("name", CASES)
def test_origin_rows_come_near_the_printed_ones(name):
    runs = np.array([row(gmsnet.quality(CASES[name].mesh(run))) for run in range(10)])
    printed = np.array(ORIGIN[name])
    mean = runs.mean(axis=0)
    assert mean[[1, 3, 4]] == pytest.approx(printed[[1, 3, 4]], rel=0.03)
    (low, high), (flat, flattest) = EXTREMES[name]
    assert low < mean[0] < high
    assert flat < mean[2] < flattest
    assert runs[0, [1, 3, 4]] == pytest.approx(printed[[1, 3, 4]], rel=0.03)
    assert runs[0, 0] == pytest.approx(printed[0], rel=0.5)


@pytest.mark.parametrize("name", CASES)
def test_meshes_are_valid_and_connected_in_one_piece(name):
    mesh = CASES[name].mesh(3)
    assert gmsnet.quality(mesh).inverted == 0
    triangles = mesh.cells[0].nodes
    assert len(np.unique(triangles)) == len(mesh.points)
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    assert len(mesh.points) - len(edges) + len(triangles) == (0 if name == "airfoil" else 1)
    assert 500 < len(mesh.points) < 2000


@pytest.mark.parametrize("name", CASES)
def test_runs_and_seeds_are_different_meshes_and_always_the_same(name):
    case = CASES[name]
    meshes = [case.mesh(0), case.mesh(1), case.mesh(0, seed=1), case.mesh(1, seed=1)]
    assert np.array_equal(meshes[0].points, case.mesh(0).points)
    assert len({mesh.points.tobytes() for mesh in meshes}) == 4


@pytest.mark.parametrize("name", ["airfoil", "pipe"])
def test_a_run_disturbs_the_good_mesh_inside_alone(name):
    case = CASES[name]
    good, first, second = case.good(), case.mesh(0), case.mesh(1)
    for mesh in (first, second):
        assert np.array_equal(mesh.cells[0].nodes, good.cells[0].nodes)
        held = np.unique(good.cells[1].nodes)
        assert np.array_equal(mesh.points[held], good.points[held])
    assert not np.array_equal(first.points, second.points)


@pytest.mark.parametrize(("name", "mean", "low"), [("airfoil", 0.935, 54.0), ("pipe", 0.95, 55.5)])
def test_good_meshes_are_good(name, mean, low):
    report = gmsnet.quality(CASES[name].good())
    assert report.aspect.mean() > mean
    assert report.min_angle.mean() > low
    assert report.min_angle.min() > 25.0
    assert report.max_angle.max() < 115.0


@pytest.mark.parametrize("name", ["airfoil", "pipe"])
def test_six_inner_nodes_of_good_meshes_have_degree_four(name):
    mesh = CASES[name].good()
    degree = np.bincount(mesh.cells[0].nodes.ravel(), minlength=len(mesh.points))
    degree[mesh.cells[1].nodes] = 0
    assert np.bincount(degree)[1:5].tolist() == [0, 0, 0, 6]


def test_square_and_circle_have_no_good_mesh():
    assert CASES["square"].good() is None
    assert CASES["circle"].good() is None


def test_markers():
    assert set(CASES["airfoil"].good().markers) == {"airfoil", "farfield", "domain"}
    assert set(CASES["pipe"].good().markers) == {"inlet", "outlet", "wall", "domain"}


def test_airfoil_is_naca_0012():
    x, y = naca0012().T
    assert (x[0], y[0], x[-1], y[-1]) == (0.0, 0.0, 1.0, 0.0)
    assert y.max() == pytest.approx(0.06, abs=2e-4)
    assert x[y.argmax()] == pytest.approx(0.30, abs=0.02)
    mesh = CASES["airfoil"].good()
    on_foil = mesh.points[mesh.markers["airfoil"]]
    assert np.abs(on_foil[:, 1]) == pytest.approx(np.interp(on_foil[:, 0], x, y), abs=1e-12)


@pytest.mark.parametrize(("run", "seed"), [(-1, 0), (0, -1), (0.5, 0), (True, 0), (0, "1"), (SEEDS_APART, 0)])
def test_bad_runs_and_seeds_are_named(run, seed):
    with pytest.raises(InputError, match="of a case must be a whole number"):
        CASES["square"].mesh(run, seed)


def test_cases_need_no_torch_and_no_matplotlib():
    code = "import sys; from gmsnet.paper.cases import CASES; print(sorted({'torch', 'matplotlib'} & set(sys.modules)))"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.strip() == "[]"
