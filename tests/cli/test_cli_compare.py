"""gmsnet quality of two meshes side by side."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import random_mesh, random_volume


@pytest.fixture
def smoothed(run, square, tmp_path):
    path = tmp_path / "smoothed.su2"
    assert run("smooth", square, path, "-q").code == 0
    return path


def test_both_are_measured_and_their_nodes_compared(run, square, smoothed):
    document = json.loads(run("quality", square, smoothed, "--json").out)
    one, other = gmsnet.read(square), gmsnet.read(smoothed)
    for told, path, mesh in zip(document["meshes"], (square, smoothed), (one, other), strict=True):
        assert told["input"] == str(path)
        assert told["shape"]["min"] == gmsnet.quality(mesh).shape.min()
    way = np.linalg.norm(one.points - other.points, axis=1)
    assert document["same_cells"] is True
    assert document["moved"] == np.count_nonzero(way)
    assert document["largest_move"] == way.max()
    text = run("quality", square, smoothed).out
    row = next(line for line in text.splitlines() if line.startswith("1/q, least"))
    assert row.split()[-2:] == [f"{gmsnet.quality(mesh).shape.min():.4f}" for mesh in (one, other)]
    assert f"{document['moved']} nodes elsewhere" in text


def test_the_same_mesh_in_another_format(run, square, tmp_path):
    gmsnet.write(gmsnet.read(square), tmp_path / "same.vtu")
    document = json.loads(run("quality", square, tmp_path / "same.vtu", "--json").out)
    assert document["same_cells"] is False  # it has three coordinates then
    assert "the two have other cells" in run("quality", square, tmp_path / "same.vtu").out
    assert run("quality", square, square).out.count("0 nodes elsewhere") == 1


def test_other_cells_are_not_compared_node_by_node(run, square, tmp_path):
    gmsnet.write(random_mesh(50, seed=9), tmp_path / "other.su2")
    document = json.loads(run("quality", square, tmp_path / "other.su2", "--json").out)
    assert document["same_cells"] is False
    assert "moved" not in document


def test_a_threshold_holds_for_both(run, square, smoothed):
    limit = (gmsnet.quality(gmsnet.read(square)).shape.min() + gmsnet.quality(gmsnet.read(smoothed)).shape.min()) / 2
    done = run("quality", square, smoothed, "--threshold", limit, "--json")
    assert done.code == 1
    assert [each["below_threshold"] > 0 for each in json.loads(done.out)["meshes"]] == [True, False]
    assert done.err.startswith(f"gmsnet: {square}: below the threshold")
    assert run("quality", smoothed, smoothed, "--threshold", limit).code == 0


def test_what_cannot_be_compared(run, square, polygons, tmp_path):
    volume = tmp_path / "volume.mesh"
    gmsnet.write(random_volume(20, seed=0), volume)
    for arguments, words in (
        ([square, volume], "volumes and faces have no measures in common"),
        ([square, polygons], "no cells that can be measured"),
        ([square, square, "--plot", tmp_path / "a.png"], "--plot draws one mesh"),
        (["-", "-"], "can be read once"),
        ([square, tmp_path / "none.su2"], "no such file"),
    ):
        done = run("quality", *arguments)
        assert (done.code, done.out) == (2, "")
        assert words in done.err
