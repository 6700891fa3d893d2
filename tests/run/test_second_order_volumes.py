"""Second-order volumes: corners become as good as those of the straight twin, and all cells stay valid everywhere."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.generate import ball_volume, block_volume, disturb, lattice_volume, o_grid_section, swept_volume
from gmsnet.generate.curved_volumes import on_sphere, second_order_volume
from gmsnet.measure.report import connectivity_of
from gmsnet.measure.solid import judge_volumes
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.run import stop
from gmsnet.topology.curved_solids import CURVED, STRAIGHT, mirrored


def volumes(mesh):
    return Mesh(mesh.points, tuple(block for block in mesh.cells if block.dimension == 3))


def thrown(mesh, amount=0.2, seed=1, **options):
    mesh = volumes(mesh)
    return disturb(mesh, connectivity_of(mesh).free, amount, seed=seed, **options)


BASES = {
    "tetra10": (lambda: lattice_volume(4), False),
    "hexahedron27": (lambda: block_volume(4), False),
    "hexahedron20": (lambda: block_volume(4), True),
    "wedge18": (lambda: block_volume(3, "wedge"), False),
    "wedge15": (lambda: block_volume(3, "wedge"), True),
}


def twins(kind, seed=1, bend=0.0):
    """The same thrown, valid mesh of straight cells, of the first order and of the second."""
    made, serendipity = BASES[kind]
    first = thrown(made(), seed=seed)
    return first, second_order_volume(first, serendipity=serendipity, bend=bend, seed=seed)


def rim(mesh):
    """(N,) bool: the nodes of facets of one cell alone."""
    rows = {}
    for block in mesh.cells:
        for facet in CELLS[block.kind].facets:
            for nodes in block.nodes[:, list(facet)].tolist():
                rows.setdefault(frozenset(nodes), []).append(nodes)
    found = np.zeros(len(mesh.points), dtype=bool)
    for nodes, uses in rows.items():
        found[list(nodes)] |= len(uses) == 1
    return found


def signs(mesh, points):
    blocks = [block for block in mesh.cells if block.kind in CURVED]
    found = [
        judge_volumes(points, b.nodes.astype(np.int32), b.kind, np.ones(len(b.nodes), dtype=np.int8))[0] for b in blocks
    ]
    return np.concatenate(found)


def assert_sound(mesh, result, before=None):
    """What was valid is, by exact arithmetic; the boundary and what is held have their bits."""
    before = signs(mesh, mesh.points) if before is None else before
    after = signs(mesh, result.points)
    assert (after[before == 1] == 1).all()
    assert result.after.inverted == (after != 1).sum()
    changed = (result.points != mesh.points).any(axis=1)
    np.testing.assert_array_equal(changed, result.moved)
    assert not changed[rim(mesh)].any()
    for ids in result.held.values():
        assert not changed[ids].any()


@pytest.mark.parametrize("guard", ["worst", "star", "valid"])
@pytest.mark.parametrize("kind", BASES)
def test_corners_become_as_good_as_those_of_the_first_order_twin(kind, guard):
    first, second = twins(kind)
    expected, result = gmsnet.smooth(first, guard=guard), gmsnet.smooth(second, guard=guard)
    assert_sound(second, result)
    assert result.after.inverted == 0
    assert result.after.shape.min() >= expected.after.shape.min() - 0.02
    assert result.after.shape.mean() >= expected.after.shape.mean() - 0.01
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.sweeps > 0
    assert result.stop_reason == stop.NO_PROGRESS


@pytest.mark.parametrize("kind", BASES)
def test_nodes_of_straight_edges_stay_in_their_middle(kind):
    _, mesh = twins(kind)
    result = gmsnet.smooth(mesh, "laplacian", max_sweeps=2)
    assert_sound(mesh, result)
    assert result.moved.any()
    for block in mesh.cells:
        for start, end, middle in CELLS[block.kind].edges:
            ends = result.points[block.nodes[:, [start, end]]].mean(axis=1)
            np.testing.assert_allclose(result.points[block.nodes[:, middle]], ends, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", BASES)
def test_cells_that_are_thrown_out_of_validity_become_valid(kind, seed):
    _, mesh = twins(kind, seed, bend=0.4)
    assert (signs(mesh, mesh.points) != 1).sum() > 5
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    assert result.after.inverted == 0
    assert result.invalid_curved == 0


@pytest.mark.parametrize("kind", BASES)
def test_tangled_corners_are_mended_with_what_follows_them(kind):
    made, serendipity = BASES[kind]
    first = thrown(made(), 0.6, keep_valid=False)
    mesh = second_order_volume(first, serendipity=serendipity)
    assert gmsnet.quality(mesh).inverted > 0
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    assert result.after.inverted == 0


def test_a_ball_stays_on_its_sphere_and_its_bound_rises():
    first = thrown(volumes(ball_volume(200).mesh), 0.1)
    radius = np.linalg.norm(first.points, axis=1).max()
    mesh = second_order_volume(first, project=on_sphere(radius))
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    assert result.after.cells.curved_bounds().min() >= min(0.5, result.before.cells.curved_bounds().min())
    assert result.after.shape.mean() > result.before.shape.mean()


def test_a_swept_o_grid_keeps_its_round_wall():
    section = o_grid_section(2, 2)
    first = thrown(volumes(swept_volume(section, 4, 2.0)), 0.15)
    outer = np.linalg.norm(first.points[:, :2], axis=1).max()

    def wall(points):
        radius = np.linalg.norm(points[:, :2], axis=1)
        found, near = points.copy(), np.abs(radius - outer) < 0.2 * outer
        found[near, :2] *= (outer / radius[near])[:, None]
        return found

    mesh = second_order_volume(first, project=wall)
    before = signs(mesh, mesh.points)
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result, before)
    assert result.after.inverted <= result.before.inverted


@pytest.mark.parametrize("kind", BASES)
def test_cells_that_are_inside_out_are_read_the_other_way_round(kind):
    _, mesh = twins(kind, bend=0.05)
    order = np.array(mirrored(kind))
    turned = Mesh(mesh.points, tuple(CellBlock(b.kind, b.nodes[:, order], b.regions) for b in mesh.cells))
    expected, result = gmsnet.smooth(mesh), gmsnet.smooth(turned)
    assert result.after.inverted == 0
    np.testing.assert_allclose(result.points, expected.points, atol=0.02)
    assert_sound(mesh, expected)


@pytest.mark.parametrize("kind", CURVED)
def test_the_mirrored_order_turns_the_reference_cell_over(kind):
    corners = CELLS[STRAIGHT[kind]].corners
    assert sorted(mirrored(kind)) == list(range(CELLS[kind].nodes))
    assert sorted(mirrored(kind)[:corners]) == list(range(corners))


def test_what_is_fixed_and_interfaces_stay():
    first, _ = twins("tetra10")
    block = first.cells[0]
    left = first.points[block.nodes].mean(axis=1)[:, 0] < 0.5
    regions = left.astype(np.int64)
    first = Mesh(first.points, (CellBlock("tetra", block.nodes, regions),))
    mesh = second_order_volume(first)
    inner = np.flatnonzero(~rim(mesh))
    chosen = inner[::7]
    result = gmsnet.smooth(mesh, fixed=chosen)
    assert not result.moved[chosen].any()
    nodes = mesh.cells[0].nodes
    between = np.intersect1d(nodes[left], nodes[~left])
    assert not result.moved[between].any()
    assert result.moved.any()
    assert_sound(mesh, result)


def test_first_order_cells_beside_them_move_in_their_own_sweeps():
    first, second = twins("tetra10")
    nodes = first.cells[0].nodes
    left = first.points[nodes].mean(axis=1)[:, 0] < 0.5
    cells = (
        CellBlock("tetra", nodes[~left], np.zeros((~left).sum(), dtype=np.int64)),
        CellBlock("tetra10", second.cells[0].nodes[left], np.zeros(left.sum(), dtype=np.int64)),
    )
    mesh = Mesh(second.points, cells)
    result = gmsnet.smooth(mesh)
    between = np.intersect1d(nodes[left], nodes[~left])
    assert not result.moved[between].any()
    for chosen in (left, ~left):
        own = np.setdiff1d(nodes[chosen], between)
        assert result.moved[own].any()
    assert result.after.inverted == 0
    assert len(result.after.cell) == len(nodes)


@pytest.mark.parametrize("kind", BASES)
def test_a_target_is_reached_by_the_cells_that_miss_it_and_those_around(kind):
    mesh = twins(kind)[1]
    full = gmsnet.smooth(mesh)
    target = 0.5 * float(full.before.shape.min() + full.after.shape.min())
    result = gmsnet.smooth(mesh, target_quality=target)
    assert_sound(mesh, result)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.before.shape.min() < target <= result.after.shape.min()


@pytest.mark.parametrize("kind", BASES)
def test_of_a_target_that_cannot_be_reached_no_more_cells_miss_it_than_after_a_full_run(kind):
    mesh = twins(kind)[1]
    fixed = np.random.default_rng(3).random(len(mesh.points)) < 0.1
    full = gmsnet.smooth(mesh, fixed=fixed).after.shape
    target = min(1.0, 1.1 * float(full.min()))
    result = gmsnet.smooth(mesh, target_quality=target, fixed=fixed)
    assert_sound(mesh, result)
    assert result.stop_reason == stop.NO_PROGRESS
    assert 0 < (result.after.shape < target).sum() <= (full < target).sum()


def test_a_target_is_not_reached_where_straight_cells_alone_do():
    first = thrown(lattice_volume(3))
    curved = second_order_volume(first)
    far = first.points + np.array([10.0, 0.0, 0.0])
    straight = CellBlock("tetra", first.cells[0].nodes + len(curved.points), np.zeros(len(first.cells[0].nodes)))
    mesh = Mesh(np.concatenate([curved.points, far]), (*curved.cells, straight))
    fixed = np.arange(len(mesh.points)) < len(curved.points)
    held = gmsnet.smooth(mesh, target_quality=0.7, fixed=fixed)
    assert held.before.shape.min() < 0.7
    assert held.stop_reason == stop.NO_PROGRESS
    assert held.moved[~fixed].any()
    whole = gmsnet.smooth(curved, target_quality=0.7, fixed=np.ones(len(curved.points), dtype=bool))
    assert (whole.stop_reason, whole.moved.any()) == (stop.NOTHING_TO_MOVE, False)


def test_a_node_in_the_middle_of_two_edges_is_held():
    _, mesh = twins("tetra10")
    nodes = mesh.cells[0].nodes.copy()
    inner = ~rim(mesh)
    middles = np.unique(nodes[:, 4:][inner[nodes[:, 4:]]])
    torn, other = middles[:2]
    nodes[nodes == other] = torn
    broken = Mesh(mesh.points, (CellBlock("tetra10", nodes, mesh.cells[0].regions),))
    result = gmsnet.smooth(broken)
    assert not result.moved[torn]
    assert result.moved.any()


def test_threads_make_the_same_bits():
    _, mesh = twins("hexahedron27", bend=0.1)
    one, two = gmsnet.smooth(mesh, threads=1), gmsnet.smooth(mesh, threads=2)
    np.testing.assert_array_equal(one.points, two.points)


@pytest.mark.parametrize("kind", BASES)
def test_single_cells_that_are_inside_out_are_told_by_their_neighbours(kind):
    _, mesh = twins(kind)
    block = mesh.cells[0]
    nodes = block.nodes.copy()
    nodes[3] = nodes[3, np.array(mirrored(kind))]
    one = Mesh(mesh.points, (CellBlock(kind, nodes, block.regions),))
    found = gmsnet.quality(one)
    assert found.inverted == 0
    assert found.summary()["read_inside_out"] == {kind: 1}
    assert gmsnet.smooth(one).after.inverted == 0


def test_slide_beside_lines_of_curved_volumes() -> None:
    """There are no straight facets to slide on, though lines of a marker stand at the boundary."""
    _, mesh = twins("tetra10")
    lines = CellBlock("line3", mesh.cells[0].nodes[:, [0, 1, 4]], np.full(len(mesh.cells[0].nodes), 7))
    marked = Mesh(mesh.points, (*mesh.cells, lines))
    result = gmsnet.smooth(marked, slide=True)
    assert "slide: no node of the boundary can move along it" in result.notes
    assert result.after.inverted == 0


@pytest.mark.parametrize("regions", [1, 2])
def test_nodes_of_the_boundary_are_told_as_such(regions):
    """The file has its faces there, as Gmsh writes them, and one between cells."""
    _, mesh = twins("tetra10")
    block, outside = mesh.cells[0], rim(mesh)
    faces = np.concatenate([block.nodes[:, list(facet)] for facet in CELLS["tetra10"].facets])
    at_rim = outside[faces].all(axis=1)
    shown = np.concatenate([faces[at_rim], faces[~outside[faces].any(axis=1)][:1]])
    halves = np.arange(len(block.nodes)) % regions
    marked = Mesh(
        mesh.points,
        (CellBlock("tetra10", block.nodes, halves), CellBlock("triangle6", shown, np.zeros(len(shown), dtype=int))),
    )
    held = gmsnet.smooth(marked).held
    assert held["boundary"].tolist() == np.flatnonzero(outside).tolist()
    assert held["node of a face cell"].tolist() == sorted(shown[-1])
    facets, which = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    seen = np.zeros((len(facets), 2), dtype=bool)
    seen[which.ravel(), np.tile(halves, len(CELLS["tetra10"].facets))] = True
    between = np.setdiff1d(facets[seen.all(axis=1)], [*np.flatnonzero(outside), *shown[-1]])
    assert (len(between) > 0) == (regions == 2)
    assert held.get("interface between regions", between[:0]).tolist() == between.tolist()
    assert len(np.unique(np.concatenate(list(held.values())))) == sum(map(len, held.values()))
    assert gmsnet.smooth(mesh).held["boundary"].tolist() == np.flatnonzero(outside).tolist()


def test_beside_cells_that_are_held_or_of_the_first_order_facets_of_one_cell_alone_may_be_no_boundary():
    first, _ = twins("tetra10")
    mesh = second_order_volume(first)
    nodes = mesh.cells[0].nodes
    straight = CellBlock("tetra", nodes[:9, :4], np.zeros(9, dtype=int))
    mixed = Mesh(mesh.points, (CellBlock("tetra10", nodes[9:], np.zeros(len(nodes) - 9, dtype=int)), straight))
    between = np.setdiff1d(np.intersect1d(nodes[9:], nodes[:9]), nodes[:, :4])
    assert len(between)
    assert not np.isin(between, gmsnet.smooth(mixed).held.get("boundary", [])).any()
