"""Meshes moved by the network's raw shifts, which the engine would refuse: what truncation prevents.

The sweep is sequential: nodes of one colour share no cell, so that they move at once as if one after another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.losses import truncation
from gmsnet.learn.model import GMSNet
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology


@dataclass(frozen=True, eq=False)
class Moved:
    """A mesh after one sweep. visits: how many shifts. inverting: how many of them would leave a negative triangle."""

    mesh: Mesh
    visits: int
    inverting: int


def sweep(net: GMSNet, mesh: Mesh, *, truncate: bool, topology: Topology | None = None) -> Moved:
    """Each free node of a planar mesh moved once, by the raw shift, or by the shift halved as Algorithm 1 has it."""
    topology = topology or Topology.of(mesh)
    start, ring = topology.patches
    degree = np.diff(start).astype(np.int64)
    column = np.arange(degree.max(initial=3))
    rings = ring[start[:-1, None] + np.minimum(column, degree[:, None] - 1)]  # (F × M), padded with the last one
    plane = list(mesh.plane or (0, 1))
    points, colours, inverting = mesh.points[:, plane], topology.colours[topology.free], 0
    for colour in range(colours.max(initial=-1) + 1):
        rows = np.flatnonzero(colours == colour)
        nodes = topology.free[rows]
        stars = Stars.of(points[nodes], points[rings[rows]], degree[rows])
        shift = net.propose(stars)
        factor = _truncation(stars, shift)
        inverting += int((factor < 1.0).sum())
        points[nodes] += factor[:, None] * shift if truncate else shift
    moved = mesh.points.copy()
    moved[:, plane] = points
    return Moved(mesh.with_points(moved), len(topology.free), inverting)


def _truncation(stars: Stars, shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """(B,) the factor of Algorithm 1 for shifts in the units of the mesh."""
    scaled = torch.as_tensor(shift / stars.size[:, None])
    factor: NDArray[np.float64] = truncation(torch.as_tensor(stars.ring), torch.as_tensor(stars.degree), scaled).numpy()
    return factor
