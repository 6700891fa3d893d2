"""What a run says of itself while it works: a line where kernels are compiled, and how long that took."""

from __future__ import annotations

import json

import numba
import pytest

from gmsnet.cli import main
from gmsnet.run.progress import COMPILING, Progress
from gmsnet.topology.topology import Topology


def compile_something():
    @numba.njit
    def three(x):
        return 3 * x

    assert three(2) == 6


@pytest.mark.parametrize("enabled", [True, False])
def test_off_a_terminal_one_line_tells_of_compilation(capsys, enabled):
    with Progress(10, enabled=enabled) as progress:
        progress.begin("reading")
        assert capsys.readouterr().err == ""
        compile_something()
        compile_something()
    assert capsys.readouterr() == ("", f"gmsnet: {COMPILING}\n" if enabled else "")
    assert progress.compilation.seconds > 0.0


@pytest.fixture
def compiling(monkeypatch):
    """Every run has something to compile."""
    genuine = Topology.and_points

    def slower(*arguments):
        compile_something()
        return genuine(*arguments)

    monkeypatch.setattr(Topology, "and_points", slower)


@pytest.mark.usefixtures("compiling")
def test_compilation_is_reported_apart(square, tmp_path, capsys):
    assert main(["smooth", str(square), str(tmp_path / "out.su2"), "--json"]) == 0
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert err == f"gmsnet: {COMPILING}\n"
    assert 0.0 < document["seconds_compiling"] < document["seconds"]
    assert main(["smooth", str(square), str(tmp_path / "out.su2")]) == 0
    assert " s to compile kernels, once): " in capsys.readouterr().out
    assert main(["smooth", str(square), str(tmp_path / "out.su2"), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_without_compilation_nothing_is_said_of_it(run, square, tmp_path):
    run("smooth", square, tmp_path / "out.su2", "--quiet")  # whatever is not compiled yet is compiled here
    assert main(["smooth", str(square), str(tmp_path / "out.su2")]) == 0
    done = run("smooth", square, tmp_path / "out.su2", "--json")
    assert done.err == ""
    assert json.loads(done.out[done.out.index("{") :])["seconds_compiling"] == 0.0
