"""Wrong arguments, odd arrays, callbacks, many callers at once, forks: an error in words or the same bits."""

from __future__ import annotations

import subprocess
import sys
import threading

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.methods import METHODS
from gmsnet.run import stop

MESH = gmsnet.random_mesh(150, seed=5)
POINTS = np.array(MESH.points)
CELLS = np.array(next(block.nodes for block in MESH.cells if block.kind == "triangle"))


@pytest.fixture(scope="module")
def expected():
    return gmsnet.smooth((POINTS, CELLS)).points.tobytes()


LAYOUTS = {
    "fortran": np.asfortranarray,
    "negative strides": lambda a: a[::-1].copy()[::-1],
    "columns backwards": lambda a: a[:, ::-1].copy()[:, ::-1],
    "every third row of more": lambda a: np.repeat(a, 3, axis=0)[1::3],
    "columns of more": lambda a: np.column_stack([a, a, a])[:, : a.shape[1]],
    "read-only": lambda a: np.frombuffer(a.tobytes(), a.dtype).reshape(a.shape),
    "other byte order": lambda a: a.astype(a.dtype.newbyteorder()),
    "not aligned": lambda a: np.frombuffer(b"x" + a.tobytes(), a.dtype, offset=1).reshape(a.shape),
    "matrix": lambda a: np.array(a).view(np.ma.MaskedArray),
    "lists": np.ndarray.tolist,
}


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_the_same_numbers_in_any_layout_give_the_same_bits(layout, expected):
    points, cells = layout(POINTS), layout(CELLS)
    assert gmsnet.smooth((points, cells)).points.tobytes() == expected
    assert np.array_equal(np.asarray(points), POINTS)
    assert np.array_equal(np.asarray(cells), CELLS)
    assert gmsnet.quality((points, cells)).qhat == gmsnet.quality((POINTS, CELLS)).qhat


@pytest.mark.parametrize("dtype", [np.float32, np.float16, np.longdouble, np.int32, np.int64, np.uint8])
def test_other_types_of_numbers_are_taken_as_they_are(dtype):
    given = (POINTS * 200).astype(dtype)
    result = gmsnet.smooth((given, CELLS))
    assert result.mesh[0].dtype == (np.float32 if dtype is np.float32 else np.float64)
    assert (result.points[~result.moved] == given[~result.moved]).all()
    assert result.after.inverted <= result.before.inverted


@pytest.mark.parametrize("node", [2**31, 2**32, 2**32 + 1, 2**62, 2**63 - 1, -1, -(2**31), -(2**63)])
def test_ids_beyond_int32_do_not_wrap_round(node):
    cells = CELLS.copy()
    cells[3, 1] = node
    with pytest.raises(InputError, match=rf"triangle 3 .* names the nodes .*{node}"):
        gmsnet.smooth((POINTS, cells))
    with pytest.raises(InputError, match=f"fixed names the node {node}"):
        gmsnet.smooth((POINTS, CELLS), fixed=[node])


