"""The true shape of a mesh's curves, where the user has one: what it must tell, and polylines as the first kind."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.constraints.curve import ArcSpline, through
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import plain_array

Floats = NDArray[np.float64]
CORNER = 30.0  # degrees: where a polyline turns by more it has a corner, elsewhere it stands for a smooth curve


class Entity(NamedTuple):
    """Which curve of a mesh is meant. dimension: 1. number: among its curves. markers: whose line cells are on it."""

    dimension: int
    number: int
    markers: tuple[str, ...]


class Geometry(Protocol):
    """The true shape of the curves of a mesh, in the mesh's own coordinates along the two axes of its plane."""

    def project(self, entity: Entity, points: Floats) -> tuple[Floats, Floats]:
        """The places (K, 2) on an entity nearest to points (K, 2), and their parameters (K,) there."""
        ...

    def tangent(self, entity: Entity, parameters: Floats) -> Floats:
        """Tangents (K, 2) of an entity at parameters (K,), of any length, in either direction."""
        ...


class Polylines:
    """Fine polylines as the geometry of curves, by the names of the markers on them.

    curves: name → points (K, 2) in order, in the mesh's own coordinates; one whose last point is its first is closed.
    Between the points lie arcs (constraints.curve), but for corners of more than CORNER degrees. The entities of a
    mesh whose markers are not among the names have no geometry here.

    Raises InputError for fewer than two points, points that are not finite, and points that repeat in a row.
    """

    def __init__(self, curves: Mapping[str, ArrayLike]) -> None:
        if not isinstance(curves, Mapping) or not curves:
            raise InputError("Polylines needs a mapping: name of a marker → its points (K, 2) in order")
        self._splines = {name: _smooth(name, points) for name, points in curves.items()}

    def project(self, entity: Entity, points: Floats) -> tuple[Floats, Floats]:
        """See Geometry. Raises InputError for an entity that none of the polylines is named after."""
        return self._of(entity).project(0, points)

    def tangent(self, entity: Entity, parameters: Floats) -> Floats:
        """See Geometry. Raises InputError as ``project``."""
        return self._of(entity).tangent(0, parameters)

    def _of(self, entity: Entity) -> ArcSpline:
        for name in entity.markers:
            if name in self._splines:
                return self._splines[name]
        known = ", ".join(map(repr, self._splines))
        raise InputError(f"there is no polyline for {named(entity)}, only for {known}: let only these markers slide")


def _smooth(name: str, points: ArrayLike) -> ArcSpline:
    """The pieces of a polyline as those of one curve, whether it has corners or not."""
    p = plain_array(points, f"the polyline {name!r}")
    if p.ndim != 2 or p.shape[1] != 2 or len(p) < 2 or p.dtype.kind not in "iuf" or not np.isfinite(p).all():
        raise InputError(f"the polyline {name!r} needs two points or more (K, 2), all finite, got shape {p.shape}")
    p = p.astype(np.float64)
    step = np.diff(p, axis=0)
    length = np.hypot(*step.T)
    if not length.all():
        row = int(np.flatnonzero(length == 0.0)[0])
        raise InputError(f"the points {row} and {row + 1} of the polyline {name!r} (counted from 0) are equal")
    cosine = (step * np.roll(step, 1, axis=0)).sum(axis=1) / (length * np.roll(length, 1))
    sharp = np.flatnonzero(cosine < np.cos(np.radians(CORNER))).tolist()  # edges that begin at a corner
    ring = bool((p[0] == p[-1]).all()) and len(p) > 3
    if ring and not sharp:
        chains, closed = [p], [True]
    else:
        if ring and 0 not in sharp:
            p = np.concatenate([p[sharp[0] :], p[1 : sharp[0] + 1]])
            sharp = [edge - sharp[0] for edge in sharp]
        borders = [0, *(edge for edge in sharp if edge), len(p) - 1]
        chains = [p[low : high + 1] for low, high in pairwise(borders)]
        closed = [False] * len(chains)
    spline = through(chains, np.array(closed), None)
    return ArcSpline(spline.first[[0, -1]], spline.piece, np.array([False]))


def named(entity: Entity) -> str:
    """For messages."""
    return f"the curve {entity.number}" + (f" ({', '.join(entity.markers)})" if entity.markers else "")
