"""gmsnet smooth: targets, inverted cells, layers and levels of the guard, as the command line tells them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb
from gmsnet.topology.topology import Topology


@pytest.fixture
def tangled(square, tmp_path):
    """The square with nodes thrown over each other."""
    mesh = gmsnet.read(square)
    path = tmp_path / "tangled.su2"
    gmsnet.write(disturb(mesh, Topology.of(mesh).free[:40], 1.5, seed=3, keep_valid=False), path)
    assert gmsnet.quality(gmsnet.read(path)).inverted > 5
    return path


def test_inverted_cells_are_mended_by_default_and_told(run, tangled, tmp_path):
    out = tmp_path / "out.su2"
    done = run("smooth", tangled, out)
    assert done.code == 0
    assert "untangling: all" in done.out
    assert gmsnet.quality(gmsnet.read(out)).inverted == 0
    document = json.loads(run("smooth", tangled, out, "--json").out)
    assert document["unmended"] == []
    assert any(note.startswith("untangling") for note in document["notes"])


def test_what_stays_inverted_is_exit_1_with_its_cells_and_why(run, tmp_path):
    path, out = tmp_path / "twisted.obj", tmp_path / "out.obj"
    # A strip of three triangles, the middle one folded over; all nodes are on the boundary.
    path.write_text("v 0 0 0\nv 2 0 0\nv 1 2 0\nv 1.2 0.5 0\nv 3 1 0\nf 1 2 3\nf 1 2 4\nf 2 5 3\n")
    assert gmsnet.quality(gmsnet.read(path)).inverted == 1
    done = run("smooth", path, out)
    assert done.code == 1
    assert "gmsnet: inverted still: 1 cell (numbers from 0): cell 1 at 1.06667 0.166667 0: " in done.err
    assert "held" in done.err
    document = json.loads(run("smooth", path, out, "--json").out)
    assert [cell["cell"] for cell in document["unmended"]] == [1]


def test_without_untangling_methods_mend_what_they_can(run, tangled, tmp_path):
    done = run("smooth", tangled, tmp_path / "out.su2", "--no-untangle", "--max-sweeps", 0)
    assert done.code == 1
    assert "inverted still" in done.err
    assert "untangling:" not in done.out


def test_an_angle_can_be_the_target(run, square, tmp_path):
    out = tmp_path / "out.su2"
    assert run("smooth", square, out, "--target-angle", 12).code == 0
    assert gmsnet.quality(gmsnet.read(out)).min_angle.min() >= 12
    done = run("smooth", square, out, "--target-angle", 59.5)
    assert done.code == 1
    assert "below 59.5°" in done.err
    assert "cannot all exceed" in done.err
    more, most = (run("smooth", square, out, "--target-angle", angle) for angle in (61, 90))
    assert more.code == most.code == 2
    assert "no triangle has a minimum angle of more than 60°" in more.err
    assert "must lie in (0, 60], of quads alone in (0, 89]" in most.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--guard", "best"], "guard must be one of 'valid', 'worst', 'star'"),
        (["--preserve", "everything"], "preserve must be one of 'shape', 'size', 'metric', 'none'"),
        (["--preserve", "size", "--method", "cvt"], "cvt does not keep the sizes"),
        (["--preserve", "size", "--target-quality", 0.3], "contradict"),
        (["--target-quality", 1.5], r"must lie in (0, 1]"),
    ],
)
def test_what_cannot_be_used_is_said_before_anything_is_read(run, tmp_path, options, said):
    done = run("smooth", tmp_path / "nowhere.su2", tmp_path / "out.su2", *options)
    assert done.code == 2
    assert said in done.err


def test_the_stages_and_the_limit_are_told(run, square, tmp_path):
    text = run("smooth", square, tmp_path / "out.su2").out
    for stage in ("Newton on q, to its end", "MetricLoss, above 1/q = 0.4", "worst first", "MetricLoss, worst kept"):
        assert stage in text
    assert "the minimum 1/q is" in text
    assert "cannot exceed" in text
    assert json.loads(run("smooth", square, tmp_path / "out.su2", "--json").out)["ceiling"] <= 1


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
def test_every_level_of_the_guard(run, square, tmp_path, guard):
    out = tmp_path / "out.su2"
    assert run("smooth", square, out, "--guard", guard).code == 0
    expected = gmsnet.smooth(gmsnet.read(square), guard=guard)
    np.testing.assert_array_equal(gmsnet.read(out).points, expected.points)


def test_layers_are_told_and_held(run, tmp_path):
    x, y = np.meshgrid(np.arange(31.0), np.concatenate([np.arange(10) / 40, 10 / 40 + np.arange(20)]))
    nodes = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    mesh = gmsnet.Mesh(
        np.column_stack([x.ravel(), y.ravel()]),
        (gmsnet.CellBlock("triangle", triangles, np.zeros(len(triangles), int)),),
    )
    path, out = tmp_path / "layers.vtk", tmp_path / "out.vtk"
    gmsnet.write(mesh, path)
    text = run("smooth", path, out).out
    assert "anisotropic on purpose" in text
    assert "stretched layer:" in text
    still = mesh.points[:, 1] < 0.2
    np.testing.assert_array_equal(gmsnet.read(out).points[still, :2], mesh.points[still])
    assert "nothing is held" in run("smooth", path, out, "--preserve", "none").out
    assert "(fix_layers)" in run("smooth", path, out, "--preserve", "none", "--fix-layers").out


def test_no_target_is_met_where_there_is_nothing_to_measure(run, polygons, tmp_path):
    for option in (["--target-quality", 0.3], ["--target-angle", 20]):
        done = run("smooth", polygons, tmp_path / "out.vtk", *option)
        assert done.code == 2
        assert (
            "polygons.vtk: a target is asked of triangles and quads, and this mesh has none: 3 polygon cells"
            in done.err
        )
        assert not (tmp_path / "out.vtk").exists()
    done = run("quality", polygons, "--threshold", 0.3)
    assert done.code == 2
    assert "a threshold is asked of triangles and quads, and this mesh has none: 3 polygon cells cannot" in done.err


def test_cells_that_a_target_is_not_asked_of_are_told(run, tmp_path):
    path = tmp_path / "mixed.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0.5 0\nv 0.5 1.5 0\nf 1 2 3 6 4\nf 2 5 3\n")
    done = run("smooth", path, tmp_path / "out.obj", "--target-quality", 0.3)
    assert done.code == 0
    assert "the target is asked of triangles and quads alone, not of 1 polygon cell" in done.out
    assert "not of" not in run("smooth", path, tmp_path / "out.obj").out
    assert "not measured: 1 polygon cell" in run("quality", path).out


def test_held_cells_that_miss_an_angle_are_said_to_be_held(run, tmp_path):
    path = tmp_path / "one.off"
    path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0.9 0.45 0\n3 0 1 2\n")
    done = run("smooth", path, tmp_path / "out.off", "--target-angle", 30)
    assert done.code == 1
    assert "1 cell misses it" in done.err
    assert "cell 0: all its nodes are held, so it stays as it is" in done.err
    assert "no bound known" not in done.err


def test_figures_of_patches_are_not_taken_for_those_of_the_mesh(run, square, tmp_path):
    assert (
        "stage, in the patches that are smoothed" in run("smooth", square, tmp_path / "o.su2", "--target-angle", 9).out
    )
    done = run("smooth", square, tmp_path / "o.su2")
    assert "stage" in done.out
    assert "in the patches" not in done.out
