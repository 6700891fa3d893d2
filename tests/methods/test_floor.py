"""The floor of the guard's level WORST: a bound of the worst cell, whatever is looked at."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

import gmsnet
from gmsnet.kernels.star.guard import Precision
from gmsnet.methods import floor as module
from gmsnet.methods.floor import Floor
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

HELD_BACK, ALL_MOVED = np.array([9, 1, 0]), np.array([10, 0, 0])


class Looks:
    """A floor on a mesh of its own, and how many blocks each look took in."""

    def __init__(self, monkeypatch):
        mesh = gmsnet.random_mesh(6000, seed=1)
        self.topology, self.floor, self.blocks = Topology.of(mesh), Floor(), []
        self.points, original = near_points(mesh, self.topology), module.ratio_upper_bounds

        def counted(points, simplices, blocks, *others):
            self.blocks.append(len(blocks))
            original(points, simplices, blocks, *others)

        monkeypatch.setattr(module, "ratio_upper_bounds", counted)

    def look(self, tally=None):
        found = self.floor.of(self.points, self.topology, Precision(), serial)
        if tally is not None:
            self.floor.swept(tally)
        return found


@pytest.fixture
def looks(monkeypatch):
    return Looks(monkeypatch)


def worst(points, triangles, orientation):
    """The minimum D/L, exactly."""
    least = Fraction(1)
    for t, sign in zip(triangles, orientation, strict=True):
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in points[i].tolist()] for i in t)
        doubled = int(sign) * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
        lengths = (bx - ax) ** 2 + (by - ay) ** 2 + (cx - bx) ** 2 + (cy - by) ** 2 + (ax - cx) ** 2 + (ay - cy) ** 2
        least = min(least, doubled / lengths)
    return least


def test_it_is_never_below_the_worst_cell_and_next_to_it_after_a_look_at_all(looks):
    triangles, orientation, *_ = looks.topology.changeable
    random = np.random.default_rng(0)
    for number in range(5):
        found, least = looks.look(HELD_BACK), worst(looks.points, triangles, orientation)
        assert Fraction(found) >= least
        if number in (0, 3):  # looks at all
            assert found == pytest.approx(float(least), rel=1e-9)
        free = looks.topology.near_free
        looks.points[free] += random.normal(scale=1e-3, size=(free.sum(), 2))


def test_all_are_looked_at_again_only_where_stars_were_held_back(looks):
    count = math.ceil(len(looks.topology.changeable.rows) / module.LANES)
    for tally in [ALL_MOVED] * 6:
        looks.look(tally)
    few = looks.blocks[1]
    assert looks.blocks == [count, *[few] * 5]
    assert few == max(Floor.FEWEST, count // Floor.SHARE) < count
    looks.look(HELD_BACK)
    looks.look(ALL_MOVED)
    assert looks.blocks[6:] == [few, count]  # at once, for LOOKS have passed
    for tally in [HELD_BACK, *[ALL_MOVED] * 6]:
        looks.look(tally)
    assert looks.blocks[8:] == [*[few] * 5, count, few]  # twice as many, for the worst was where it was looked for


def at_all(looks):
    """The numbers of the looks at all."""
    return [number for number, blocks in enumerate(looks.blocks) if blocks == looks.blocks[0]]


def test_the_longer_the_worst_stays_where_it_is_looked_for_the_rarer_are_looks_at_all(looks):
    for _ in range(46):
        looks.look(HELD_BACK)
    assert Floor.LOOKS == 3
    assert Floor.MOST_LOOKS == 12
    assert at_all(looks) == [0, 3, 9, 21, 33, 45]


def test_a_worst_cell_that_was_overlooked_makes_looks_at_all_as_frequent_as_at_first(looks):
    for _ in range(20):
        looks.look(HELD_BACK)
    triangles = looks.topology.changeable.rows
    elsewhere = np.setdiff1d(np.arange(len(triangles) // module.LANES), looks.floor.blocks)
    free = looks.topology.near_free[triangles]
    cell = next(t for t in elsewhere * module.LANES if free[t].any())
    corner = int(np.argmax(free[cell]))
    a, b, c = (looks.points[triangles[cell, (corner + k) % 3]] for k in range(3))
    a[:] = 4 * ((b + c) / 2) - 3 * a  # over the opposite side: inverted, and far the worst
    for _ in range(8):
        looks.look(HELD_BACK)
    assert at_all(looks) == [0, 3, 9, 21, 24]


def test_a_method_that_does_not_tell_what_a_sweep_did_counts_as_held_back(looks):
    for _ in range(10):
        looks.look()
    assert at_all(looks) == [0, 3, 9]


def test_the_worst_cells_that_a_method_names_are_looked_at_from_then_on(looks):
    triangles = looks.topology.changeable.rows
    cells = np.array([0, 1, 64, 640, len(triangles) - 1], dtype=np.int32)
    looks.floor.watch(cells, np.linspace(0.1, 0.5, len(cells)))
    looks.look(ALL_MOVED)
    assert looks.blocks == [len(np.unique(cells // module.LANES))]
