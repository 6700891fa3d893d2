"""What is known of a whole mesh before anybody looks at its cells: its plane, the size of its coordinates, its box."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of, flat_axes, in_plane

Floats = NDArray[np.float64]


def framed(comm: Any, mesh: Mesh) -> Mesh:
    """The mesh of one rank as a part of the mesh of all."""
    volumes, quads, solids = (bool(comm.allreduce(each, mpi().LOR)) for each in mesh.kinds_there)
    plane = _plane(comm, mesh)
    points = mesh.points if plane is None else in_plane(mesh.points, plane)
    box = box_of(comm, points)
    exponent = exponent_of(box, None, mesh.single)
    exact = not comm.allreduce(not mesh.exact, mpi().LOR)
    return mesh.as_part(plane, (volumes, quads, solids), exponent, exact, np.ldexp(box, -exponent))


def _plane(comm: Any, mesh: Mesh) -> tuple[int, int] | None:
    """See ``Mesh.plane``."""
    if mesh.points.shape[1] == 2:
        return (0, 1)
    low, high = box_of(comm, mesh.points[:, 2:])
    if low == high:
        return (0, 1)
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        used[block.nodes] = True
    box = box_of(comm, 0.25 * mesh.points[used])
    return flat_axes(box[1] - box[0]) if np.isfinite(box).all() else (0, 1)


def box_of(comm: Any, points: Floats) -> Floats:
    """(2, D) the least and the greatest coordinates of all ranks."""
    low, high = np.empty((2, points.shape[1]))
    comm.Allreduce(points.min(axis=0, initial=np.inf), low, mpi().MIN)
    comm.Allreduce(points.max(axis=0, initial=-np.inf), high, mpi().MAX)
    return np.stack([low, high])
