"""The table of tools that move tetrahedra: what is handed to them, and what is told of their results."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from support import volumes

import gmsnet

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

import volume_peers


@pytest.fixture
def case(tmp_path):
    points, cells = volumes.cube(200, 2)
    mesh = volumes.mesh_of(points, volumes.shuffled(np.random.default_rng(0), cells))
    return mesh, volume_peers.Case(mesh, tmp_path / "mesh.npz")


def test_figures_are_those_of_the_cells_with_a_free_node(case):
    mesh, made = case
    report = gmsnet.quality(mesh)
    least, mean, low, high, inverted, away = made.figures(made.points)
    own = made.own
    assert 0 < own.sum() < len(own)
    np.testing.assert_allclose([least, mean], [report.shape[own].min(), report.shape[own].mean()])
    np.testing.assert_allclose([low, high], [report.min_dihedral[own].min(), report.max_dihedral[own].max()])
    assert (inverted, away) == (0, 0)
    points = made.points.copy()
    points[np.flatnonzero(made.held)[0]] += 0.5
    assert made.figures(points)[5] == 0.5


def test_every_tool_that_is_there_keeps_valid_cells(case):
    _, made = case
    before = made.figures(made.points)
    for tool, module in (
        ("gmsnet", "gmsnet"), ("gmsnet, 3.5°", "gmsnet"), ("Gmsh Relocate3D", "gmsh"), ("Mmg3D, moves alone", "mmgpy"),
        ("Netgen m", "netgen"), ("MFEM TMOP 303", "mfem"),
    ):  # fmt: skip
        if importlib.util.find_spec(module) is None:
            continue
        found = made.run(tool, 100.0)
        assert not isinstance(found, str), found
        after = made.figures(found[0])
        assert found[0].shape == made.points.shape
        assert after[1] > before[1] - 0.005  # Gmsh gives some of the mean for the worst
        assert after[4] == 0
        assert after[5] < 1e-9
    assert "KeyError" in made.run("no tool", 100.0)
    assert made.run("gmsnet", 0.01) == "more than 0.01 s"


class Steps:
    """Calls that gain 0.1 of the least and 0.2 of the mean η a sweep, and take a second and one more for each."""

    points = 0

    def run(self, tool, limit):
        sweeps = int(tool.split(", ")[1].removesuffix(" sweeps"))
        return sweeps, 1.0 + sweeps

    def figures(self, points):
        return 0.1 * points, 0.2 * points, 0.0, 180.0, 0, 0.0


def test_times_are_those_of_the_first_call_that_comes_to_what_a_tool_came_to(capsys):
    def end(name, least, mean, seconds):
        return {"name": name, "seconds": seconds, "figures": {"min": least, "mean": mean}}

    ends = [end("gmsnet", 0.9, 0.9, 20.0), end("better", 0.25, 0.3, 12.0), end("worse", 0.1, -0.1, 1.0)]
    volume_peers.print_times(Steps(), {each["name"]: each for each in ends}, 1.0)
    said = capsys.readouterr().out
    *_, better, worse = said.splitlines()
    assert " ".join(better.split()) == "better 0.6 4.0 (6.0) by auto, 2 sweeps 3.0 (6.0) by auto, 3 sweeps"
    assert " ".join(worse.split()) == "worse 0.1 – (0.5) 0.5 (0.5) by auto, 1 sweeps"
    assert "auto, 3 sweeps" in said
    assert "auto, 4 sweeps" not in said
