"""Shape within bands: derivatives against differences, areas that stay in them, shapes that gain all the same."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb, recombine
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import banded as kernels
from gmsnet.kernels.methods.bands import AREA, HEIGHT
from gmsnet.kernels.star.guard import Precision
from gmsnet.methods import Field
from gmsnet.methods.banded import PLAN, Banded, Kept
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def everything(count, nodes=None):
    nodes = np.ones(count, dtype=bool) if nodes is None else nodes
    return Kept.nothing(count)._replace(nodes=nodes)


def objective(ring, x, y, low, high, top, power, weight):
    """Of one star, in the plain way."""
    value = 0.0
    for k in range(len(ring)):
        a, b = ring[k - 1] - (x, y), ring[k] - (x, y)
        d = a[0] * b[1] - a[1] * b[0]
        q = (a @ a + b @ b - a @ b) / (np.sqrt(3.0) * d)
        value += (q / top) ** power
        if np.isfinite(high[k]):
            value -= weight * np.log(4.0 * (high[k] - d) * (d - low[k]) / (high[k] - low[k]) ** 2)
    return value


def test_derivatives_and_values_are_those_of_the_objective():
    rng, n, weight, doublings, top = np.random.default_rng(1), 6, 0.03, 3, 1.4
    rings = np.empty((n, 2, LANES))
    for k in range(n):
        rings[k] = np.array([[np.cos(k)], [np.sin(k)]]) + 0.1 * rng.normal(size=(2, LANES))
    a, b = np.roll(rings, 1, axis=0), rings
    d = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    low, high = 0.8 * d, 1.3 * d
    low[2], high[2] = -np.inf, np.inf
    state, local = np.empty(kernels.STATE * LANES), rings.ravel().copy()
    arguments = (local, n, None, low.ravel(), high.ravel(), 1.0 / top, doublings, weight, state)
    kernels.derive(*arguments)
    rows = state.reshape(kernels.STATE, LANES).copy()
    state[:] = 0.0
    state[kernels.VALUE * LANES : (kernels.VALUE + 1) * LANES] = rows[kernels.VALUE]
    state[kernels.DX * LANES : (kernels.DX + 1) * LANES] = 0.02
    state[kernels.SHARE * LANES : (kernels.SHARE + 1) * LANES] = 0.5
    kernels.judge(*arguments)
    rise, h = state[kernels.AFTER * LANES : (kernels.AFTER + 1) * LANES], 1e-4
    for lane in range(LANES):

        def of(x, y, lane=lane):
            return objective(rings[:, :, lane], x, y, low[:, lane], high[:, lane], top, 8, weight)

        assert rise[lane] == pytest.approx(of(0.01, 0.0) - of(0.0, 0.0), rel=1e-6, abs=1e-9)
        gradient = (of(h, 0) - of(-h, 0)) / (2 * h), (of(0, h) - of(0, -h)) / (2 * h)
        bend = (of(h, 0) - 2 * of(0, 0) + of(-h, 0)) / h**2
        cross = (of(h, h) - of(h, -h) - of(-h, h) + of(-h, -h)) / (4 * h**2)
        np.testing.assert_allclose(rows[[kernels.GX, kernels.GY], lane], gradient, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(rows[[kernels.XX, kernels.XY], lane], (bend, cross), rtol=1e-4, atol=1e-4)


def swept(mesh, kept):
    """The points in memory order at the start and in the end, and the topology. kept: by id."""
    topology = Topology.of(mesh)
    start = planar_points(mesh)[topology.memory]
    field = Field(start.copy(), topology, Precision())
    smoother = Banded(start, kept.taken(topology.memory))
    for sweep in range(len(PLAN)):
        smoother.sweep(field, serial, lambda: True)
        assert smoother.converged == (sweep + 1 == len(PLAN))
    return start, field.points, topology


def test_areas_stay_in_their_bands_and_shapes_gain():
    mesh = gmsnet.random_mesh(400, seed=2)
    kept = everything(len(mesh.points), mesh.points[:, 0] < 0.6)
    start, end, topology = swept(mesh, kept)
    cells = kept.nodes[topology.memory][topology.near].all(axis=1)
    ratio = doubles(end, topology.near) / doubles(start, topology.near)
    assert np.abs(ratio[cells] - 1.0).max() <= AREA + 1e-9
    assert np.abs(ratio[cells] - 1.0).max() > 0.09
    assert np.abs(ratio[~cells] - 1.0).max() > 1.0
    points = mesh.points.copy()
    points[topology.memory] = end
    near = kept.nodes[topology.triangles].all(axis=1)
    before, after = (gmsnet.quality(m).shape[near] for m in (mesh, mesh.with_points(points)))
    assert after.min() > before.min()
    assert np.quantile(after, 0.05) > np.quantile(before, 0.05)


def changes_of_quads(start, end, topology):
    """(Q,) of their areas, and which quads have four positive corners at the start."""
    quads, positive = topology.places[topology.quads], []
    signs = topology.quad_orientation
    for k in range(4):
        positive.append(signs * doubles(start, np.roll(quads, -k, axis=1)[:, [0, 1, 3]]) > 0.0)
    areas = [doubles(points, quads[:, :3]) + doubles(points, quads[:, [0, 2, 3]]) for points in (start, end)]
    return np.abs(areas[1] / areas[0] - 1.0), np.all(positive, axis=0)


@pytest.mark.parametrize("quads", [False, True])
def test_heights_over_a_wall_stay_in_theirs(quads):
    mesh = gmsnet.random_mesh(400, seed=1)
    good = mesh.with_points(gmsnet.smooth(mesh).points)
    mesh = disturb(good, Topology.of(good).free, 0.1, seed=0)
    mesh = recombine(mesh) if quads else mesh
    wall = (mesh.points == 0.0).any(axis=1) | (mesh.points == 1.0).any(axis=1)
    heights = []
    for kept in (everything(len(mesh.points)), everything(len(mesh.points))._replace(heights=wall.astype(float))):
        start, end, topology = swept(mesh, kept)
        signs = topology.near_orientation
        before, after = (signs * doubles(points, topology.near) for points in (start, end))
        on_wall = wall[topology.memory][topology.near]
        at_wall = (on_wall.sum(axis=1) == 2) & (before > 0.0)
        if quads:  # two corners that are not next to each other have no edge of the wall
            at_wall &= on_wall[:, 0] | (topology.near_shapes == 0)
        assert at_wall.sum() > 70
        if quads:
            change, convex = changes_of_quads(start, end, topology)
            assert change[convex].max() <= AREA + 1e-9
        else:
            assert np.abs(after / before - 1.0)[before > 0.0].max() <= AREA + 1e-9
        heights.append(np.abs(after / before - 1.0)[at_wall].max())  # the wall's nodes are held, and so lengths
    assert heights[0] > 2.0 * HEIGHT
    assert 0.9 * HEIGHT < heights[1] <= HEIGHT + 1e-9


def test_noise_gives_way_to_the_mean_around():
    mesh = gmsnet.random_mesh(400, seed=2)
    firm = everything(len(mesh.points))
    tight, wide = swept(mesh, firm), swept(mesh, firm._replace(blend=np.ones(len(mesh.points))))
    shapes = []
    for _, end, topology in (tight, wide):
        points = mesh.points.copy()
        points[topology.memory] = end
        shapes.append(gmsnet.quality(mesh.with_points(points)).shape)
    assert shapes[1].mean() > shapes[0].mean() + 0.02
    start, end, topology = wide
    own, found = (np.log(doubles(points, topology.near)) for points in (start, end))
    mean = np.log([doubles(start, topology.near[(topology.near == i).any(axis=1)]).mean() for i in range(len(start))])
    goal = mean[topology.near].mean(axis=1)
    assert (found >= np.minimum(own, goal) + np.log(1.0 - AREA) - 1e-9).all()
    assert (found <= np.maximum(own, goal) + np.log(1.0 + AREA) + 1e-9).all()


def test_quads_keep_their_areas_and_not_those_at_their_corners():
    mesh = recombine(gmsnet.random_mesh(300, seed=1))
    start, end, topology = swept(mesh, everything(len(mesh.points)))
    change, convex = changes_of_quads(start, end, topology)
    assert convex.sum() > 100
    assert 0.09 < change[convex].max() <= AREA + 1e-9
    signs = topology.near_orientation
    before, after = (signs * doubles(points, topology.near) for points in (start, end))
    assert (after[before > 0.0] > 0.0).all()
    assert np.abs(after / before - 1.0)[topology.near_shapes > 0].max() > 0.5


def test_a_tangled_star_stays():
    mesh = gmsnet.random_mesh(200, seed=1)
    topology = Topology.of(mesh)
    node = int(topology.free[len(topology.free) // 2])
    points = mesh.points.copy()
    points[node] += 0.3
    tangled = mesh.with_points(points)
    assert gmsnet.quality(tangled).inverted
    start, end, topology = swept(tangled, everything(len(mesh.points)))
    place = int(np.flatnonzero(topology.memory == node)[0])
    assert (start[place] == end[place]).all()
    assert np.isfinite(end).all()
