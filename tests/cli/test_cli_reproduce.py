"""gmsnet reproduce: the whole of it, quickly; what it writes, that it resumes, and what it refuses."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import pytest

pytest.importorskip("torch")
pytest.importorskip("matplotlib")

from gmsnet.methods import METHODS
from gmsnet.paper.figures import PICTURES

WRITTEN = [
    "claims.csv", "loss-study.csv", "reproduction.html", "reproduction.json", "table1.csv", "table2.csv", "table3.csv",
    "timing.csv",
]  # fmt: skip


class Page(HTMLParser):
    """What a page refers to, and its text."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.text = ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        self.references += [value for name, value in attributes if name in ("src", "href", "action", "srcset", "data")]
        self.ids += [value for name, value in attributes if name == "id"]
        assert tag not in ("link", "script", "iframe", "object")

    def handle_data(self, data):
        self.text += data


def everything_is_written(quick):
    assert sorted(path.name for path in quick.iterdir() if path.suffix in (".html", ".csv")) == [
        name for name in WRITTEN if not name.endswith(".json")
    ]
    for picture in PICTURES:
        assert (quick / picture.file).read_bytes().startswith(b"\x89PNG")
    document = json.loads((quick / "reproduction.json").read_text())
    assert {"table1", "table2", "table3", "study", "figures", "claims", "machine", "versions"} <= document.keys()
    assert len(document["claims"]) >= 14
    assert {claim["verdict"] for claim in document["claims"]} <= {"holds", "holds in part", "does not hold"}


def the_page_is_whole_and_refers_to_nothing_outside(quick):
    page = Page(quick / "reproduction.html")
    pictures = [each for each in page.references if each.startswith("data:image/png;base64,")]
    assert len(pictures) == len(PICTURES)
    inner = [each for each in page.references if each.startswith("#")]
    assert sorted({*pictures, *inner}) == sorted(set(page.references))
    assert {each[1:] for each in inner} <= set(page.ids)
    assert not re.search(r"https?:|url\(|@import", (quick / "reproduction.html").read_text(encoding="utf-8"))
    assert "This is a quick run" in page.text
    for claim in json.loads((quick / "reproduction.json").read_text())["claims"]:
        assert claim["title"] in page.text
        assert claim["measured"] in page.text


def all_methods_and_variants_are_in_table_2(quick):
    table = json.loads((quick / "reproduction.json").read_text())["table2"]
    for case, rows in table["rows"].items():
        keys = {row["method"] for row in (*rows, *table["beyond"][case])} - {None}
        assert all(any(key.startswith(name) for name in METHODS) for key in keys)
        assert all(any(key.startswith(name) for key in keys) for name in METHODS)
        for method in METHODS.values():
            assert all(any(key.startswith(f"{method.name}-{variant}") for key in keys) for variant in method.variants)
        assert [row["label"] for row in rows] == [
            "Origin", "LaplacianSmoothing", "AngleSmoothing", "CVTSmoothing", "GETMeSmoothing", "OptimSmoothing",
            "NN-Smoothing", "GMSNet",
        ]  # fmt: skip
        assert all(row["columns"]["inverted"]["most"] == 0 for row in (*rows, *table["beyond"][case]))
        assert all("paper" in row["columns"]["inv_q_mean"] for row in rows)


def a_second_call_does_nothing_anew(quick, run):
    def stamps():
        return {path: path.stat().st_mtime_ns for path in (quick / "units").rglob("*.json")}

    before, page = stamps(), (quick / "reproduction.html").read_bytes()
    done = run("reproduce", "all", "--quick", "--out", quick)
    assert done.code == 0
    assert "everything is there already" in done.err
    assert stamps() == before
    assert (quick / "reproduction.html").read_bytes() == page


def other_options_never_mix(quick, run):
    done = run("reproduce", "all", "--quick", "--sweeps", "7", "--out", quick)
    assert done.code == 2
    assert "holds a reproduction with other options (sweeps 20 there, 7 here)" in done.err


@pytest.mark.long
def test_all_of_it_quickly(tmp_path, run):
    """One test, so that processes that share the tests do not each make a reproduction of their own."""
    quick = tmp_path / "out"
    assert run("reproduce", "all", "--quick", "--out", quick).code == 0
    everything_is_written(quick)
    the_page_is_whole_and_refers_to_nothing_outside(quick)
    all_methods_and_variants_are_in_table_2(quick)
    a_second_call_does_nothing_anew(quick, run)
    other_options_never_mix(quick, run)


def stopped(arguments, out, *, of_all):
    """What there is of a run that a signal ends as soon as it has a training more; of_all: SIGTERM to all processes."""
    before = set(out.glob("units/training/*/*.json"))
    process = subprocess.Popen(
        [sys.executable, "-m", "gmsnet", *arguments], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        deadline = time.monotonic() + 300
        while set(out.glob("units/training/*/*.json")) == before and process.poll() is None:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        if of_all:
            os.killpg(process.pid, signal.SIGTERM)
        else:
            process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == 130
    assert said.endswith(f"gmsnet: interrupted; {out} keeps what is done: the same command goes on with it\n")
    assert not (out / "reproduction.html").exists()
    return said, {path: path.stat().st_mtime_ns for path in out.rglob("units/**/*.json")}


@pytest.mark.long
def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path, run):
    """Once by SIGTERM to all its processes, once by SIGINT, then to the end."""
    out = tmp_path / "out"
    arguments = ["reproduce", "table3", "--quick", "--runs", "1", "--sweeps", "2", "--out", str(out)]
    said, first = stopped(arguments, out, of_all=True)
    assert said.count("\n") == 1
    said, second = stopped(arguments, out, of_all=False)
    assert re.match(rf".*{len(first)} of 12 parts are there already; going on.*\n", said)
    assert said.count("\n") == 2
    assert 0 < len(first) < len(second) < 12
    done = run(*arguments)
    assert done.code == 0
    assert re.search(rf"{len(second)} of 12 parts are there already; going on", done.err)
    for there in (first, second):
        assert {path: path.stat().st_mtime_ns for path in there} == there
    document = json.loads((out / "reproduction.json").read_text())
    assert "table2" not in document
    assert document["table3"]["pipe"]["metric"]["trainings"] == 2


def test_what_cannot_be_reproduced(tmp_path, run):
    done = run("reproduce", "table4", "--out", tmp_path / "out")
    assert (done.code, done.out) == (2, "")
    assert "choose one of: table1, table2, table3, figures, all" in done.err
    assert run("reproduce", "--runs", "0", "--out", tmp_path / "out").code == 2
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_told_before_the_work(tmp_path, run):
    (tmp_path / "file").write_text("mine")
    done = run("reproduce", "all", "--quick", "--out", tmp_path / "file")
    assert done.code == 2
    assert f"{tmp_path / 'file'}: this folder cannot be made" in done.err
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("missing", ["torch", "matplotlib"])
def test_without_an_extra_the_command_to_install_it_is_named(tmp_path, missing):
    code = (
        f"import sys; sys.modules[{missing!r}] = None; from gmsnet.cli import main; "
        f"sys.exit(main(['reproduce', 'all', '--out', {str(tmp_path / 'out')!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    assert re.search(
        r'install the extra "(train|view)", in the folder of the sources by pip install "\.\[\1\]"', done.stderr
    )
    assert not (tmp_path / "out").exists()
