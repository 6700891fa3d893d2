"""Whole meshes as tensors: coloured sweeps that can be differentiated, and the barrier of a mesh.

Several meshes stand beside one another as one. N nodes, T triangles, K meshes; a colour has B stars, M the largest
degree in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gmsnet.learn.backend import torch
from gmsnet.learn.losses import truncation
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

MOST_Q = 1e4  # q in a loss, so that its powers stay finite in float32; beyond there is no gradient


class Colour(NamedTuple):
    """The stars of one colour: centre (B,) and ring (B × M) by nodes, padded; degree (B,)."""

    centre: torch.Tensor
    ring: torch.Tensor
    degree: torch.Tensor


@dataclass(frozen=True, eq=False)
class Meshes:
    """K meshes. start: (N × 2) float32, each mesh in units of its extent.

    triangles: (T × 3), counter-clockwise; of: (T,) to which mesh they belong; count: (K,) how many a mesh has.
    """

    start: torch.Tensor
    colours: Sequence[Colour]
    triangles: torch.Tensor
    of: torch.Tensor
    count: torch.Tensor

    @classmethod
    def joined(cls, meshes: Sequence[Mesh]) -> Meshes:
        """These planar meshes, coloured as for smoothing."""
        points, triangles, stars, before = [], [], [], 0
        for mesh in meshes:
            topology = Topology.of(mesh)
            plane = mesh.points[:, list(mesh.plane or (0, 1))]
            low, extent = plane.min(axis=0), np.ptp(plane, axis=0).max()
            points.append((plane - low) / extent)
            turned = np.where(topology.orientation[:, None] > 0, topology.triangles, topology.triangles[:, ::-1])
            triangles.append(before + turned.astype(np.int64))
            colour = np.empty(len(plane), dtype=np.int64)
            colour[topology.memory] = topology.near_colours
            start, ring = topology.patches
            for k, node in enumerate(topology.free.tolist()):
                stars.append((int(colour[node]), before + node, before + ring[start[k] : start[k + 1]]))
            before += len(plane)
        sizes = [len(part) for part in triangles]
        return cls(
            torch.as_tensor(np.concatenate(points), dtype=torch.float32),
            [_colour([star for star in stars if star[0] == c]) for c in range(max(s[0] for s in stars) + 1)],
            torch.as_tensor(np.concatenate(triangles)),
            torch.repeat_interleave(torch.arange(len(sizes)), torch.as_tensor(sizes)),
            torch.as_tensor(sizes, dtype=torch.float32),
        )

    def log_power(self, points: torch.Tensor, power: int) -> torch.Tensor:
        """(K,) of each mesh (1/p) log mean q^p."""
        q = self.q(points)
        total = q.new_zeros(len(self.count)).index_add(0, self.of, q**power)
        return (total / self.count).log() / power

    def q(self, points: torch.Tensor) -> torch.Tensor:
        """(T,) the inverse of the mean ratio, MOST_Q for what is inverted or worse."""
        a, b, c = (points.index_select(0, self.triangles[:, k]) for k in range(3))
        return inverse_mean_ratio(b - a, c - a)

    def metric(self, points: torch.Tensor) -> float:
        """The mean of 1 − 1/q over all triangles, MetricLoss."""
        return float((1.0 - 1.0 / self.q(points)).mean())


def _colour(stars: Sequence[tuple[int, int, np.ndarray]]) -> Colour:
    degree = np.array([len(ring) for _, _, ring in stars], dtype=np.int64)
    padded = np.array([np.pad(ring, (0, degree.max() - len(ring)), mode="edge") for _, _, ring in stars])
    centre = np.array([node for _, node, _ in stars], dtype=np.int64)
    return Colour(torch.as_tensor(centre), torch.as_tensor(padded.astype(np.int64)), torch.as_tensor(degree))


def inverse_mean_ratio(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """(…) q of the triangles (0, a, b), a and b (… × 2); MOST_Q for those that are inverted or worse."""
    (ax, ay), (bx, by) = a.unbind(-1), b.unbind(-1)
    d = ax * by - ay * bx
    size = (ax * ax + ay * ay + bx * bx + by * by - ax * bx - ay * by) / math.sqrt(3.0)
    bad = d * MOST_Q <= size
    return torch.where(bad, MOST_Q, size / torch.where(bad, 1.0, d))


def proposal(net: torch.nn.Module, points: torch.Tensor, colour: Colour) -> tuple[torch.Tensor, torch.Tensor]:
    """(B × M × 2) the rings of a colour relative to their free nodes; (B × 2) the shifts, truncated (Algorithm 1)."""
    ring = points.index_select(0, colour.ring.flatten()).view(*colour.ring.shape, 2)
    ring = ring - points.index_select(0, colour.centre)[:, None]
    shift = net(ring, colour.degree)
    factor = truncation(ring.detach(), colour.degree, shift.detach())
    return ring, factor[:, None] * shift


def sweep(net: torch.nn.Module, points: torch.Tensor, colours: Sequence[Colour]) -> torch.Tensor:
    """(N × 2) the points after each free node has been visited once, colour after colour."""
    for colour in colours:
        points = points.index_add(0, colour.centre, proposal(net, points, colour)[1])
    return points


def star_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor, power: int) -> torch.Tensor:
    """(B,) (1/p) log mean q^p of stars with their free nodes at these positions (rings as ``proposal`` gives them)."""
    column = torch.arange(ring.shape[1])
    before = torch.where(column == 0, degree[:, None] - 1, column - 1).clamp(min=0)
    a = ring.gather(1, before[:, :, None].expand(-1, -1, 2))
    q = inverse_mean_ratio(a - position[:, None], ring - position[:, None])
    total = torch.where(column < degree[:, None], q**power, 0.0).sum(dim=1)
    return (total / degree).log() / power
