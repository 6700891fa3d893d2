"""Some second-order cells untangled as a transaction: what stands at its end is the best state on the way.

That has the fewest cells that are not certainly valid, none of them valid at first, and no cell with positive corners
at first without them now. A state in which cells break this is not taken. On demand it is, with their nodes back where
they were at first, until no cell does: what cannot be mended then costs no more than the cells around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.untangle.curved_cells import Cells, Floats, Ints, Mask, Signs

INNER_SWEEPS = 4  # for each τ: of inner middles alone, before corners move, too


def rows_of(start: Ints, items: NDArray[np.int32], nodes: NDArray[np.integer[Any]]) -> Ints:
    """The items of a CSR list that stand beside some nodes."""
    low, count = start[nodes], start[nodes + 1] - start[nodes]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(items[np.repeat(low, count) + within], dtype=np.int64)


class Nodes(NamedTuple):
    """(N,) those that may move: the ones that are no corners, and the corners."""

    inner: Mask
    corner: Mask


class CurvedPatch:
    """Some cells, and the nodes that have no other cells: moving these changes none outside.

    for_good: (C,) the cells that stay invalid, which are not counted. give_back: whether nodes of lost cells are taken
    back, so that the rest of a state can be kept. fewest: how many others are not certainly valid
    in the best state so far; lowest: how many were in any state with lost cells whose nodes were taken back.
    """

    def __init__(self, curved: Cells, cells: Ints, may: Nodes, for_good: Mask, give_back: bool) -> None:
        self.curved, self.cells, self.give_back = curved, cells, give_back
        mesh = curved.mesh
        uses = mesh.cells[cells]
        nodes, count = np.unique(uses[uses >= 0], return_counts=True)
        nodes = nodes[count == mesh.cell_start[nodes + 1] - mesh.cell_start[nodes]]
        self.inner, self.corner = nodes[may.inner[nodes]], nodes[may.corner[nodes]]
        self.nodes, self.at = np.concatenate([self.inner, self.corner]), curved.offsets_at(self.inner, cells)
        self.valid, self.straight = curved.signs(cells), curved.straight_signs(cells)
        self.open = ~for_good[cells]
        self.fewest = self.lowest = self._left(self.valid)
        self.first = self.best = self._state()

    @contextmanager
    def at_best(self) -> Iterator[None]:
        """Leaves the best state that was judged, the first one if there is no better; after an interruption, too."""
        try:
            yield
        finally:
            self._put(self.best)

    def untangle(self, most: int, thresholds: tuple[float, ...], budget: float) -> float:
        """Searches a better state; returns what it took of the budget."""
        spent = 0.0
        if not (self.fewest and self.nodes.size):
            return spent
        bad = self.curved.mesh.cells[self.cells[self.open & (self.valid != 1)]]
        self.curved.straighten(self.inner[np.isin(self.inner, bad)])
        if self.judge():
            return spent
        for nodes, sweeps in ((self.inner, INNER_SWEEPS), (self.nodes, most)):
            cost = self._cost(nodes)
            for threshold in thresholds:
                for _ in range(sweeps):
                    if spent >= budget or not self.curved.untangling_sweep(nodes, threshold):
                        break
                    spent += cost
                    if self.judge():
                        return spent
        return spent

    def judge(self) -> bool:
        """Keeps the state if it is the best so far; True if all cells are certainly valid.

        One with lost cells is kept, if at all, without what is taken back for them; the search goes on from it.
        """
        sign = self.curved.signs(self.cells)
        left, lost = self._left(sign), self._lost(sign)
        if not lost.any():
            self._keep(left)
        elif self.give_back and left < self.lowest:
            self.lowest, now = left, self._state()
            self._keep(self._give_back(lost))
            self._put(now)
        return self.fewest == 0

    def _keep(self, left: int) -> None:
        if left < self.fewest:
            self.fewest, self.best = left, self._state()

    def _give_back(self, lost: Mask) -> int:
        """Takes nodes back until no cell is lost; returns how many cells are left."""
        while True:
            self._take_back(self.cells[lost])
            sign = self.curved.signs(self.cells)
            lost = self._lost(sign)
            if not lost.any():
                return self._left(sign)

    def _take_back(self, cells: Ints) -> None:
        """Puts the nodes of some cells to where they were at first; what goes along with them does."""
        curved, (points, kept), inner = self.curved, self.first, len(self.inner)
        back = np.isin(self.nodes, curved.mesh.cells[cells])
        moved = np.flatnonzero(back & (curved.points[self.nodes] != points).any(axis=1))
        if not moved.size:  # else this would never end
            raise RuntimeError("cells are lost of which no node has moved")
        for some in (moved[moved >= inner], moved[moved < inner]):  # centres follow middles, and these follow corners
            curved.go(self.nodes[some], points[some])
        curved.points[self.nodes[back]] = points[back]
        at, now = curved.offsets_at(self.inner[back[:inner]], cells), curved.offsets(self.at)
        curved.keep(self.at, kept)
        wanted = curved.offsets(at)
        curved.keep(self.at, now)
        curved.keep(at, wanted)

    def _left(self, sign: Signs) -> int:
        return int((self.open & (sign != 1)).sum())

    def _lost(self, sign: Signs) -> Mask:
        """Which cells were valid at first and are not so now, or had positive corners and have not."""
        folded = (self.straight != -1) & (self.curved.straight_signs(self.cells) != 1)
        lost: Mask = ((self.valid == 1) & (sign != 1)) | folded
        return lost

    def _state(self) -> tuple[Floats, Any]:
        return self.curved.points[self.nodes], self.curved.offsets(self.at)

    def _put(self, state: tuple[Floats, Any]) -> None:
        points, offsets = state
        self.curved.points[self.nodes] = points
        self.curved.keep(self.at, offsets)

    def _cost(self, nodes: Ints) -> float:
        """Of a sweep over some of the nodes: the squared numbers of nodes of all cells around each."""
        mesh = self.curved.mesh
        sizes = np.array([CELLS[name].nodes or 0 for name in self.curved.names], dtype=np.float64)
        around = rows_of(mesh.cell_start, mesh.cell_of, nodes)
        return float((sizes[mesh.kinds[around]] ** 2).sum())
