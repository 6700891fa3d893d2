"""Second-order meshes: straight cells become as good as those of the first-order twin, and all cells stay valid."""

from __future__ import annotations

import numpy as np
import pytest
from support import curved_meshes, rings

import gmsnet
from gmsnet.generate import layered_mesh, random_mesh, recombine
from gmsnet.generate.curved import second_order, throw
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import METHODS
from gmsnet.preserve.protection import LAYER
from gmsnet.run import stop

CORNERS = {"triangle6": 3, "quad8": 4, "quad9": 4}
BASES = {
    "triangle6": lambda seed: random_mesh(150, seed=seed),
    "quad8": lambda seed: curved_meshes.quad_grid(9),
    "quad9": lambda seed: curved_meshes.quad_grid(8),
    "mixed": lambda seed: recombine(random_mesh(150, seed=seed), least=0.6),
}


def twins(kind, seed=1, amount=0.25):
    """The same jittered, valid mesh of straight cells, of the first order and of the second."""
    base, quads = BASES[kind](seed), "quad8" if kind == "quad8" else "quad9"
    base = Mesh(base.points, base.cells)
    while True:
        thrown = throw(second_order(base, quads=quads), middles=0.0, corners=amount, seed=seed)
        first = base.with_points(thrown.points[: len(base.points)])
        if not gmsnet.quality(first).inverted:
            return first, second_order(first, quads=quads)
        amount *= 0.8


def boundary(mesh):
    """(N,) bool: nodes of edges with one cell, middles among them."""
    rows = [np.empty((0, 3), dtype=int)]
    for block in mesh.cells:
        count = {**CORNERS, "triangle": 3, "quad": 4}.get(block.kind, 0)
        for k in range(count):
            ends = block.nodes[:, [k, (k + 1) % count]]
            rows.append(
                np.column_stack([np.sort(ends), block.nodes[:, count + k] if block.kind in CORNERS else ends[:, 0]])
            )
    edges = np.concatenate(rows)
    _, number, uses = np.unique(edges[:, :2], axis=0, return_inverse=True, return_counts=True)
    found = np.zeros(len(mesh.points), dtype=bool)
    found[edges[uses[number.ravel()] == 1]] = True
    return found


def assert_sound(mesh, result):
    """All cells certified, held nodes and the boundary bit for bit, and ``moved`` tells what moved."""
    sign, _ = curved_meshes.judged(mesh.with_points(result.points))
    assert (sign == 1).all()
    assert result.invalid_curved == 0
    changed = (result.points != mesh.points).any(axis=1)
    np.testing.assert_array_equal(changed, result.moved)
    assert not changed[boundary(mesh)].any()
    for ids in result.held.values():
        assert not changed[ids].any()


def shape(report):
    return np.array([report.totals.shape_min, report.totals.shape_mean])


@pytest.mark.parametrize("guard", ["worst", "star", "valid"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", BASES)
def test_straight_cells_become_as_good_as_those_of_the_first_order_twin(kind, seed, guard):
    first, second = twins(kind, seed)
    expected, result = gmsnet.smooth(first, guard=guard), gmsnet.smooth(second, guard=guard)
    assert_sound(second, result)
    np.testing.assert_array_equal(shape(result.before), shape(expected.before))
    allowance = [0.03, 0.005] if kind == "mixed" else [0.005, 0.005]  # a quad's bound may not fall below a half
    assert (shape(result.after) >= shape(expected.after) - allowance).all()
    assert shape(result.after)[1] > shape(result.before)[1]
    assert result.sweeps > 0
    assert result.stop_reason == stop.NO_PROGRESS


@pytest.mark.parametrize("seed", range(20))
def test_curved_meshes_become_valid_and_better(seed):
    mesh = (curved_meshes.known_valid if seed % 2 else curved_meshes.thrown)(seed)
    result = gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    if seed % 2:
        assert shape(result.after)[0] >= shape(result.before)[0]
        quality = curved_meshes.judged(mesh)[1].min(), curved_meshes.judged(result.mesh)[1].min()
        assert quality[1] >= min(quality[0], 0.5) - 1e-9


def stars(mesh, points):
    """(N,) the minimum 1/q of the straight cells around each corner."""
    least = np.full(len(points), np.inf)
    for block in mesh.cells:
        count = CORNERS.get(block.kind, 0)
        for k in range(count):
            corner, after, last = (block.nodes[:, j % count] for j in (k, k + 1, k + count - 1))
            p, q = points[after] - points[corner], points[last] - points[corner]
            cross, squares = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], (p * p + q * q).sum(axis=1)
            far = ((p - q) ** 2).sum(axis=1)
            value = 2 * np.sqrt(3) * cross / (squares + far) if count == 3 else 2 * cross / squares
            for j in range(count):
                np.minimum.at(least, block.nodes[:, j], value)
    return least


@pytest.mark.parametrize("kind", BASES)
def test_at_the_level_star_no_star_gets_worse(kind):
    _, mesh = twins(kind)
    result = gmsnet.smooth(mesh, "laplacian", guard="star", max_sweeps=5)
    assert_sound(mesh, result)
    corners = np.flatnonzero(~boundary(mesh))
    before, after = stars(mesh, mesh.points)[corners], stars(mesh, result.points)[corners]
    assert (after >= before - 1e-9).all()
    assert result.moved.any()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["triangle6", "quad9"])
