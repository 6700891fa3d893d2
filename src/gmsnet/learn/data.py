"""What GMSNet learns from: the stars of random Delaunay squares, in the frame of the network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.generate import random_mesh
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

SPLIT = (12, 4, 4)  # meshes for training, validation and testing
NODES = (250, 2000)  # least and most nodes inside a mesh
SIZES = (0.1, 10.0)  # least and largest side
DESCRIPTION = (
    f"{sum(SPLIT)} random Delaunay squares, {NODES[0]} to {NODES[1]} uniform nodes inside (log-uniform), sides of "
    f"{SIZES[0]:g} to {SIZES[1]:g} (log-uniform), evenly spaced boundary nodes; split {'/'.join(map(str, SPLIT))}"
)


@dataclass(frozen=True, eq=False)
class Stars:
    """B star polygons in the frame of the network, the free node at the origin.

    ring: (B × M × 2) the neighbours counter-clockwise, divided by the star's size; rows from ``degree`` on are zero.
    degree: (B,) number of neighbours. size: (B,) the longer side of the bounding box of the n + 1 nodes.
    """

    ring: NDArray[np.float64]
    degree: NDArray[np.int64]
    size: NDArray[np.float64]

    @classmethod
    def of(cls, centre: NDArray[np.float64], ring: NDArray[np.float64], degree: NDArray[np.int64]) -> Stars:
        """The stars of free nodes (B × 2) and their padded rings (B × M × 2), in the coordinates of the mesh."""
        inside = (np.arange(ring.shape[1]) < degree[:, None])[:, :, None]
        edges = np.where(inside, ring - centre[:, None], 0.0)
        # The free node is the origin, so the padding does not widen the box.
        size = (edges.max(axis=1).clip(min=0.0) - edges.min(axis=1).clip(max=0.0)).max(axis=1)
        return cls(edges / size[:, None, None], degree, size)

    @classmethod
    def of_mesh(cls, mesh: Mesh) -> Stars:
        """The stars of all free nodes of a planar mesh, in the order of their ids.

        Each ring starts at its smallest id: the sums of a training then depend on the mesh alone.
        """
        topology = Topology.of(mesh)
        start, ring = topology.patches
        degree = np.diff(start).astype(np.int64)
        column = np.arange(degree.max(initial=3))
        ids = ring[start[:-1, None] + np.minimum(column, degree[:, None] - 1)]  # (F × M), padded with the last one
        points = mesh.points[:, list(mesh.plane or (0, 1))]
        return cls.of(points[topology.free], points[ids], degree)

    def __len__(self) -> int:
        return len(self.degree)


def meshes(seed: int) -> list[Mesh]:
    """The 20 random squares of a seed, of differing size and density: those for training first, for testing last."""
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(sum(SPLIT)):
        nodes = round(np.exp(rng.uniform(*np.log(NODES))))
        size = float(np.exp(rng.uniform(*np.log(SIZES))))
        drawn.append(random_mesh(nodes, "square", size=size, seed=int(rng.integers(2**31))))
    return drawn


def joined(parts: list[Stars]) -> Stars:
    """The stars of several meshes, one after another."""
    most = max(part.ring.shape[1] for part in parts)
    ring = [np.pad(part.ring, ((0, 0), (0, most - part.ring.shape[1]), (0, 0))) for part in parts]
    return Stars(
        np.concatenate(ring), np.concatenate([p.degree for p in parts]), np.concatenate([p.size for p in parts])
    )
