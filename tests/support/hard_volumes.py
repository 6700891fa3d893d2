"""Volumes on which sweeps have a hard time."""

from __future__ import annotations

import itertools

import numpy as np
import scipy.spatial

from gmsnet.generate import block_volume
from support import volumes


def delaunay(points):
    cells = scipy.spatial.Delaunay(points, qhull_options="QJ").simplices.astype(np.int64)
    double = volumes.volumes6(points, cells)
    cells[double < 0.0] = cells[double < 0.0][:, [0, 2, 1, 3]]
    return volumes.mesh_of(points, cells[np.abs(double) > 1e-300])


def slivers(side=7, off=1e-9, seed=0):
    """A grid whose nodes are off by next to nothing: some cells between them are as flat."""
    grid = np.array(list(itertools.product(np.linspace(0.0, 1.0, side), repeat=3)))
    inner = ((grid > 0.0) & (grid < 1.0)).all(axis=1)
    grid[inner] += off * np.random.default_rng(seed).uniform(-1.0, 1.0, (int(inner.sum()), 3))
    return delaunay(grid)


def core(nodes=1200, side=3, width=0.3, seed=0):
    """Many small cells in the middle of a box with few nodes."""
    grid = np.array(list(itertools.product(np.linspace(0.0, 1.0, side), repeat=3)))
    hull = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
    inner = np.random.default_rng(seed).random((nodes, 3)) * width + 0.5 * (1.0 - width)
    return delaunay(np.concatenate([hull, inner]))


def spiked(kind, n=6, wide=0.02):
    """A block with a spike into its bottom, whose worst cells have to gain together."""
    mesh = block_volume(n, kind)
    x, y, z = ((mesh.points - mesh.points.min(axis=0)) / np.ptp(mesh.points, axis=0)).T
    away = (x - 0.5) ** 2 + (y - 0.5) ** 2
    return mesh.with_points(np.column_stack([x, y, z * (1.0 - 0.6 * np.exp(-away / wide))]))
