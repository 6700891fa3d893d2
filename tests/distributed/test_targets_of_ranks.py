"""A target is reached over ranks with the bits of the serial run: the first one smooths patches with what is around."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
import gmsnet.generate

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.blocks import block
from support.ranks import nodes_lent, parts_at_random, same, spread

import gmsnet.distributed.executor as executor
from gmsnet.distributed import loan
from gmsnet.kernels.topology import patch
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.set_up import first_state
from gmsnet.run.stop import CALLBACK, NO_PROGRESS, NOTHING_TO_MOVE, TARGET_REACHED
from gmsnet.run.target_run import corners_missing

MESHES = {
    "triangles": gmsnet.random_mesh(3000, seed=3),
    "quads": gmsnet.generate.random_quad_mesh(2500, seed=3),
    "mixed": gmsnet.generate.random_quad_mesh(2500, seed=4, cells="mixed"),
    "tetrahedra": gmsnet.generate.random_volume(3000, seed=2),
    "hexahedra": block(12, 12, 12, jitter=0.2, seed=1),
    "solids": block(12, 12, 12, wedges=np.ndindex(2, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.15, seed=2),
}
SHAPES = {kind: np.sort(gmsnet.quality(mesh).shape) for kind, mesh in MESHES.items()}


def aim(**options):
    return SmoothOptions(**{"preserve": "none", "threads": 1, **options})


def strips(mesh, ranks=3):
    return parts_at_random(mesh, ranks, np.random.default_rng(1), "strips")


@pytest.fixture
def lent(monkeypatch):
    return nodes_lent(monkeypatch, executor, "read_alike")


@pytest.mark.parametrize("kind", MESHES)
def test_a_few_cells_are_smoothed_with_what_lies_around(lent, kind):
    mesh = MESHES[kind]
    told = same(mesh, aim(target_quality=float(SHAPES[kind][2])), strips(mesh), 3)
    assert told.gathered == ""
    assert told.missed == 0
    assert told.stop_reason == TARGET_REACHED
    assert 0 < lent[0] < 0.9 * len(mesh.points)


@pytest.mark.parametrize("share", [0.1, 0.3])
@pytest.mark.parametrize("kind", MESHES)
def test_many_cells_with_sweeps_over_all_of_them(kind, share):
    mesh = MESHES[kind]
    target = float(SHAPES[kind][int(share * len(SHAPES[kind]))])
    assert same(mesh, aim(target_quality=target), strips(mesh), 3).gathered == ""


@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@pytest.mark.parametrize(
    ("kind", "method"),
    [*product(["triangles", "tetrahedra"], ["barrier", "laplacian", "optimize"]), ("triangles", "gmsnet")],
)
def test_any_method_and_guard(kind, method, guard):
    mesh = MESHES[kind]
    options = aim(method=method, guard=guard, target_quality=float(SHAPES[kind][12]), max_sweeps=9)
    assert same(mesh, options, strips(mesh), 3).gathered == ""


def blocks_with_pyramids(seed):
    """A block in which some cubes are six pyramids each, and a target that a few of its cells miss."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(5, 11, 3)
    cubes = list(np.ndindex(*counts))
    pyramids = [cubes[k] for k in rng.permutation(len(cubes))[: len(cubes) // 4]]
    mesh = block(*counts, pyramids=pyramids, jitter=0.12, seed=seed)
    return mesh, float(np.sort(gmsnet.quality(mesh).shape)[len(cubes) // 8])


@pytest.mark.parametrize("seed", [10, 90, 290])
def test_stars_of_nodes_that_do_not_move_are_kept(seed):
    mesh, target = blocks_with_pyramids(seed)
    same(mesh, aim(method="laplacian", guard="star", target_quality=target), strips(mesh, 2), 2)


@pytest.mark.parametrize("kind", MESHES)
def test_the_first_rank_gets_all_that_moves_without_ranks(kind, monkeypatch):
    gathered, left_out = executor.Ranks.gathered_around, []

    def looked(ranks, field, corners, rings):
        topology = field.topology
        chosen = np.zeros(len(topology.memory), dtype=bool)
        chosen[corners] = True
        for many in (1, 2, 4, 8):
            moving = patch.around(corners, many, topology.near_free, topology.near_start, topology.near_ring)
            left_out.append(np.count_nonzero(moving & ~loan.around(ranks.part, topology, chosen, many)))
        return gathered(ranks, field, corners, rings)

    monkeypatch.setattr(executor.Ranks, "gathered_around", looked)
    mesh = MESHES[kind]
    spread(mesh, aim(target_quality=float(SHAPES[kind][1])), strips(mesh, 1), 1)
    assert left_out
    assert not any(left_out)


@pytest.mark.parametrize("kind", MESHES)
def test_the_first_rank_knows_which_nodes_have_stars(kind, monkeypatch):
    mesh, gathered, seen = MESHES[kind], executor.read_alike, []

    def looked(part, field, active):
        loan = gathered(part, field, active)
        if loan.field is not None:
            topology = loan.field.topology
            seen.append((topology.near_ringed.sum(), topology.near_free.sum()))
        return loan

    monkeypatch.setattr(executor, "read_alike", looked)
    spread(mesh, aim(target_quality=float(SHAPES[kind][2])), strips(mesh), 3)
    starred, free = seen[0]
    assert starred > free


@pytest.mark.parametrize(
    ("kind", "target"),
    [("triangles", {"target_angle": 22.0}), ("mixed", {"target_angle": 40.0}),
     ("tetrahedra", {"target_dihedral": 9.0}), ("tetrahedra", {"target_dihedral": 14.0, "target_quality": 0.3})],
)  # fmt: skip
def test_angles(kind, target):
    told = same(MESHES[kind], aim(**target), strips(MESHES[kind]), 3)
    assert told.gathered == ""
    assert told.history


def test_a_large_angle_where_a_target_of_angles_is_met_is_told():
    """Of one quad among squares."""
    at = np.arange(7.0)
    points = np.array([[x, y] for y in at for x in at])
    first = np.array([7 * row + column for row in range(6) for column in range(6)])
    points[8] = 0.51, 0.51  # a corner of the first square: nearly on its diagonal
    mesh = Mesh(points, (CellBlock("quad", first[:, None] + [0, 1, 8, 7], np.zeros(36, dtype=int)),))
    told = same(mesh, aim(target_angle=20.0), strips(mesh), 3, fixed=np.arange(49) == 8)
    assert told.missed == 0
    assert any(
        note.startswith("target: it is of small angles alone, and the greatest one is 17") for note in told.notes
    )


@pytest.mark.parametrize("kind", ["triangles", "quads", "tetrahedra", "solids"])
def test_inverted_cells_first(kind):
    mesh, rng = MESHES[kind], np.random.default_rng(5)
    points = mesh.points.copy()
    middle = points.mean(axis=0)
    chosen = np.argsort(np.linalg.norm(points - middle, axis=1))[:2]
    points[chosen] += 0.1 * np.ptp(points) * rng.normal(size=(2, points.shape[1]))
    tangled = replace(mesh, points=points)
    assert gmsnet.quality(tangled).inverted
    told = same(tangled, aim(target_quality=float(SHAPES[kind][5])), strips(mesh), 3)
    assert told.gathered == ""
    assert told.after.inverted == 0


@pytest.mark.parametrize("kind", ["triangles", "mixed", "tetrahedra", "solids"])
def test_cells_that_are_held_stay_below(kind):
    mesh = MESHES[kind]
    worst = np.argsort(gmsnet.quality(mesh).shape)[:4]
    nodes = np.concatenate([corners_of(mesh, cell) for cell in worst[:2]])
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[nodes] = True
    told = same(mesh, aim(target_quality=float(SHAPES[kind][4])), strips(mesh), 3, fixed)
    assert told.gathered == ""
    assert told.missed >= 2
    assert told.stop_reason == NO_PROGRESS
    fixed[:] = True
    told = same(mesh, aim(target_quality=float(SHAPES[kind][4])), strips(mesh), 3, fixed)
    assert told.stop_reason == NOTHING_TO_MOVE


def corners_of(mesh, cell):
    for cells in mesh.cells:
        if cell < len(cells.nodes):
            return cells.nodes[cell]
        cell -= len(cells.nodes)
    raise AssertionError("there is no such cell")


def test_nothing_is_gathered_where_all_cells_reach_it(lent):
    mesh = MESHES["triangles"]
    told = same(mesh, aim(target_quality=float(SHAPES["triangles"][0])), strips(mesh), 3)
    assert (told.sweeps, told.stop_reason, lent) == (0, TARGET_REACHED, [])


def test_the_callback_of_the_first_rank_ends_it():
    mesh, seen = MESHES["triangles"], []
    options = aim(target_quality=float(SHAPES["triangles"][900]), callback=lambda sweep: seen.append(sweep) or True)
    _, results = spread(mesh, options, strips(mesh), 3)
    assert [result.stop_reason for result in results] == [CALLBACK] * 3
    assert len(seen) == 1


def test_an_interruption_of_the_first_rank_reaches_all():
    mesh = MESHES["triangles"]

    def stop(sweep):
        raise KeyboardInterrupt

    options = aim(target_quality=float(SHAPES["triangles"][40]), callback=stop)
    _, results = spread(mesh, options, strips(mesh), 3)
    assert all(result.interrupted for result in results)


@pytest.mark.parametrize(
    ("kind", "options", "says"),
    [("quads", {"method": "gmsnet"}, "488 quads"), ("tetrahedra", {"target_angle": 20.0}, "target_dihedral"),
     ("triangles", {"target_dihedral": 20.0}, "target_angle"), ("triangles", {"hausdorff": 0.1}, "leave it out"),
     ("tetrahedra", {"best_by": "aspect"}, "leave it out")],
)  # fmt: skip
def test_options_that_the_mesh_does_not_take(kind, options, says):
    """No rank goes on, though some may have no such cell."""
    mesh = gmsnet.generate.random_quad_mesh(400, seed=3) if kind == "quads" else MESHES[kind]
    with pytest.raises(gmsnet.InputError, match=says):
        spread(mesh, aim(**options), parts_at_random(mesh, 3, np.random.default_rng(1), "lonely"), 3)


@given(
    seed=st.integers(0, 2**32 - 1), ranks=st.integers(1, 4), kind=st.sampled_from(sorted(MESHES)),
    share=st.floats(0.0, 0.2), how=st.sampled_from(["interleaved", "strips", "lonely"]),
    preserve=st.sampled_from(["none", "shape"]),
)  # fmt: skip
@settings(max_examples=12, deadline=None)
def test_any_target_on_any_partition(seed, ranks, kind, share, how, preserve):
    rng, mesh = np.random.default_rng(seed), MESHES[kind]
    fixed = rng.random(len(mesh.points)) < 0.02
    options = aim(target_quality=float(SHAPES[kind][int(share * len(SHAPES[kind]))]), preserve=preserve)
    assert same(mesh, options, parts_at_random(mesh, ranks, rng, how), ranks, fixed).gathered == ""


@pytest.mark.parametrize("seed", range(4))
def test_what_misses_hangs_on_all_that_move_not_on_those_of_a_rank(seed):
    """Of a quad on a surface each corner has its quality: one with a node that moves, anywhere, stands for it."""
    rng, options = np.random.default_rng(seed), aim(target_quality=0.8)
    mesh = gmsnet.generate.disturb_on(gmsnet.generate.torus_surface(288, cells="quad"), 0.45, seed=seed).mesh
    moves = rng.random(len(mesh.points)) < 0.3
    state = first_state(mesh, ~moves, options.smoother(), options, serial)
    points, topology, free = state.points, state.topology, state.topology.near_free
    found = corners_missing(points, topology, options.target, free)
    assert len(found) == len(np.unique(found, axis=0)) > 0
    for rank in range(3):
        of_rank = replace(topology, near_free=free & (rng.integers(0, 3, len(free)) == rank))
        assert np.array_equal(corners_missing(points, of_rank, options.target, free), found)
