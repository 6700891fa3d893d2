"""The floor of the guard's level WORST: a bound of the worst cell, whatever is looked at."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

import gmsnet
from gmsnet.kernels.guard import Precision
from gmsnet.methods import floor as module
from gmsnet.methods.floor import Floor
from gmsnet.topology import Topology, near_points
from gmsnet.workers import serial

HELD_BACK, ALL_MOVED = np.array([9, 1, 0]), np.array([10, 0, 0])


class Looks:
    """A floor on a mesh of its own, and how many blocks each look took in."""

    def __init__(self, monkeypatch):
        mesh = gmsnet.random_mesh(6000, seed=1)
        self.topology, self.floor, self.blocks = Topology.of(mesh), Floor(), []
        self.points, original = near_points(mesh, self.topology), module.most_ratios

        def counted(points, triangles, turn, blocks, *others):
            self.blocks.append(len(blocks))
            original(points, triangles, turn, blocks, *others)

        monkeypatch.setattr(module, "most_ratios", counted)

    def look(self, tally=None):
        found = self.floor.of(self.points, self.topology, Precision(), serial)
        if tally is not None:
            self.floor.swept(tally)
        return found


@pytest.fixture
def looks(monkeypatch):
    return Looks(monkeypatch)


def worst(points, triangles, turn):
    """The least D/L, exactly."""
    least = Fraction(1)
    for t, sign in zip(triangles, turn, strict=True):
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in points[i].tolist()] for i in t)
        doubled = int(sign) * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
        lengths = (bx - ax) ** 2 + (by - ay) ** 2 + (cx - bx) ** 2 + (cy - by) ** 2 + (ax - cx) ** 2 + (ay - cy) ** 2
        least = min(least, doubled / lengths)
    return least


def test_it_is_never_below_the_worst_cell_and_next_to_it_after_a_look_at_all(looks):
    triangles, turn = looks.topology.changeable
    random = np.random.default_rng(0)
    for number in range(5):
        found, least = looks.look(HELD_BACK), worst(looks.points, triangles, turn)
        assert Fraction(found) >= least
        if number in (0, 3):  # looks at all
            assert found == pytest.approx(float(least), rel=1e-9)
        free = looks.topology.near_free
        looks.points[free] += random.normal(scale=1e-3, size=(free.sum(), 2))


def test_all_are_looked_at_again_only_where_stars_were_held_back(looks):
    count = math.ceil(len(looks.topology.changeable[0]) / module.LANES)
    for tally in [ALL_MOVED] * 6:
        looks.look(tally)
    few = looks.blocks[1]
    assert looks.blocks == [count, *[few] * 5]
    assert few == max(Floor.FEWEST, count // Floor.SHARE) < count
    looks.look(HELD_BACK)
    looks.look(ALL_MOVED)
    assert looks.blocks[6:] == [few, count]  # at once, for LOOKS have passed
    for tally in [HELD_BACK, ALL_MOVED, ALL_MOVED, ALL_MOVED]:
        looks.look(tally)
    assert looks.blocks[8:] == [few, few, count, few]


def test_a_method_that_does_not_tell_what_a_sweep_did_counts_as_held_back(looks):
    for _ in range(2 * Floor.LOOKS + 1):
        looks.look()
    count = looks.blocks[0]
    assert [blocks == count for blocks in looks.blocks] == [True, *[False] * (Floor.LOOKS - 1)] * 2 + [True]


def test_the_worst_cells_that_a_method_names_are_looked_at_from_then_on(looks):
    triangles, _ = looks.topology.changeable
    cells = np.array([0, 1, 64, 640, len(triangles) - 1], dtype=np.int32)
    looks.floor.watch(cells, np.linspace(0.1, 0.5, len(cells)))
    looks.look(ALL_MOVED)
    assert looks.blocks == [len(np.unique(cells // module.LANES))]
