"""Coordinates in the plane of a mesh, and the order of its nodes in memory."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import layout
from gmsnet.mesh.plane import in_plane
from gmsnet.topology.stars import Ints


def inverse(order: Ints) -> Ints:
    """The place of each number in an order of all of them."""
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    return place


def memory_order(points: NDArray[np.float64], box: NDArray[np.float64] | None = None) -> tuple[Ints, Ints]:
    """The ids in memory order, and the place of each. box: of the mesh that these are a part of."""
    nodes = len(points)
    memory, position = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    keys, other = np.empty(nodes, dtype=np.int64), np.empty(nodes, dtype=np.int64)
    order = layout.morton_order if points.shape[1] == 2 else layout.morton_order3
    box = np.empty((0, min(points.shape[1], 3))) if box is None else box
    order(points, box, keys, other, memory, position)
    return memory, position


class Flat(Protocol):
    """Points in a plane: a Mesh, or what is kept of one. See there."""

    @property
    def points(self) -> NDArray[np.float64]:
        """(N × 2 or N × 3) coordinates."""
        ...

    @property
    def plane(self) -> tuple[int, int] | None:
        """The two axes."""
        ...

    @property
    def exponent(self) -> int:
        """The power of two by which ``planar_points`` divides them."""
        ...


def planar_points(mesh: Flat) -> NDArray[np.float64]:
    """The points in the plane of the mesh (N, 2), divided by 2 to the power of its ``exponent``, which is exact.

    The largest coordinate is then near 1, so that products of tiny or huge ones neither under- nor overflow. Of a mesh
    that is not planar, the first two coordinates.
    """
    points = in_plane(mesh.points, mesh.plane)
    if abs(mesh.exponent) < 1000:
        return np.ascontiguousarray(points * 2.0**-mesh.exponent)
    return np.ldexp(points, -mesh.exponent)


def space_points(mesh: Flat) -> NDArray[np.float64]:
    """The points in space (N, 4), divided by 2 to the power of ``exponent``; the fourth number is 0.

    Four numbers are loaded at once.
    """
    points = np.zeros((len(mesh.points), 4))
    np.ldexp(mesh.points, -mesh.exponent, out=points[:, :3])
    return points


class Ordered(Protocol):
    """What has an order in memory: a Topology."""

    @property
    def memory(self) -> Ints:
        """The ids in memory order."""
        ...


def near_points(mesh: Flat, topology: Ordered) -> NDArray[np.float64]:
    """The same by places in memory; of a mesh that is not planar, ``space_points``."""
    return taken(planar_points(mesh) if mesh.plane else space_points(mesh), topology.memory)


def taken(points: NDArray[np.float64], memory: Ints) -> NDArray[np.float64]:
    """The points in memory order."""
    return np.take(points, memory, axis=0)
