"""Objectives of stars in space, tetrahedron by tetrahedron, as they are defined."""

from __future__ import annotations

from itertools import combinations

import numpy as np

NAIVE = {"metric": lambda eta: 1 - eta, "q": lambda eta: 1 / eta, "q2": lambda eta: 1 / eta**2}


def shape(corners):
    """η of a tetrahedron (4, 3)."""
    volume = np.linalg.det(corners[1:] - corners[0]) / 6
    lengths = sum(np.sum((a - b) ** 2) for a, b in combinations(corners, 2))
    return np.sign(volume) * 12 * (3 * abs(volume)) ** (2 / 3) / lengths


def angles(corners):
    """The six dihedral angles in radians, each between the planes of two faces."""
    found = []
    for i, j in combinations(range(4), 2):
        k, m = (c for c in range(4) if c not in (i, j))
        edge = corners[j] - corners[i]
        first, second = np.cross(edge, corners[k] - corners[i]), np.cross(edge, corners[m] - corners[i])
        found.append(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
    return found


def value_of(name, ends, at, aim, scale):
    """The value of an objective and the least weighted angle. ends: (F, 3, 3)."""
    stars = [np.vstack([at, corners]) for corners in ends]
    if name in NAIVE:
        return sum(NAIVE[name](shape(corners)) for corners in stars), np.inf
    total, least = 0.0, np.inf
    for corners in stars:
        every = angles(corners) + ([aim.wide * (np.pi - angle) for angle in angles(corners)] if aim.wide else [])
        total += sum((scale / angle) ** (2**aim.doublings) for angle in every)
        least = min(least, *every)
        if aim.bound:
            total += (aim.bound / np.sqrt(shape(corners) ** 3 / 432)) ** 64
    return total, least
