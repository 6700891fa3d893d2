"""Nodes that slide, and surfaces in space, over ranks: the bits of the serial run, whatever they slide on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import shortest_path

import gmsnet
import gmsnet.generate

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.blocks import block
from support.ranks import parts_at_random, same, spread
from support.surface_meshes import ball, halves, wavy

from gmsnet.distributed import skin, smoothing
from gmsnet.distributed.gathered import gathered as gathered_whole
from gmsnet.errors import InputError
from gmsnet.measure.report import connectivity_of
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.held import ON_INTERFACE

IN_PLANE = {
    "square": gmsnet.random_mesh(900, seed=3),
    "circle": gmsnet.random_mesh(900, "circle", seed=3),
    "quads": gmsnet.generate.random_quad_mesh(900, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(900, seed=4, cells="mixed"),
}
VOLUMES = {
    "cube": gmsnet.generate.random_volume(400, seed=2),
    "ball": gmsnet.generate.ball_volume(500).mesh,
    "hexahedra": block(5, 5, 5, jitter=0.2, seed=1),
    "solids": block(6, 6, 6, wedges=np.ndindex(2, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.15, seed=2),
}
SURFACES = {
    "sphere": ball(500, 1),
    "bracket": gmsnet.generate.bracket(600).mesh,
    "sheet of quads": wavy(14, 1),
    "mixed sheet": wavy(20, 2, kind="mixed"),
}
MESHES = {**IN_PLANE, **VOLUMES, **SURFACES}


def slid(**options):
    return SmoothOptions(**{"preserve": "none", "threads": 1, "slide": "all", **options})


def cut(mesh, ranks=3, how="strips", seed=1):
    return parts_at_random(mesh, ranks, np.random.default_rng(seed), how)


@pytest.mark.parametrize(
    ("method", "guard"),
    [("barrier", "valid"), ("barrier", "worst"), ("barrier", "star"), ("laplacian", "worst"), ("worst-first", "star")],
)
@pytest.mark.parametrize("kind", MESHES)
def test_sweeps(kind, method, guard):
    mesh = MESHES[kind]
    told = same(mesh, slid(method=method, guard=guard, max_sweeps=3), cut(mesh), 3)
    assert told.gathered == ""
    assert any(sweep.moved for sweep in told.history)


@pytest.mark.parametrize("kind", MESHES)
def test_the_default_with_all_its_stages(kind):
    mesh = MESHES[kind]
    told = same(mesh, slid(), cut(mesh, 3, "interleaved"), 3)
    assert told.gathered == ""
    assert told.notes[0].startswith("surface:" if kind in SURFACES else "slide:")


@pytest.mark.parametrize("kind", MESHES)
def test_targets(kind):
    mesh = MESHES[kind]
    shapes = np.sort(gmsnet.quality(mesh).shape)
    for method, cell in (("auto", 2), ("auto", len(shapes) // 6), ("barrier", 6)):
        options = slid(method=method, target_quality=float(shapes[cell]), max_sweeps=30)
        assert same(mesh, options, cut(mesh), 3).gathered == ""


@pytest.mark.parametrize("kind", ["sphere", "mixed sheet"])
def test_nodes_of_features_stay_where_nothing_else_is_asked(kind):
    mesh = SURFACES[kind]
    assert same(mesh, slid(slide=None), cut(mesh, 2), 2).gathered == ""


@pytest.mark.parametrize(
    ("count", "seed", "how"), [(200, 1, "interleaved"), (400, 0, "strips"), (600, 1, "interleaved")]
)
def test_nodes_on_facets_stay_where_only_their_rank_knows_them(count, seed, how):
    """The first rank gets cells around the worst ones, and with them nodes that do not move there."""
    mesh = ball(count, seed)
    parts = cut(mesh, 3 if how == "strips" else 2, how)
    assert same(mesh, slid(slide=None), parts, 3 if how == "strips" else 2).gathered == ""


@pytest.mark.parametrize(("count", "seed"), [(130, 2), (200, 3), (280, 2)])
def test_nodes_beside_a_round_of_a_target_are_located_alike(count, seed):
    """One process locates all nodes in each round, several those of the patches alone."""
    mesh = ball(count, seed, 0.4)
    told = same(mesh, slid(slide=None, target_quality=0.8, hausdorff=0.01), cut(mesh, 3, "interleaved"), 3)
    assert told.gathered == ""


@pytest.mark.parametrize(("side", "seed"), [(12, 7), (10, 4), (14, 6)])
def test_quads_whose_other_corners_are_held_are_among_the_worst(side, seed):
    """A corner's row has no free node where only the fourth one of its quad is free: it counts as others do."""
    mesh, options = wavy(side, seed, 0.4), slid(slide=None, method="worst-first", untangle=False)
    fixed = np.random.default_rng(seed).random(len(mesh.points)) < 0.4
    assert same(mesh, options, [np.arange(side * side, dtype=np.int32) % 2], 2, fixed).gathered == ""


