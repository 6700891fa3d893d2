"""The converged per-node optimum of MetricLoss, by a search without derivatives: what a network is held against."""

from __future__ import annotations

import math

import numba
import numpy as np

from gmsnet.topology.topology import Topology

DIRECTIONS = np.array([(math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8)])


@numba.njit
def star_loss(points, ring, x, y):
    """Equation 10 over the star of a node at (x, y); infinite if a triangle is not positive."""
    loss = 0.0
    for j in range(len(ring)):
        a, b = points[ring[j - 1]], points[ring[j]]
        ax, ay, bx, by = a[0] - x, a[1] - y, b[0] - x, b[1] - y
        twice = ax * by - ay * bx
        if twice <= 0.0:
            return np.inf
        lengths = ax * ax + ay * ay + bx * bx + by * by + (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2
        loss += 1.0 - 2.0 * math.sqrt(3.0) * twice / lengths
    return loss / len(ring)


@numba.njit
def settle(points, free, start, ring, sweeps, directions):
    """Compass search at each node in turn, down to 1e-4 of the star's size."""
    for _ in range(sweeps):
        for i in range(len(free)):
            v, around = free[i], ring[start[i] : start[i + 1]]
            size = 0.0
            for j in around:
                size = max(size, abs(points[j, 0] - points[v, 0]), abs(points[j, 1] - points[v, 1]))
            x, y = points[v]
            least, step = star_loss(points, around, x, y), 0.25 * size
            while step > 1e-4 * size:
                found = False
                for d in directions:
                    loss = star_loss(points, around, x + step * d[0], y + step * d[1])
                    if loss < least:
                        least, bx, by, found = loss, x + step * d[0], y + step * d[1], True
                if found:
                    x, y = bx, by
                else:
                    step *= 0.5
            points[v, 0], points[v, 1] = x, y


def metric_loss_optimum(mesh, sweeps=80):
    """The points after so many sweeps of per-node minimisation, by when the mean of 1/q has settled to 1e-4."""
    topology = Topology.of(mesh)
    start, ring = topology.patches
    points = mesh.points[:, list(topology.plane)].copy()
    settle(points, topology.free, start, ring, sweeps, DIRECTIONS)
    return points
