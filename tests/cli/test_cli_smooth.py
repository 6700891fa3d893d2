"""gmsnet smooth: what is written, what is said, and the exit code."""

from __future__ import annotations

import json
import os
import re
import stat
from dataclasses import replace

import numpy as np
import pytest
from support import curved_meshes

import gmsnet
from gmsnet.generate import random_mesh, random_volume, second_order_volume
from gmsnet.run import stop
from gmsnet.run.account import Account


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


def test_the_result_is_that_of_the_api(run, square, tmp_path):
    out = tmp_path / "out.su2"
    before = square.read_bytes()
    done = run("smooth", square, out, "--max-sweeps", 5)
    assert (done.code, done.err) == (0, "")
    assert square.read_bytes() == before
    assert listing(tmp_path) == ["out.su2", "square.su2"]
    expected = gmsnet.smooth(gmsnet.read(square), max_sweeps=5)
    assert gmsnet.read(out).points.tolist() == expected.points.tolist()
    assert expected.after.qhat > expected.before.qhat


def test_the_tables_tell_before_after_worst_held_and_written(run, square, tmp_path):
    out = tmp_path / "out.su2"
    text = run("smooth", square, out).out
    result = gmsnet.smooth(gmsnet.read(square))
    row = next(line for line in text.splitlines() if line.startswith("1/q, least"))
    assert row.split()[-2:] == [f"{result.before.shape.min():.4f}", f"{result.after.shape.min():.4f}"]
    worst = int(result.after.cell[result.after.worst(1)[0]])
    place = " ".join(f"{value:.6g}" for value in result.after.centre[result.after.worst(1)[0]])
    assert re.search(rf"^{worst} .*{re.escape(place)} .* of 3$", text, re.MULTILINE)
    assert f"boundary: {len(result.held['boundary'])}" in text
    assert f"{result.sweeps} sweeps" in text
    assert result.stop_reason in text
    assert f"written: {out}" in text


