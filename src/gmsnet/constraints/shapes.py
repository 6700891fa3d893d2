"""Surfaces in space that formulas describe: planes, spheres, cylinders, cones, tori and star-shaped ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]


class Shape(Protocol):
    """A surface without bounds."""

    def project(self, points: Floats) -> Floats:
        """The places (K, 3) on the surface nearest to points (K, 3)."""
        ...

    def normal(self, points: Floats) -> Floats:
        """The unit normals (K, 3) at points (K, 3) of the surface."""
        ...


@dataclass(frozen=True)
class Plane:
    """Through a point, at right angles to a unit normal. Coordinates of planes along two axes are exact."""

    point: Vector
    direction: Vector

    def project(self, points: Floats) -> Floats:
        """See Shape."""
        n = np.array(self.direction)
        if (abs(n) == 1.0).any():
            return np.where(abs(n) == 1.0, np.array(self.point), points)
        return np.asarray(points - ((points - self.point) @ n)[:, None] * n)

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        return np.tile(np.array(self.direction), (len(points), 1))


@dataclass(frozen=True)
class Sphere:
    """Around a centre."""

    centre: Vector
    radius: float

    def project(self, points: Floats) -> Floats:
        """See Shape."""
        return np.asarray(self.centre + self.radius * self.normal(points))

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        return units(points - np.array(self.centre))


@dataclass(frozen=True)
class Cylinder:
    """Around the line through a point along a unit axis; inside: its normals point to the axis, as those of a hole."""

    point: Vector
    axis: Vector
    radius: float
    inside: bool = False

    def project(self, points: Floats) -> Floats:
        """See Shape."""
        spoke, along = apart(points, self.point, self.axis)
        at = self.point + along[:, None] * np.array(self.axis) + self.radius * units(spoke)
        return np.where(abs(np.array(self.axis)) == 1.0, points, at)

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        outward = units(apart(points, self.point, self.axis)[0])
        return -outward if self.inside else outward


@dataclass(frozen=True)
class Cone:
    """apex: its tip. axis: the unit vector from there into it. slope: its radius over the distance along the axis."""

    apex: Vector
    axis: Vector
    slope: float

    def project(self, points: Floats) -> Floats:
        """See Shape."""
        spoke, along = apart(points, self.apex, self.axis)
        far = np.maximum((along + self.slope * lengths(spoke)) / (1.0 + self.slope**2), 0.0)
        return np.asarray(self.apex + far[:, None] * (np.array(self.axis) + self.slope * units(spoke)))

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        return units(units(apart(points, self.apex, self.axis)[0]) - self.slope * np.array(self.axis))


@dataclass(frozen=True)
class Torus:
    """Around the centre in the plane at right angles to a unit axis: tube of radius ``tube`` around a circle."""

    centre: Vector
    axis: Vector
    ring: float
    tube: float

    def project(self, points: Floats) -> Floats:
        """See Shape."""
        return np.asarray(self._middle(points) + self.tube * self.normal(points))

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        return units(points - self._middle(points))

    def _middle(self, points: Floats) -> Floats:
        spoke, _ = apart(points, self.centre, self.axis)
        return np.asarray(self.centre + self.ring * units(spoke))


@dataclass(frozen=True, eq=False)
class Star:
    """Around the origin: in the direction d its radius is ``base`` + Σ height·exp(sharpness·(d·bump − 1)).

    bumps: (B, 3) unit vectors. heights, sharpness: (B,). It is projected onto along rays from the origin.
    """

    base: float
    bumps: Floats
    heights: Floats
    sharpness: Floats

    def project(self, points: Floats) -> Floats:
        """The places on the rays through points."""
        d = units(points)
        return np.asarray(self.radius(d)[:, None] * d)

    def radius(self, directions: Floats) -> Floats:
        """(K,) in unit directions (K, 3)."""
        return np.asarray(self.base + self._terms(directions).sum(axis=1))

    def normal(self, points: Floats) -> Floats:
        """See Shape."""
        d = units(points)
        rise = (self._terms(d) * self.sharpness) @ self.bumps
        rise -= (rise * d).sum(axis=1)[:, None] * d
        return units(d - rise / self.radius(d)[:, None])

    def _terms(self, directions: Floats) -> Floats:
        return np.asarray(self.heights * np.exp(self.sharpness * (directions @ self.bumps.T - 1.0)))


def apart(points: Floats, origin: Vector, axis: Vector) -> tuple[Floats, Floats]:
    """How far points are from a line, (K, 3) at right angles to it, and (K,) along it."""
    way, u = points - np.array(origin), np.array(axis)
    along = way @ u
    return way - along[:, None] * u, along


def lengths(vectors: Floats) -> Floats:
    """(K,) of vectors (K, 3)."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


def units(vectors: Floats) -> Floats:
    """(K, 3) of length 1; no direction stays none."""
    size = lengths(vectors)[:, None]
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)


def tangents(normal: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors at right angles to each normal (K, 3) and to each other."""
    axis = np.eye(3)[abs(normal).argmin(axis=1)]
    one = units(np.cross(normal, axis))
    return one, np.cross(normal, one)
