"""Bounds of meshes that are not all triangles, and of those whose boundary slides: from what is held, and free corners.

*Held cells.* A cell whose nodes are all held keeps its 1/q. So does a held corner of a quad (held_corners).

*Quads around a free node.* Of a square corner of angle θ, 1/q = 2|e₁||e₂| sin θ/(|e₁|² + |e₂|²) ≤ sin θ. The angles of
the n quads of a closed star add up to 360°, so that one is 360°/n or less where n > 4, and one is 360°/n or more where
n = 3: its 1/q is at most sin(360°/n). Nodes that slide have no closed star.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.measures import SHAPE
from gmsnet.measure.bounds.groups import ABOVE, FREE_CORNER, HELD, NOWHERE, Groups
from gmsnet.measure.bounds.held_corners import held_corners
from gmsnet.measure.cells import MeasuredCells
from gmsnet.topology.topology import Topology

Flags = NDArray[np.bool_]


def collect(cells: MeasuredCells, topology: Topology, free: Flags, below: float) -> tuple[Groups, Flags]:
    """All groups with a bound less than ``below``, rows those of a report; and which cells are held (C,).

    free: (N,) by id.
    """
    held = np.concatenate([~free[cells.corners].any(axis=1), ~free[cells.quads].any(axis=1)])
    place = np.arange(len(held))
    if cells.order is not None:
        held, place[cells.order] = held[cells.order], np.arange(len(held))
    shape = cells.columns()[SHAPE]
    own = np.flatnonzero(held & (shape < below))
    none = np.full(len(own), NOWHERE)
    parts = [Groups.of(HELD, none, np.zeros(len(own)), shape[own], np.ones(len(own), dtype=np.intp), own)]
    quads = np.bincount(cells.quads.ravel(), minlength=len(free))
    around = np.empty(len(free), dtype=np.int64)
    around[topology.memory] = np.diff(topology.near_start)
    closed = free & (around == 2 * quads)  # of quads alone, whose nodes around stand once each
    nodes = np.flatnonzero(closed & (quads >= 3) & (quads != 4))
    bound = np.sin(2.0 * math.pi / quads[nodes]) * (1.0 + ABOVE)
    nodes, bound = nodes[bound < below], bound[bound < below]
    corner = np.flatnonzero(np.isin(cells.quads.ravel(), nodes))
    corner = corner[np.argsort(cells.quads.ravel()[corner], kind="stable")]
    rows = place[len(cells.corners) + corner // 4]
    parts.append(Groups.of(FREE_CORNER, nodes, np.zeros(len(nodes)), bound, quads[nodes], rows))
    parts.append(held_corners(cells, free, below))
    return Groups.joined(parts), held
