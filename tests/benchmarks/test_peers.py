"""The comparison with other tools: its arithmetic, checks and tables, and what becomes of tools that are not there."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import gmsnet

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

from peers import checks, command, meshes, plots, report, results, runner, table
from peers.peer import AVERAGING, OURS, QUALITY, Peer, Plane

INPUT = {"mean": 0.7, "min": 0.1, "qhat": -0.2, "inverted": 0, "min_angle": 1.0, "max_angle": 170.0}
KEPT = {"points_kept": True, "cells_kept": True, "moved": 1.0, "boundary": checks.HELD, "boundary_shift": 0.0}


def record(unit, *levels):
    """What worker.py would write: L, and levels of (effort, seconds, mean, minimum 1/q, q̂)."""
    return {
        "status": "measured", "versions": {"fake": "1.0"}, "L": unit, "memory": {"before": 1000, "peak": 4000},
        "levels": [
            {
                "effort": effort, "runs": 3, "seconds": seconds, "units": seconds / unit, "clock": seconds,
                "set_up": 0.25 * seconds, "smoothing": 0.75 * seconds, "back": 0.0, "behaviour": KEPT,
                "figures": INPUT | {"mean": mean, "min": least, "qhat": qhat},
            }
            for effort, seconds, mean, least, qhat in levels
        ],
    }  # fmt: skip


@pytest.fixture
def theirs():
    """At 0.89 of a final mean of 0.9 one level before the last; its minimum 1/q comes with the last only."""
    return record(2e-3, (1, 1.0, 0.80, 0.10, -0.1), (2, 4.0, 0.895, 0.15, 0.0), (3, 10.0, 0.90, 0.40, 0.1))


@pytest.fixture
def ours():
    return record(1e-3, (1, 0.10, 0.85, 0.30, 0.0), (2, 0.20, 0.892, 0.45, 0.11))


@pytest.fixture
def document(theirs, ours):
    missing = {peer.name: f"there is no {peer.packages[0]}" for peer in table.PEERS}
    tools = {name: {"status": "not installed", "reason": reason} for name, reason in missing.items()}
    tools |= {"Netgen": theirs, "SciPy matrix": theirs, table.DEFAULT: ours, "gmsnet laplacian plain": ours}
    mesh = {"nodes": 100, "cells": 180, "input": INPUT, "tools": tools}
    threads = {table.DEFAULT: {"status": "measured", "threads": [1, 2], "whole": [2.0, 1.0], "smoothing": [1.0, 0.5],
                               "same_bits": True}}  # fmt: skip
    return {
        "machine": "a machine\nversions", "date": "2026-01-01",
        "meshes": {"random square/100": mesh | {"threads": threads}, "random square/1000": mesh | {"nodes": 1000}},
    }  # fmt: skip


def test_goal_is_a_share_of_the_final_figure_where_it_is_better_than_the_input(theirs):
    assert results.goal(theirs, "mean", INPUT) == pytest.approx(0.99 * 0.90)
    assert results.goal(theirs, "min", INPUT) == pytest.approx(0.99 * 0.40)
    assert results.goal(theirs, "qhat", INPUT) == 0.1  # itself: a share of a negative one would be above it
    assert results.goal(theirs, "mean", INPUT | {"mean": 0.9}) is None
    assert results.goal(record(1.0, (1, 1.0, 0.8, -0.1, 0.0)), "min", INPUT | {"min": -0.5}) is None


def test_what_a_figure_takes_is_the_least_effort_that_is_enough(theirs):
    assert results.level_to(theirs, "mean", 0.891)["effort"] == 2
    assert results.level_to(theirs, "mean", 0.90)["effort"] == 3
    assert results.level_to(theirs, "mean", 0.9001) is None
    theirs["levels"][1]["figures"] = None  # its points could not be used
    assert results.level_to(theirs, "mean", 0.891)["effort"] == 3


def test_ratios_are_of_times_in_the_unit_beside_them(theirs, ours):
    found = results.pair(theirs, ours, INPUT)
    assert found["mean"]["theirs"] == 4.0
    assert found["mean"]["ours"] == 0.20
    assert found["mean"]["times"] == pytest.approx((4.0 / 2e-3) / (0.20 / 1e-3))
    assert found["mean"]["times_whole"] == pytest.approx((10.0 / 2e-3) / (0.20 / 1e-3))
    assert found["min"]["theirs"] == 10.0
    assert found["qhat"]["times"] == pytest.approx((10.0 / 2e-3) / (0.20 / 1e-3))
    assert not found["mean"]["in_input"]
    assert results.better(ours, theirs) == {"min": True, "qhat": True}


def test_a_figure_that_ours_never_reaches_has_no_ratio(theirs, ours):
    for level in ours["levels"]:
        level["figures"]["mean"] = 0.8
    found = results.pair(theirs, ours, INPUT)["mean"]
    assert found["ours"] is None
    assert found["times"] is None


def test_what_the_input_has_already_is_said_to_be_there(theirs, ours):
    assert results.pair(theirs, ours, INPUT | {"mean": 0.8999})["mean"]["in_input"]


def test_tables_show_the_figures_and_who_is_missing(document):
    text = report.markdown(document)
    rows = [line for line in text.splitlines() if line.startswith("| Netgen |")]
    assert len(rows) == 3  # what it is, and one for each mesh
    cells = [cell.strip() for cell in rows[1].split("|")[1:-1]]
    assert cells[:8] == ["Netgen", "0.9000", "0.4000", "0.1000", "0", "2.50 s", "7.50 s", "30"]
    assert cells[8:11] == ["4.00 s", "200 ms", "10.0 (25.0)"]
    assert "| Mmg |" in text
    assert "not installed: there is no mmgpy" in text
    assert "optimesh" in text
    assert "Netgen: " not in text[text.index("Where the aim is missed") :]
    assert "| Random square, 100 nodes | gmsnet auto | 2 | 1.00 s | 2.00 |" in text


def test_what_is_missed_is_listed(document, ours):
    for mesh in document["meshes"].values():
        mesh["tools"][table.DEFAULT] = record(1e-3, (1, 1.0, 0.892, 0.35, 0.11))
    missed = report.markdown(document).split("Where the aim is missed")[1]
    assert "Netgen: 2.00 times as fast to 99 % of its mean (5.00 with all that it did), 10 wanted" in missed
    assert "Netgen: 99 % of its minimum 1/q is not reached" in missed
    assert "Netgen: its minimum 1/q is better" in missed
    assert "its q̂ is better" not in missed
    assert "SciPy matrix: its minimum 1/q is better" in missed


def test_pictures_are_made_of_what_there_is(document, tmp_path):
    made = plots.draw(document, tmp_path)
    names = ["quality-random-square-100.png", "quality-random-square-1000.png", "ahead.png", "size.png", "threads.png"]
    assert [path.name for path in made] == names
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in made)
    assert plots.draw({"meshes": {}}, tmp_path) == []


def test_tables_go_between_the_markers():
    page = f"before\n{command.BEGIN}\nold\n{command.END}\nafter"
    assert command.between_markers(page, "new") == f"before\n{command.BEGIN}\n\nnew\n{command.END}\nafter"
    with pytest.raises(ValueError):
        command.between_markers("no markers", "new")


def test_pictures_that_a_page_shows_are_put_beside_it(document, tmp_path):
    page, folder = tmp_path / "page.md", tmp_path / "folder"
    folder.mkdir()
    page.write_text(f"![ahead](peers-ahead.png)\n{command.BEGIN}\nold\n{command.END}\n", encoding="utf-8")
    command.write(document, folder, page)
    assert "| Netgen |" in page.read_text(encoding="utf-8")
    assert (folder / "report.md").read_text(encoding="utf-8") in page.read_text(encoding="utf-8")
    assert {path.name for path in tmp_path.glob("*.png")} == {"peers-ahead.png"}
    assert (tmp_path / "peers-ahead.png").read_bytes() == (folder / "ahead.png").read_bytes()


def test_a_tool_that_is_not_installed_is_reported_and_nothing_is_started(tmp_path):
    peer = Peer("nobody", QUALITY, "nothing:Nothing", ("numpy", "no-such-distribution"), (1,), "sweeps", "none")
    found = runner.run_peer(peer, tmp_path, tmp_path, 10, {"folder": tmp_path})
    assert found == {"status": "not installed", "reason": "there is no no-such-distribution"}
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", [None, "", "/no/such/program"])
def test_a_tool_whose_program_is_not_there_is_reported(tmp_path, monkeypatch, path):
    peer = Peer("nobody", QUALITY, "nothing:Nothing", (), (1,), "calls", "none", program="NO_SUCH_DRIVER")
    if path is not None:
        monkeypatch.setenv(peer.program, path)
    found = runner.run_peer(peer, tmp_path, tmp_path, 10, {"folder": tmp_path})
    assert found == {"status": "not installed", "reason": "NO_SUCH_DRIVER names no program"}
    assert list(tmp_path.iterdir()) == []


def test_a_tool_that_fails_and_one_that_takes_too_long_are_reported(tmp_path):
    options = {"repeats": 1, "patience": 0.0, "limit": 60.0, "folder": tmp_path}
    peer = Peer("nobody", QUALITY, "nothing:Nothing", ("numpy",), (1,), "sweeps", "none", most_nodes=100)
    found = runner.run_peer(peer, tmp_path, tmp_path, 10, options)
    assert found["status"] == "failed"
    assert "nobody" in found["reason"]
    assert runner.run_peer(peer, tmp_path, tmp_path, 101, options)["status"] == "left out"
    assert runner.run_peer(peer, tmp_path, tmp_path, 10, options | {"limit": 0.0})["status"] == "too slow"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return meshes.stored(tmp_path_factory.mktemp("meshes"), "random", 200)


@pytest.mark.parametrize("name", ["SciPy matrix", "gmsnet laplacian plain"])
def test_a_tool_in_a_process_of_its_own(file, name, tmp_path):
    peer = table.named(name)
    options = {"repeats": 2, "patience": 60.0, "limit": 600.0, "folder": tmp_path}
    found = runner.run_peer(peer, file, file, 200, options)
    assert found["status"] == "measured", found
    efforts = [level["effort"] for level in found["levels"]]
    assert efforts == sorted(set(efforts))
    assert peer.kind == OURS or tuple(efforts) == peer.efforts
    for level in found["levels"]:
        assert level["runs"] == 2
        assert level["seconds"] > 0
        assert level["behaviour"]["boundary"] == checks.HELD
        assert level["behaviour"]["moved"] == 1.0
    plane = Plane.load(file)
    before = checks.figures(plane.points, plane.cells)
    assert results.usable(found)
    assert results.final(found)["mean"] > before["mean"]
    assert found["memory"]["peak"] >= found["memory"]["before"] > 0
    assert (peer.kind == OURS) == ("smoothing_alone" in found)


def test_boundary_nodes_and_segments_are_those_of_edges_with_one_triangle(file):
    plane = Plane.load(file)
    edges = Counter(frozenset((a, b)) for i, j, k in plane.cells.tolist() for a, b in ((i, j), (j, k), (k, i)))
    single = {edge for edge, count in edges.items() if count == 1}
    assert {frozenset(edge) for edge in plane.segments.tolist()} == single
    assert len(plane.segments) == len(single)
    assert set(np.flatnonzero(plane.held).tolist()) == set().union(*single)
    directed = {(a, b) for i, j, k in plane.cells.tolist() for a, b in ((i, j), (j, k), (k, i))}
    assert {tuple(edge) for edge in plane.segments.tolist()} <= directed


def test_checks_tell_what_a_tool_did(file):
    plane = Plane.load(file)
    inner = np.flatnonzero(~plane.held)
    points = plane.points.copy()
    points[inner] += 1e-3
    found = checks.behaviour(plane, points, plane.cells)
    assert found == KEPT
    side = np.flatnonzero((plane.points[:, 1] == 0.0) & (plane.points[:, 0] > 0.0) & (plane.points[:, 0] < 1.0))[0]
    far, near, next_to = (0.0, 1e-2), (0.0, 1e-5), (1e-8, 1e-8)
    words = {(1e-2, 0.0): checks.SLIDES, far: checks.LOST, near: checks.DRIFTS, next_to: checks.ROUNDED}
    for shift, word in words.items():
        there = points.copy()
        there[side] += shift
        found = checks.behaviour(plane, there, None)
        assert found["boundary"] == word
        assert found["boundary_shift"] == pytest.approx(np.hypot(*shift))
        assert found["cells_kept"] is None
    assert not checks.behaviour(plane, points, plane.cells[::-1])["cells_kept"]
    assert not checks.behaviour(plane, points[1:], plane.cells)["points_kept"]
    assert not checks.behaviour(plane, np.where(points > 0.9, np.nan, points), plane.cells)["points_kept"]
    assert not checks.behaviour(plane, np.column_stack([points, points[:, 0]]), plane.cells)["points_kept"]


def test_the_meshes_are_kept_and_valid(tmp_path):
    for name in meshes.NAMES:
        path = meshes.stored(tmp_path, name, 300)
        written = path.read_bytes()
        assert meshes.stored(tmp_path, name, 300) == path
        assert path.read_bytes() == written
        plane = Plane.load(path)
        assert 250 < (~plane.held).sum() < 350
        corners = plane.points[plane.cells]
        along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
        assert area.min() > 0
        assert area.sum() == pytest.approx(2.0)
    assert gmsnet.quality(meshes.good(300)).shape.mean() > 0.97


def test_every_row_of_the_table_can_be_told_from_the_others():
    every = [*table.PEERS, *table.QUAD_PEERS, *table.OWN]
    assert [table.named(peer.name) for peer in every] == every
    assert all(tuple(sorted(set(peer.efforts))) == peer.efforts for peer in every)
    rows = [*table.PEERS, *table.OWN]
    assert len({str(plots.style(peer)["color"]) + plots.style(peer)["marker"] for peer in rows}) == len(rows)
    assert {peer.kind for peer in rows} == {AVERAGING, QUALITY, OURS}
