"""--report: one HTML file beside the mesh."""

from __future__ import annotations

import json

import pytest
from support.pages import Page

import gmsnet
from gmsnet.generate import random_volume


def test_smooth_writes_a_page_with_the_document_that_json_prints(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.su2", "--report", tmp_path / "page.html", "--json")
    assert done.code == 0
    page, document = Page((tmp_path / "page.html").read_bytes()), json.loads(done.out)
    assert page.block("report") == document
    assert document["report"] == str(tmp_path / "page.html")
    assert page.texts["command"].startswith(f"gmsnet smooth {square} {tmp_path}/out.su2 --report ")
    assert f"read{square}" in page.texts["notes"]


def test_the_text_names_the_page(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.su2", "--report", tmp_path / "page.HTM")
    assert f"report: {tmp_path}/page.HTM" in done.out
    assert json.loads(run("smooth", square, tmp_path / "o.su2", "--json").out)["report"] is None


def test_a_target_that_is_missed_is_told_by_the_page_and_the_exit_code(run, square, tmp_path):
    options = ("--target-quality", 0.95, "--max-sweeps", 1)
    done = run("smooth", square, tmp_path / "out.su2", *options, "--report", tmp_path / "page.html")
    assert done.code == 1
    page = Page((tmp_path / "page.html").read_bytes())
    assert page.texts["faults"].startswith("target not met: the minimum 1/q is ")
    assert "1/q of 0.95 or more" in page.texts["notes"]


def test_deform_tells_how_far_the_boundary_has_come(run, square, tmp_path):
    move = ("--move", "left", -0.05, 0)
    done = run(
        "deform", square, tmp_path / "out.su2", *move, "--fix", "1", "--report", tmp_path / "page.html", "--json"
    )
    page = Page((tmp_path / "page.html").read_bytes())
    assert page.block("report") == json.loads(done.out)
    assert page.texts["verdict"].startswith("The boundary")
    assert "--move left -0.05 0" in page.texts["command"]


@pytest.mark.parametrize("threshold", [(), ("--threshold", 0.5)])
def test_quality_writes_a_page_of_one_mesh(run, square, tmp_path, threshold):
    done = run("quality", square, "--report", tmp_path / "page.html", "--json", *threshold)
    assert done.code == (1 if threshold else 0)
    page = Page((tmp_path / "page.html").read_bytes())
    assert page.block("report") == json.loads(done.out)
    assert page.block("scene")["states"] == ["now"]
    assert "worst-before" not in page.texts


def test_volumes_have_pages(run, tmp_path):
    gmsnet.write(random_volume(40, seed=1), tmp_path / "cube.vtk")
    done = run("smooth", tmp_path / "cube.vtk", tmp_path / "out.vtk", "--report", tmp_path / "page.html")
    assert done.code == 0
    assert Page((tmp_path / "page.html").read_bytes()).block("scene")["volumes"]


@pytest.mark.parametrize("command", ["smooth", "quality", "deform"])
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("page.pdf", "a report is an HTML file: name it .html"),
        ("missing/page.html", "does not exist"),
        ("folder.html", "this is a folder"),
    ],
)
def test_what_cannot_be_written_is_said_before_the_work(run, square, tmp_path, command, name, message):
    (tmp_path / "folder.html").mkdir()
    output = [] if command == "quality" else [tmp_path / "out.su2"]
    done = run(command, square, *output, "--report", tmp_path / name)
    assert done.code == 2
    assert message in done.err
    assert not (tmp_path / "out.su2").exists()


def test_a_page_overwrites_no_mesh(run, square, tmp_path):
    mesh = tmp_path / "mesh.html"
    mesh.write_bytes(square.read_bytes())
    done = run("smooth", mesh, tmp_path / "out.su2", "--format", "su2", "--report", mesh)
    assert done.code == 2
    assert "the report would overwrite the mesh" in done.err
    assert mesh.read_bytes() == square.read_bytes()


def test_where_the_page_fails_the_mesh_is_there_and_the_error_says_so(run, square, tmp_path, monkeypatch):
    def broken(contents):
        yield b"half"
        raise MemoryError("none left")

    monkeypatch.setattr("gmsnet.page.write.pieces", broken)
    done = run("smooth", square, tmp_path / "out.su2", "--report", tmp_path / "page.html")
    assert done.code == 2
    assert f"mesh written to {tmp_path}/out.su2; the report failed: none left" in done.err
    assert (tmp_path / "out.su2").exists()
    assert not (tmp_path / "page.html").exists()


def test_names_of_files_and_markers_become_no_markup(run, square, tmp_path):
    harm = "<img src=x onerror=alert(1)>"
    source = tmp_path / f"{harm}.su2"
    source.write_bytes(square.read_bytes().replace(b"bottom", harm.replace(" ", "_").encode()))
    assert run("smooth", source, tmp_path / "out.su2", "--report", tmp_path / "page.html").code == 0
    page = Page((tmp_path / "page.html").read_bytes())
    assert not [tag for tag, _ in page.tags if tag == "img"]
    assert f"{harm}.su2" in page.texts["notes"]