def test_each_method_moves_corners_or_says_why_not(kind, method):
    _, mesh = twins(kind)
    result = gmsnet.smooth(mesh, method, max_sweeps=10)
    assert_sound(mesh, result)
    (note,) = (note for note in result.notes if note.startswith("second order"))
    if kind == "triangle6" or METHODS[method].moves("quad"):
        assert "moves triangles alone" not in note
        assert shape(result.after)[1] > shape(result.before)[1]
        assert result.sweeps > 0
    else:
        assert "moves triangles alone" in note
        assert result.sweeps == 0
        assert not result.moved[: len(mesh.cells[0].nodes)].all()


def test_what_is_chosen_stays_and_its_middles_follow_the_other_end():
    _, mesh = twins("triangle6")
    inner = np.flatnonzero(~boundary(mesh))
    corner, middle = inner[0], inner[-1]
    result = gmsnet.smooth(mesh, fixed=[corner, middle])
    assert_sound(mesh, result)
    assert not result.moved[[corner, middle]].any()
    assert result.moved.any()


def test_the_sweeps_end_as_those_of_other_meshes_do():
    _, mesh = twins("quad9")
    seen = []
    limited = gmsnet.smooth(mesh, "barrier", max_sweeps=2, callback=lambda sweep: seen.append(sweep))
    assert (limited.sweeps, limited.stop_reason, len(seen)) == (2, stop.MAX_SWEEPS, 2)
    stopped = gmsnet.smooth(mesh, "barrier", callback=lambda sweep: True)
    assert (stopped.sweeps, stopped.stop_reason) == (1, stop.CALLBACK)
    assert_sound(mesh, stopped)
    none = gmsnet.smooth(mesh, max_sweeps=0)
    assert not none.moved.any()
    assert "0 of 49 free corners" in none.notes[-1]


def test_a_target_ends_the_run_when_it_is_met():
    _, mesh = twins("triangle6")
    result = gmsnet.smooth(mesh, target_quality=0.5)
    assert_sound(mesh, result)
    assert result.stop_reason == stop.TARGET_REACHED
    assert result.after.shape.min() >= 0.5


@pytest.mark.parametrize("kind", ["triangle6", "quad9", "mixed"])
@pytest.mark.parametrize("share", [0.97, 1.1])
def test_for_a_target_all_patches_are_tried(kind, share):
    """That nothing of the first order is there to move is no reason to stop."""
    _, mesh = twins(kind)
    full = gmsnet.smooth(mesh).after.shape
    target = min(share * float(full.min()), 0.99)
    result = gmsnet.smooth(mesh, target_quality=target)
    assert_sound(mesh, result)
    assert result.sweeps > 0
    left = int((result.after.shape < target).sum())
    assert left <= (full < target).sum() < (result.before.shape < target).sum()
    assert (result.stop_reason == stop.TARGET_REACHED) == (left == 0)


@pytest.mark.parametrize("sweeps", [1, 3])
def test_ctrl_c_leaves_the_best_mesh_with_its_middles(sweeps):
    _, mesh = twins("triangle6")

    def interrupt(sweep):
        if sweep.index == sweeps:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(mesh, "barrier", callback=interrupt)
    result = caught.value.result
    assert result.stop_reason == stop.INTERRUPTED
    assert_sound(mesh, result)
    assert result.moved.any()
    ends, nodes = mesh.cells[0].nodes[:, :3], mesh.cells[0].nodes[:, 3:]
    straight = (result.points[ends] + result.points[np.roll(ends, -1, axis=1)]) / 2
    np.testing.assert_allclose(result.points[nodes], straight, atol=1e-12)


def test_stretched_layers_are_held_as_in_the_first_order_twin():
    first = layered_mesh(8, 30, around=40, body="circle")
    result = gmsnet.smooth(second_order(first))
    layers = [note for note in result.notes if "anisotropic on purpose" in note]
    assert layers == [note for note in gmsnet.smooth(first).notes if "anisotropic on purpose" in note]
    assert len(layers) == 1
    assert len(result.held[LAYER])
    assert not result.moved[result.held[LAYER]].any()
    free = gmsnet.smooth(second_order(first), preserve="none")
    assert LAYER not in free.held
    assert free.moved.sum() > result.moved.sum()


