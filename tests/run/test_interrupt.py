"""A KeyboardInterrupt reaches the caller wherever it comes, and brings the best mesh so far."""

from __future__ import annotations

import _thread
import threading

import numpy as np
import pytest

import gmsnet
from gmsnet.methods.base import StarSmoother
from gmsnet.parallel import threads as workers
from gmsnet.run import api, outcome, stop, untangle_stage
from gmsnet.topology.topology import Topology


@pytest.fixture(scope="module")
def square():
    return gmsnet.random_mesh(400, seed=11)


@pytest.fixture(scope="module")
def tangled():
    mesh = gmsnet.random_mesh(400, seed=11)
    points, thrown = mesh.points.copy(), Topology.of(mesh).free[::12]
    points[thrown] += 0.1 * np.random.default_rng(1).standard_normal((len(thrown), 2))
    return mesh.with_points(points)


class Second:
    """Passes calls on to a function, but for the n-th, which is interrupted."""

    def __init__(self, function, n=1):
        self.function, self.n, self.calls = function, n, 0

    def __call__(self, *arguments, **options):
        self.calls += 1
        if self.calls == self.n:
            raise KeyboardInterrupt
        return self.function(*arguments, **options)


def interrupted(*arguments, **options):
    """The result that comes with the interruption."""
    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(*arguments, **options)
    result = caught.value.result
    assert result.stop_reason == stop.INTERRUPTED
    assert result.after.inverted <= result.before.inverted
    assert gmsnet.quality(result.mesh).qhat == pytest.approx(result.after.qhat, abs=1e-12)
    return result


@pytest.mark.parametrize("kind", [KeyboardInterrupt, type("Mine", (KeyboardInterrupt,), {})])
def test_one_raised_by_the_callback(square, kind):
    error = kind("mine")

    def interrupt(sweep):
        if sweep.index == 5:
            raise error

    with pytest.raises(kind, match="mine") as caught:
        gmsnet.smooth(square, "gmsnet", callback=interrupt)
    assert caught.value is error
    result = error.result
    assert result.stop_reason == stop.INTERRUPTED
    assert result.sweeps == 5
    assert result.judged.after.qhat == pytest.approx(max(s.qhat for s in result.history), abs=1e-12)
    assert result.after.qhat > result.before.qhat
    assert result.points.tobytes() == gmsnet.smooth(square, "gmsnet", max_sweeps=5).points.tobytes()


@pytest.mark.parametrize("method", gmsnet.METHODS)
def test_one_raised_by_the_callback_of_any_method(square, method):
    result = interrupted(square, method, callback=Second(lambda sweep: False))
    assert len(result.history) == 1


@pytest.mark.parametrize("n", [1, 4])
@pytest.mark.parametrize("threads", [1, 3])
def test_one_in_a_sweep(n, threads, monkeypatch):
    """What was made since the last look counts, too."""
    monkeypatch.setattr(workers, "FEWEST_BLOCKS", 1)
    mesh, whole = gmsnet.random_mesh(2000, seed=3), StarSmoother.sweep
    calls = []

    def sweep(*arguments):
        calls.append(whole(*arguments))
        if len(calls) == n:
            raise KeyboardInterrupt
        return calls[-1]

    monkeypatch.setattr(StarSmoother, "sweep", sweep)
    result = interrupted(mesh, "gmsnet", threads=threads)
    assert len(result.history) == n - 1
    monkeypatch.undo()
    assert result.points.tobytes() == gmsnet.smooth(mesh, "gmsnet", max_sweeps=n).points.tobytes()


def test_one_while_threads_are_at_work(monkeypatch):
    """No thread moves nodes any more when the result is formed."""
    monkeypatch.setattr(workers, "FEWEST_BLOCKS", 1)
    mesh, submit = gmsnet.random_mesh(3000, seed=3), workers.Threads._submit
    at_work = []

    def submitted(self, take, times):
        def counted():
            at_work.append(1)
            take()
            at_work.pop()

        others = submit(self, counted, times)
        if len(begun) == 20:
            begun.clear()
            raise KeyboardInterrupt
        begun.append(1)
        return others

    begun = []
    monkeypatch.setattr(workers.Threads, "_submit", submitted)
    write_back = outcome.put_back

    def checked(*arguments):
        assert at_work == []
        return write_back(*arguments)

    monkeypatch.setattr(outcome, "put_back", checked)
    result = interrupted(mesh, "laplacian", threads=3)
    assert result.after.qhat >= result.before.qhat
    assert result.after.inverted == 0


