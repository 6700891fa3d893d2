"""A mesh that is spread over ranks ends with the bits of the serial run, however it is spread."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together

from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.smoothing import smoothed
from gmsnet.run.options import SmoothOptions

MESHES = {
    "triangles": gmsnet.random_mesh(700, seed=3),
    "quads": gmsnet.generate.random_quad_mesh(400, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(400, seed=4, cells="mixed"),
    "tetrahedra": gmsnet.generate.random_volume(250, seed=2),
}
SWEEPS = 6


def parts_at_random(mesh, ranks, rng, how):
    """Which rank has which cell: at random, in runs, or but for one all on the last one."""
    found = []
    for block in mesh.cells:
        count = len(block.nodes)
        if how == "interleaved":
            part = rng.integers(0, ranks, count)
        elif how == "strips":
            part = np.arange(count) * ranks // max(count, 1)
        else:
            part = np.full(count, ranks - 1)
            part[:1] = 0
        found.append(part.astype(np.int32))
    return found


def spread(mesh, options, parts, ranks, fixed=None):
    """The points (N, dim) after a run over ranks, and what the first rank tells."""
    fixed = np.zeros(len(mesh.points), dtype=bool) if fixed is None else fixed
    pieces = pieces_of(mesh, fixed, parts, ranks)
    results = together(ranks, lambda comm: smoothed(pieces[comm.rank], options, comm))
    points = np.full_like(mesh.points, np.nan)
    for piece, result in zip(pieces, results, strict=True):
        seen = points[piece.ids]
        assert (np.isnan(seen) | (seen == result.points)).all(), "ranks agree on the nodes that they share"
        points[piece.ids] = result.points
    for result in results:
        assert (result.before, result.after, result.sweeps) == (results[0].before, results[0].after, results[0].sweeps)
    return points, results


def same(mesh, options, parts, ranks, fixed=None):
    serial = gmsnet.smooth(
        mesh, options.method, guard=options.guard, max_sweeps=options.max_sweeps, preserve=options.preserve,
        variant=options.variant, objective=options.objective, threads=1, fixed=fixed,
    )  # fmt: skip
    points, results = spread(mesh, options, parts, ranks, fixed)
    assert points.tobytes() == serial.points.tobytes()
    told = results[0]
    assert told.after == serial.after.totals
    assert told.stop_reason == serial.stop_reason
    assert [sweep.moved for sweep in told.history] == [sweep.moved for sweep in serial.history]
    assert told.held == {reason: len(ids) for reason, ids in serial.held.items()}
    return told


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("method", ["barrier", "laplacian"])
@pytest.mark.parametrize("kind", MESHES)
def test_guard_levels_on_interleaved_cells(kind, method, guard):
    mesh, rng = MESHES[kind], np.random.default_rng(1)
    options = SmoothOptions(method=method, guard=guard, max_sweeps=SWEEPS, preserve="none", threads=1)
    told = same(mesh, options, parts_at_random(mesh, 3, rng, "interleaved"), 3)
    assert told.gathered == ""
    assert told.messages > 0


@pytest.mark.parametrize("method", ["gmsnet", "gmsnet2", "nn", "angle", "cvt", "cpt"])
def test_methods_for_triangles(method):
    mesh, rng = MESHES["triangles"], np.random.default_rng(2)
    options = SmoothOptions(method=method, max_sweeps=3, preserve="none", threads=1)
    assert same(mesh, options, parts_at_random(mesh, 2, rng, "strips"), 2).gathered == ""


@given(seed=st.integers(0, 2**32 - 1), ranks=st.integers(1, 6), kind=st.sampled_from(sorted(MESHES)),
       how=st.sampled_from(["interleaved", "strips", "lonely"]))  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_any_partition(seed, ranks, kind, how):
    rng, mesh = np.random.default_rng(seed), MESHES[kind]
    fixed = rng.random(len(mesh.points)) < 0.1
    options = SmoothOptions(method="barrier", max_sweeps=4, preserve="none", threads=1)
    assert same(mesh, options, parts_at_random(mesh, ranks, rng, how), ranks, fixed).gathered == ""


@pytest.mark.parametrize("kind", MESHES)
def test_ranks_that_have_no_cells_or_one_kind_of_them(kind):
    mesh = MESHES[kind]
    options = SmoothOptions(method="barrier", max_sweeps=3, preserve="none", threads=1)
    same(mesh, options, parts_at_random(mesh, 5, np.random.default_rng(0), "lonely"), 5)
    by_kind = [np.full(len(block.nodes), k % 3, dtype=np.int32) for k, block in enumerate(mesh.cells)]
    same(mesh, options, by_kind, 3)


def test_more_ranks_than_cells():
    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0.3, 0.4]])
    mesh = Mesh(points, (CellBlock("triangle", [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4),))
    options = SmoothOptions(method="barrier", max_sweeps=4, preserve="none", threads=1)
    same(mesh, options, [np.arange(4, dtype=np.int32)], 7)


def test_a_large_floor_watches_the_same_blocks_of_cells():
    """So many blocks that not all are watched; a grid, whose cells are alike."""
    grid = gmsnet.generate.structured_mesh(60)
    mesh = gmsnet.generate.disturb(grid, ((grid.points > 0.0) & (grid.points < 1.0)).all(axis=1), 0.2, seed=1)
    options = SmoothOptions(method="laplacian", max_sweeps=8, preserve="none", threads=1)
    rng = np.random.default_rng(3)
    same(mesh, options, parts_at_random(mesh, 3, rng, "interleaved"), 3)


@pytest.mark.parametrize("method", ["auto", "getme", "worst-first"])
def test_what_is_not_shared_out_is_done_by_the_first_rank(method):
    mesh, rng = MESHES["triangles"], np.random.default_rng(4)
    options = SmoothOptions(method=method, max_sweeps=5, threads=1)
    told = same(mesh, options, parts_at_random(mesh, 3, rng, "strips"), 3)
    assert "follow one another" in told.gathered
    assert told.notes[-1] == f"ranks: the first one smoothed all {len(mesh.points):,} nodes, for {told.gathered}"


def test_tangles_are_gathered_and_mended():
    mesh = MESHES["triangles"]
    points = mesh.points.copy()
    inner = np.flatnonzero(((mesh.points > 0.2) & (mesh.points < 0.8)).all(axis=1))[:40]
    points[inner] += 0.1 * np.random.default_rng(5).normal(size=(len(inner), 2))
    options = SmoothOptions(method="barrier", max_sweeps=5, threads=1)
    tangled = replace(mesh, points=points)
    rng = np.random.default_rng(6)
    told = same(tangled, options, parts_at_random(tangled, 2, rng, "strips"), 2)
    assert told.gathered == "inverted cells are mended one after the other"
