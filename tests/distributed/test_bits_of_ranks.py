"""A mesh that is spread over ranks ends with the bits of the serial run, however it is spread."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support import solid
from support.blocks import block, cells_of
from support.ranks import parts_at_random, same

from gmsnet.run.options import SmoothOptions

MESHES = {
    "triangles": gmsnet.random_mesh(700, seed=3),
    "quads": gmsnet.generate.random_quad_mesh(400, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(400, seed=4, cells="mixed"),
    "tetrahedra": gmsnet.generate.random_volume(250, seed=2),
    "hexahedra": block(6, 5, 6, jitter=0.25, seed=1),
    "wedges": block(4, 4, 4, wedges=np.ndindex(4, 4), jitter=0.2, seed=3),
    "solids": block(5, 5, 5, wedges=np.ndindex(1, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.2, seed=2),
}
SWEEPS = 6


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


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize("kind", MESHES)
def test_elements_that_are_transformed_all_at_once(kind, guard):
    mesh, rng = MESHES[kind], np.random.default_rng(3)
    options = SmoothOptions(
        method="getme", variant="simultaneous", guard=guard, max_sweeps=SWEEPS, preserve="none", threads=1
    )
    assert same(mesh, options, parts_at_random(mesh, 4, rng, "interleaved"), 4).gathered == ""


@pytest.mark.parametrize("method", ["getme"])
def test_what_is_not_shared_out_is_done_by_the_first_rank(method):
    mesh, rng = MESHES["triangles"], np.random.default_rng(4)
    options = SmoothOptions(method=method, max_sweeps=5, threads=1)
    told = same(mesh, options, parts_at_random(mesh, 3, rng, "strips"), 3)
    assert "follow one another" in told.gathered
    assert told.notes[-1] == f"ranks: the first one smoothed all {len(mesh.points):,} nodes, for {told.gathered}"


def test_a_hexahedron_that_is_inverted_between_its_corners_is_mended_by_the_first_rank():
    rng, base = np.random.default_rng(4), block(3, 3, 3)
    while True:
        nodes = solid.random_cell(rng, "hexahedron", 0.45)
        alone = gmsnet.quality(Mesh(nodes, [cells_of("hexahedron", [range(8)])]))
        if alone.shape[0] > 0.0 and alone.inverted:
            break
    points = np.vstack([base.points, nodes + 10.0])
    cells = np.vstack([base.cells[0].nodes, len(base.points) + np.arange(8)])
    mesh = Mesh(points, [cells_of("hexahedron", cells)])
    options = SmoothOptions(method="barrier", max_sweeps=5, threads=1)
    told = same(mesh, options, parts_at_random(mesh, 2, rng, "strips"), 2)
    assert told.gathered == "inverted cells could not be mended with what lies around them"


def test_facets_that_do_not_match_are_seen_by_the_first_rank():
    """Quadrilaterals on two triangles each: a rank may have one of these alone."""
    mesh = block(3, 3, 3, pyramids=[(1, 1, 1)])
    cubes, pyramids = mesh.cells
    halves = [pyramids.nodes[:, corners] for corners in ([0, 1, 2, 4], [0, 2, 3, 4])]
    mesh = Mesh(mesh.points, [cubes, cells_of("tetra", np.vstack(halves))])
    options = SmoothOptions(method="barrier", max_sweeps=2, preserve="none", threads=1)
    told = same(mesh, options, parts_at_random(mesh, 3, np.random.default_rng(2), "interleaved"), 3)
    assert told.gathered == "parts of the mesh, or facets that do not match, have to be seen whole"
    assert told.held["facet against others of other nodes"] == 8


@pytest.mark.parametrize("slide", [None, "all"])
def test_cells_that_name_a_node_twice_are_told(slide):
    mesh = block(4, 4, 4, jitter=0.2, seed=5)
    nodes = mesh.cells[0].nodes.copy()
    nodes[[7, 50], 3], nodes[[7, 50], 7] = nodes[[7, 50], 2], nodes[[7, 50], 6]
    mesh = Mesh(mesh.points, [cells_of("hexahedron", nodes)])
    options = SmoothOptions(method="barrier", max_sweeps=2, preserve="none", threads=1, slide=slide)
    told = same(mesh, options, parts_at_random(mesh, 3, np.random.default_rng(2), "interleaved"), 3)
    assert told.gathered == ""
    assert "not measured, and their nodes are held: 2 cells that name a node twice" in told.notes


@pytest.mark.parametrize("slide", [None, "all"])
@pytest.mark.parametrize("kind", ["tetrahedra", "hexahedra"])
def test_faces_of_a_marker_between_cells_hold_their_nodes(kind, slide):
    mesh = MESHES[kind]
    block = mesh.cells[0]
    facets = block.nodes[:, list(block.cell.facets[0])]
    free = gmsnet.smooth(mesh, max_sweeps=1, preserve="none").topology.free
    inside = facets[np.isin(facets, free).all(axis=1)][:5]
    faces = CellBlock("triangle" if kind == "tetrahedra" else "quad", inside, np.full(len(inside), 9))
    marked = Mesh(mesh.points, (*mesh.cells, faces))
    options = SmoothOptions(method="barrier", max_sweeps=2, preserve="none", threads=1, slide=slide)
    told = same(marked, options, parts_at_random(marked, 3, np.random.default_rng(2), "interleaved"), 3)
    assert told.gathered == ""
    assert told.held["node of a face cell"] == len(np.unique(inside))
