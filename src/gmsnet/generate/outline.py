"""The boundary of a random mesh: named shapes, polygons with holes, and the nodes on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Random = np.random.Generator | None  # None: even spacing


@dataclass(frozen=True)
class Ring:
    """A closed polygon of the boundary.

    corners: (k × 2), the inside of the domain on their left. markers: of the side that leaves each corner.
    divide: the sides get nodes of their own; the chords of a circle, which is sampled already, do not.
    """

    corners: Floats
    markers: tuple[str, ...]
    divide: bool = True


def _square(spacing: float, rng: Random) -> list[Ring]:
    return [Ring(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), ("bottom", "right", "top", "left"))]


def _round(radius: float, marker: str, spacing: float, rng: Random) -> Ring:
    count = max(3, round(2 * np.pi * radius / spacing))
    share = np.arange(count) / count if rng is None else np.sort(rng.random(count))
    angle = 2 * np.pi * share
    return Ring(0.5 + radius * np.column_stack([np.cos(angle), np.sin(angle)]), (marker,) * count, divide=False)


def _circle(spacing: float, rng: Random) -> list[Ring]:
    return [_round(0.5, "circle", spacing, rng)]


def _plate(spacing: float, rng: Random) -> list[Ring]:
    hole = _round(0.2, "hole", spacing, rng)
    return [*_square(spacing, rng), Ring(hole.corners[::-1].copy(), hole.markers, divide=False)]


def _lshape(spacing: float, rng: Random) -> list[Ring]:
    corners = np.array([[0.0, 0], [1, 0], [1, 0.5], [0.5, 0.5], [0.5, 1], [0, 1]])
    return [Ring(corners, ("bottom", "right", "notch", "notch", "top", "left"))]


# Name → its area in the unit square, and the rings for a mean spacing.
SHAPES: dict[str, tuple[float, Callable[[float, Random], list[Ring]]]] = {
    "square": (1.0, _square),
    "circle": (np.pi / 4, _circle),
    "plate": (1.0 - np.pi * 0.2**2, _plate),
    "lshape": (0.75, _lshape),
}


def polygon(given: Sequence[ArrayLike]) -> list[Ring]:
    """The rings of a polygon, the outer one first, checked, oriented and named. Raises InputError."""
    rings = [_ring(corners, "outer" if k == 0 else f"hole_{k}") for k, corners in enumerate(given)]
    if not rings:
        raise InputError("a polygon needs at least one ring")
    _check_simple(rings)
    for index, ring in enumerate(rings):
        around = [other for other in rings if other is not ring and inside(ring.corners[:1], *sides([other]))[0]]
        if around != ([] if index == 0 else rings[:1]):
            raise InputError(f"the ring {ring.markers[0]!r} must lie inside the first ring and inside no other one")
    return [  # the outer ring counter-clockwise, holes clockwise
        ring if (area(ring.corners) > 0) == (index == 0) else Ring(ring.corners[::-1].copy(), ring.markers)
        for index, ring in enumerate(rings)
    ]


def _ring(given: ArrayLike, name: str) -> Ring:
    try:
        corners = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"the ring {name!r} must be an array of corners (k × 2): {error}") from error
    if corners.ndim == 2 and len(corners) > 1 and (corners[0] == corners[-1]).all():
        corners = corners[:-1]  # the first corner repeated to close the ring
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
        raise InputError(f"the ring {name!r} must be an array of at least 3 finite corners (k × 2)")
    return Ring(corners, (name,) * len(corners))


def _check_simple(rings: Sequence[Ring]) -> None:
    """Raises InputError if two sides have a point in common that is not the corner which joins them."""
    start, end = sides(rings)
    first = np.cumsum([0] + [len(ring.corners) for ring in rings])
    following = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in pairwise(first.tolist())])
    low, high = np.minimum(start, end), np.maximum(start, end)

    def turn(a: Floats, b: Floats, c: Floats) -> Floats:
        return np.asarray(np.sign((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]))

    for k in range(len(start)):
        a, b, c, d = start[k], end[k], start[k + 1 :], end[k + 1 :]
        meets = (turn(a, b, c) * turn(a, b, d) <= 0) & (turn(c, d, a) * turn(c, d, b) <= 0)
        meets &= ((low[k] <= high[k + 1 :]) & (low[k + 1 :] <= high[k])).all(axis=1)
        for other in (np.flatnonzero(meets) + k + 1).tolist():
            if other == following[k] or k == following[other]:
                before, after = (k, other) if other == following[k] else (other, k)
                back, on = start[before] - end[before], end[after] - start[after]
                if back[0] * on[1] != back[1] * on[0] or back @ on < 0:
                    continue  # they share their corner and nothing else
            names = [name for ring in rings for name in ring.markers]
            places = " and ".join(f"{names[s]!r} from {start[s].tolist()} to {end[s].tolist()}" for s in (k, other))
            raise InputError(f"the sides of a polygon may only meet at their corners, but see {places}")


def area(corners: Floats) -> float:
    """Signed area of a polygon (k × 2), positive if it runs counter-clockwise."""
    x, y = (corners - corners[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def sides(rings: Sequence[Ring]) -> tuple[Floats, Floats]:
    """Start and end (K × 2 each) of the sides of all rings."""
    start = np.concatenate([ring.corners for ring in rings])
    end = np.concatenate([np.roll(ring.corners, -1, axis=0) for ring in rings])
    return start, end


def inside(points: Floats, start: Floats, end: Floats) -> NDArray[np.bool_]:
    """Which points (N × 2) the closed sides start → end enclose: a ray to the right crosses an odd number of them."""
    order = np.argsort(points[:, 1], kind="stable")
    x, y = points[order].T
    odd = np.zeros(len(points), dtype=bool)
    lowest = np.searchsorted(y, np.minimum(start[:, 1], end[:, 1]))
    highest = np.searchsorted(y, np.maximum(start[:, 1], end[:, 1]))
    for (x0, y0), (x1, y1), first, last in zip(start, end, lowest, highest, strict=True):
        if first < last:  # only the points at the height of this side
            odd[first:last] ^= x[first:last] < x0 + (y[first:last] - y0) * ((x1 - x0) / (y1 - y0))
    enclosed = np.empty_like(odd)
    enclosed[order] = odd
    return enclosed


def uniform_inside(count: int, rings: Sequence[Ring], rng: np.random.Generator) -> Floats:
    """Uniform random points (count × 2) inside the rings, by rejection from their bounding box."""
    start, end = sides(rings)
    low, extent = start.min(axis=0), np.ptp(start, axis=0)
    found, missing = [], count
    while missing:
        tried = low + extent * rng.random((missing, 2))
        found.append(tried[inside(tried, start, end)])
        missing -= len(found[-1])
    return np.concatenate(found)


def divide(rings: Sequence[Ring], spacing: float, rng: Random) -> tuple[Floats, Ints, Ints]:
    """Nodes on the rings: points (B × 2), the segments (B × 2) that join them, and the side (B,) of each segment."""
    points, segments, side = [], [], []
    nodes = sides_before = 0
    for ring in rings:
        first = nodes
        for k, (start, end) in enumerate(zip(*sides([ring]), strict=True)):
            count = max(1, round(float(np.linalg.norm(end - start)) / spacing)) if ring.divide else 1
            share = np.arange(count) / count if rng is None else np.append(0.0, np.sort(rng.random(count - 1)))
            points.append(start + share[:, None] * (end - start))
            side.append(np.full(count, sides_before + k, dtype=np.int64))
            nodes += count
        node = np.arange(first, nodes)
        segments.append(np.column_stack([node, np.roll(node, -1)]))
        sides_before += len(ring.corners)
    return np.concatenate(points), np.concatenate(segments), np.concatenate(side)
