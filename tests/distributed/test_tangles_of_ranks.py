"""Inverted cells of a mesh that is spread over ranks are mended as in the serial run, with what lies around them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
import gmsnet.generate

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.blocks import block
from support.layer_meshes import grid, heights
from support.ranks import nodes_lent, parts_at_random, same

import gmsnet.distributed.mending as mending
from gmsnet.distributed.partition import bisection
from gmsnet.run.options import SmoothOptions

MESHES = {
    "triangles": gmsnet.random_mesh(3000, seed=3),
    "quads": gmsnet.generate.random_quad_mesh(2500, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(2500, seed=4, cells="mixed"),
    "tetrahedra": gmsnet.generate.random_volume(3000, seed=2),
    "hexahedra": block(16, 16, 16, jitter=0.2, seed=1),
    "solids": block(16, 16, 16, wedges=np.ndindex(2, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.15, seed=2),
}


def tangled(mesh, rng, count, far, where=(0.1, 0.9)):
    """The mesh with some nodes thrown, each so many times the mean distance of nodes. where: shares of the box."""
    points, dim = mesh.points.copy(), mesh.points.shape[1]
    size = np.ptp(points, axis=0)
    low, high = (points.min(axis=0) + share * size for share in where)
    inner = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
    chosen = rng.choice(inner, min(count, len(inner)), replace=False)
    step = far * float(np.prod(size) / len(points)) ** (1.0 / dim)
    points[chosen] += step * rng.normal(size=(len(chosen), dim))
    return replace(mesh, points=points)


def compact(mesh, ranks):
    """Which rank has which cell: those that lie together."""
    of_node = bisection(mesh.points, ranks)
    return [of_node[block.nodes[:, 0]] for block in mesh.cells]


@pytest.mark.parametrize("kind", MESHES)
def test_a_few_cells_are_mended_with_what_lies_around(monkeypatch, kind):
    mesh = tangled(MESHES[kind], np.random.default_rng(5), 2, 1.3, (0.1, 0.25))
    assert gmsnet.quality(mesh).inverted
    counts = nodes_lent(monkeypatch, mending, "gathered_field")
    options = SmoothOptions(method="barrier", max_sweeps=4, preserve="none", threads=1)
    told = same(mesh, options, compact(mesh, 3), 3)
    assert told.gathered == ""
    assert told.after.inverted == 0
    assert any(note.startswith("untangling: all") for note in told.notes)
    assert 0 < counts[-1] < 0.6 * len(mesh.points)


@pytest.mark.parametrize("kind", ["triangles", "mixed", "tetrahedra", "hexahedra"])
def test_many_cells_are_mended_with_all(monkeypatch, kind):
    mesh = tangled(MESHES[kind], np.random.default_rng(7), 400, 0.5)
    counts = nodes_lent(monkeypatch, mending, "gathered_field")
    options = SmoothOptions(method="laplacian", max_sweeps=3, preserve="none", threads=1)
    told = same(mesh, options, compact(mesh, 2), 2)
    assert told.gathered == ""
    assert counts[-1] == len(mesh.points)


def test_the_default_with_all_that_is_meant():
    """Layers are found among cells that are mended first."""
    width = np.linspace(0.0, 1.0, 41)
    mesh, rng = grid(width, heights(40.0, width[1])), np.random.default_rng(1)
    points = mesh.points.copy()
    even = np.flatnonzero((abs(points[:, 0] - 0.5) < 0.2) & (abs(points[:, 1] - 0.5 * points[:, 1].max()) < 0.1))
    points[even[:3]] += 0.05 * rng.normal(size=(3, 2))
    mesh = replace(mesh, points=points)
    assert gmsnet.quality(mesh).inverted
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, 3, rng, "interleaved"), 3)
    assert told.gathered == ""
    assert any("layer" in reason for reason in told.held)


def test_what_cannot_be_mended_is_listed_by_the_first_rank():
    mesh = tangled(gmsnet.random_mesh(300, seed=3), np.random.default_rng(1), 3, 2.0, (0.1, 0.4))
    assert gmsnet.quality(mesh).inverted
    fixed = mesh.points.max(axis=1) < 0.9
    options = SmoothOptions(method="barrier", max_sweeps=3, preserve="none", threads=1)
    told = same(mesh, options, compact(mesh, 2), 2, fixed)
    assert told.gathered == "inverted cells could not be mended with what lies around them"
    assert told.after.inverted


@given(
    seed=st.integers(0, 2**32 - 1), ranks=st.integers(1, 4), kind=st.sampled_from(sorted(MESHES)),
    count=st.integers(1, 30), far=st.floats(0.3, 3.0), how=st.sampled_from(["interleaved", "strips", "lonely"]),
)  # fmt: skip
@settings(max_examples=12, deadline=None)
def test_any_tangle_on_any_partition(seed, ranks, kind, count, far, how):
    rng = np.random.default_rng(seed)
    mesh = tangled(MESHES[kind], rng, count, far)
    fixed = rng.random(len(mesh.points)) < 0.02
    options = SmoothOptions(method="barrier", max_sweeps=3, preserve="none", threads=1)
    same(mesh, options, parts_at_random(mesh, ranks, rng, how), ranks, fixed)


@pytest.mark.parametrize("seed", [8, 10, 19])
def test_a_rank_that_has_an_inverted_quad_apart(seed):
    """It would read it the other way round, and find it inverted once it is mended."""
    rng = np.random.default_rng(seed)
    mesh = tangled(gmsnet.generate.structured_mesh(12), rng, 4, 1.5)
    options = SmoothOptions(method="laplacian", max_sweeps=2, preserve="none", threads=1)
    assert same(mesh, options, parts_at_random(mesh, 4, rng, "interleaved"), 4).after.inverted == 0