def with_a_marker_inside(mesh, seed):
    """The same with a marker of lines, the shortest way between two nodes."""
    ends = [np.stack([each.nodes, np.roll(each.nodes, -1, axis=1)], axis=-1).reshape(-1, 2) for each in mesh.cells]
    count = len(mesh.points)
    edges = coo_matrix((np.ones(sum(map(len, ends))), np.concatenate(ends).T), (count, count)).tocsr()
    first, last = np.random.default_rng(seed).choice(count, 2, replace=False)
    _, before = shortest_path(edges, directed=False, unweighted=True, indices=first, return_predecessors=True)
    way = [last]
    while way[-1] != first:
        way.append(before[way[-1]])
    rows = np.column_stack([way[:-1], way[1:]])
    return replace(mesh, cells=(*mesh.cells, CellBlock("line", rows, np.full(len(rows), 7, dtype=np.int64))))


@pytest.mark.parametrize("how", ["strips", "interleaved"])
@pytest.mark.parametrize(("kind", "seed"), [("triangle", 0), ("triangle", 5), ("quad", 1), ("quad", 8)])
def test_nodes_slide_along_a_marker_inside_of_a_region(kind, seed, how):
    """Its lines are lent with the cells around, so that the first rank has the stars that one process has."""
    make = gmsnet.random_mesh if kind == "triangle" else gmsnet.generate.random_quad_mesh
    mesh = with_a_marker_inside(make(250, seed=seed), seed)
    assert same(mesh, slid(), parts_at_random(mesh, 2, np.random.default_rng(seed), how), 2).gathered == ""


@pytest.mark.parametrize("kind", ["circle", "quads", "cube", "hexahedra", "sphere", "sheet of quads"])
def test_inverted_cells(kind):
    mesh, rng = MESHES[kind], np.random.default_rng(7)
    points = mesh.points.copy()
    inner = np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[:3]
    points[inner] += 0.15 * np.ptp(points) * rng.normal(size=(3, points.shape[1]))
    same(replace(mesh, points=points), slid(), cut(mesh), 3)


def test_a_surface_with_turned_triangles_is_seen_by_the_first_rank():
    mesh = SURFACES["sphere"]
    nodes = mesh.cells[0].nodes.copy()
    nodes[:100] = nodes[:100, [0, 2, 1]]
    turned = replace(mesh, cells=(replace(mesh.cells[0], nodes=nodes),))
    assert "wound" in same(turned, slid(method="barrier", max_sweeps=3), cut(mesh, 2), 2).gathered


def test_a_folded_plane_in_space_is_mended_by_the_first_rank():
    mesh = wavy(12, 3, 0.9)
    flat = np.column_stack([mesh.points[:, :2], mesh.points[:, :2].sum(axis=1)])
    mesh = mesh.with_points(flat)
    assert "folded" in same(mesh, slid(slide=None), cut(mesh, 2), 2).gathered


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_folds_of_a_curved_surface_are_mended_by_the_first_rank(kind):
    mesh = wavy(16, 3, 0.7, kind)
    told = same(mesh, slid(slide=None), cut(mesh, 2), 2)
    assert "folded" in told.gathered
    assert told.after.inverted == 0


@pytest.mark.parametrize("options", [{}, {"slide": None}, {"slide": None, "preserve": "shape"}])
@pytest.mark.parametrize("kind", ["mixed", "cube", "hexahedra", "sheet of quads"])
def test_regions_that_are_joined(kind, options):
    mesh = halves(MESHES[kind])
    told = same(mesh, slid(join_regions=True, max_sweeps=4, **options), cut(mesh), 3)
    assert told.gathered == ""
    assert ON_INTERFACE not in told.held


def test_options_that_cannot_be_had_are_named_on_all_ranks():
    mesh = IN_PLANE["square"]
    with pytest.raises(InputError, match="nowhere"):
        spread(mesh, slid(slide=["nowhere"]), cut(mesh, 2), 2)


@pytest.mark.parametrize("how", [{"surface_tolerance": 0.02}, {"hausdorff": 0.001}])
def test_how_far_nodes_of_surfaces_may_go(how):
    mesh = SURFACES["bracket"]
    assert same(mesh, slid(**how), cut(mesh), 3).gathered == ""


