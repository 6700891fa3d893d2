"""The state of one untangling: the points as they are now, and which cells are still to be untangled."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.untangle import cells, untangling
from gmsnet.measure.signs import exact_signs
from gmsnet.topology.topology import Topology
from gmsnet.untangle.cells import first_rows, whole_cells
from gmsnet.untangle.patch import Flags, Floats, Ints, Patch, free_nodes_of, in_order
from gmsnet.untangle.reach import Reach


class UntanglingState:
    """points: (N, 2) in memory order, of which free nodes are moved. before: the same at first, not changed.

    bad: (T,) the rows of ``Topology.near`` of the cells that are to be untangled: not certified
    (kernels.untangle.cells), and inverted at first (was_bad) or with a node that has moved. left: how many cells.
    frozen: (N,) free nodes that stand still all the same. work: iterations of L-BFGS so far, times nodes. reach: of
    which mesh this is a part.
    """

    before: Floats
    topology: Topology
    precision: Precision
    points: Floats
    was_bad: Flags
    bad: Flags
    frozen: Flags
    left: int
    reach: Reach

    def __init__(self, points: Floats, topology: Topology, precision: Precision, reach: Reach | None = None) -> None:
        self.before, self.topology, self.precision = points, topology, precision
        self.reach = reach or Reach.whole(topology)
        self.points = points.copy()
        self.was_bad = whole_cells(topology, exact_signs(points, topology.near, topology.near_orientation) <= 0)
        self.bad = np.empty(len(topology.near), dtype=bool)
        self.left = self.work = 0
        self.frozen = np.zeros(len(points), dtype=bool)
        self.look()

    @cached_property
    def worst(self) -> float:
        """An upper bound of the minimum D/L at first of the cells that can change, 0 if none of them was inverted."""
        precision = self.precision
        return min(
            float(cells.least_ratio(self.before, self.topology.changeable, precision.unit, precision.grain)), 0.0
        )

    def look(self) -> int:
        """Finds the bad cells of the points as they are now; returns how many there are."""
        precision, topology = self.precision, self.topology
        self.left = int(
            cells.find_bad(
                self.points, self.before, topology.simplices, self.was_bad, precision.unit, precision.grain, self.bad
            )
        )
        if self.left and topology.near_cells is not None:
            self.bad = whole_cells(topology, self.bad)
            self.left = len(first_rows(topology, self.bad))
        return self.left

    def bad_nodes(self) -> Flags:
        """(N,) the free nodes of bad cells, without those that are frozen."""
        return free_nodes_of(self.topology, self.bad) & ~self.frozen

    def worst_first(self, nodes: Ints) -> Ints:
        """Some free nodes, those with the largest share of bad cells first: most likely they are the culprits.

        When it is the turn of their neighbours, these have nothing to mend any more.
        """
        precision = self.precision
        shares = untangling.bad_shares(self.points, nodes, self.topology.links, precision.unit, precision.grain)
        return nodes[np.argsort(-shares, kind="stable")]

    def bad_among(self, moved: Flags) -> Flags:
        """(N,) of some free nodes that may have moved, and of their neighbours, those with an uncertified cell."""
        topology, precision = self.topology, self.precision
        around = moved.copy()
        untangling.grow(around, topology.near_start, topology.near_ring, 1)
        around &= ~self.frozen
        nodes = np.flatnonzero(around).astype(np.int32)  # as elsewhere, so that nothing is compiled twice
        shares = untangling.bad_shares(self.points, nodes, topology.links, precision.unit, precision.grain)
        around[nodes[shares == 0.0]] = False
        return around

    def average(self, nodes: Ints, weighing: int) -> None:
        """One Laplacian sweep over those of some free nodes that have bad cells, which no guard holds back.

        The worst come first. weighing: see the kernel.
        """
        topology, precision = self.topology, self.precision
        untangling.average(
            self.points, self.worst_first(nodes), topology.links, weighing, precision.unit, precision.grain,
            precision.single,
        )  # fmt: skip

    def around(self, rings: int) -> Patch:
        """The patch of the free nodes of bad cells and those within so many rings of them."""
        chosen = self.bad_nodes()
        untangling.grow(chosen, self.topology.near_start, self.topology.near_ring, rings)
        chosen &= ~self.frozen
        return Patch.of(self.topology, self.in_order(chosen))

    def in_order(self, chosen: Flags) -> Ints:
        """The places in memory of the chosen free nodes (N, bool) in the order in which they are visited."""
        self.reach.choose(chosen)
        return in_order(self.topology, chosen)

    def rounded(self, points: Floats) -> Floats:
        """As they will be kept."""
        return self.precision.rounded(points)

    def uncertified(self, points: Floats, patch: Patch) -> int:
        """How many cells of a patch are not certified, its points (m, 2) rounded."""
        precision = self.precision
        kept = points
        if precision.single:
            kept = points.copy()
            kept[: patch.count] = self.rounded(points[: patch.count])
        return int(untangling.uncertified(kept, patch.cells, precision.unit, precision.grain))

    def certified(self, points: Floats, patch: Patch) -> bool:
        """Are all cells of a patch certified, its points (m, 2) rounded?"""
        return not self.uncertified(points, patch)

    def put(self, points: Floats, patch: Patch) -> None:
        """Takes over the moved points of a patch (m, 2)."""
        self.points[patch.nodes] = self.rounded(points[: patch.count])
