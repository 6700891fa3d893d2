"""Bands: their ends against a slow twin, and nodes that slide no further than to where a first cell leaves its band."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import bands
from gmsnet.kernels.methods.bands import AREA, HEIGHT
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.pattern import count_of, other_of, pair_of, pattern_at
from gmsnet.methods.sized import places_of
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def doubles(points, triangles):
    a, b, c = (points[triangles[..., k]] for k in range(3))
    return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]


def limited(points, topology, kept, firm, blend=0.0, room=1.0):
    """The bands of all stars, and the logarithms of the mean areas around nodes."""
    blocks = topology.stars.blocks
    first, count = places_of(blocks)
    found, log_mean = bands.bands_for(first, count), np.empty(len(points))
    bands.mean_areas(points, topology.near, log_mean)
    same = np.ones(len(points))
    bands.limit(points, kept, log_mean, blend * same, room * same, firm, blocks, found)
    return found, log_mean


@pytest.mark.parametrize(("blend", "room"), [(0.0, 1.0), (0.5, 1.0), (1.0, 3.0)])
def test_the_ends_of_bands_follow_from_areas(blend, room):
    mesh = gmsnet.random_mesh(120, seed=3)
    topology = Topology.of(mesh)
    points = planar_points(mesh)[topology.memory]
    rng = np.random.default_rng(0)
    kept, firm = rng.random(len(points)) < 0.8, rng.choice([0.0, 0.0, 0.4, 1.0], len(points))
    wall = firm > 0.0
    found, log_mean = limited(points, topology, kept, firm, blend, room)
    for node in range(len(points)):
        around = np.abs(doubles(points, topology.near[(topology.near == node).any(axis=1)]))
        assert log_mean[node] == pytest.approx(np.log(around.mean()))
    blocks, seen, over = topology.stars.blocks, 0, 0
    for block, first in enumerate(found.first):
        n = blocks.degree[block]
        for k in range(n):
            for lane in range(blocks.filled[block]):
                ring = blocks.rings[blocks.offset[block] :]
                i, j = (n - 1 if k == 0 else k - 1), k
                corners = np.array(
                    [blocks.centre[block * LANES + lane], ring[i * LANES + lane], ring[j * LANES + lane]]
                )
                at = first + k * LANES + lane
                low, high = found.low[at], found.high[at]
                if not kept[corners].all():
                    assert (low, high) == bands.ends_of(found, at, 0.0, 1.0) == (-np.inf, np.inf)
                    continue
                own = doubles(points, corners)
                goal = own * (np.exp(log_mean[corners].mean()) / own) ** blend
                least, most = min(own, goal) / room, max(own, goal) * room
                assert low == pytest.approx((1 - AREA) * least)
                assert high == pytest.approx((1 + AREA) * most)
                seen += 1
                on_wall = corners[wall[corners]]
                if len(on_wall) != 2:
                    assert found.edge[at] == bands.NOWHERE
                    continue
                length, calm = np.linalg.norm(np.diff(points[on_wall], axis=0)), firm[on_wall].min() * (1.0 - blend)
                shallow = (1 - AREA) * ((1 - HEIGHT) / (1 - AREA)) ** calm * least
                tall = (1 + AREA) * ((1 + HEIGHT) / (1 + AREA)) ** calm * most
                assert (found.least[at], found.most[at]) == pytest.approx((shallow / length, tall / length))
                if wall[corners[0]]:
                    assert wall[corners[found.edge[at] - 1]]
                    assert bands.ends_of(found, at, 0.0, length) == (low, high)
                    continue
                assert found.edge[at] == bands.OPPOSITE
                for longer in (0.95, 1.0, 1.05):
                    ends = max(low, longer * shallow), min(high, longer * tall)
                    assert bands.ends_of(found, at, 0.0, longer * length) == pytest.approx(ends)
                over += 1
    assert seen > 300
    assert over > 30


@pytest.mark.parametrize("cells", ["quad", "mixed"])
def test_a_quad_has_a_band_for_its_area_and_one_for_each_height_over_its_edges_on_a_wall(cells):
    mesh = gmsnet.generate.random_quad_mesh(150, cells=cells, seed=4)
    topology = Topology.of(mesh)
    points = planar_points(mesh)[topology.memory]
    everywhere, firm = np.ones(len(points), dtype=bool), np.zeros(len(points))
    firm[: len(points) // 3] = 1.0
    found, _ = limited(points, topology, everywhere, firm)
    quads = topology.places[topology.quads]
    whole = {tuple(np.roll(quad, -k).tolist()) for quad in quads for k in range(4)}
    blocks, places = topology.stars.blocks, Counter()
    for block, first in enumerate(found.first):
        n = blocks.degree[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        for k in range(count_of(pattern, n)):
            (i, j), ring = pair_of(pattern, n, k), blocks.rings[blocks.offset[block] :]
            other = other_of(pattern, k, i)
            if other == i:
                continue
            for lane in range(blocks.filled[block]):
                c = blocks.centre[block * LANES + lane]
                a, b, o = (ring[row * LANES + lane] for row in (i, j, other))
                at = first + k * LANES + lane
                own = (c, a, o, b) in whole or (c, b, o, a) in whole
                d, rest = doubles(points, np.array([[c, a, b], [o, b, a]]))
                if own:
                    assert (found.low[at], found.high[at]) == pytest.approx(
                        ((1 - AREA) * (d + rest), (1 + AREA) * (d + rest))
                    )
                    low, high = bands.ends_of(found, at, rest, 1.0)
                    assert (low, high) == pytest.approx((found.low[at] - rest, found.high[at] - rest))
                else:
                    assert (found.low[at], found.high[at]) == (-np.inf, np.inf)
                sides = {(c, a), (c, b)} if own else {(c, a), (a, b)} if (c, a, b, o) in whole else {(c, b), (a, b)}
                on_wall = [side for side in sides if firm[list(side)].all() and firm[[a, b, c]].sum() == 2.0]
                assert (found.edge[at] != bands.NOWHERE) == (len(on_wall) == 1)
                places[own, int(found.edge[at])] += 1
                if on_wall:
                    length = np.linalg.norm(points[on_wall[0][0]] - points[on_wall[0][1]])
                    ends = (1 - HEIGHT) * d / length, (1 + HEIGHT) * d / length
                    assert (found.least[at], found.most[at]) == pytest.approx(ends)
    assert set(places) == {(own, edge) for own in (True, False) for edge in range(4)} - {(True, bands.OPPOSITE)}


@given(seed=st.integers(0, 2**32 - 1), reach=st.sampled_from([1e-3, 0.03, 0.3, 10.0]))
def test_what_is_left_of_a_shift_ends_where_a_band_does_or_is_whole(seed, reach):
    rng = np.random.default_rng(seed)
    p, q = rng.normal(size=(2, 2))
    if p[0] * q[1] - p[1] * q[0] < 0:
        p, q = q, p
    d = p[0] * q[1] - p[1] * q[0]
    low, high = d * rng.uniform(0.5, 1.0), d * rng.uniform(1.0, 2.0)
    dx, dy = reach * rng.normal(size=2)
    share = bands.share_inside(low, high, *p, *q, dx, dy)
    there = (p[0] - share * dx) * (q[1] - share * dy) - (p[1] - share * dy) * (q[0] - share * dx)
    assert 0.0 <= share <= 1.0
    assert low - 1e-9 * d <= there <= high + 1e-9 * d
    assert share == 1.0 or min(abs(there - low), abs(there - high)) <= 1e-9 * max(high, 1.0)


def test_what_is_outside_of_its_band_may_go_back_only():
    for d, slope_to_band in ((0.5, 1.0), (2.0, -1.0)):  # D is p × q = d, and rises by dy·(…)
        p, q = (1.0, 0.0), (0.0, d)
        back, away = -0.1 * slope_to_band, 0.1 * slope_to_band
        shares = [bands.share_inside(0.9, 1.1, *p, *q, dx, 0.0) for dx in (back, away)]
        assert sorted(shares) == [0.0, 1.0]


def test_without_a_band_all_passes_and_so_does_what_is_not_finite():
    assert bands.share_inside(-np.inf, np.inf, 1.0, 0.0, 0.0, 1.0, 50.0, 0.0) == 1.0
    assert bands.share_inside(0.9, 1.1, 1.0, 0.0, 0.0, 1.0, np.nan, 0.0) == 1.0


def test_nodes_that_do_not_slide_keep_their_shifts():
    mesh = gmsnet.random_mesh(60, seed=0)
    topology = Topology.of(mesh)
    points = planar_points(mesh)[topology.memory]
    everywhere = np.ones(len(points), dtype=bool)
    found, _ = limited(points, topology, everywhere, np.zeros(len(points)))
    blocks = topology.stars.blocks
    room, shift = stars.workspace_for(blocks.most), np.full(2 * LANES, 0.3)
    stars.fetch(points, blocks, 0, room, np.empty(2 * blocks.most * LANES))
    bands.shorten(found, None, blocks, 0, room.star, room.work[:LANES], shift)
    assert (shift == 0.3).all()
