"""gmsnet smooth --metric, --size and --preserve metric: files of values, the report, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gmsnet


def sol(path, values):
    values = np.atleast_2d(np.asarray(values).T).T
    kind = {1: 1, 3: 3}[values.shape[1]]
    rows = "\n".join(" ".join(map(repr, row)) for row in values.tolist())
    path.write_text(f"MeshVersionFormatted 2\nDimension 2\nSolAtVertices\n{len(values)}\n1 {kind}\n{rows}\nEnd\n")
    return path


@pytest.fixture
def lengths(square, tmp_path):
    points = gmsnet.read(square).points
    return sol(tmp_path / "size.sol", 0.04 + 0.06 * points[:, 0])


def test_sizes_of_a_file_are_those_of_an_array(run, square, lengths, tmp_path):
    out = tmp_path / "out.su2"
    done = run("smooth", square, out, "--size", lengths)
    assert done.code == 0
    assert "quality in the metric, least" in done.out
    assert "edges within 20 % of 1" in done.out
    mesh = gmsnet.read(square)
    wanted = gmsnet.smooth(mesh, size=0.04 + 0.06 * mesh.points[:, 0])
    assert (gmsnet.read(out).points == wanted.points).all()
    document = json.loads(run("smooth", square, out, "--size", lengths, "--json").out)
    before, after = (document["conformity"][key] for key in ("before", "after"))
    assert after == wanted.conformity.after.summary()
    assert after["least"] >= before["least"]
    assert after["near_mean"] > before["near_mean"]


def test_a_metric_of_a_file_is_that_of_an_array(run, square, tmp_path):
    mesh, out = gmsnet.read(square), tmp_path / "out.su2"
    tensors = np.tile([400.0, 50.0, 100.0], (len(mesh.points), 1))
    assert run("smooth", square, out, "--metric", sol(tmp_path / "m.sol", tensors)).code == 0
    assert (gmsnet.read(out).points == gmsnet.smooth(mesh, metric=tensors).points).all()


def test_the_metric_of_the_mesh_itself_is_told(run, square, tmp_path):
    done = run("smooth", square, tmp_path / "out.su2", "--preserve", "metric")
    assert done.code == 0
    told = " ".join(done.out.split())
    assert "kept as a smooth metric (preserve='metric'): around " in told
    assert "if this is not meant, use preserve='none'" in told
    plain = json.loads(run("smooth", square, tmp_path / "out.su2", "--json").out)
    assert plain["conformity"] is None


def test_what_cannot_be_used_is_refused_in_a_line(run, square, lengths, tmp_path):
    out, short = tmp_path / "out.su2", sol(tmp_path / "short.sol", np.ones(3))
    for arguments, message in (
        (["--size", short], "it has the shape (3,)"),
        (["--metric", lengths], "it holds a number, but a metric is a symmetric tensor"),
        (["--size", tmp_path / "none.sol"], "none.sol: there is no such file"),
        (["--size", lengths, "--guard", "star"], "the guard 'star' cannot be had with size"),
        (["--size", lengths, "--preserve", "metric"], "size and preserve='metric' contradict each other"),
        (["--size", lengths, "--target-angle", "20"], "a target and size contradict each other"),
    ):
        done = run("smooth", square, out, *arguments)
        assert done.code == 2
        assert message in done.err
        assert done.err.count("\n") == 1
        assert not out.exists()