def test_text_in_a_pipe_is_plain_and_never_cut(run, square, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    text = run("smooth", square, tmp_path / "out.su2").out
    assert "\x1b" not in text
    assert "…" not in text
    assert re.search(r"^min angle, least +\d+\.\d\d +\d+\.\d\d$", text, re.MULTILINE)


def test_json_holds_everything(run, square, tmp_path):
    out = tmp_path / "out.vtk"
    done = run("smooth", square, out, "--json", "--max-sweeps", 3, "--fix", "0,1")
    assert (done.code, done.err) == (0, "")

    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    document = json.loads(done.out, parse_constant=refuse)
    result = gmsnet.smooth(gmsnet.read(square), max_sweeps=3)
    assert document["before"] == result.before.summary()
    assert document["after"] == result.after.summary()
    assert document["moved"] == int(result.moved.sum())
    assert document["held"] == {reason: len(ids) for reason, ids in result.held.items()}
    assert [sweep["qhat"] for sweep in document["history"]] == [sweep.qhat for sweep in result.history]
    assert document["output"] == str(out)
    assert document["stop_reason"] == stop.MAX_SWEEPS
    assert len(document["worst"]) == 5
    assert any("bottom" in loss for loss in document["lost"])
    assert document["target_met"] is None  # none was asked for
    met = run("smooth", square, out, "--json", "--target-quality", 0.001)
    assert json.loads(met.out)["target_met"] is True


def test_quiet_says_nothing(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.su2", "--quiet")
    assert (done.code, done.out, done.err) == (0, "", "")
    assert (tmp_path / "out.su2").exists()


def test_a_target_that_is_met(run, square, tmp_path):
    result = gmsnet.smooth(gmsnet.read(square))
    target = (result.before.shape.min() + result.after.shape.min()) / 2
    done = run("smooth", square, tmp_path / "out.su2", "--target-quality", target)
    assert (done.code, done.err) == (0, "")
    assert stop.TARGET_REACHED in done.out


def test_a_target_that_is_met_already(run, square, tmp_path):
    smoothed = tmp_path / "smoothed.su2"
    run("smooth", square, smoothed)
    done = run("smooth", smoothed, tmp_path / "out.su2", "--target-quality", 0.001)
    assert done.code == 0
    assert "the target is met already" in done.out
    assert (tmp_path / "out.su2").read_bytes() == smoothed.read_bytes()


@pytest.mark.parametrize("flag", ["--quiet", "--json", None])
def test_a_target_that_is_not_met_is_exit_1_and_names_the_cells(run, square, tmp_path, flag):
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--target-quality", 0.99, *([flag] if flag else []))
    assert done.code == 1
    after = gmsnet.quality(gmsnet.read(out))
    few = int((after.shape < 0.99).sum())
    worst = int(after.cell[after.worst(1)[0]])
    gap = 0.99 - after.shape.min()
    assert re.fullmatch(
        rf"gmsnet: target not met: the minimum 1/q is \S+, {gap:.4g} below 0\.99; {few:,} cells miss it "
        rf"\(numbers from 0, worst first: {worst}, [^)]*\)(\n  cell \d+: .+){{10}}\n",
        done.err,
    )
    if flag == "--json":
        document = json.loads(done.out)
        assert (document["target_met"], document["below_target"]) == (False, few)
    if flag == "--quiet":
        assert done.out == ""


def test_nothing_to_move_is_no_error(run, polygons, tmp_path):
    out = tmp_path / "out.vtk"
    done = run("smooth", polygons, out)
    assert done.code == 0
    assert "nothing to move: all 10 nodes are held (boundary: 9, node of a cell that is not smoothed: 1)" in done.out
    assert f"written unchanged: {out}" in done.out
    assert out.read_bytes() == polygons.read_bytes()
    assert json.loads(run("smooth", polygons, out, "--json").out)["after"] == {"triangles": 0, "inverted": 0}


def test_no_gain_is_said_and_the_mesh_is_written_unchanged(run, square, tmp_path):
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--max-sweeps", 0)
    assert done.code == 0
    assert "no gain: no mesh on the way was better than the input" in done.out
    assert out.read_bytes() == square.read_bytes()


def test_in_place_keeps_permissions(run, square, tmp_path):
    square.chmod(0o640)
    before = gmsnet.quality(gmsnet.read(square))
    done = run("smooth", square, "--in-place")
    assert done.code == 0
    assert gmsnet.quality(gmsnet.read(square)).qhat > before.qhat
    assert stat.S_IMODE(square.stat().st_mode) == 0o640
    assert listing(tmp_path) == ["square.su2"]


def test_in_place_without_gain_does_not_touch_the_file(run, square):
    before = square.stat()
    done = run("smooth", square, "--in-place", "--max-sweeps", 0)
    assert f"left as it is: {square}" in done.out
    assert (square.stat().st_ino, square.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_in_place_keeps_the_format_that_the_name_does_not_tell(run, square, tmp_path):
    (plain := tmp_path / "mesh.dat").write_bytes(square.read_bytes())
    assert run("smooth", plain, "--in-place", "--format", "su2").code == 0
    assert run("smooth", square, "--in-place").code == 0
    assert plain.read_bytes() == square.read_bytes()


def test_an_existing_output_is_replaced(run, square, tmp_path):
    out = tmp_path / "out.su2"
    out.write_text("old")
    assert run("smooth", square, out).code == 0
    assert gmsnet.read(out).points.shape == gmsnet.read(square).points.shape


def test_what_conversion_loses_is_named(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.off")
    assert done.code == 0
    assert "lost in conversion: " in done.out


def test_the_output_format_can_be_named(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.dat", "--output-format", "su2")
    assert done.code == 0
    assert (tmp_path / "out.dat").read_bytes().startswith(b"NDIME")


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_plot(run, square, tmp_path, suffix):
    picture = tmp_path / f"picture.{suffix}"
    done = run("smooth", square, tmp_path / "out.su2", "--plot", picture)
    assert done.code == 0
    assert f"picture: {picture}" in done.out
    assert picture.read_bytes()[:5] in (b"\x89PNG\r", b"<?xml", b"%PDF-")


def test_a_picture_of_a_mesh_without_triangles_is_refused_before_the_work(run, polygons, tmp_path):
    done = run("smooth", polygons, tmp_path / "out.vtk", "--plot", tmp_path / "p.png")
    assert done.code == 2
    assert "polygons.vtk: a picture shows the quality of triangles and quads, and this mesh has none; leave" in done.err
    assert listing(tmp_path) == ["polygons.vtk"]
    done = run("quality", polygons, "--plot", tmp_path / "p.png")
    assert (done.code, done.out) == (2, "")
    assert "leave out --plot" in done.err


@pytest.mark.parametrize(
    ("error", "code", "what"),
    [
        (gmsnet.InputError("p.png: no room"), 2, "p.png: no room"),
        (MemoryError(), 2, "MemoryError"),
        (KeyError("font"), 70, "'font'"),
    ],
)
def test_a_picture_that_fails_says_that_the_mesh_is_written(run, square, tmp_path, monkeypatch, error, code, what):
    def fail(*arguments):
        raise error

    monkeypatch.delenv("GMSNET_DEBUG", raising=False)
    monkeypatch.setattr("gmsnet.plot.plot_smoothing", fail)
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--plot", tmp_path / "p.png")
    assert done.code == code
    assert f"mesh written to {out}; the picture failed: {what}" in done.err
    assert len(gmsnet.read(out).points) == len(gmsnet.read(square).points)


def test_the_target_is_judged_by_the_cells_and_not_by_the_reason_to_stop(square):
    mesh = gmsnet.read(square)
    result = gmsnet.smooth(mesh, max_sweeps=2)
    least = result.after.shape.min()
    for target, reason, met in (
        (np.nextafter(least, 1), stop.TARGET_REACHED, False),
        (least, stop.MAX_SWEEPS, True),
    ):
        asked = {"target_quality": target}
        assert Account(mesh, replace(result, stop_reason=reason, asked=asked)).target_met is met
    missed = replace(result, asked={"target_quality": np.nextafter(least, 1)})
    assert "1 cell misses it" in Account(mesh, missed).shortfall()


def test_a_bug_is_one_line_and_a_traceback_on_demand(run, square, tmp_path, monkeypatch):
    def fail(*arguments):
        raise RuntimeError("boom\nbang")

    monkeypatch.setattr("gmsnet.io.read", fail)
    monkeypatch.delenv("GMSNET_DEBUG", raising=False)
    done = run("smooth", square, tmp_path / "out.su2")
    assert done.code == 70
    assert done.err.startswith("gmsnet: internal error: RuntimeError: boom bang; please report it")
    assert done.err.count("\n") == 1
    monkeypatch.setenv("GMSNET_DEBUG", "1")
    with pytest.raises(RuntimeError, match="boom"):
        run("smooth", square, tmp_path / "out.su2")


def test_a_full_disk_is_one_line(run, square, tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", full)
    done = run("smooth", square, tmp_path / "out.su2")
    assert done.code == 2
    assert "out.su2: cannot be written: no space left on device" in done.err
    assert listing(tmp_path) == ["square.su2"]


def test_the_metric_by_which_the_best_mesh_is_chosen(run, square, tmp_path):
    results = {
        by: json.loads(run("smooth", square, tmp_path / f"{by}.su2", "--best-by", by, "--json").out)
        for by in ("shape", "aspect")
    }
    assert results["aspect"]["after"]["qhat_aspect"] >= results["shape"]["after"]["qhat_aspect"]
    assert results["shape"]["after"]["qhat"] >= results["aspect"]["after"]["qhat"]
    assert results["shape"]["history"][0]["qhat"] != results["aspect"]["history"][0]["qhat"]
    refused = run("smooth", square, tmp_path / "out.su2", "--best-by", "qhat")
    assert refused.code == 2
    assert "best_by must be one of 'shape', 'aspect'" in refused.err
    assert not (tmp_path / "out.su2").exists()


def test_a_mesh_of_boundary_nodes_is_told_of_sliding(run, tmp_path):
    gmsnet.write(random_mesh(10, seed=1), tmp_path / "a.su2")
    hint = "most nodes are at the boundary and stay there: --slide all lets them move along it"
    assert hint in run("smooth", tmp_path / "a.su2", tmp_path / "b.su2").out
    assert hint not in run("smooth", tmp_path / "a.su2", tmp_path / "b.su2", "--slide", "all").out
    gmsnet.write(random_mesh(200, seed=1), tmp_path / "a.su2")
    assert hint not in run("smooth", tmp_path / "a.su2", tmp_path / "b.su2").out
    gmsnet.write(second_order_volume(random_volume(40, seed=1)), tmp_path / "a.vtu")  # whose boundary does not slide
    told = run("smooth", tmp_path / "a.vtu", tmp_path / "b.vtu").out
    assert "(boundary: " in told
    assert hint not in told


def test_no_target_is_met_where_curved_cells_stay_invalid(run, tmp_path):
    mesh = curved_meshes.known_valid(102)
    points = mesh.points.copy()
    line = next(block.nodes for block in mesh.cells if block.dimension == 1)[0]
    points[line[2]] = points.mean(axis=0) + 3.0 * (points.mean(axis=0) - points[line[2]])
    source = tmp_path / "in.vtu"
    gmsnet.write(mesh.with_points(points), source)
    done = run("smooth", source, tmp_path / "out.vtu", "--target-quality", 0.01, "--json")
    told = json.loads(done.out)
    assert (done.code, told["below_target"], told["target_met"]) == (1, 0, False)