@pytest.mark.parametrize("n", [1, 2])
def test_one_during_untangling(tangled, monkeypatch, n):
    """Untangling is a transaction: the mesh is as it was."""
    import gmsnet.untangle

    assert gmsnet.quality(tangled).inverted
    monkeypatch.setattr(gmsnet.untangle, "take", Second(gmsnet.untangle.take))
    result = interrupted(tangled)
    assert not result.moved.any()
    assert result.after is result.before
    assert (result.sweeps, result.history, result.notes) == (0, [], [])


def test_one_when_all_is_untangled(tangled, monkeypatch):
    """The first thing after untangling: nothing is inverted in what was made."""
    monkeypatch.setattr(StarSmoother, "sweep", Second(StarSmoother.sweep))
    result = interrupted(tangled)
    assert result.after.inverted == 0 < result.before.inverted
    assert result.notes[0].startswith("untangling: ")


def test_one_in_a_second_try_at_untangling_keeps_the_first(tangled, monkeypatch):
    first = []

    def beside(*arguments):
        first.append(arguments)
        raise KeyboardInterrupt

    held = np.zeros(len(tangled.points), dtype=bool)
    held[Topology.of(tangled).free[::12]] = True
    monkeypatch.setattr(untangle_stage, "beside", beside)
    result = interrupted(tangled, fixed=held)
    assert first
    assert 0 < result.after.inverted <= result.before.inverted
    assert result.unmended


def test_one_between_patches(monkeypatch):
    mesh = gmsnet.random_mesh(600, seed=1)
    second = Second(Topology.restricted, 2)
    monkeypatch.setattr(Topology, "restricted", lambda *arguments: second(*arguments))
    result = interrupted(mesh, target_quality=0.6)
    assert (result.after.shape < 0.6).sum() < (result.before.shape < 0.6).sum()


def test_one_on_a_patch():
    result = interrupted(gmsnet.random_mesh(600, seed=1), target_quality=0.6, callback=Second(lambda sweep: False))
    assert (result.after.shape < 0.6).sum() < (result.before.shape < 0.6).sum()


def test_one_near_walls(real_meshes):
    def interrupt(sweep):
        if sweep.stage == "near walls, areas kept":
            raise KeyboardInterrupt

    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    result = interrupted(mesh, callback=interrupt)
    assert [sweep.stage for sweep in result.history].count("near walls, areas kept") == 1
    assert result.after.qhat > result.before.qhat
    assert any("move only as far" in note for note in result.notes)
    assert "refined near a wall" not in result.held


@pytest.mark.parametrize("where", [(outcome, "measure"), (api, "result_of")])
def test_one_after_the_sweeps_loses_nothing(square, monkeypatch, where):
    monkeypatch.setattr(*where, Second(getattr(*where)))
    result = interrupted(square, max_sweeps=3)
    monkeypatch.undo()
    assert result.points.tobytes() == gmsnet.smooth(square, max_sweeps=3).points.tobytes()


def test_a_second_one_does_not_wait_for_the_result(square, monkeypatch):
    monkeypatch.setattr(outcome, "measure", Second(outcome.measure))
    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(square, callback=Second(lambda sweep: False))
    assert caught.value.result is None


def test_one_before_the_input_is_measured_has_no_result(square, monkeypatch):
    second = Second(Topology.and_points)
    monkeypatch.setattr(Topology, "and_points", second)
    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(square)
    assert caught.value.result is None


def test_the_outer_one_of_two_calls_brings_the_outer_result(square):
    inner = gmsnet.random_mesh(60, seed=1)

    def nested(sweep):
        gmsnet.smooth(inner, callback=Second(lambda sweep: False))

    assert len(interrupted(square, callback=nested).points) == len(square.points)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("milliseconds", [1, 3, 10, 30, 100, 300])
def test_ctrl_c_ends_a_loop(square, milliseconds, threads):
    timer = threading.Timer(milliseconds / 1000, _thread.interrupt_main)
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 (the loop of a user)
        timer.start()
        for _ in range(10_000):
            gmsnet.smooth(square, threads=threads)
    timer.join()
