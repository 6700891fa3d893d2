"""Turned parts for tests: surfaces of revolution with planes, cylinders, cones and tori, which are known exactly."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from support.surface_meshes import surface_mesh
from support.surfaces import turned

EDGE, FEWEST, MOST_TURN = 0.26, 16, math.radians(20)
PARTS = ("filleted", "frustum", "cup", "stepped", "spindle")


class Piece(NamedTuple):
    """Of a profile, in the half plane of radius and height: a line from one end to the other, or around a centre."""

    start: tuple[float, float]
    end: tuple[float, float]
    centre: tuple[float, float] | None = None

    def at(self, share):
        """(K, 2) places, by shares (K,) of the way."""
        share, start, end = share[:, None], np.array(self.start), np.array(self.end)
        if self.centre is None:
            return start + share * (end - start)
        (r, first), turn = self._polar
        angle = first + share[:, 0] * turn
        return self.centre + r * np.column_stack([np.cos(angle), np.sin(angle)])

    @property
    def rows(self):
        """Into how many rows of facets it is cut."""
        if self.centre is None:
            return max(1, round(math.dist(self.start, self.end) / EDGE))
        (r, _), turn = self._polar
        return max(math.ceil(abs(turn) / MOST_TURN), round(abs(turn) * r / EDGE))

    def away(self, places):
        """(K,) how far places (K, 2) are from the whole line or circle."""
        if self.centre is not None:
            return abs(np.linalg.norm(places - self.centre, axis=1) - self._polar[0][0])
        way = np.subtract(self.end, self.start) / math.dist(self.start, self.end)
        return abs((places - self.start) @ [-way[1], way[0]])

    @property
    def is_plane(self):
        return self.centre is None and self.start[1] == self.end[1]

    @property
    def _polar(self):
        first, last = (np.subtract(place, self.centre) for place in (self.start, self.end))
        turn = math.atan2(first[0] * last[1] - first[1] * last[0], first @ last)
        return (math.hypot(*first), math.atan2(first[1], first[0])), turn


class Turned(NamedTuple):
    """mesh. of: (N, 2) the pieces of each node, the same one twice inside of it. groups: (P,) the number of each piece,
    equal where pieces meet smoothly. pieces; tips: nodes. back: points of the mesh → (K, 2) radius and height."""

    mesh: object
    of: np.ndarray
    groups: np.ndarray
    pieces: list
    tips: list
    back: object


def profile(name, rng):
    """Pieces from the axis to the axis, and where one goes on smoothly into the next."""
    u = rng.uniform
    if name == "filleted":
        h, a = u(0.4, 1.0), u(0.2, 0.5)
        corners = [(0, 0), (1, 0), (1, h), (1 - a, h + a), (0, h + a)]
        return _pieces(corners, {2: (1 - a, h)}), {1, 2}
    if name == "frustum":
        h, r = u(0.5, 1.5), u(0.3, 0.7)
        return _pieces([(0, 0), (1, 0), (r, h), (0, h)], {}), set()
    if name == "cup":
        h, a, tip = u(0.8, 1.2), u(0.15, 0.25), -u(0.6, 1.0)
        corners = [(0, tip), (1, 0), (1, h), (1 - 2 * a, h), (1 - 2 * a, 0.3), (0, 0.3)]
        halved = [*corners[:3], (1 - a, h + a), *corners[3:]]
        return _pieces(halved, {2: (1 - a, h), 3: (1 - a, h)}), {1, 2, 3}
    if name == "stepped":
        h, a, r = u(0.3, 0.6), u(0.2, 0.4), u(0.5, 0.8)
        top = h + a + u(0.3, 0.6)
        corners = [(0, 0), (1.5, 0), (1.5, h), (r + a, h), (r, h + a), (r, top), (0, top + r * u(0.65, 0.9))]
        return _pieces(corners, {3: (r + a, h + a)}), {2, 3}
    return _pieces([(0, -u(0.6, 2.5)), (1, 0), (0, u(0.6, 2.5))], {}), set()


def part(name, seed, thrown=0.3, scale=1.0, rotated=True):
    """One of PARTS, its nodes thrown along their pieces and its rims by so much of an edge."""
    rng = np.random.default_rng(seed)
    pieces, smooth = profile(name, rng)
    places, angles, of, rings = [], [], [], []
    for number, piece in enumerate(pieces):
        for k in range(piece.rows + 1):
            inside = 0 < k < piece.rows
            if k == 0 and number:
                continue
            ((radius, _),) = piece.at(np.array([k / piece.rows]))
            count = 1 if radius == 0 else max(FEWEST, round(2 * math.pi * radius / EDGE))
            throw = thrown * rng.uniform(-1, 1, (2, count))
            share = (k + (throw[0] if inside else np.zeros(count))) / piece.rows
            angle = (np.arange(count) + 0.5 * (len(rings) % 2) + throw[1]) * 2 * math.pi / count
            first = sum(map(len, angles))
            rings.append(np.arange(first, first + count))
            places.append(piece.at(share))
            angles.append(angle)
            after = number + 1 if k == piece.rows and number + 1 < len(pieces) else number
            of.append(np.tile([number, after], (count, 1)))
    (radius, height), angle = np.concatenate(places).T, np.concatenate(angles)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    rows = np.concatenate([_strip(*pair, angle) for pair in itertools.pairwise(rings)])
    matrix = turned(seed % 97) if rotated else np.eye(3)
    shift = scale * rng.uniform(-1, 1, 3)

    def back(found):
        flat = (found - shift) / scale @ matrix
        return np.column_stack([np.hypot(flat[:, 0], flat[:, 1]), flat[:, 2]])

    groups = np.cumsum([0, *(k not in smooth for k in range(len(pieces) - 1))])
    tips = [int(ring[0]) for ring, piece in ((rings[0], pieces[0]), (rings[-1], pieces[-1])) if not piece.is_plane]
    mesh = surface_mesh(scale * points @ matrix.T + shift, {"triangle": rows})
    return Turned(mesh, np.concatenate(of), groups, pieces, tips, back)


def _pieces(corners, centres):
    ends = itertools.pairwise(corners)
    return [Piece(a, b, centres.get(k)) for k, (a, b) in enumerate(ends)]


def _strip(inner, outer, angle):
    """The triangles between two rings of nodes, which go on where the next node comes first."""
    rows, i, j = [], 0, 0
    n, m = len(inner), len(outer)

    def turns(ring, k):
        return angle[ring[k % len(ring)]] + 2 * math.pi * (k // len(ring))

    while (i < n and n > 1) or (j < m and m > 1):
        ahead = n > 1 and i < n and (m == 1 or j == m or turns(inner, i + 1) < turns(outer, j + 1))
        here, there = inner[i % n], outer[j % m]
        rows.append([here, there, inner[(i + 1) % n]] if ahead else [here, there, outer[(j + 1) % m]])
        i, j = (i + 1, j) if ahead else (i, j + 1)
    return np.array(rows)