@settings(max_examples=12)
@given(
    kind=st.sampled_from(sorted(MESHES)),
    seed=st.integers(0, 10**6),
    ranks=st.integers(1, 4),
    how=st.sampled_from(["interleaved", "strips", "lopsided"]),
    method=st.sampled_from(["auto", "barrier"]),
)
def test_any_partition(kind, seed, ranks, how, method):
    mesh, rng = MESHES[kind], np.random.default_rng(seed)
    fixed = rng.random(len(mesh.points)) < 0.05
    same(mesh, slid(method=method, max_sweeps=40), cut(mesh, ranks, how, seed), ranks, fixed)


def with_regions_and_lines(mesh):
    """Two regions, and line cells of two markers, on the boundary and inside."""
    edges, blocks = [], []
    for shape in mesh.cells:
        right = mesh.points[shape.nodes].mean(axis=1)[:, 0] > 0.5
        blocks.append(CellBlock(shape.kind, shape.nodes, right + 1))
        edges += [shape.nodes[:, [k, (k + 1) % shape.corners]] for k in range(shape.corners)]
    edges = np.unique(np.sort(np.concatenate(edges), axis=1), axis=0)
    middle = mesh.points[edges].mean(axis=1)
    lines = edges[(middle[:, 0] < 0.02) | (abs(middle[:, 1] - 0.5) < 0.03)]
    named = (mesh.points[lines].mean(axis=1)[:, 0] > 0.02) + 1
    return gmsnet.Mesh(mesh.points, (*blocks, CellBlock("line", lines, named)), {(1, 1): "left", (1, 2): "inside"})


BOUNDED = {**VOLUMES, **IN_PLANE} | {
    f"{kind} of two regions": with_regions_and_lines(IN_PLANE[kind]) for kind in ("square", "quads", "mixed")
}


@pytest.mark.parametrize("how", ["strips", "interleaved"])
@pytest.mark.parametrize("kind", BOUNDED)
def test_what_slides_is_found_at_the_boundary(kind, how, monkeypatch):
    """The first rank never has the whole mesh, and says the same as one process."""
    mesh, seen = BOUNDED[kind], []

    def gathered(piece, comm, known=None):
        found = gathered_whole(piece, comm, known)
        seen.extend([] if found is None else [found])
        return found

    monkeypatch.setattr(skin, "gathered", gathered)
    monkeypatch.setattr(smoothing, "gathered", None)
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[np.setdiff1d(np.arange(len(fixed)), connectivity_of(mesh).free)[:3]] = True
    told = same(mesh, slid(method="barrier", max_sweeps=3), cut(mesh, 3, how), 3, fixed)
    serial = gmsnet.smooth(mesh, "barrier", slide="all", max_sweeps=3, preserve="none", fixed=fixed)
    assert told.notes == serial.notes
    (found,) = seen
    outer = np.unique(mesh.points[found.ids], axis=0)
    assert len(outer) < len(mesh.points)
    assert sum(len(each.nodes) for each in found.mesh.cells) < sum(len(each.nodes) for each in mesh.cells)


@pytest.mark.parametrize("marker", ["left", "inside"])
def test_a_marker_in_a_plane_slides_alone(marker):
    mesh = BOUNDED["mixed of two regions"]
    told = same(mesh, slid(slide=[marker], max_sweeps=5), cut(mesh, 3, "interleaved"), 3)
    assert told.gathered == ""
    assert told.notes[0].startswith("slide: ")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("make", [gmsnet.generate.random_volume, gmsnet.random_mesh])
def test_a_boundary_whose_cells_are_read_otherwise_is_seen_whole(make, seed):
    """More of the cells at it are inverted than not: they alone would be read inside out."""
    mesh = make(200, seed=seed)
    middle = mesh.points.mean(axis=0)
    points = mesh.points.copy()
    inside = connectivity_of(mesh).free
    points[inside] = middle + 3.0 * (points[inside] - middle)
    tangled = mesh.with_points(points)
    same(tangled, slid(max_sweeps=5), cut(tangled, 3, "interleaved", seed), 3)


@pytest.mark.parametrize("how", ["strips", "interleaved", "lonely"])
@pytest.mark.parametrize("kind", ["surface", "volume"])
def test_facets_at_the_ends_of_ellipsoids_are_bound(kind, how):
    mesh = gmsnet.generate.sphere_surface(100).mesh if kind == "surface" else gmsnet.generate.ball_volume(150).mesh
    mesh = mesh.with_points(mesh.points * [3.0, 1.0, 1.0])
    told = same(mesh, slid(slide=None if kind == "surface" else True), cut(mesh, how=how), 3)
    assert told.gathered == ""


def test_facets_of_volumes_are_bound_by_what_is_asked():
    mesh = gmsnet.generate.ball_volume(150).mesh
    mesh = mesh.with_points(mesh.points * [3.0, 1.0, 1.0])
    same(mesh, slid(hausdorff=0.002), cut(mesh, how="interleaved"), 3)
