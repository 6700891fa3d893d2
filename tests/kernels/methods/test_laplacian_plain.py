"""The plain Laplacian: the mean of the ring as exact as coordinates are, whatever the guard makes of it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from support.one_block import visited
from support.random_stars import star

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import laplacian_plain
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.guard import MeshGuard, Precision, StarGuard, plain_guard


def exact_mean(ring):
    return [sum(Fraction(float(v)) for v in column) / len(ring) for column in ring.T]


def around_their_means(rng, degree, count, scale, offset):
    """Stars whose means keep all triangles positive, beside others of which that is not known."""
    stars = [star(rng, degree, scale, offset) for _ in range(count)]
    return [(ring.mean(axis=0) + 0.05 * scale * rng.normal(size=2), ring) for _, ring in stars]


def is_safe(centre, ring):
    """Do all triangles around the centre have a doubled area that is clearly positive?"""
    spokes = ring - centre
    before = np.roll(spokes, 1, axis=0)
    return (before[:, 0] * spokes[:, 1] - before[:, 1] * spokes[:, 0]).min() > 1e-2 * np.abs(spokes).max() ** 2


@pytest.mark.parametrize("degree", [3, 4, 5, 6, 7, 8, 13, 40])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (1.0, 1e3), (1e-3, 1e5)])
def test_nodes_go_to_the_mean_of_their_ring_within_two_units_of_rounding(degree, scale, offset):
    rng = np.random.default_rng(degree)
    stars = around_their_means(rng, degree, LANES - 5, scale, offset)
    moved, tally = visited(laplacian_plain.sweep, stars)
    safe = [is_safe(ring.mean(axis=0), ring) for _, ring in stars]
    assert sum(safe) > (0 if degree == 40 else 5)
    for (_, ring), place, sure in zip(stars, moved, safe, strict=True):
        if sure:
            for found, wanted, column in zip(place.tolist(), exact_mean(ring), ring.T, strict=True):
                unit = np.spacing(abs(found)) + degree * np.finfo(float).eps * np.ptp(column)
                assert abs(Fraction(found) - wanted) <= 2 * Fraction(unit)
    assert tally[MOVED] + tally[DROPPED] == len(stars)


@pytest.mark.parametrize("level", ["valid", "worst", "star"])
def test_a_block_with_a_star_that_is_held_back_moves_the_others_to_the_same_bits(level):
    """What is made for a block that has one, or for a level, changes no bit of a target."""
    rng = np.random.default_rng(0)
    stars = [s for s in around_their_means(rng, 6, 60, 1.0, 3.0) if is_safe(s[1].mean(axis=0), s[1])][:20]
    assert len(stars) == 20
    alone, _ = visited(laplacian_plain.sweep, stars)
    arrow = np.array([(0.0, 0.0), (3.0, -1.0), (0.2, 0.0), (3.0, 1.0), (0.1, 0.1), (0.0, 0.1)])
    assert not is_safe(arrow.mean(axis=0), arrow)  # the mean lies outside of it
    stars.append((np.array([0.1, 0.05]), arrow))
    floors = np.full(500, -np.inf)
    guard = {
        "valid": plain_guard(),
        "worst": MeshGuard(*Precision(), 1e-6),
        "star": StarGuard(*plain_guard(), floors),
    }[level]
    together, tally = visited(laplacian_plain.sweep, stars, guard=guard)
    np.testing.assert_array_equal(together[:20], alone)
    assert tally[TRUNCATED] + tally[DROPPED] == 1


def test_where_the_file_keeps_single_precision_targets_do_too():
    rng = np.random.default_rng(1)
    given = around_their_means(rng, 6, 40, 1.0, 2.0)
    stars = [(np.float64(np.float32(centre)), np.float64(np.float32(ring))) for centre, ring in given]
    moved, tally = visited(laplacian_plain.sweep, stars, guard=plain_guard(Precision(2.0**-24, 2.0**-150, single=True)))
    np.testing.assert_array_equal(moved, np.float64(np.float32(moved)))
    assert tally[MOVED] > 10


def test_a_star_at_its_mean_counts_neither_as_moved_nor_as_held_back():
    ring = np.array([(1.0, 0.0), (0.5, 0.875), (-0.5, 0.875), (-1.0, 0.0), (-0.5, -0.875), (0.5, -0.875)])
    for floor, wanted in ((-np.inf, [1, 0, 0]), (0.28867, [0, 0, 1])):  # the latter is above what any star here has
        stars = [(np.zeros(2), ring), (np.array([0.125, 0.0]), 0.5 * ring + 0.25 * ring[:1])]
        moved, tally = visited(laplacian_plain.sweep, stars, guard=MeshGuard(*Precision(), floor))
        assert (moved[0] == 0).all()
        assert tally.tolist() == wanted
