"""The edges of boundaries: those by which it is told how a boundary turns, and whether it crosses itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.polygons import Ints
from gmsnet.topology.solids import KINDS
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


def held_edges(topology: Topology | Volume) -> tuple[Ints, Ints]:
    """The edges of cells whose two nodes are held (e, 2), by places in memory: those of the boundary, and all.

    The boundary are the facets of one cell alone. The diagonals of its quads count as edges.
    """
    if isinstance(topology, Volume):
        return _of_facets(topology), _of_simplices(topology)
    near, whole = topology.near, topology.near
    if topology.near_shapes is not None:  # of a quad, whose corners are all there, each gives the edge that follows it
        whole = near[topology.near_shapes == EQUILATERAL]
    edges = np.concatenate([near[:, [0, 1]], whole[:, [1, 2]], whole[:, [2, 0]]])
    edges = np.sort(edges[~topology.near_free[edges].any(axis=1)], axis=1)
    every, cells = np.unique(edges, axis=0, return_counts=True)
    return every[cells == 1], every


def _of_simplices(topology: Volume) -> Ints:
    rows = topology.near[(~topology.near_free[topology.near]).sum(axis=1) > 1]
    return _once(np.concatenate([rows[:, [i, j]] for i in range(3) for j in range(i + 1, 4)]), topology.near_free)


def _of_facets(topology: Volume) -> Ints:
    """Edges of the facets without a free node that one cell alone has."""
    free, edges = topology.near_free, [np.empty((0, 2), dtype=np.int32)]
    for corners in (3, 4):
        found = [
            nodes[:, facet] for kind, nodes in _cells(topology) for facet in CELLS[kind].facets if len(facet) == corners
        ]
        facets = np.concatenate(
            [np.empty((0, corners), dtype=np.int32), *(each[~free[each].any(axis=1)] for each in found)]
        )
        facets, cells = np.unique(np.sort(facets, axis=1), axis=0, return_counts=True)
        edges += [facets[cells == 1][:, [i, j]] for i in range(corners) for j in range(i + 1, corners)]
    return _once(np.concatenate(edges), free)


def _cells(topology: Volume) -> list[tuple[str, Ints]]:
    """Kind → corners (n, corners) by places in memory."""
    if not isinstance(topology, MixedVolume):
        return [("tetra", topology.near)]
    solids = topology.simplices.solids
    assert solids is not None
    return [(name, solids.nodes[solids.kind == number]) for number, name in enumerate(KINDS)]


def _once(edges: Ints, free: NDArray[np.bool_]) -> Ints:
    """Each edge between two held nodes once."""
    edges = np.sort(edges, axis=1)
    chosen = (edges[:, 0] != edges[:, 1]) & ~free[edges].any(axis=1)
    found: Ints = np.unique(edges[chosen], axis=0)
    return found
