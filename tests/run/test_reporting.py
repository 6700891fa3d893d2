"""SmoothResult.report, and what a result knows of the call that made it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.pages import Page

import gmsnet
from gmsnet import InputError
from gmsnet.generate import random_mesh
from gmsnet.measure.target import Target
from gmsnet.run.options import SmoothOptions


def test_a_result_writes_its_report(tmp_path):
    mesh = random_mesh(60, seed=1)
    result = gmsnet.smooth(mesh, max_sweeps=3, target_angle=np.float32(5))
    result.report(tmp_path / "page.html")
    page = Page((tmp_path / "page.html").read_bytes())
    assert page.texts["command"] == "gmsnet.smooth(mesh, max_sweeps=3, target_angle=5.0)"
    assert page.block("report")["after"]["shape"]["min"] == result.after.shape.min()
    assert page.block("report")["target_angle"] == 5.0


def test_arrays_have_a_report_too(tmp_path):
    mesh = random_mesh(60, seed=1)
    gmsnet.smooth((mesh.points, mesh.cells[0].nodes)).report(str(tmp_path / "page.html"))
    assert (tmp_path / "page.html").stat().st_size > 10_000


def test_of_deform_the_report_tells_how_far_the_boundary_has_come(tmp_path):
    result = gmsnet.deform(random_mesh(60, seed=1), (0.01, 0.0), "left")
    result.report(tmp_path / "page.html")
    page = Page((tmp_path / "page.html").read_bytes())
    assert page.texts["verdict"].startswith("The boundary is in place")
    assert page.texts["command"] == "gmsnet.deform(mesh)"
    assert page.block("report")["fraction"] == 1.0


def test_a_report_is_an_html_file(tmp_path):
    with pytest.raises(InputError, match=r"name it \.html"):
        gmsnet.smooth(random_mesh(20, seed=1), max_sweeps=0).report(tmp_path / "report")


def test_the_mesh_before_is_drawn_as_it_was(tmp_path):
    mesh = random_mesh(60, seed=1)
    result = gmsnet.smooth(mesh)
    assert np.array_equal(result.before.cells.points, mesh.points)
    assert np.array_equal(result.after.cells.points, result.points)


def test_what_was_asked_for_is_kept_as_plain_values():
    options = SmoothOptions(
        method="laplacian",
        slide=np.array(["a"]),
        feature_angle=30.0,
        weights=None,
        callback=print,
        max_sweeps=np.int64(7),
    )
    assert options.asked == {"method": "laplacian", "slide": "array of shape (1,)", "max_sweeps": 7}
    assert SmoothOptions().asked == {}
    assert SmoothOptions(method="gmsnet", weights=Path("w.safetensors")).asked["weights"] == "w.safetensors"
    assert SmoothOptions(size=np.sin).asked == {"size": "sin"}
    assert SmoothOptions(slide=("a", "b")).asked == {"slide": ["a", "b"]}


def test_what_a_target_asks_for_is_told_in_words():
    assert Target(0.3, 20.0).words("1/q") == "1/q of 0.3 or more and angles of 20° or more"
    assert Target(None, None, 12.5).words("η") == "dihedral angles of 12.5° or more"