def of_both_orders(first, second, chosen):
    """The cells of ``first`` where ``chosen`` says so by the number of each, those of ``second`` elsewhere."""
    blocks, before = [], 0
    for one, two in zip(first.cells, second.cells, strict=True):
        some = chosen(np.arange(before, before + len(one.nodes)))
        before += len(one.nodes)
        blocks += [CellBlock(b.kind, b.nodes[rows], b.regions[rows]) for b, rows in ((one, some), (two, ~some))]
    return Mesh(second.points, tuple(blocks))


@pytest.mark.parametrize("chosen", [lambda cell: cell % 7 < 3, lambda cell: cell % 40 < 20, lambda cell: cell < 90])
@pytest.mark.parametrize("kind", ["triangle6", "quad9", "mixed"])
def test_meshes_of_both_orders_become_as_good_as_those_of_the_first(kind, chosen):
    first, second = twins(kind)
    mesh = of_both_orders(first, second, chosen)
    expected, result = gmsnet.smooth(first), gmsnet.smooth(mesh)
    assert_sound(mesh, result)
    assert (shape(result.after) >= shape(expected.after) - [0.03, 0.005]).all()
    free = np.setdiff1d(np.concatenate([b.nodes.ravel() for b in first.cells]), np.flatnonzero(boundary(second)))
    assert result.moved[free].mean() > 0.9


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", BASES)
def test_a_square_that_is_tangled_is_mended_whatever_its_orders(kind, seed):
    """Straight cells of one, of the other and of both orders, corners thrown by an edge."""
    first, quads = BASES[kind](seed), "quad8" if kind == "quad8" else "quad9"
    first = Mesh(first.points, first.cells)
    thrown = throw(second_order(first, quads=quads), middles=0.0, corners=1.0, seed=seed)
    first = first.with_points(thrown.points[: len(first.points)])
    second = second_order(first, quads=quads)
    assert gmsnet.quality(first).inverted > 5
    for mesh in (second, of_both_orders(first, second, lambda cell: cell % 3 == seed % 3)):
        result = gmsnet.smooth(mesh)
        assert result.after.inverted == 0
        assert_sound(mesh, result)


def test_middles_between_a_region_of_each_order_and_on_marked_lines_stay():
    first, second = twins("triangle6")
    triangles, inner = first.cells[0].nodes, np.flatnonzero(~boundary(second))
    left = first.points[triangles][:, :, 0].mean(axis=1) < np.median(first.points[:, 0])
    own = second.cells[0].nodes[left]
    line = next(cell for cell in own if np.isin(cell, inner).all())
    cells = (
        CellBlock("triangle", triangles[~left], np.ones((~left).sum(), dtype=int)),
        CellBlock("triangle6", own, np.zeros(left.sum(), dtype=int)),
        CellBlock("line", line[None, :2], np.zeros(1, dtype=int)),
    )
    result = gmsnet.smooth(Mesh(second.points, cells))
    between = np.intersect1d(triangles[left], triangles[~left])
    edges = np.concatenate([own[:, [k, (k + 1) % 3, 3 + k]] for k in range(3)])
    middles = edges[np.isin(edges[:, :2], between).all(axis=1), 2]
    single = np.flatnonzero(np.bincount(edges[:, 2], minlength=len(second.points)) == 1)
    held = np.concatenate([between, np.intersect1d(middles, single), line[[0, 1, 3]]])
    assert not result.moved[held].any()
    assert result.moved[np.setdiff1d(inner, held)].any()
    assert result.invalid_curved == 0


def test_the_bound_of_the_worst_cell_knows_that_corners_move():
    _, mesh = twins("triangle6")
    result = gmsnet.smooth(mesh)
    assert result.limits.ceiling >= shape(result.after)[0]


@pytest.mark.parametrize("around", [16, 24])
def test_worst_cells_of_a_ring_that_are_all_alike_gain_together(around):
    mesh = rings.ring(around, 8, 4.0)
    result = gmsnet.smooth(mesh, threads=1)
    (block,) = mesh.cells
    first = gmsnet.smooth((mesh.points, {"quad": block.nodes[:, :4]}), threads=1)
    assert result.invalid_curved == 0
    assert result.judged.after.shape_min > result.judged.before.shape_min + 0.1
    assert result.judged.after.shape_min == pytest.approx(first.judged.after.shape_min, abs=1e-3)
