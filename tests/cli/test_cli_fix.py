"""gmsnet smooth --fix: markers, node ids, files of them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gmsnet


def test_fixed_nodes_stay(run, square, tmp_path):
    names = tmp_path / "ids.txt"
    mesh = gmsnet.read(square)
    free = np.flatnonzero(gmsnet.smooth(mesh).moved)
    names.write_text(f"{free[2]}, {free[3]}\n# a comment\n{free[4]} # another\n")
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--fix", f"{free[0]},{free[1]}", "--fix", f"@{names}", "--fix", "left")
    assert done.code == 0
    assert "fixed by the user: 5" in done.out
    moved = (gmsnet.read(out).points != mesh.points).any(axis=1)
    assert not moved[free[:5]].any()
    assert moved[free[5:]].any()


def test_a_marker_that_is_a_number_goes_before_a_node(run, tmp_path):
    mesh = gmsnet.random_mesh(60, seed=1)
    path = tmp_path / "numbers.mesh"
    gmsnet.write(mesh, path)  # Medit keeps the numbers of markers, not their names
    lines = gmsnet.read(path).markers["1"]
    assert 1 < len(lines) < len(mesh.points) / 2
    held = json.loads(run("smooth", path, tmp_path / "out.mesh", "--fix", "1", "--json").out)["held"]
    assert held["boundary"] == len(mesh.cells[1].nodes), "the lines of marker 1 are held anyway, node 1 is not"
    assert "fixed by the user" not in held
    inner = int(np.flatnonzero(gmsnet.smooth(mesh).moved)[0])
    held = json.loads(run("smooth", path, tmp_path / "out.mesh", "--fix", f"{inner},", "--json").out)["held"]
    assert held["fixed by the user"] == 1


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("lefft", "did you mean 'left'"),
        ("999999", "there is no node 999999; the mesh has the nodes 0 to"),
        ("1,2,x", "no marker '1,2,x'"),
        ("", "no marker ''"),
        ("@nowhere.txt", "nowhere.txt: the list of nodes cannot be read: No such file"),
        ("@{folder}/words.txt", "words.txt, line 2: 'left' is not a node: give whole numbers"),
        ("@{folder}/far.txt", "far.txt, line 1: there is no node 123456"),
        ("@{folder}/binary.txt", "this is not a list of nodes"),
        ("@{folder}/none.txt", "none.txt: the list names no node: leave out --fix"),
    ],
)
def test_wrong_fixed_nodes(run, square, tmp_path, value, message):
    (tmp_path / "words.txt").write_text("1 2\nleft\n")
    (tmp_path / "far.txt").write_text("123456")
    (tmp_path / "none.txt").write_text("# 1 2\n\n")
    (tmp_path / "binary.txt").write_bytes(b"\xff\xfe\x00")
    done = run("smooth", square, tmp_path / "out.su2", "--fix", value.format(folder=tmp_path))
    assert done.code == 2
    assert message in done.err
    assert not (tmp_path / "out.su2").exists()


@pytest.mark.parametrize("name", ["unnamed.su2", "unnamed.mesh"])
def test_a_number_is_no_region_of_cells_without_a_name(run, tmp_path, name):
    triangles = gmsnet.random_mesh(60, seed=1).cells[0]
    mesh = gmsnet.Mesh(gmsnet.random_mesh(60, seed=1).points, (triangles,))
    path = tmp_path / name
    gmsnet.write(mesh, path)
    inner = int(np.flatnonzero(gmsnet.smooth(mesh).moved)[0])
    for node in (0, 1, inner):
        document = json.loads(run("smooth", path, tmp_path / f"out-{name}", "--fix", node, "--json").out)
        assert document["held"].get("fixed by the user", 0) == (node == inner)
        assert document["free"] > 30
    done = run("smooth", path, tmp_path / f"out-{name}", "--fix", "wall")
    assert "there is no marker 'wall': the mesh has no markers" in done.err


def test_a_file_with_a_mask_is_not_taken_for_the_nodes_0_and_1(run, square, tmp_path):
    count = len(gmsnet.read(square).points)
    (tmp_path / "mask.txt").write_text("0\n1\n" * (count // 2) + "0\n" * (count % 2))
    done = run("smooth", square, tmp_path / "out.su2", "--fix", f"@{tmp_path / 'mask.txt'}")
    assert done.code == 2
    assert f"a 0 or a 1 for each of the {count} nodes" in done.err
    assert not (tmp_path / "out.su2").exists()


def test_nodes_that_are_held_anyway_are_told(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.su2", "--fix", "left")
    left = len(gmsnet.read(square).markers["left"])
    assert f"fixed: {left} nodes are named, and held for other reasons anyway" in done.out
    assert "fixed:" not in run("smooth", square, tmp_path / "out.su2").out
