"""The best apex over several held edges at once: where discs over them meet (proof: gmsnet.measure.bounds.bounds).

An apex makes 1/q ≥ t with an edge of length c if it lies in the disc of the radius √3c/2·√(1/t² − 1) whose centre is
√3c/2t above the edge's middle. Sets of edges are given as middle (G, m, 2) and upright (G, m, 2), the vector to the
left of each edge that is as long as it.

Over k edges, ``best_apex`` takes k³ steps, so it is for few. Over many, ``best_apex_of_many`` solves for at most
``FEW`` of them at a time. The largest t of some edges of a set is never below that of all: what comes out is an upper
bound, however early it stops. Superlevel sets of 1/q are discs, which are convex, so three edges decide (Helly), and
most often the exact t is found (a cutting-plane method: the edge that is worst at the best place so far is added).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

ROOT3 = math.sqrt(3.0)
LEAST = 1e-4  # a smaller t is given as this one
BISECTIONS = 40
FEW = 6  # edges at most, over which all pairs of discs are looked at
ROUNDS = 20  # places at most that are tried over more edges than that
CLOSE = 1e-7  # so near to each other, an upper and a lower bound of t are one
SLACK = 1e-9  # of the sizes of discs, for rounding


def best_apex(middle: Floats, upright: Floats) -> Floats:
    """(G,) the largest t for which one apex makes 1/q ≥ t with all edges of a set, from above."""
    return best_apex_and_place(middle, upright)[0]


def best_apex_and_place(middle: Floats, upright: Floats) -> tuple[Floats, Floats]:
    """And a place (G, 2) of the apex that comes as near to it as bisection does; nan where t is below ``LEAST``."""
    low, high = np.full(len(middle), LEAST), np.ones(len(middle))
    some, place = common_point(middle, upright, low)
    all_of_it, best = common_point(middle, upright, high)
    for _ in range(BISECTIONS):
        t = 0.5 * (low + high)
        met, there = common_point(middle, upright, t)
        low, high, place = np.where(met, t, low), np.where(met, high, t), np.where(met[:, None], there, place)
    return np.where(all_of_it, 1.0, np.where(some, high, LEAST)), np.where(all_of_it[:, None], best, place)


def best_apex_of_many(middle: Floats, upright: Floats, first: Places, below: float) -> Floats:
    """(G,) upper bounds of what ``best_apex`` says of sets of any numbers of edges; 1 for t of ``below`` or more.

    middle, upright: (E, 2), those of set g are first[g] : first[g + 1], at least one. Work is E·ROUNDS at most. What is
    given up: after ROUNDS places, the bound of the edges looked at so far stands, though that of all may be tighter.
    """
    upper = np.ones(len(first) - 1)
    count = np.diff(first)
    place = np.add.reduceat(middle, first[:-1], axis=0) / count[:, None]
    chosen = np.empty((len(upper), 0), dtype=np.intp)  # the edges that are solved for
    going = np.arange(len(upper))
    for _ in range(ROUNDS):
        edges = np.repeat(first[going] - starts(count[going])[:-1], count[going]) + np.arange(count[going].sum())
        ratio = shape_with(middle[edges], upright[edges], np.repeat(place, count[going], axis=0))
        begin = starts(count[going])[:-1]
        lower = np.minimum.reduceat(ratio, begin)
        at_least = np.flatnonzero(ratio == np.repeat(lower, count[going]))
        worst = edges[at_least[np.searchsorted(at_least, begin)]]
        upper[going[lower >= below]] = 1.0
        on = (lower < below) & (lower < upper[going] - CLOSE) & ~(chosen == worst[:, None]).any(axis=1)
        going, place, chosen = going[on], place[on], np.column_stack([chosen, worst])[on]
        if not len(going):
            break
        if chosen.shape[1] > FEW:  # the one that matters the least gives way
            ratio = shape_with(middle[chosen], upright[chosen], place[:, None])
            away = np.argmax(ratio, axis=1)[:, None] == np.arange(FEW + 1)
            chosen = chosen[~away].reshape(-1, FEW)
        t, place = best_apex_and_place(middle[chosen], upright[chosen])
        upper[going] = np.minimum(upper[going], t)
        known = np.isfinite(place).all(axis=1)
        going, place, chosen = going[known], place[known], chosen[known]
        if not len(going):
            break
    return upper


def shape_with(middle: Floats, upright: Floats, apex: Floats) -> Floats:
    """1/q of the triangles over edges (…, 2) with an apex (…, 2): 2√3·D/L; infinite over edges of no length."""
    away = apex - middle
    length = (upright * upright).sum(axis=-1)
    double, squares = (away * upright).sum(axis=-1), 2.0 * (away * away).sum(axis=-1) + 1.5 * length
    ratio: Floats = np.divide(2.0 * ROOT3 * double, squares, out=np.full(squares.shape, np.inf), where=length > 0.0)
    return ratio


def starts(count: Places) -> Places:
    """(G + 1,) where each of the groups of so many begins."""
    return np.concatenate([[0], np.cumsum(count, dtype=np.intp)])


def meet(middle: Floats, upright: Floats, t: Floats) -> Flags:
    """(G,) have the discs of all edges of a set a point in common at its t?"""
    return common_point(middle, upright, t)[0]


def common_point(middle: Floats, upright: Floats, t: Floats) -> tuple[Flags, Floats]:
    """(G,) bool, have the discs of all edges of a set a point in common at its t, and one (G, 2), nan where not.

    One that two circles share, or a centre: one of them lies in all discs if any point does.
    """
    count = middle.shape[1]
    length = np.hypot(upright[..., 0], upright[..., 1])
    centre = middle + (0.5 * ROOT3 / t)[:, None, None] * upright
    radius = (0.5 * ROOT3 * np.sqrt(np.maximum(1.0 / (t * t) - 1.0, 0.0)))[:, None] * length
    workspace = SLACK * length.max(axis=1, initial=0.0)
    reach = radius * (1.0 + SLACK) + workspace[:, None]

    def inside(place: Floats) -> Flags:
        """Does a point (G, 2) lie in all discs, but for rounding?"""
        away = place[:, None] - centre
        held: Flags = (np.hypot(away[..., 0], away[..., 1]) <= reach).all(axis=1)
        return held

    common, apart = np.zeros(len(middle), dtype=bool), np.zeros(len(middle), dtype=bool)
    found = np.full((len(middle), 2), np.nan)

    def try_at(place: Floats, where: Flags | bool = True) -> None:
        """Note where a place lies in all discs."""
        good = where & inside(place)
        found[good] = place[good]
        common[good] = True

    for m in range(count):
        try_at(centre[:, m])
    for m in range(count):
        for k in range(m):
            r, s, between = radius[:, m], radius[:, k], centre[:, k] - centre[:, m]
            d = np.hypot(between[:, 0], between[:, 1])
            apart |= d > (r + s) * (1.0 + SLACK) + workspace
            crossing = (d > np.abs(r - s)) & (d > 0.0)  # else one lies in the other
            d = np.where(crossing, d, 1.0)
            along = 0.5 * (d + (r - s) * (r + s) / d)
            across = np.sqrt(np.maximum(r * r - along * along, 0.0))
            unit = between / d[:, None]
            foot, side = centre[:, m] + along[:, None] * unit, across[:, None] * unit[:, ::-1] * (-1.0, 1.0)
            try_at(foot + side, crossing)
            try_at(foot - side, crossing)
    return common & ~apart, found
