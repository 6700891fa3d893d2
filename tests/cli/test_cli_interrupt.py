"""Ctrl-C and SIGTERM: what is written, what is said, and the exit code."""

from __future__ import annotations

import json
import signal
from concurrent.futures import ThreadPoolExecutor

import pytest

import gmsnet
from gmsnet.cli import program
from gmsnet.cli.signals import Deferral
from gmsnet.io import read, write
from gmsnet.run import stop
from gmsnet.run.progress import Progress


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


def test_ctrl_c_writes_the_best_mesh_so_far(run, square, tmp_path, monkeypatch):
    def interrupt(self, sweep):
        if sweep.index == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "sweep", interrupt)
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--method", "gmsnet")
    assert done.code == 0
    assert "2 sweeps" in done.out
    assert stop.INTERRUPTED in done.out
    expected = gmsnet.smooth(gmsnet.read(square), "gmsnet", max_sweeps=2)
    assert gmsnet.read(out).points.tolist() == expected.points.tolist()


def test_ctrl_c_before_the_smoothing_writes_nothing(run, square, tmp_path, monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("gmsnet.io.read", interrupt)
    done = run("smooth", square, tmp_path / "out.su2")
    assert (done.code, done.out) == (130, "")
    assert done.err == "gmsnet: interrupted; nothing was written\n"
    assert listing(tmp_path) == ["square.su2"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_between_sweeps_writes_the_best_mesh_so_far(run, square, tmp_path, monkeypatch, number):
    handler = signal.getsignal(number)

    def interrupted(self, sweep):
        if sweep.index == 2:
            signal.raise_signal(number)

    monkeypatch.setattr(Progress, "sweep", interrupted)
    out = tmp_path / "out.su2"
    document = json.loads(run("smooth", square, out, "--method", "gmsnet", "--json").out)
    assert (document["sweeps"], document["stop_reason"]) == (2, stop.INTERRUPTED)
    expected = gmsnet.smooth(gmsnet.read(square), "gmsnet", max_sweeps=2)
    assert gmsnet.read(out).points.tolist() == expected.points.tolist()
    assert signal.getsignal(number) is handler


@pytest.mark.parametrize("arguments", [[], ["--max-sweeps", "0"]])
def test_a_signal_while_writing_waits(run, square, tmp_path, monkeypatch, arguments):
    def interrupted(*given):
        signal.raise_signal(signal.SIGINT)
        return write(*given)

    assert run("smooth", square, tmp_path / "plain.su2", *arguments).code == 0
    monkeypatch.setattr("gmsnet.io.write", interrupted)
    done = run("smooth", square, tmp_path / "out.su2", *arguments)
    assert (done.code, done.err) == (0, "")
    assert stop.INTERRUPTED not in done.out, "the sweeps were over"
    assert (tmp_path / "out.su2").read_bytes() == (tmp_path / "plain.su2").read_bytes()


def test_a_second_signal_ends_at_once(run, square, tmp_path, monkeypatch):
    def interrupted(*given):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("gmsnet.io.write", interrupted)
    done = run("smooth", square, tmp_path / "out.su2")
    assert (done.code, done.err) == (130, "gmsnet: interrupted; nothing was written\n")
    assert listing(tmp_path) == ["square.su2"]


def test_ctrl_c_while_drawing_says_that_the_mesh_is_written(run, square, tmp_path, monkeypatch):
    monkeypatch.setattr("gmsnet.plot.plot_smoothing", lambda *given: signal.raise_signal(signal.SIGINT))
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--plot", tmp_path / "p.png")
    assert (done.code, done.err) == (130, f"gmsnet: interrupted; the mesh is written to {out}\n")
    assert gmsnet.quality(gmsnet.read(out)).qhat > gmsnet.quality(gmsnet.read(square)).qhat


def test_ctrl_c_that_is_lost_ends_the_next_sweep(run, square, tmp_path, monkeypatch):
    swept = gmsnet.smooth(gmsnet.read(square), "gmsnet", max_sweeps=1)
    check = Deferral.begin

    def lost(self):
        if not self.caught:  # as in a function that LLVM calls, before the first sweep has ended
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        check(self)

    monkeypatch.setattr(Deferral, "begin", lost)
    out = tmp_path / "out.su2"
    document = json.loads(run("smooth", square, out, "--method", "gmsnet", "--json").out)
    assert (document["sweeps"], document["stop_reason"]) == (1, stop.INTERRUPTED)
    assert gmsnet.read(out).points.tolist() == swept.points.tolist()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_that_is_lost_while_reading_ends_the_command(run, square, tmp_path, monkeypatch):
    def lost(*given):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return read(*given)

    monkeypatch.setattr("gmsnet.io.read", lost)
    done = run("smooth", square, tmp_path / "out.su2")
    assert (done.code, done.err) == (130, "gmsnet: interrupted; nothing was written\n")
    assert listing(tmp_path) == ["square.su2"]


def test_ctrl_c_in_a_program_that_has_done_its_work_shows_no_traceback(monkeypatch):
    monkeypatch.setattr("gmsnet.cli.main", lambda: 1)
    before = signal.getsignal(signal.SIGINT)
    try:
        assert program() == 1
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)


def test_signals_that_the_caller_ignores_stay_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Deferral() as deferral:
            deferral.begin()
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            assert not deferral.caught
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_smoothing_in_a_thread_of_its_own(run, square, tmp_path):
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(run, "smooth", square, tmp_path / "out.su2", "-q").result().code == 0
