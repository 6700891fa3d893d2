"""Untangling: what it must keep whatever comes in, and tangles that it must mend."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from support import naive
from support.tangles import annulus, grid, mesh_of, moved, prepared, untangled

import gmsnet
from gmsnet.generate import disturb, moved_hole_mesh
from gmsnet.topology.topology import Topology
from gmsnet.untangle import ALL, NOTHING, PART, untangle


def signs(points, topology):
    return np.array(naive.signs(points, topology.near, topology.near_orientation))


def share(points, topology):
    """1/q of each triangle."""
    a, b, c = (points[topology.near[:, k]] for k in range(3))
    twice = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) * topology.near_orientation
    lengths = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
    return 2 * np.sqrt(3) * twice / np.where(lengths > 0, lengths, 1)


def check(result, points, topology):
    """What holds for every result."""
    before, after = signs(points, topology), signs(result.points, topology)
    held = topology.near_colours < 0
    assert result.points[held].tobytes() == points[held].tobytes()
    assert (after[before > 0] > 0).all()
    assert result.before == (before <= 0).sum()
    assert result.after == (after <= 0).sum() <= result.before
    still = after <= 0
    if still.any():
        assert share(result.points, topology)[still].min() >= share(points, topology).min() - 1e-15
    if (result.points != points).any():
        assert result.after < result.before
    assert (result.taken == NOTHING) == (result.before > 0 and (result.points == points).all())
    assert set(np.flatnonzero(still)) <= {row.row for row in result.unmended}
    assert all(row.reason and np.isfinite(row.place).all() for row in result.unmended)


def any_mesh(rng, nodes, tangle, single):
    points = rng.random((nodes, 2)) + rng.choice([0.0, 10.0])
    points = np.float64(np.float32(points)) if single else points
    triangles = np.array([t[:: rng.choice([1, -1])] for t in Delaunay(points).simplices])
    mesh = mesh_of(points, triangles, single=single)
    fixed = rng.random(nodes) < rng.choice([0.0, 0.3])
    topology = Topology.of(mesh, fixed)
    chosen = topology.free[rng.random(len(topology.free)) < rng.choice([0.1, 1.0])]
    if rng.random() < 0.2:  # the boundary, too
        chosen = np.arange(nodes)
    if rng.random() < 0.2:  # some in one place: cells without area
        points = mesh.points.copy()
        points[chosen] = points[rng.choice(nodes, len(chosen) or 1)[: len(chosen)]]
        return mesh.with_points(points), topology
    return disturb(mesh, chosen, tangle, seed=int(rng.integers(2**31)), keep_valid=False), topology


@given(
    seed=st.integers(0, 2**32 - 1), nodes=st.integers(6, 70), tangle=st.sampled_from([0.3, 1.0, 5.0]),
    single=st.booleans(),
)  # fmt: skip
@settings(max_examples=150)
def test_held_nodes_stay_positive_cells_stay_and_the_same_comes_out_twice(seed, nodes, tangle, single):
    mesh, topology = any_mesh(np.random.default_rng(seed), nodes, tangle, single)
    points, topology, precision = prepared(mesh, topology)
    given_ = points.copy()
    result = untangle(points, topology, precision)
    assert points.tobytes() == given_.tobytes()
    check(result, points, topology)
    again = untangle(points, topology, precision)
    assert again.points.tobytes() == result.points.tobytes()
    assert again.steps == result.steps
    if single:
        changed = (result.points != points).any(axis=1)
        np.testing.assert_array_equal(result.points[changed], np.float64(np.float32(result.points[changed])))


def mended(mesh, topology=None):
    result, points, topology, _ = untangled(mesh, topology)
    check(result, points, topology)
    assert result.before > 0
    assert result.after == 0
    assert result.taken == ALL
    assert result.why == ""
    assert result.unmended == ()
    assert result.steps[-1].left == 0
    return result, points, topology


def test_a_valid_mesh_is_left_alone():
    result, points, _, _ = untangled(grid(5))
    assert (result.points == points).all()
    assert (result.before, result.after, result.taken, result.steps, result.unmended) == (0, 0, ALL, (), ())


def test_a_node_thrown_out_of_its_star():
    mesh = grid(6)
    result, points, _ = mended(moved(mesh, [3 * 7 + 3], [[0.95, 0.9]]))
    assert (result.points != points).any(axis=1).sum() < 12  # what is far off keeps its bits


def test_two_neighbours_that_have_changed_places():
    mesh = grid(6)
    one, other = 3 * 7 + 3, 3 * 7 + 4
    mended(moved(mesh, [one, other], mesh.points[[other, one], :2]))


@pytest.mark.parametrize("throw", ["everywhere", "one point", "one line"])
def test_everything_thrown(throw):
    mesh = grid(30)
    free = Topology.of(mesh).free
    places = np.random.default_rng(1).random((len(free), 2))
    if throw == "one point":
        places[:] = 0.37
    elif throw == "one line":
        places[:, 1] = places[:, 0]
    mended(moved(mesh, free, places))


@pytest.mark.parametrize("how", ["one point", "mirrored", "permuted"])
@pytest.mark.parametrize("shape", ["square", "plate", "lshape"])
def test_a_mesh_that_is_folded_as_a_whole(shape, how):
    mesh = gmsnet.random_mesh(1500, shape, seed=3)
    free, rng = Topology.of(mesh).free, np.random.default_rng(3)
    places = mesh.points[free, :2].copy()
    if how == "one point":
        places[:] = places[0]
    elif how == "mirrored":
        places[:, 0] = 1.0 - places[:, 0]
    else:
        places = rng.permutation(places)
    mended(moved(mesh, free, places))


def test_where_most_of_a_mesh_is_folded_all_nodes_move_at_once():
    """L-BFGS on 70 % of them took most of the time, and left nearly all cells inverted."""
    mesh = moved_hole_mesh(0.02, shift=0.0)
    free = Topology.of(mesh).free
    result, *_ = untangled(
        moved(mesh, free, np.tile(mesh.points[np.random.default_rng(1).choice(free)], (len(free), 1)))
    )
    assert result.after == 0
    assert not any("L-BFGS" in step.name for step in result.steps)


@pytest.mark.parametrize("degrees", [45, 60, 90, 120])
@pytest.mark.parametrize(("rings", "nodes"), [(10, 60), (20, 100)])
def test_a_hole_that_has_been_turned(rings, nodes, degrees):
    mended(annulus(rings, nodes, degrees))


def test_cells_without_area():
    mesh = grid(6)
    inner = 3 * 7 + 3
    mended(moved(mesh, [inner], mesh.points[[inner + 1], :2]))  # on its neighbour
    mended(moved(mesh, [inner], [(mesh.points[inner + 1, :2] + mesh.points[inner + 8, :2]) / 2]))  # on an edge


@pytest.mark.parametrize("offset", [0.0, 1.0, 300.0])
def test_single_precision(offset):
    mesh = grid(12, offset=offset, single=True)
    mesh = mesh.with_points(np.float64(np.float32(mesh.points)))
    topology = Topology.of(mesh)
    result, _, _ = mended(disturb(mesh, topology.free, 2.0, seed=4, keep_valid=False), topology)
    np.testing.assert_array_equal(result.points, np.float64(np.float32(result.points)))


@pytest.mark.parametrize("amount", [0.5, 1.0, 3.0, 10.0])
def test_random_meshes_with_all_nodes_thrown(amount):
    mesh = gmsnet.random_mesh(500, seed=3)
    mended(disturb(mesh, Topology.of(mesh).free, amount, seed=1, keep_valid=False))


def test_far_off_nothing_moves():
    """Two nodes thrown in opposite corners of 60 × 60 cells: only a few nodes around each are elsewhere afterwards."""
    mesh = grid(60)
    topology = Topology.of(mesh)
    nodes = [5 * 61 + 5, 55 * 61 + 55]
    result, points, _ = mended(moved(mesh, nodes, mesh.points[nodes, :2] + [[0.04, 0.0], [0.0, -0.04]]), topology)
    elsewhere = np.linalg.norm(mesh.points[topology.memory][:, None] - mesh.points[nodes], axis=2).min(axis=1) > 0.1
    assert result.points[elsewhere].tobytes() == points[elsewhere].tobytes()


def turned(mesh):
    cosine, sine = np.cos(0.7), np.sin(0.7)
    return mesh.with_points(mesh.points @ np.array([[cosine, sine], [-sine, cosine]]))


@pytest.mark.parametrize(
    "change", [turned, lambda m: m.with_points(m.points * [1, -1]), lambda m: m.with_points(1e-9 * m.points),
               lambda m: m.with_points(m.points + 7.0)], ids=["turned", "mirrored", "scaled", "translated"],
)  # fmt: skip
def test_turning_mirroring_scaling_and_translating_commute(change):
    mesh = gmsnet.random_mesh(300, seed=8)
    topology = Topology.of(mesh)
    tangled = disturb(mesh, topology.free, 3.0, seed=2, keep_valid=False)

    def by_id(mesh):
        result, _, topology, _ = untangled(mesh)
        assert result.after == 0
        points = np.empty_like(result.points)
        points[topology.memory] = result.points
        return np.ldexp(points, mesh.exponent)

    one = change(tangled.with_points(by_id(tangled))).points
    other = by_id(change(tangled))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-6 * np.ptp(one))


def test_nothing_can_be_taken_or_only_a_part():
    """A node whose ring, all held, no place sees from the left: it stays; another one is untangled."""
    mesh = grid(8)
    stuck, thrown = 2 * 9 + 2, 6 * 9 + 6
    held = np.zeros(81, dtype=bool)
    start, ring = Topology.of(mesh).patches
    k = Topology.of(mesh).free.tolist().index(stuck)
    around = ring[start[k] : start[k + 1]]
    held[around] = True
    topology = Topology.of(mesh, held)
    # Two opposite nodes of the ring past each other: the edges there look away from each other.
    crossed = moved(mesh, [1 * 9 + 2, 3 * 9 + 2], [[0.34, 0.25], [0.16, 0.25]])
    result, points, topology, _ = untangled(crossed, topology)
    check(result, points, topology)
    assert result.taken in (NOTHING, PART)
    both = moved(crossed, [thrown], [[0.99, 0.5]])
    result, points, topology, _ = untangled(both, topology)
    check(result, points, topology)
    assert result.taken == PART
    assert 0 < result.after < result.before


def test_a_mesh_whose_nodes_are_all_in_wrong_places_boundary_included():
    mesh = grid(12)
    topology = Topology.of(mesh)
    mesh = mesh.with_points(np.random.default_rng(0).permutation(mesh.points))
    result, points, _, _ = untangled(mesh, topology)
    check(result, points, topology)
    assert 0 < result.after < result.before
    assert result.taken == PART
