"""The best apex over several held edges at once: where discs over them meet (proof: gmsnet.measure.bounds.bounds).

An apex makes 1/q ≥ t with an edge of length c if it lies in the disc of the radius √3c/2·√(1/t² − 1) whose centre is
√3c/2t above the edge's middle. Sets of edges are given as middle (G, m, 2) and upright (G, m, 2), the vector to the
left of each edge that is as long as it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROOT3 = math.sqrt(3.0)
LEAST = 1e-4  # a smaller t is given as this one
BISECTIONS = 40
SLACK = 1e-9  # of the sizes of discs, for rounding


def best_apex(middle: Floats, upright: Floats) -> Floats:
    """(G,) the largest t for which one apex makes 1/q ≥ t with all edges of a set, from above."""
    low, high = np.full(len(middle), LEAST), np.ones(len(middle))
    none, all_of_it = ~meet(middle, upright, low), meet(middle, upright, high)
    for _ in range(BISECTIONS):
        t = 0.5 * (low + high)
        met = meet(middle, upright, t)
        low, high = np.where(met, t, low), np.where(met, high, t)
    return np.where(all_of_it, 1.0, np.where(none, LEAST, high))


def meet(middle: Floats, upright: Floats, t: Floats) -> Flags:
    """(G,) have the discs of all edges of a set a point in common at its t? One that two circles share, or a centre."""
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
    for m in range(count):
        common |= inside(centre[:, m])
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
            common |= crossing & (inside(foot + side) | inside(foot - side))
    return common & ~apart
