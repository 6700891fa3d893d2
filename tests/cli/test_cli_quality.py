"""gmsnet quality and gmsnet methods."""

from __future__ import annotations

import json

import pytest
from support.hand_made import vtk_text

import gmsnet


def test_the_figures_are_those_of_the_api(run, square):
    done = run("quality", square, "--json")
    assert (done.code, done.err) == (0, "")
    document = json.loads(done.out)
    report = gmsnet.quality(gmsnet.read(square))
    assert {name: document[name] for name in report.summary()} == report.summary()
    assert [cell["cell"] for cell in document["worst"]] == report.cell[report.worst(5)].tolist()
    assert document["planar"] is True


def test_the_table(run, square):
    text = run("quality", square).out
    report = gmsnet.quality(gmsnet.read(square))
    assert f"{len(gmsnet.read(square).points)} nodes" in text
    assert f"{report.shape.min():.4f}" in text
    assert "inverted cells" in text


@pytest.mark.parametrize("limit", [-1.0, 0.3])
def test_threshold(run, square, limit):
    few = int((gmsnet.quality(gmsnet.read(square)).shape < limit).sum())
    done = run("quality", square, "--threshold", limit, "--json")
    assert json.loads(done.out)["below_threshold"] == few
    assert done.code == (1 if few else 0)
    assert (f"{few} cells below it" in done.err) is bool(few)
    assert (few > 0) is (limit > 0)


def test_inverted_cells_are_marked(run, tmp_path):
    path = tmp_path / "folded.vtk"
    points = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0), (3.0, 1.0, 0.0)]
    path.write_text(vtk_text(points, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)], 5))
    text = run("quality", path).out
    assert "1 (inverted)" in text
    assert json.loads(run("quality", path, "--json").out)["inverted"] == 1


def test_a_surface_has_no_sign(run, tmp_path):
    path = tmp_path / "tent.vtk"
    path.write_text(vtk_text([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1)], [(0, 1, 2), (1, 3, 2)], 5))
    done = run("quality", path)
    assert done.code == 0
    assert "surface in space" in done.out


def test_no_triangles(run, polygons):
    done = run("quality", polygons)
    assert done.code == 0
    assert "no triangles or quads to measure" in done.out
    assert json.loads(run("quality", polygons, "--json").out)["triangles"] == 0


def test_plot(run, square, tmp_path):
    done = run("quality", square, "--plot", tmp_path / "picture.png")
    assert done.code == 0
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_methods(run):
    text = run("methods").out
    rows = json.loads(run("methods", "--json").out)["methods"]
    assert [row["name"] for row in rows] == list(gmsnet.METHODS)
    for row in rows:
        assert row["summary"] in text
        assert row["source"] in text
