"""Smooth curves through the nodes of chains: arcs that join with a common tangent, two for each edge (biarcs).

At each inner node the tangent is that of the circle through the node and its two neighbours. Over each edge stand two
arcs with these tangents at its ends (Bolton 1975, "Biarc curves", Computer-Aided Design 7), whose chords are equally
long. At an end of a chain the arc of its first or last edge is one arc. So a circle is reproduced to rounding however
its nodes lie on it, and a straight chain is a segment. The error on a smooth curve is of third order in the edges.

**Distance.** Let a, b be the angles between the tangents at the ends of an edge of length l and the edge, positive
where the curve leaves to the left; |a| ≤ |b| = β ≤ 90°. Then the curve over this edge is nowhere further from it than
(l/2)·tan(β/2): the sagitta of an arc on this edge that has the curvature 2 sin β/l of the sharper of the two circles
(docs/sliding.md has the proof). For nodes at which the chain turns by at most 90° all these angles are below 90°.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.features import Curves
from gmsnet.kernels.star import constraint as kernels

Floats = NDArray[np.float64]
Places = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class ArcSpline:
    """Curves made of arcs and segments, numbered as those that they were made for.

    first: (C + 1,); curve c has the pieces piece[first[c] : first[c + 1]]. piece: (P, 6): both ends of a piece, and the
    cosine and sine of the angle between its first tangent and its chord (kernels.star.arcs). closed: (C,) bool.
    per_edge: how many pieces stand over each edge of a curve that is no line.
    """

    first: NDArray[np.int64]
    piece: Floats
    closed: NDArray[np.bool_]
    per_edge: int = 2

    def project(self, entity: int, points: Floats) -> Places:
        """The places (K, 2) on a curve nearest to points (K, 2), and their parameters (K,): piece number plus t."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        parameters, places = np.zeros(len(points)), np.zeros((len(points), 2))
        kernels.project(self._pieces(entity), points, bool(self.closed[entity]), parameters, places)
        return places, parameters

    def tangent(self, entity: int, parameters: Floats) -> Floats:
        """The unit tangents (K, 2) of a curve at parameters (K,), in its direction."""
        out = np.zeros((len(parameters), 2))
        kernels.tangents(self._pieces(entity), np.asarray(parameters, dtype=np.float64), out)
        return out

    def _pieces(self, entity: int) -> Floats:
        return self.piece[self.first[entity] : self.first[entity + 1]]


def arc_spline(curves: Curves, points: Floats) -> ArcSpline:
    """The curves through points (N, 2): a segment from end to end for a straight one, else two arcs for each edge."""
    chains = [points[curves.nodes_of(c)] for c in range(len(curves))]
    ends = [chain[[0, -1]] if line else chain for chain, line in zip(chains, curves.straight, strict=True)]
    return through(ends, curves.closed, None)


def through(chains: list[Floats], closed: NDArray[np.bool_], tangent: list[Floats] | None) -> ArcSpline:
    """Arcs through chains of points (K, 2), K ≥ 2, no two in a row equal unless there are only two.

    tangent: of each chain (K, 2), in its direction; without, those of circles through three points. A chain of two
    points is one segment then. Tangents must be at most 90° off the way to the next point and from the last one.
    """
    sizes = np.array([len(chain) for chain in chains], dtype=np.int64)
    if tangent is None:
        found = [_circle_tangents(chain, ring) for chain, ring in zip(chains, closed.tolist(), strict=True)]
    else:
        found = [_edge_angles(chain, directions) for chain, directions in zip(chains, tangent, strict=True)]
    pieces = [
        _segment(chain) if size == 2 and tangent is None else _arcs(chain, *angles)
        for chain, size, angles in zip(chains, sizes.tolist(), found, strict=True)
    ]
    first = np.zeros(len(chains) + 1, dtype=np.int64)
    np.cumsum([len(piece) for piece in pieces], out=first[1:])
    return ArcSpline(first, np.concatenate([np.zeros((0, 6)), *pieces]), closed)


def _unit(v: Floats) -> Floats:
    """Vectors (K, 2) over their lengths, by operations that round alike everywhere; zero stays zero."""
    largest = abs(v).max(axis=1, keepdims=True, initial=0.0)
    v = v / np.where(largest > 0.0, largest, 1.0)
    length = np.sqrt(v[:, :1] * v[:, :1] + v[:, 1:] * v[:, 1:])
    return np.asarray(v / np.where(length > 0.0, length, 1.0))


def _times(p: Floats, q: Floats, conjugate: bool = False) -> Floats:
    """Products (K, 2) of complex numbers, q conjugate if asked for."""
    sign = -1.0 if conjugate else 1.0
    return np.column_stack(
        [p[:, 0] * q[:, 0] - sign * (p[:, 1] * q[:, 1]), p[:, 1] * q[:, 0] + sign * (p[:, 0] * q[:, 1])]
    )


def _half(e: Floats) -> Floats:
    """Unit complex numbers of half the angle, for angles between −180° and 180°."""
    return _unit(e + np.array([1.0, 0.0]))


def _circle_tangents(p: Floats, ring: bool) -> tuple[Floats, Floats]:
    """The angles a and b of each edge of a chain as unit complex numbers (K − 1, 2), with the tangents of circles.

    A circle through p, q, r has at q the direction of (q − p)/|q − p|² + (r − q)/|r − q|²: inverted at q it is a line.
    """
    edge = np.diff(p, axis=0)
    if len(edge) == 1:
        return np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]])
    way, length = _unit(edge), np.sqrt(edge[:, :1] * edge[:, :1] + edge[:, 1:] * edge[:, 1:])
    back, ahead = (np.roll(way, 1, axis=0), way) if ring else (way[:-1], way[1:])
    near, far = (np.roll(length, 1, axis=0), length) if ring else (length[:-1], length[1:])
    at = _unit(back * far + ahead * near)  # of the nodes that begin an edge: all if closed, else all but the first
    start, end = _times(at, ahead, conjugate=True), _times(back, at, conjugate=True)
    if ring:
        return start, np.roll(end, -1, axis=0)
    return np.vstack([end[:1], start]), np.vstack([end, start[-1:]])  # one arc at either end


def _edge_angles(p: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """The same for given tangents at the nodes."""
    way, at = _unit(np.diff(p, axis=0)), _unit(direction)
    return _times(at[:-1], way, conjugate=True), _times(way, at[1:], conjugate=True)


def _segment(p: Floats) -> Floats:
    return np.array([[*p[0], *p[1], 1.0, 0.0]])


def _arcs(p: Floats, a: Floats, b: Floats) -> Floats:
    """Two arcs for each edge. Where they join lies above its middle by (l/2)·tan((a + b)/4)."""
    quarter = _half(_times(_half(a), _half(b)))  # the angle (a + b)/4 between the edge and either chord
    half = 0.5 * np.diff(p, axis=0)
    lift = (quarter[:, 1] / quarter[:, 0])[:, None]
    joint = p[:-1] + half + lift * np.column_stack([-half[:, 1], half[:, 0]])
    pieces = np.empty((2 * len(half), 6))
    pieces[0::2], pieces[1::2] = (
        np.hstack([p[:-1], joint, _times(a, quarter, conjugate=True)]),
        np.hstack([joint, p[1:], _times(b, quarter, conjugate=True)]),
    )
    return pieces
