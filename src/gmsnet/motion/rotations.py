"""What a rotation is: an angle in the plane, in space an axis with an angle.

A *turn* is how far something has turned, full turns counted: radians counter-clockwise (k = 1), or the axis times the
radians (k = 3). An *attitude* is how it stands then: in the plane the turn itself, in space a unit quaternion.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gmsnet.kernels.whole import rotations as kernels

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int32]

FULL = 2.0 * math.pi
STILL = 1e-12  # radians: a turn by less has no axis
FLAT = 1e-3  # of the largest singular value: directions with less of the second are about one line


class Rotations(Protocol):
    """Of one dimension. k: of a turn."""

    k: int

    def still(self, count: int) -> Floats:
        """The attitudes of so many nodes that have not turned."""

    def turned(self, vectors: Floats, turns: Floats) -> Floats:
        """Vectors (n, D), each turned by the turn (n, k) beside it, or all by one (k,)."""

    def nearest(self, turns: Floats, to: Floats) -> Floats:
        """The turns (n, k) that come to the same and are nearest to others."""

    def joined(self, first: Floats, second: Floats) -> Floats:
        """The turns (n, k) that come to a first one and then a second one."""

    def onto(self, old: Floats, new: Floats) -> tuple[Floats, bool]:
        """The turn (k,) that takes vectors (n, D) best to others, and whether they tell it."""

    def at_nodes(self, edges: Ints, old: Floats, new: Floats, count: int) -> tuple[Floats, Flags]:
        """The turns (count, k) by which the directions of edges (E, D) have turned at their nodes; which are told."""

    def toward(self, attitude: Floats, turns: Floats, near: Floats) -> Floats:
        """By which turns (n, k) attitudes come to those of other turns; of those that come to the same, near others."""

    def turn(self, attitude: Floats, turns: Floats) -> Floats:
        """The attitudes when they turn."""

    def back(self, edges: Ints, ways: Floats, attitude: Floats) -> Floats:
        """Ways along edges as they were before their nodes have turned."""

    def pulls(self, edges: Ints, weight: Floats, ways: Floats, attitude: Floats, points: Floats) -> Floats:
        """(N, D) see kernels.whole.rotations."""

    def fit(
        self, edges: Ints, weight: Floats, ways: Floats, points: Floats, chosen: Flags, attitude: Floats
    ) -> float:  # fmt: skip
        """Turns the attitudes of chosen nodes, in place: see kernels.whole.rotations."""


class Plane:
    """See Rotations."""

    k = 1

    def still(self, count: int) -> Floats:
        """See Rotations."""
        return np.zeros((count, 1))

    def turned(self, vectors: Floats, turns: Floats) -> Floats:
        """See Rotations."""
        return _as_points(np.exp(1j * turns[..., 0]) * _as_complex(vectors))

    def nearest(self, turns: Floats, to: Floats) -> Floats:
        """See Rotations."""
        return turns + FULL * np.round((to - turns) / FULL)

    def joined(self, first: Floats, second: Floats) -> Floats:
        """See Rotations."""
        return first + second

    def onto(self, old: Floats, new: Floats) -> tuple[Floats, bool]:
        """See Rotations."""
        product = complex((np.conj(_as_complex(old)) * _as_complex(new)).sum())
        return np.array([np.angle(product)]), bool(product)

    def at_nodes(self, edges: Ints, old: Floats, new: Floats, count: int) -> tuple[Floats, Flags]:
        """See Rotations."""
        ways = np.conj(_as_complex(old)) * _as_complex(new)
        ways = np.where(ways == 0.0, 1.0, ways)
        ways /= np.abs(ways)
        told = np.zeros(count, dtype=bool)
        told[edges] = True
        return np.angle(_sums(edges, ways, count))[:, None], told

    def toward(self, attitude: Floats, turns: Floats, near: Floats) -> Floats:
        """See Rotations."""
        return turns - attitude

    def turn(self, attitude: Floats, turns: Floats) -> Floats:
        """See Rotations."""
        return attitude + turns

    def back(self, edges: Ints, ways: Floats, attitude: Floats) -> Floats:
        """See Rotations."""
        return self.turned(ways, -0.5 * (attitude[edges[:, 0]] + attitude[edges[:, 1]]))

    def pulls(self, edges: Ints, weight: Floats, ways: Floats, attitude: Floats, points: Floats) -> Floats:
        """See Rotations."""
        a, b = edges.T
        wanted = self.turned(ways, 0.5 * (attitude[a] + attitude[b]))
        pull = weight * _as_complex(wanted - (points[b] - points[a]))
        return _as_points(_sums(edges, pull, len(points), -1.0))

    def fit(
        self, edges: Ints, weight: Floats, ways: Floats, points: Floats, chosen: Flags, attitude: Floats
    ) -> float:  # fmt: skip
        """See Rotations."""
        a, b = edges.T
        product = weight * np.conj(_as_complex(ways)) * _as_complex(points[b] - points[a])
        more = np.angle(_sums(edges, product, len(points)) * np.exp(-1j * attitude[:, 0]))
        attitude[chosen, 0] += more[chosen]
        return float(np.abs(more[chosen]).max(initial=0.0))


class Space:
    """See Rotations."""

    k = 3

    def still(self, count: int) -> Floats:
        """See Rotations."""
        attitude = np.zeros((count, 4))
        attitude[:, 3] = 1.0
        return attitude

    def turned(self, vectors: Floats, turns: Floats) -> Floats:
        """See Rotations."""
        found: Floats = _rotation(turns).apply(np.array(vectors))
        return found

    def nearest(self, turns: Floats, to: Floats) -> Floats:
        """See Rotations."""
        size = np.linalg.norm(turns, axis=-1, keepdims=True)
        whole = np.linalg.norm(to, axis=-1, keepdims=True)
        axis = np.where(size > STILL, turns / np.maximum(size, STILL), to / np.maximum(whole, STILL))
        more = np.round(((to - turns) * axis).sum(axis=-1, keepdims=True) / FULL)
        return np.asarray(turns + FULL * more * axis)

    def joined(self, first: Floats, second: Floats) -> Floats:
        """See Rotations."""
        return self.nearest((_rotation(second) * _rotation(first)).as_rotvec(), first + second)

    def onto(self, old: Floats, new: Floats) -> tuple[Floats, bool]:
        """See Rotations."""
        found, told = _best((new.T @ old)[None])
        return found[0], bool(told[0])

    def at_nodes(self, edges: Ints, old: Floats, new: Floats, count: int) -> tuple[Floats, Flags]:
        """See Rotations."""
        nodes, place = np.unique(edges, return_inverse=True)
        place = place.reshape(edges.shape)
        units = [each / np.maximum(np.linalg.norm(each, axis=1, keepdims=True), 1e-300) for each in (new, old)]
        ways = (units[0][:, :, None] * units[1][:, None, :]).reshape(-1, 9)
        moments = np.column_stack([
            np.bincount(place[:, 0], way, len(nodes)) + np.bincount(place[:, 1], way, len(nodes)) for way in ways.T
        ])  # fmt: skip
        turns, told = np.zeros((count, 3)), np.zeros(count, dtype=bool)
        turns[nodes], told[nodes] = _best(moments.reshape(-1, 3, 3))
        return turns, told

    def toward(self, attitude: Floats, turns: Floats, near: Floats) -> Floats:
        """See Rotations."""
        return self.nearest((_rotation(turns) * Rotation.from_quat(attitude).inv()).as_rotvec(), near)

    def turn(self, attitude: Floats, turns: Floats) -> Floats:
        """See Rotations."""
        found: Floats = (_rotation(turns) * Rotation.from_quat(attitude)).as_quat()
        return found

    def back(self, edges: Ints, ways: Floats, attitude: Floats) -> Floats:
        """See Rotations."""
        out = np.empty_like(ways)
        kernels.turn_edges(edges, ways, attitude, -1.0, out)
        return out

    def pulls(self, edges: Ints, weight: Floats, ways: Floats, attitude: Floats, points: Floats) -> Floats:
        """See Rotations."""
        out = np.empty((len(points), 3))
        kernels.pulls(edges, weight, ways, attitude, points, out)
        return out

    def fit(
        self, edges: Ints, weight: Floats, ways: Floats, points: Floats, chosen: Flags, attitude: Floats
    ) -> float:  # fmt: skip
        """See Rotations."""
        return float(kernels.fit(edges, weight, ways, points, chosen, attitude))


PLANE, SPACE = Plane(), Space()


def rotations_in(dimension: int) -> Rotations:
    """Those of two or three dimensions."""
    return PLANE if dimension == 2 else SPACE


def _rotation(turns: Floats) -> Any:
    return Rotation.from_rotvec(np.array(turns))  # a copy, for SciPy refuses to read what may not be written


def _best(moments: Floats) -> tuple[Floats, Flags]:
    """The turns (n, 3) of the rotations R with the largest Σ R_kl m_kl, and which of them moments (n, 3, 3) tell.

    Kabsch: A solution for the best rotation to relate two sets of vectors, Acta Crystallographica A 32, 1976.
    """
    u, sizes, v = np.linalg.svd(moments)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
    told = sizes[:, 1] > FLAT * sizes[:, 0]
    turns = np.zeros((len(moments), 3))
    if told.any():
        turns[told] = Rotation.from_matrix((u @ v)[told]).as_rotvec()
    return turns, told


def _as_complex(points: Floats) -> NDArray[np.complex128]:
    """(…, 2) as x + iy."""
    z: NDArray[np.complex128] = points[..., 0] + 1j * points[..., 1]
    return z


def _as_points(z: NDArray[np.complex128]) -> Floats:
    """x + iy as (…, 2)."""
    return np.stack([z.real, z.imag], axis=-1)


def _sums(edges: Ints, values: NDArray[np.complex128], count: int, of_first: float = 1.0) -> NDArray[np.complex128]:
    """(count,) sums of values of edges at their two ends."""
    a, b = edges.T
    parts = [
        of_first * np.bincount(a, part, count) + np.bincount(b, part, count) for part in (values.real, values.imag)
    ]
    sums: NDArray[np.complex128] = parts[0] + 1j * parts[1]
    return sums
