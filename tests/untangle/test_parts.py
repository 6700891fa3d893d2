"""The parts of untangling, each by itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.tangles import annulus, grid, moved, prepared, untangled

import gmsnet
from gmsnet.generate import disturb
from gmsnet.generate.layered import layered_mesh
from gmsnet.kernels.untangle import untangling as kernels
from gmsnet.topology.topology import Topology
from gmsnet.untangle.guarded import what_is_left, worst_nodes
from gmsnet.untangle.harmonic import harmonic
from gmsnet.untangle.patch import Patch, in_order
from gmsnet.untangle.state import UntanglingState
from gmsnet.untangle.transaction import restore, take


def thrown(seed, nodes=200, amount=1.0, share=1.0):
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    topology = Topology.of(mesh)
    chosen = topology.free[np.random.default_rng(seed).random(len(topology.free)) < share]
    return disturb(mesh, chosen, amount, seed=seed, keep_valid=False)


def share(points, near, turn):
    """D/L of each triangle."""
    a, b, c = (points[near[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return turn * twice / ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.4, 1.0]))
@settings(max_examples=30)
def test_a_patch_is_what_it_says(seed, part):
    _, topology, _ = prepared(gmsnet.random_mesh(120, seed=seed % 5))
    chosen = np.flatnonzero(
        (topology.near_colours >= 0) & (np.random.default_rng(seed).random(len(topology.memory)) < part)
    )
    patch = Patch.of(topology, chosen.astype(np.int32))
    assert patch.nodes.tolist() == chosen.tolist()
    assert len(set(patch.every.tolist())) == len(patch.every)
    for k, v in enumerate(chosen):
        ring = patch.every[patch.stars.around[patch.stars.start[k] : patch.stars.start[k + 1]]]
        assert ring.tolist() == topology.near_ring[topology.near_start[v] : topology.near_start[v + 1]].tolist()
    touching = np.isin(topology.near, chosen).any(axis=1)
    expected = {frozenset(row) for row in topology.near[touching].tolist()}
    cells = patch.every[patch.cells]
    assert {frozenset(row) for row in cells.tolist()} == expected
    assert len(cells) == len(expected)
    assert (patch.cells[:, 0] < patch.count).all()
    assert (
        not len(cells) or share(prepared(gmsnet.random_mesh(120, seed=seed % 5))[0], cells, 1).min() > 0
    )  # their turn
    for row in cells:
        assert len({int(patch.part[patch.nodes == v][0]) for v in row if v in chosen}) == 1


def test_growing_by_rings():
    _, topology, _ = prepared(grid(12))
    chosen = np.zeros(13 * 13, dtype=bool)
    chosen[np.flatnonzero(topology.memory == 6 * 13 + 6)] = True
    sizes = []
    for _ in range(7):
        sizes.append(int(chosen.sum()))
        more = kernels.grow(chosen, topology.near_start, topology.near_ring, 1)
    assert sizes[:3] == [1, 7, 19]  # hexagonal numbers
    assert not more or chosen.sum() < 121
    kernels.grow(chosen, topology.near_start, topology.near_ring, 100)
    assert chosen.sum() == 11 * 11
    assert not chosen[topology.near_colours < 0].any()


def test_harmonic_places_are_the_means_of_their_rings_and_valid_in_a_convex_rim():
    points, topology, precision = prepared(thrown(1, amount=40.0))
    patch = Patch.of(topology, in_order(topology, topology.near_colours >= 0))
    new = harmonic(points[patch.every], patch)
    means = [
        new[patch.stars.around[patch.stars.start[k] : patch.stars.start[k + 1]]].mean(axis=0)
        for k in range(patch.count)
    ]
    np.testing.assert_allclose(new[: patch.count], means, rtol=0, atol=1e-12)
    assert (new[patch.count :] == points[patch.every[patch.count :]]).all()
    assert kernels.uncertified(new, patch.cells, precision.unit, precision.grain) == 0


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.02, 0.5]), st.sampled_from([worst_nodes, what_is_left]))
@settings(max_examples=30)
def test_guarded_sweeps_do_no_harm(seed, part, sweeps):
    points, topology, precision = prepared(thrown(seed, 150, 2.0, part))
    tangle = UntanglingState(points, topology, precision)
    before = share(points, topology.near, topology.near_orientation)
    step = sweeps(tangle)
    after = share(tangle.points, topology.near, topology.near_orientation)
    assert (after[before > 0] > 0).all()
    assert after[after <= 0].min(initial=np.inf) >= before.min() - 1e-12
    assert tangle.left == step.left == (after <= 0).sum() <= (before <= 0).sum()


def test_what_is_taken_inverts_nothing_and_the_rest_goes_back():
    """By hand: one node mends its star, another inverts its own, a third moves for nothing."""
    mesh = grid(12)
    tangled, innocent, idle = 3 * 13 + 3, 9 * 13 + 9, 3 * 13 + 9
    mesh = moved(mesh, [tangled], [[0.45, 0.3]])
    points, topology, precision = prepared(mesh)
    place = np.argsort(topology.memory)
    tangle = UntanglingState(points, topology, precision)
    assert tangle.left > 0
    tangle.points[place[tangled]] = np.array([0.25, 0.25]) / 2  # coordinates of the run are halves
    tangle.points[place[innocent]] += [0.1, 0.0]
    tangle.points[place[idle]] += [0.001, 0.0]
    tangle.look()
    assert "that were positive" in take(tangle)
    assert tangle.left == 0
    elsewhere = np.flatnonzero((tangle.points != points).any(axis=1))
    assert topology.memory[elsewhere].tolist() in ([tangled], [tangled, idle], [idle, tangled])
    tangle.points[place[idle]] += [0.001, 0.0]
    restore(tangle)
    assert (tangle.points[place[idle]] == points[place[idle]]).all()
    assert (tangle.points[place[tangled]] != points[place[tangled]]).any()


@pytest.mark.parametrize("case", ["worse than the worst", "no gain"])
def test_what_mends_nothing_is_not_taken(case):
    mesh = moved(grid(6), [3 * 7 + 3], [[0.7, 0.52]])
    points, topology, precision = prepared(mesh)
    tangle = UntanglingState(points, topology, precision)
    v = int(np.argsort(topology.memory)[3 * 7 + 3])
    tangle.points[v] += [0.5, 0.0] if case == "worse than the worst" else [-1e-3, 0.0]
    tangle.look()
    assert take(tangle)
    assert tangle.points.tobytes() == points.tobytes()


def test_layers_stay_thin():
    """One node in a hundred thrown in layers of an aspect up to 1,000: hardly more than those nodes are elsewhere."""
    mesh = layered_mesh(10, 1000.0, 60)
    topology = Topology.of(mesh)
    chosen = np.random.default_rng(1).choice(topology.free, len(topology.free) // 100, replace=False)
    tangled = disturb(mesh, chosen, 1.0, seed=1, keep_valid=False)
    result, points, _, _ = untangled(tangled, topology)
    assert result.before > 0
    assert result.after == 0
    assert (result.points != points).any(axis=1).sum() <= 2 * len(chosen)


def test_beside_what_cannot_be_mended_the_rest_is():
    """A bottom node pulled over the top of a mesh whose inner nodes are all thrown."""
    mesh = grid(20)
    mesh = disturb(mesh, Topology.of(mesh).free, 3.0, seed=3, keep_valid=False)
    result, _, _, _ = untangled(moved(mesh, [10 * 21], [[0.5, 1.2]]))
    assert result.before > 300
    assert 0 < result.after <= 8
    assert result.taken == "part"
    assert result.why


def test_stages_say_what_was_left():
    result, _, _, _ = untangled(annulus(10, 50, 60))
    assert [step.left for step in result.steps][-1] == 0
    assert result.sweeps == sum(step.sweeps for step in result.steps)
    assert all(step.nodes > 0 for step in result.steps)
