"""Shape and size: derivatives against differences, areas that stay, slivers that get the areas around them."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import sized
from gmsnet.methods.sized import WEIGHT, Sized, places_of
from gmsnet.paper.cases import CASES
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k], :2] for k in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def changes(mesh, other):
    triangles = Topology.of(mesh).triangles
    return np.abs(np.log(np.abs(doubles(other.points, triangles) / doubles(mesh.points, triangles))))


def smoothed(mesh):
    return gmsnet.smooth(mesh, "sized", preserve="none", max_sweeps=20)


def stars(rng, n):
    """A block of stars, [ring node][axis][lane], and areas for their triangles."""
    turn = 2.0 * np.pi * (np.arange(n)[:, None] + 0.6 * rng.random((n, LANES))) / n
    radius = 0.3 + 0.3 * rng.random((n, LANES))
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    return local.ravel(), 0.05 + 0.2 * rng.random(n * LANES)


@pytest.mark.parametrize("n", [3, 6, 9])
def test_derivatives(n):
    rng = np.random.default_rng(n)
    local, wanted = stars(rng, n)
    state = np.zeros(sized.STATE * LANES)
    step = 1e-5

    def at(x, y):
        state[: 2 * LANES] = np.repeat([x, y], LANES)
        sized.derive(local, n, None, wanted, WEIGHT, state)
        rows = state.reshape(-1, LANES)[:, inside]
        return rows[sized.VALUE].copy(), rows[sized.GX : sized.LEAST].copy()

    inside = np.ones(LANES, dtype=bool)
    at(0.0, 0.0)
    inside = state.reshape(-1, LANES)[sized.LEAST] > 0.01
    assert inside.sum() > LANES / 2
    value, (gx, gy, xx, xy, yy) = at(0.0, 0.0)
    right, left, up, down = at(step, 0.0), at(-step, 0.0), at(0.0, step), at(0.0, -step)
    for exact, difference in (
        (gx, (right[0] - left[0]) / (2 * step)),
        (gy, (up[0] - down[0]) / (2 * step)),
        (xx, (right[1][0] - left[1][0]) / (2 * step)),
        (xy, (right[1][1] - left[1][1]) / (2 * step)),
        (yy, (up[1][1] - down[1][1]) / (2 * step)),
    ):
        np.testing.assert_allclose(exact, difference, rtol=1e-4, atol=1e-4 * np.abs(exact).max())
    points = np.moveaxis(local.reshape(n, 2, LANES), 2, 0)
    for k, lane in enumerate(np.flatnonzero(inside)[:5]):
        a, b = np.roll(points[lane], 1, axis=0), points[lane]
        d = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        q = ((a**2).sum(1) + (b**2).sum(1) - (a * b).sum(1)) / (np.sqrt(3.0) * d)
        goal = wanted.reshape(n, LANES)[:, lane]
        assert value[k] == pytest.approx((q**2 + WEIGHT / 2 * (d / goal + goal / d)).sum())


@pytest.mark.parametrize("n", [3, 5, 8])
def test_a_visit_never_makes_the_objective_larger(n):
    rng = np.random.default_rng(n)
    local, wanted = stars(rng, n)
    state = np.zeros(sized.STATE * LANES)
    sized.derive(local, n, None, wanted, WEIGHT, state)
    before, least = (state.reshape(-1, LANES)[row].copy() for row in (sized.VALUE, sized.LEAST))
    sized.descend(local, n, None, wanted, WEIGHT, state)
    place = state[: 2 * LANES].copy()
    state[:] = 0.0
    state[: 2 * LANES] = place
    sized.derive(local, n, None, wanted, WEIGHT, state)
    after = state.reshape(-1, LANES)[sized.VALUE]
    inside = least > 0.0
    assert inside.any()
    assert (after[inside] <= before[inside]).all()
    assert (after[inside] < before[inside]).mean() > 0.9


def wanted_areas(mesh):
    """D of the triangles of all stars, and what it is to be."""
    topology = Topology.of(mesh)
    blocks = topology.stars.blocks
    first, count = places_of(blocks)
    room = sized.Wanted(first, np.empty(count))
    points = planar_points(mesh)[topology.memory]
    sized.targets(points, topology.near, blocks, room)
    areas = room.double
    corners = np.empty((len(areas), 3), dtype=int)
    for block in range(len(blocks.degree)):
        n, offset = blocks.degree[block], blocks.offset[block]
        ring = blocks.rings[offset : offset + n * LANES].reshape(n, LANES)
        centre = np.broadcast_to(blocks.centre[block * LANES : (block + 1) * LANES], ring.shape)
        star = np.stack([centre, np.roll(ring, 1, axis=0), ring], axis=-1)
        corners[offset : offset + n * LANES] = star.reshape(-1, 3)
    some = np.unique(corners, axis=0, return_index=True)[1]  # the lanes left over in a block repeat its last star
    return doubles(points, corners[some]), areas[some]


def test_areas_that_are_wanted():
    """In a graded mesh a cell's own; of slivers, the areas of the cells around them."""
    good = CASES["airfoil"].good()
    own, areas = wanted_areas(good)
    assert np.abs(np.log(areas / own)).max() < 0.4
    assert np.median(np.abs(np.log(areas / own))) < 1e-12
    chosen = Topology.of(good).free[::40]
    bad = disturb(good, chosen, 3.0, seed=1)
    now, wanted = wanted_areas(bad)
    flat = now < 0.1 * own
    assert flat.sum() >= 8
    assert np.median(np.abs(np.log(wanted[flat] / own[flat]))) < 0.45
    assert np.abs(np.log(wanted / own)).max() < 1.8


@pytest.mark.parametrize("name", ["airfoil", "pipe"])
def test_areas_of_good_meshes_stay(name):
    good = CASES[name].good()
    result = smoothed(good)
    change = changes(good, result.mesh)
    free = changes(good, gmsnet.smooth(good, "optimize", variant="newton", objective="q2", preserve="none").mesh)
    assert np.percentile(change, 50) < 0.05
    assert np.percentile(change, 90) < 0.15
    assert np.percentile(change, 90) < 0.6 * np.percentile(free, 90)


@pytest.mark.parametrize("amount", [0.3, 0.6])
@pytest.mark.parametrize("name", ["airfoil", "pipe"])
def test_disturbed_meshes_get_their_areas_and_shapes_back(name, amount):
    good = CASES[name].good()
    bad = disturb(good, Topology.of(good).free, amount, seed=1)
    result = smoothed(bad)
    assert result.after.shape.mean() > 0.95
    assert result.after.shape.min() > result.before.shape.min() + 0.2
    assert np.median(changes(good, result.mesh)) < 0.5 * np.median(changes(good, bad))


def test_the_areas_are_those_at_the_first_sweep():
    """A run of twenty sweeps in two halves by one smoother is the run in one; a new smoother takes the areas anew."""
    from gmsnet.kernels.star.guard import Precision
    from gmsnet.methods import Field
    from gmsnet.parallel.threads import serial

    mesh = gmsnet.random_mesh(200, seed=1)
    topology = Topology.of(mesh)

    def run(smoothers):
        field = Field(planar_points(mesh)[topology.memory], topology, Precision())
        for smoother in smoothers:
            smoother.sweep(field, serial, lambda: True)
        return field.points

    one = Sized()
    whole, again = run([one] * 6), run([Sized() for _ in range(6)])
    assert run([Sized()] * 6).tobytes() == whole.tobytes()
    assert np.abs(whole - again).max() > 1e-3
