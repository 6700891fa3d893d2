"""What NN-Smoothing is taught: where optimisation-based smoothing puts free nodes.

"star": where optimisation puts the node of each star as it stands; beside the stars of the meshes as they are also
those on the way to being smoothed (STATES), because that is what the networks meet from the second sweep on. "mesh":
where the nodes lie in the end when whole meshes are smoothed; that depends on more than the ring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import Precision
from gmsnet.learn.data import Stars, joined
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, Smoother, smoother
from gmsnet.parallel.threads import serial
from gmsnet.topology.topology import Topology

STATES = (0, 1, 2, 5, 20)  # sweeps before the stars are looked at
END = 100  # sweeps until a mesh is taken for smoothed to the end; random squares take 20 to 60
VISITS = 5  # of a star by itself, 20 Adam steps each


@dataclass(frozen=True, eq=False)
class Labelled:
    """Stars, and where their free nodes should be.

    place: (B × 2) in the frame of each star. raw: so many of them, the first ones, are those of the mesh as it is.
    """

    stars: Stars
    place: NDArray[np.float64]
    raw: int


def labelled(mesh: Mesh, kind: str) -> Labelled:
    """The stars of a planar mesh with their labels, ``kind`` one of options.LABELS."""
    if kind == "mesh":
        stars, (end,) = Stars.of_mesh(mesh), optimised(mesh, (END,))
        axes = list(mesh.plane or (0, 1))
        moved = (end.points - mesh.points)[Topology.of(mesh).free][:, axes]
        return Labelled(stars, moved / stars.size[:, None], len(stars))
    states = [Stars.of_mesh(state) for state in optimised(mesh, STATES)]
    stars = joined(states)
    return Labelled(stars, own_optimum(stars), len(states[0]))


def optimised(mesh: Mesh, sweeps: Sequence[int]) -> list[Mesh]:
    """The planar mesh after so many sweeps (ascending) of OptimSmoothing, Adam on MetricLoss."""
    topology = Topology.of(mesh)
    axes = list(mesh.plane or (0, 1))
    points = np.ascontiguousarray(mesh.points[:, axes])[topology.memory]
    optimiser, done, meshes = _optimiser(), 0, []
    for wanted in sweeps:
        _sweep(optimiser, points, topology, wanted - done)
        done = wanted
        moved = mesh.points.copy()
        moved[topology.memory[:, None], axes] = points
        meshes.append(mesh.with_points(moved))
    return meshes


def own_optimum(stars: Stars) -> NDArray[np.float64]:
    """(B × 2) where OptimSmoothing puts the free node of each star as it stands, in the frame of the star.

    The stars become the pieces of one mesh, and the free nodes are optimised until they hardly move. In one star of a
    hundred that is further than 0.007 from the least MetricLoss of all, which has more than one valley.
    """
    inside = np.arange(stars.ring.shape[1]) < stars.degree[:, None]
    centre = np.cumsum(stars.degree + 1) - (stars.degree + 1)  # of each star, its ring after it
    star, place = np.nonzero(inside)
    points = np.zeros((int((stars.degree + 1).sum()), 2))
    points[centre[star] + 1 + place] = stars.ring[inside]
    following = (place + 1) % stars.degree[star]
    triangles = np.column_stack([centre[star], centre[star] + 1 + place, centre[star] + 1 + following])
    topology = Topology.of(Mesh(points, (CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=np.int64)),)))
    near = points[topology.memory]
    _sweep(_optimiser(), near, topology, VISITS)
    points[topology.memory] = near
    return np.asarray(points[centre])


def _optimiser() -> Smoother:
    return smoother("optimize", variant="adam", objective="metric")


def _sweep(optimiser: Smoother, points: NDArray[np.float64], topology: Topology, sweeps: int) -> None:
    """Moves the points (in memory order) in place, on one thread."""
    field = Field(points, topology, Precision())
    for _ in range(sweeps):
        optimiser.sweep(field, serial, lambda: False)
