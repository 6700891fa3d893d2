"""A patch: free nodes that are moved together, with their stars in numbers of their own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from gmsnet.kernels.star.pattern import Stars
from gmsnet.kernels.untangle import untangling as kernels
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Patch:
    """count: how many nodes are moved. every: (m,) places in memory of all its nodes, the moved ones first.

    stars: of the moved nodes, in numbers of the patch. cells: (c, 3), the corner simplices, counter-clockwise, that
    have a moved node, each with one in front. weights: (c, 3) their weights as seen from that one
    (kernels.simplex.mean_ratio2), None where all are equilateral. part: (count,) which piece of the patch a moved node
    belongs to; no cell has moved nodes of two. parts: how many pieces there are.
    """

    count: int
    every: Ints
    stars: Stars
    cells: Ints
    weights: Floats | None
    part: Ints
    parts: int

    @classmethod
    def of(cls, topology: Topology, nodes: Ints) -> Patch:
        """The patch of free nodes (places in memory), in their order."""
        number = np.full(len(topology.memory), -1, dtype=np.int32)
        table, pattern, patterns = None, None, topology.patterns
        if patterns is not None and topology.near_pattern is not None:
            pattern = topology.near_pattern[nodes]
            table = np.empty((int(np.diff(patterns.first)[pattern].sum()), 3))
        every, start, ring, cells = kernels.cut(nodes, topology.links, number, table)
        count = len(nodes)
        row = np.repeat(np.arange(count), np.diff(start))
        joined = ring < count
        graph = scipy.sparse.csr_matrix(
            (np.ones(int(joined.sum()), dtype=np.int8), (row[joined], ring[joined])), shape=(count, count)
        )
        parts, part = scipy.sparse.csgraph.connected_components(graph, directed=False)
        stars, weights = Stars(start, ring, pattern, patterns), None if table is None else table[: len(cells)]
        return cls(count, every, stars, cells, weights, part.astype(np.int32), int(parts))

    @property
    def nodes(self) -> Ints:
        """(count,) places in memory of the moved nodes."""
        return self.every[: self.count]

    def only(self, topology: Topology, wanted: Flags) -> Patch:
        """The wanted ones (parts,) of its pieces, as one patch."""
        return self if wanted.all() else Patch.of(topology, self.nodes[wanted[self.part]])

    def pieces(self, topology: Topology, wanted: Flags) -> Iterator[Patch]:
        """The wanted ones (parts,) of its pieces, as patches."""
        for piece in np.flatnonzero(wanted):
            yield self if self.parts == 1 else Patch.of(topology, self.nodes[self.part == piece])


def in_order(topology: Topology, chosen: Flags) -> Ints:
    """The places in memory of the chosen free nodes (N, bool) in the order in which they are visited: colour, then id.

    Neither depends on coordinates.
    """
    nodes = np.flatnonzero(chosen).astype(np.int32)
    return nodes[np.lexsort((topology.memory[nodes], topology.near_colours[nodes]))]


def free_nodes_of(topology: Topology, rows: Flags) -> Flags:
    """(N,) which free nodes some rows of ``near`` (T, bool) have."""
    return free_among(topology, topology.near[rows])


def free_among(topology: Topology, nodes: Ints) -> Flags:
    """(N,) which nodes are free and among some, by places in memory."""
    chosen = np.zeros(len(topology.memory), dtype=bool)
    chosen[nodes.ravel()] = True
    return chosen & topology.near_free
