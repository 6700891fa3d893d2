"""Boundaries made of curves, and nodes on them as close together as a size function asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.outline import area, polygon

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Size = Callable[[Floats], Floats]  # points (n × 2) → wanted length of an edge there (n,)

STEPS = 2000  # along a curve, for the integral of the size function


@dataclass(frozen=True, eq=False)
class Curve:
    """A part of the boundary: points (k × 2) joined by straight pieces, k ≥ 2, and the marker that it belongs to.

    Where the pieces bend, nodes need not stand on the bends; its two ends are always nodes. A curve whose end is its
    start is a ring of its own.
    """

    points: Floats
    marker: str


@dataclass(frozen=True)
class Boundary:
    """points: (B × 2). segments: (B × 2), the domain on their left. side: (B,) the straight piece that each segment is
    part of, a number of its own where it cuts a bend. markers: of each side."""

    points: Floats
    segments: Ints
    side: Ints
    markers: tuple[str, ...]


def boundary(rings: Sequence[Sequence[Curve]], size: Size) -> Boundary:
    """Nodes on rings of curves, the outer ring first and then its holes, in either direction.

    On each curve the nodes are evenly spaced in lengths of ``size``. Raises InputError where curves do not close a
    ring, and where rings of those nodes cross or do not lie inside the first one.
    """
    points: list[Floats] = []
    segments: list[Ints] = []
    side: list[int] = []
    markers: list[str] = []
    for index, ring in enumerate(rings):
        _check_closed(ring, index)
        corners: list[Floats] = []
        for curve in ring:
            nodes, piece = _divided(curve, size)
            corners.append(nodes)
            for k, p in enumerate(piece):
                if k == 0 or p < 0 or p != piece[k - 1]:
                    markers.append(curve.marker)
                side.append(len(markers) - 1)
        points.append(np.concatenate(corners))
        node = sum(map(len, points[:-1])) + np.arange(len(points[-1]))
        pairs = np.column_stack([node, np.roll(node, -1)])
        segments.append(pairs if (area(points[-1]) > 0) == (index == 0) else pairs[:, ::-1])
    polygon(points)  # what is wrong with the rings is said there
    return Boundary(np.concatenate(points), np.concatenate(segments), np.array(side, dtype=np.int64), tuple(markers))


def _check_closed(ring: Sequence[Curve], index: int) -> None:
    for k, curve in enumerate(ring):
        shape = np.shape(curve.points)
        if len(shape) != 2 or shape[1] != 2 or shape[0] < 2 or not np.isfinite(curve.points).all():
            raise InputError(f"the curve {curve.marker!r} must be an array of at least 2 finite points (k × 2)")
        if not (np.diff(curve.points, axis=0) != 0).any(axis=1).all():
            raise InputError(f"the curve {curve.marker!r} has the same point twice running; leave one out")
        following = ring[(k + 1) % len(ring)]
        if not np.allclose(curve.points[-1], following.points[0], rtol=0.0, atol=1e-9 * np.ptp(curve.points)):
            raise InputError(
                f"the ring {index} is not closed: the curve {curve.marker!r} ends at {curve.points[-1].tolist()}, "
                f"but {following.marker!r} starts at {following.points[0].tolist()}"
            )


def _divided(curve: Curve, size: Size) -> tuple[Floats, list[int]]:
    """Nodes on a curve but its end (n × 2), and the piece that the segment after each lies in, −1 where it bends."""
    lengths = np.linalg.norm(np.diff(curve.points, axis=0), axis=1)
    bends = np.append(0.0, np.cumsum(lengths))
    steps = np.unique(np.concatenate([bends, np.linspace(0.0, bends[-1], STEPS + 1)]))
    middle = _at(curve.points, bends, (steps[1:] + steps[:-1]) / 2)
    edges = np.append(0.0, np.cumsum(np.diff(steps) / size(middle)))  # how many edges up to there
    count = max(1, round(float(edges[-1])))
    place = np.interp(np.arange(count + 1) * (edges[-1] / count), edges, steps)
    first = np.searchsorted(bends, place[:-1], side="right") - 1
    last = np.searchsorted(bends, place[1:], side="left") - 1
    nodes = _at(curve.points, bends, place[:-1])
    nodes[0] = curve.points[0]
    return nodes, np.where(first == last, first, -1).tolist()


def _at(points: Floats, bends: Floats, place: Floats) -> Floats:
    """The points of a curve (n × 2) at these lengths along it (n,)."""
    return np.column_stack([np.interp(place, bends, points[:, axis]) for axis in range(2)])
