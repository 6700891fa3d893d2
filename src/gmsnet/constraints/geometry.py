"""The true shape of a mesh's curves, where the user has one: what it must tell, and polylines as the first kind."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.constraints.curve import ArcSpline, through
from gmsnet.constraints.shapes import Shape, tangents
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import plain_array

Floats = NDArray[np.float64]
ROUNDS = 60  # of projections onto two shapes
CORNER = 30.0  # degrees: where a polyline turns by more it has a corner, elsewhere it stands for a smooth curve


class Entity(NamedTuple):
    """Which curve (dimension 1) or patch (2) of a mesh is meant. number: among those of its dimension. markers: whose
    cells are on it; of a patch of a surface, its region."""

    dimension: int
    number: int
    markers: tuple[str, ...]


class Geometry(Protocol):
    """The true shape of a mesh's curves and patches in its coordinates: D = 2 along the axes of its plane, or D = 3."""

    def project(self, entity: Entity, points: Floats) -> tuple[Floats, Floats]:
        """The places (K, D) on an entity nearest to points (K, D), and their parameters, a row for each."""
        ...

    def tangent(self, entity: Entity, parameters: Floats) -> Floats:
        """Tangents (K, D) of a curve at parameters, of any length, in either direction; of a patch two (K, 2, 3)."""
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
    return f"the {'curve' if entity.dimension == 1 else 'patch'} {entity.number}" + (
        f" ({', '.join(entity.markers)})" if entity.markers else ""
    )


def checked(values: object, shape: tuple[int, ...], what: str, entity: Entity) -> Floats:
    """What a geometry gave, as an array of its own. Raises InputError for another shape and for no finite numbers."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"the {what} that geometry gives for {named(entity)} must be {shape} finite numbers")
    return array


class Shapes:
    """Surfaces by formulas (``constraints.shapes``) as the geometry of patches, by names of their regions or markers.

    A curve between two patches is where their shapes meet: alternating projections find it.
    """

    def __init__(self, shapes: Mapping[str, Shape]) -> None:
        if not isinstance(shapes, Mapping) or not shapes:
            raise InputError("Shapes needs a mapping: name of a region or marker → its shape")
        self._shapes = dict(shapes)

    def project(self, entity: Entity, points: Floats) -> tuple[Floats, Floats]:
        """See Geometry; the parameters are the places. On curves between shapes, those of both, one after the other.

        Raises InputError for an entity that none of the shapes is named after.
        """
        places = points
        for _ in range(1 if entity.dimension == 2 else ROUNDS):
            for shape in self._of(entity):
                places = shape.project(places)
        return places, places

    def tangent(self, entity: Entity, parameters: Floats) -> Floats:
        """See Geometry. Raises InputError as ``project``."""
        normals = [shape.normal(parameters) for shape in self._of(entity)]
        if entity.dimension == 1:
            return np.cross(normals[0], normals[-1])
        return np.stack(tangents(normals[0]), axis=1)

    def _of(self, entity: Entity) -> list[Shape]:
        found = [self._shapes[name] for name in entity.markers if name in self._shapes]
        if len(found) < (2 if entity.dimension == 1 else 1):
            known = ", ".join(map(repr, self._shapes))
            raise InputError(f"there is no shape for {named(entity)}, only for {known}: let only these slide")
        return found[:2]
