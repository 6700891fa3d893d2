"""Which of two meshes is nearer to a target."""

from __future__ import annotations

import itertools
import math

import pytest

from gmsnet.measure.target import HALF, MUCH, SLIVER, Nearness, Target

NEARER = [  # each is nearer than all behind it
    Nearness(0, 0, math.inf, 0.9),
    Nearness(0, 3, 0.4, 0.4),
    Nearness(0, 3, 0.3, 0.3),
    Nearness(0, 900, 0.2, 0.13),
    Nearness(0, 3, 0.12, 0.12),
    Nearness(0, 4, 0.12, 0.12),
    Nearness(0, 2, 0.02, 0.02),
    Nearness(0, 1, 0.0, 0.0),
    Nearness(1, 1, -0.1, -0.1),
    Nearness(1, 5, -0.1, -0.1),
    Nearness(2, 2, 0.1, 0.3),
]


@pytest.mark.parametrize(("one", "other"), list(itertools.combinations(NEARER, 2)))
def test_fewest_inverted_then_fewest_that_miss_it_then_the_worst_but_no_sliver(one, other):
    assert one < other
    assert not other < one
    assert one <= other
    assert not other <= one


def test_equal_ones_and_the_bounds():
    one = Nearness(0, 7, 0.1, 0.1)
    assert one <= one
    assert not one < one
    assert Nearness(0, 0, math.inf, 0.1) < Nearness(0, 1, 0.5, 0.5), "one that meets it is nearer"
    assert Nearness(0, 9, 0.2, SLIVER) < Nearness(0, 1, 0.2, 0.999 * SLIVER), "no sliver"
    assert Nearness(0, 9, 0.1, SLIVER / MUCH) < Nearness(0, 1, 0.1, 0.999 * SLIVER / MUCH), "a thicker one"
    nothing = Nearness.of(Target(0.5), 0, 3, 0.1, None)
    assert nothing <= nothing
    assert not nothing < nothing


def test_of_two_that_miss_it_alike_the_one_with_the_better_mean_is_nearer():
    one, other = Nearness(0, 3, 0.2, 0.3, 0.8), Nearness(0, 3, 0.2, 0.3, 0.7)
    assert one < other
    assert Nearness(0, 0, math.inf, 0.4, 0.7) <= Nearness(0, 0, math.inf, 0.5, 0.8), "one that meets it is enough"


def test_a_sliver_has_less_than_half_of_what_is_asked_for():
    assert Target(0.1).sliver == SLIVER
    assert Target(0.9).sliver == HALF * 0.9
    assert SLIVER < Target(angle=20.0).sliver < Target(angle=40.0).sliver < HALF
    assert SLIVER < Target(dihedral=20.0).sliver < Target(dihedral=50.0).sliver < HALF
    assert Target(dihedral=90.0).sliver == HALF, "no tetrahedron has such angles"
    assert Nearness(0, 9, 0.5, 0.5, sliver=0.45) < Nearness(0, 1, 0.3, 0.3, sliver=0.45)
