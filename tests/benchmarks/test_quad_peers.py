"""Quads and mixed meshes as other tools get them: neighbours, boundary, arrays, and our own tools on them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from support import quads as twin

from gmsnet.generate import random_mesh

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

import quads
from corners import Corners
from peers import mesquite_wrappers, mixed, scipy_matrix, worker
from peers.ours import Smooth
from peers.peer import QUALITY, Peer, Plane
from peers.whole_mesh import Lbfgs

DRIVER = """
import pathlib, sys
_, name, calls, given, found = sys.argv
head, *lines = pathlib.Path(given).read_text().splitlines()
nodes, triangles, quads = map(int, head.split())
assert name == "Fake" and len(lines) == nodes + triangles + quads
text = f"0.25 {calls}\\n"
for x, y, held in map(str.split, lines[:nodes]):
    text += f"{float(x) + (held == '0')!r} {float(y) + (held == '0')!r}\\n"
pathlib.Path(found).write_text(text)
pathlib.Path(__file__).with_name("cells").write_text(" ".join(lines[nodes:]))
"""


@pytest.fixture(scope="module", params=[*quads.KINDS, "patch"])
def mesh(request):
    kind, seed = ("mixed", 3) if request.param == "patch" else (request.param, 0)
    return quads.made(kind, 150, seed)


@pytest.fixture
def plane(mesh, tmp_path):
    return Plane.load(mixed.saved(mesh, tmp_path / "folder" / "mesh.npz"))


def test_arrays_are_those_of_the_mesh(mesh, plane):
    assert sorted(twin.faces(mixed.mesh_of(plane))) == sorted(twin.faces(mesh))
    assert np.array_equal(plane.points, mesh.points)
    assert twin.figures(mesh)["invalid"] == 0


def test_boundary_and_neighbours_are_those_of_the_twin(mesh, plane):
    held = twin.held(mesh)
    assert set(np.flatnonzero(plane.held)) == held
    around = {node: set() for node in range(len(mesh.points))}
    for cell in twin.faces(mesh):
        for a, b in twin.sides(cell):
            around[a].add(b)
            around[b].add(a)
    matrix = scipy_matrix.neighbours(plane)
    for node, neighbours in around.items():
        assert set(matrix[node].indices) == (set() if node in held else neighbours)
    count = sum(len(twin.sides(cell)) for cell in twin.faces(mesh)) - sum(map(len, around.values())) // 2
    assert len(plane.segments) == sum(map(len, around.values())) // 2 - count
    good = scipy_matrix.in_good_order(plane)
    assert Corners.of(mixed.mesh_of(good)).figures(good.points) == pytest.approx(twin.figures(mesh))


def test_whole_mesh_optimisation_makes_the_mesh_better(mesh, plane):
    tool = Lbfgs(plane, 2)
    tool.smooth(200)
    before, after = twin.figures(mesh), twin.figures(mesh.with_points(tool.points()))
    assert tool.cells() is None
    assert after["invalid"] == 0
    assert after["mean"] > before["mean"] + 0.1


def test_our_own_tool_takes_mixed_meshes(mesh, plane):
    tool = Smooth(plane, "auto")
    tool.smooth(2)
    assert tool.points().shape == mesh.points.shape
    assert tool.cells() is None
    assert tool.efforts()[-1] == tool.result.sweeps


def test_a_program_gets_the_mesh_and_tells_its_own_seconds(mesh, plane, tmp_path, monkeypatch):
    program = tmp_path / "driver"
    program.write_text(f"#!{sys.executable}\n{DRIVER}")
    program.chmod(0o700)
    monkeypatch.setenv(mesquite_wrappers.PROGRAM, str(program))
    peer = Peer("fake", QUALITY, "mesquite_wrappers:Wrapper", (), (7,), "calls", "none", {"wrapper": "Fake"})
    found = worker.run(peer, plane, 7)
    assert found.seconds == [0.25, 7.0, 0.0]
    assert found.cells is None
    moved = np.where(plane.held[:, None], plane.points, plane.points + 1.0)
    assert np.array_equal(found.points, moved)
    assert (tmp_path / "cells").read_text().split() == [
        str(k) for part in (plane.cells, plane.quads) for k in part.flat
    ]


def test_triangles_stay_a_mesh_without_quads(tmp_path):
    mesh = random_mesh(50)
    plane = Plane.load(mixed.saved(mesh, tmp_path / "mesh.npz"))
    assert plane.quads.shape == (0, 4)
    assert np.array_equal(plane.cells, mesh.cells[0].nodes)


def test_checks_name_what_fails():
    reference = {"min": 0.5, "mean": 0.9, "invalid": 0}
    assert all(quads.checks({"min": 0.5, "mean": 0.8951, "invalid": 0}, reference).values())
    failed = quads.checks({"min": 0.49, "mean": 0.89, "invalid": 1}, reference)
    assert not any(failed.values())
    assert list(failed) == ["min 1/q ≥ reference", "mean ≥ reference − 0.005", "0 invalid"]
