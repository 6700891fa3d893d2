"""What a prompt and a notebook show of meshes, reports and results: one screen, whatever their size."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gmsnet


@pytest.fixture(scope="module")
def result():
    return gmsnet.smooth(gmsnet.random_mesh(2000, seed=0), max_sweeps=5)


def test_all_fit_one_screen(result):
    things = [result, result.mesh, *result.mesh.cells, result.before, result.after, result.limits, *result.history]
    for thing in things:
        lines = repr(thing).splitlines()
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 200
        assert "array" not in repr(thing)
    for thing in (result, result.mesh, result.after):
        page = thing._repr_html_()
        assert len(page) < 3000
        assert page.startswith("<table>")
        assert page.count("<td>") == page.count("</td>")


def test_a_result_shows_before_and_after(result):
    text = repr(result)
    free = len(result.points) - sum(map(len, result.held.values()))
    assert text.startswith(f"SmoothResult: {result.moved.sum():,} of {free:,} free nodes moved, ")
    for report in (result.before, result.after):
        assert f"{report.shape.min():.4f}" in text
        assert f"{report.shape.mean():.4f}" in text
        assert f"{report.qhat:.4f}" in result._repr_html_()
    assert f"held: boundary {len(result.held['boundary'])}" in text
    assert result.stop_reason in text


def test_held_is_a_dict_that_shows_counts(result):
    held = result.held
    assert isinstance(held, dict)
    assert repr(held) == f"{{'boundary': {len(held['boundary']):,} nodes}}"
    assert held["boundary"].dtype.kind == "i"
    back = pickle.loads(pickle.dumps(held))
    assert repr(back) == repr(held)
    np.testing.assert_array_equal(back["boundary"], held["boundary"])


def test_meshes_and_blocks():
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    mesh = gmsnet.mesh_from_arrays(
        points, {"triangle": [[0, 1, 2], [0, 2, 3]], "quad": [[0, 1, 2, 3]]}, [3, 4, 5], {"<wall>": [[0, 1]]}
    )
    assert repr(mesh) == "<Mesh: 4 nodes in 2D; 2 triangle cells; 1 quad cell; 1 line cell; named '<wall>'>"
    assert list(map(repr, mesh.cells)) == [
        "<CellBlock: 2 triangle cells, regions 3 to 4>",
        "<CellBlock: 1 quad cell, region 5>",
        "<CellBlock: 1 line cell, region 1>",
    ]
    assert "&lt;wall&gt;" in mesh._repr_html_()
    assert repr(gmsnet.Mesh([[0.0, 0.0]], ())) == "<Mesh: 1 node in 2D>"


def test_without_triangles_there_are_no_figures():
    report = gmsnet.quality(gmsnet.Mesh([[0.0, 0.0]], ()))
    assert repr(report).split() == ["QualityReport", "cells", "0", "inverted", "0"]


def test_what_stays_inverted_is_shown():
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.5]]
    result = gmsnet.smooth((points, [[0, 1, 2], [0, 2, 3], [0, 4, 1]]))
    assert result.after.inverted == len(result.unmended) == 1
    assert "inverted still: 1 cell, see unmended" in repr(result)


def test_what_is_not_told_of_quads_is_left_out():
    points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]]
    report = gmsnet.quality((points, [[0, 1, 4, 3], [1, 2, 5, 4]]))
    assert repr(report).split()[:5] == ["QualityReport", "cells", "2", "inverted", "0"]
    assert "1/q, least" in repr(report)
    assert "nan" not in repr(report)
