"""A shift is shortened to where the first triangle reaches the end of its band, and no further."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import bands
from gmsnet.kernels.star import stars
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

WIDTH = 0.1


def doubles(points, topology):
    a, b, c = (points[topology.near[:, k]] for k in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def shares_of(points, topology, kept, shifts):
    """What is left of the shift (N, 2; over the stars' sizes) of each free node, all others where they are."""
    blocks = topology.stars.blocks
    given = bands.Bands(points.copy(), kept, WIDTH)
    room = stars.workspace_for(blocks.most)
    local, shift = np.empty(2 * blocks.most * LANES), np.empty(2 * LANES)
    left, size = np.full((len(points), 2), np.nan), np.full(len(points), np.nan)
    for block in range(len(blocks.degree)):
        stars.fetch(points, blocks, block, room, local)
        centre = blocks.centre[block * LANES : (block + 1) * LANES]
        shift[:] = shifts[centre].T.ravel()
        bands.shorten(given, None, blocks, block, room.star, room.work[:LANES], shift)
        left[centre], size[centre] = shift.reshape(2, LANES).T, room.work[:LANES]
    return left, size


@given(seed=st.integers(0, 2**32 - 1), reach=st.sampled_from([1e-3, 0.03, 0.3, 10.0]))
def test_no_triangle_leaves_its_band_and_no_shift_is_shortened_for_nothing(seed, reach):
    rng = np.random.default_rng(seed)
    mesh = gmsnet.random_mesh(60, seed=seed % 7)
    topology = Topology.of(mesh)
    points = planar_points(mesh)[topology.memory]
    kept = rng.random(len(points)) < 0.8
    shifts = reach * rng.normal(size=points.shape)
    left, size = shares_of(points, topology, kept, shifts)
    before = doubles(points, topology)
    banded = kept[topology.near].all(axis=1)
    for node in np.flatnonzero(~np.isnan(size)):
        moved = points.copy()
        moved[node] += size[node] * left[node]
        ratio = (doubles(moved, topology) / before)[banded]
        assert np.abs(ratio - 1.0).max(initial=0.0) <= WIDTH + 1e-9
        whole = left[node].tolist() == shifts[node].tolist()
        assert whole or np.abs(ratio - 1.0).max() == pytest.approx(WIDTH, abs=1e-9)
        np.testing.assert_allclose(left[node, 0] * shifts[node, 1], left[node, 1] * shifts[node, 0], atol=1e-12 * reach)


def test_what_is_outside_of_its_band_may_go_back_only():
    mesh = gmsnet.Mesh(
        np.array([[0.1, 0.1], [1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]]),
        (gmsnet.CellBlock("triangle", [[0, 1, 2], [0, 2, 3], [0, 3, 1]], [0, 0, 0]),),
    )
    topology = Topology.of(mesh)
    start = planar_points(mesh)[topology.memory]
    place = int(np.flatnonzero(topology.memory == 0)[0])
    blocks = topology.stars.blocks
    room = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES)
    now = start.copy()
    now[place] = [-0.2, -0.2]
    stars.fetch(now, blocks, 0, room, local)
    for direction, share in ((-0.01, 0.0), (0.01, 1.0)):
        shift = np.full(2 * LANES, direction)
        bands.shorten(
            bands.Bands(start, np.ones(4, dtype=bool), WIDTH), None, blocks, 0, room.star, room.work[:LANES], shift
        )
        assert shift[0] == share * direction


def test_shifts_that_are_not_finite_stay_so():
    mesh = gmsnet.random_mesh(30, seed=0)
    topology = Topology.of(mesh)
    points = planar_points(mesh)[topology.memory]
    left, _ = shares_of(points, topology, np.ones(len(points), dtype=bool), np.full(points.shape, np.nan))
    assert np.isnan(left).all()
