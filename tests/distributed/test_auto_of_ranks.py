"""The default method over ranks ends with the bits of the serial run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
import gmsnet.generate

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.blocks import block
from support.ranks import parts_at_random, same

from gmsnet.generate import o_grid_section, sheared_mesh
from gmsnet.methods.auto import WHOLE
from gmsnet.run.options import SmoothOptions
from gmsnet.run.rest_stage import PHASE

SOLIDS = {
    "hexahedra": block(6, 5, 6, jitter=0.27, seed=1),
    "wedges": block(4, 4, 4, wedges=np.ndindex(4, 4), jitter=0.2, seed=3),
    "mixed": block(5, 5, 5, wedges=np.ndindex(1, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.2, seed=2),
}
TETRAHEDRA = gmsnet.generate.random_volume(400, seed=2)
PLANAR = {
    "triangles": gmsnet.random_mesh(700, seed=3),
    "quads": gmsnet.generate.random_quad_mesh(400, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(400, seed=4, cells="mixed"),
}
AUTO = SmoothOptions(preserve="none", threads=1)


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
def test_tetrahedra_have_all_stages(guard):
    rng = np.random.default_rng(1)
    options = SmoothOptions(guard=guard, preserve="none", threads=1)
    told = same(TETRAHEDRA, options, parts_at_random(TETRAHEDRA, 3, rng, "interleaved"), 3)
    assert told.gathered == ""
    if guard != "star":
        assert "dihedral angles" in [sweep.stage for sweep in told.history]
    assert told.messages > 0


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("method", ["auto", "worst-first", "optimize"])
@pytest.mark.parametrize("kind", SOLIDS)
def test_volumes_of_any_kinds(kind, method, guard):
    mesh, rng = SOLIDS[kind], np.random.default_rng(1)
    fixed = rng.random(len(mesh.points)) < 0.05
    options = SmoothOptions(method=method, guard=guard, preserve="none", threads=1)
    told = same(mesh, options, parts_at_random(mesh, 3, rng, "interleaved"), 3, fixed)
    assert told.gathered == ""
    assert told.messages > 0


@pytest.mark.parametrize("kind", SOLIDS)
def test_ranks_without_a_hexahedron(kind):
    """The last one has no cell, and of mixed cells others have but one kind."""
    mesh, kinds = SOLIDS[kind], range(len(SOLIDS[kind].cells))
    parts = [np.full(len(cells.nodes), k % 3, dtype=np.int32) for k, cells in zip(kinds, mesh.cells, strict=True)]
    told = same(mesh, SmoothOptions(preserve="none", threads=1), parts, 4)
    assert told.gathered == ""


@pytest.mark.parametrize("count", [6, 12])
def test_hexahedra_that_come_back_to_their_grid(count):
    """More than a thousand free nodes do not to the last bit, though each rank has fewer."""
    mesh = block(count, count, count, jitter=0.1, seed=3)
    told = same(mesh, AUTO, parts_at_random(mesh, 3, np.random.default_rng(1), "strips"), 3)
    assert "in float64" in told.history[-1].stage
    assert (told.after.shape_min > 1.0 - 1e-9) == (count == 6)


@pytest.mark.parametrize("guard", ["valid", "worst"])
def test_the_mean_of_hexahedra_is_raised_last(guard):
    mesh = gmsnet.generate.swept_volume(o_grid_section(24, 4), 12, 3.0, twist=0.6, bend=0.4)
    options = SmoothOptions(guard=guard, preserve="none", threads=1)
    told = same(mesh, options, parts_at_random(mesh, 2, np.random.default_rng(1), "strips"), 2)
    assert told.gathered == ""
    assert told.history[-1].stage == "mean of η"


@pytest.mark.parametrize(("ranks", "how"), [(2, "strips"), (3, "interleaved")])
def test_the_rest_behind_cells_that_cannot_become_better(ranks, how):
    mesh = gmsnet.generate.random_volume(1200, seed=4)
    worst = np.argsort(gmsnet.quality(mesh).shape)[:12]
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[mesh.cells[0].nodes[worst]] = True
    told = same(mesh, AUTO, parts_at_random(mesh, ranks, np.random.default_rng(5), how), ranks, fixed)
    assert told.gathered == ""
    assert PHASE in [sweep.stage for sweep in told.history]


@given(
    seed=st.integers(0, 2**32 - 1), ranks=st.integers(1, 5), how=st.sampled_from(["interleaved", "strips", "lonely"])
)
@settings(max_examples=8, deadline=None)
def test_any_partition_of_tetrahedra(seed, ranks, how):
    rng = np.random.default_rng(seed)
    fixed = rng.random(len(TETRAHEDRA.points)) < 0.1
    assert same(TETRAHEDRA, AUTO, parts_at_random(TETRAHEDRA, ranks, rng, how), ranks, fixed).gathered == ""


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("method", ["auto", "worst-first"])
@pytest.mark.parametrize("kind", PLANAR)
def test_cells_in_a_plane_have_all_phases(monkeypatch, kind, method, guard):
    """With the phases of large meshes."""
    monkeypatch.setattr("gmsnet.methods.phases.SMALL", 100)
    mesh, rng = PLANAR[kind], np.random.default_rng(1)
    options = SmoothOptions(method=method, guard=guard, preserve="none", threads=1)
    assert same(mesh, options, parts_at_random(mesh, 3, rng, "interleaved"), 3).gathered == ""


@given(
    seed=st.integers(0, 2**32 - 1), ranks=st.integers(1, 5), kind=st.sampled_from(sorted(PLANAR)),
    how=st.sampled_from(["interleaved", "strips", "lonely"]),
)  # fmt: skip
@settings(max_examples=12, deadline=None)
def test_any_partition_of_cells_in_a_plane(seed, ranks, kind, how):
    rng, mesh = np.random.default_rng(seed), PLANAR[kind]
    fixed = rng.random(len(mesh.points)) < 0.05
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gmsnet.methods.phases.SMALL", int(rng.choice([100, 5000])))
        assert same(mesh, AUTO, parts_at_random(mesh, ranks, rng, how), ranks, fixed).gathered == ""


@pytest.mark.parametrize("ranks", [1, 3])
def test_all_nodes_at_once_where_they_creep(ranks):
    mesh = sheared_mesh(30)
    told = same(mesh, AUTO, parts_at_random(mesh, ranks, np.random.default_rng(2), "strips"), ranks)
    assert told.gathered == ""
    assert any(WHOLE in sweep.stage for sweep in told.history)


def test_cells_that_are_alike_are_chosen_by_their_numbers():
    grid = gmsnet.generate.structured_mesh(40)
    mesh = gmsnet.generate.disturb(grid, np.arange(len(grid.points)) == 820, 0.4, seed=1)
    assert same(mesh, AUTO, parts_at_random(mesh, 3, np.random.default_rng(3), "interleaved"), 3).gathered == ""