@pytest.mark.parametrize(
    ("mesh", "nodes"),
    [
        ((np.zeros((0, 2)), np.zeros((0, 3), int)), 0),
        ((np.zeros((0, 3)), []), 0),
        ((POINTS, []), len(POINTS)),
        ((POINTS, {}), len(POINTS)),
        ((POINTS, {"line": [[0, 1]], "triangle": np.zeros((0, 3), int)}), len(POINTS)),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_meshes_without_cells_come_back(mesh, nodes, method):
    result = gmsnet.smooth(mesh, method)
    assert result.stop_reason == stop.NOTHING_TO_MOVE
    assert len(result.points) == nodes
    assert (result.points == mesh[0]).all()
    assert result.after.summary() == {"triangles": 0, "inverted": 0}
    assert result.limits.ceiling == 1.0


WRONG = [
    (
        lambda: gmsnet.smooth((POINTS.astype(object), CELLS)),
        "points must be an array of N×2 or N×3 numbers, got obj",
    ),
    (lambda: gmsnet.smooth((POINTS.astype(str), CELLS)), "points must be an array of N×2 or N×3 numbers"),
    (lambda: gmsnet.smooth((POINTS[None], CELLS)), "points must be"),
    (lambda: gmsnet.smooth(((POINTS * 100).astype(int) + 2**60, CELLS)), r"from 2\*\*53 on are no exact coordinates"),
    (lambda: gmsnet.smooth((POINTS, CELLS[None])), "cells must be an M×3 array"),
    (lambda: gmsnet.smooth((POINTS, CELLS.astype(object))), "cells must be whole numbers, got object"),
    (lambda: gmsnet.smooth({"nodes": POINTS, "cells": CELLS}), "a mesh given as a mapping has no 'nodes'"),
    (lambda: gmsnet.smooth(each for each in (POINTS, CELLS)), "generator is not a mesh"),
    (lambda: gmsnet.smooth(MESH, None), "method must be the name of one"),
    (lambda: gmsnet.smooth(MESH, fixed=[None]), "fixed must be node ids"),
    (lambda: gmsnet.smooth(MESH, fixed=object()), "fixed must be node ids"),
    (lambda: gmsnet.smooth(MESH, "gmsnet", weights=""), "the path of the weights is empty"),
    (lambda: gmsnet.smooth(MESH, "gmsnet", weights="x" * 5000), "there is no such file of weights"),
    (lambda: gmsnet.smooth(MESH, "gmsnet", weights="a\0b"), "there is no such file of weights"),
    (lambda: gmsnet.smooth(MESH, "gmsnet", weights=3), "weights must be the path"),
    (lambda: gmsnet.write((POINTS, CELLS), "x.su2"), "only a gmsnet.Mesh can be written, no tuple"),
    (
        lambda: gmsnet.write(gmsnet.smooth(MESH, max_sweeps=0), "x.su2"),
        "no SmoothResult: of a result, give its .mesh",
    ),
    (lambda: gmsnet.write(MESH, "x.su2", format=3), "unknown format 3"),
    (lambda: gmsnet.read(__file__, format=["su2"]), "unknown format"),
    (lambda: MESH.with_points([[1.0, 2.0], [3.0]]), "points cannot be made an array"),
    (lambda: MESH.with_points("abc"), "new points must have the shape"),
    (lambda: MESH.with_points(POINTS.astype(complex)), "complex128"),
    (lambda: gmsnet.Mesh(POINTS, MESH.cells, single="no"), "single must be True or False, got 'no'"),
    (lambda: gmsnet.random_mesh("3"), "whole number of nodes"),
]


@pytest.mark.parametrize(("call", "message"), WRONG, ids=[message for _, message in WRONG])
def test_what_cannot_be_meant_is_refused_in_words(call, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------ callbacks


@pytest.mark.parametrize("method", METHODS)
def test_a_callback_that_fails_fails_the_call_and_nothing_else(method):
    class Mine(Exception):
        pass

    def fail(_):
        raise Mine

    alone = gmsnet.smooth(MESH, method, max_sweeps=3).points.tobytes()
    with pytest.raises(Mine):
        gmsnet.smooth(MESH, method, callback=fail)
    assert gmsnet.smooth(MESH, method, max_sweeps=3).points.tobytes() == alone
    assert (MESH.points == POINTS).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_callback_may_smooth_too(method):
    """The same mesh with the same method, and another."""
    alone = gmsnet.smooth(MESH, method, max_sweeps=3).points.tobytes()
    inner = []

    def enter(sweep):
        if len(inner) < 2:
            inner.append(gmsnet.smooth(MESH, method, max_sweeps=3).points.tobytes())
            gmsnet.smooth(gmsnet.random_mesh(30, seed=len(inner)), method, max_sweeps=2)

    assert gmsnet.smooth(MESH, method, max_sweeps=3, callback=enter).points.tobytes() == alone
    assert inner
    assert set(inner) == {alone}


def test_a_callback_may_spoil_what_was_given(expected):
    points, cells = POINTS.copy(), CELLS.copy()

    def spoil(_):
        points[:] = np.nan
        cells[:] = 0

    assert gmsnet.smooth((points, cells), callback=spoil).points.tobytes() == expected


# ------------------------------------------------------------------ many at once, and forks


def test_calls_from_many_threads_give_what_each_gives_alone(tmp_path):
    jobs = [(gmsnet.random_mesh(60 + 40 * k, seed=k % 5), method) for k, method in enumerate(METHODS)]
    jobs += [(MESH, method) for method in METHODS]
    path = tmp_path / "in.su2"
    gmsnet.write(MESH, path)

    def work(mesh, method, k):
        result = gmsnet.smooth(mesh, method, max_sweeps=4)
        gmsnet.write(result.mesh, tmp_path / f"out{k}.vtu")
        assert (gmsnet.read(path).points == POINTS).all()
        return result.points.tobytes(), result.after.qhat, result.after.shape.tobytes(), len(result.limits.bound)

    alone = [work(mesh, method, k) for k, (mesh, method) in enumerate(jobs)]
    files = [(tmp_path / f"out{k}.vtu").read_bytes() for k in range(len(jobs))]
    for _ in range(2):
        found = [None] * len(jobs)
        start = threading.Barrier(len(jobs))

        def run(k, found=found, start=start):
            start.wait()
            found[k] = work(*jobs[k], k)

        threads = [threading.Thread(target=run, args=(k,)) for k in range(len(jobs))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == alone
        assert [(tmp_path / f"out{k}.vtu").read_bytes() for k in range(len(jobs))] == files


def test_one_report_may_be_asked_by_many_threads():
    def look(report, start, found):
        start.wait()
        found.append((report.shape.tobytes(), report.sign.tobytes(), report.centre.tobytes()))

    for _ in range(20):
        report, start, found = gmsnet.smooth(MESH, max_sweeps=2).after, threading.Barrier(4), []
        threads = [threading.Thread(target=look, args=(report, start, found)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(found) == 4
        assert len(set(found)) == 1


FORKS = """
import multiprocessing, os, sys, threading
import gmsnet
from gmsnet.parallel import threads
threads.FEWEST_BLOCKS = 1  # so that threads are used though the mesh is small
mesh = gmsnet.random_mesh(3000, seed=1)

def smoothed(threads):
    return gmsnet.smooth(mesh, threads=threads).points.tobytes()

before = smoothed(3)
with multiprocessing.get_context("fork").Pool(2) as pool:
    assert pool.map(smoothed, [1, 2, 3, 4]) == [before] * 4
assert smoothed(3) == before

def fork_meanwhile(sweep):  # while threads of the parent wait for work
    if sweep.index == 1:
        child = os.fork()
        if child == 0:
            os._exit(0 if smoothed(2) == before else 1)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0

assert gmsnet.smooth(mesh, threads=3, callback=fork_meanwhile).points.tobytes() == before
print("same")
"""


@pytest.mark.skipif(not hasattr(threading, "get_native_id") or sys.platform == "win32", reason="no forks here")
def test_a_fork_after_threads_were_used_and_while_they_are():
    done = subprocess.run([sys.executable, "-c", FORKS], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "same\n"
