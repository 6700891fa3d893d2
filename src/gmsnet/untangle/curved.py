"""Invalid cells of second-order meshes made valid: inner middles first, then corners, patch by patch.

Each patch of cells around invalid ones is a transaction. What stands at its end is the best state on the way: the
fewest cells that are not certainly valid, none of them valid at first, and no cell with positive corners at first
without them now. Boundary middles and all else that is not free stays.

Source of the idea: T. Toulorge, C. Geuzaine, J.-F. Remacle, J. Lambrechts, "Robust untangling of curvilinear meshes",
Journal of Computational Physics 254, 2013 (patches around invalid cells, bounds from Bernstein coefficients).
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.kernels.star.guard import Precision
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.untangle import untangle
from gmsnet.untangle.curved_corners import bad_for_good
from gmsnet.untangle.space import untangle_volume

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Signs = NDArray[np.int8]


class Cells(Protocol):
    """Second-order cells of a plane or of space, methods.planar_cells and methods.solid_cells."""

    @property
    def points(self) -> Floats:
        """(N, dim), which change in place."""
        ...

    @property
    def mesh(self) -> Any:
        """With ``cells``, ``cell_start`` and ``cell_of``."""
        ...

    @property
    def precision(self) -> Precision:
        """How exactly coordinates are known."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """What the numbers in ``mesh.kinds`` stand for."""
        ...

    @property
    def inner(self) -> Mask:
        """(N,) the nodes that are no corners and may move."""
        ...

    @property
    def corner(self) -> Mask:
        """(N,) the corners that may move."""
        ...

    def signs(self, cells: Ints) -> Signs:
        """1 where a cell is certified valid."""
        ...

    def straight_signs(self, cells: Ints) -> Signs:
        """The same of the corners of straight cells, −1 where one is certainly not positive."""
        ...

    def offsets_at(self, nodes: Ints, cells: Ints) -> Any:
        """The numbers of the offsets of some nodes and cells."""
        ...

    def offsets(self, at: Any) -> Any:
        """The offsets with these numbers."""
        ...

    def keep(self, at: Any, offsets: Any) -> None:
        """Keeps these of them."""
        ...

    def copied(self) -> Any:
        """The same, that changes for itself."""
        ...

    def become(self, other: Any) -> None:
        """Takes over the places and offsets of a copy."""
        ...

    def go(self, nodes: Ints, places: Floats) -> None:
        """Puts corners there with what they take along; nothing is judged."""
        ...

    def straighten(self, nodes: Ints) -> None:
        """Puts nodes that are no corners at their straight places."""
        ...

    def untangling_sweep(self, nodes: Ints, threshold: float) -> int:
        """A step of descent for each node; how many have moved."""
        ...


# From try to try: rings of cells around the invalid ones, sweeps for each τ, and the τ, over the mean size of a cell's
# coefficients. A large τ spreads room between cells; a small one asks of no cell more than it has to give.
TRIES = (
    (1, 12, (0.3, 0.1, 0.03, 0.01)),
    (2, 25, (0.1, 0.02)),
    (4, 50, (0.3, 0.1, 0.03, 0.01)),
    (8, 200, (0.1, 0.02)),
    (8, 200, (0.02,)),
)
INNER_SWEEPS = 4  # for each τ: of inner middles alone, before corners move, too
# What tries of so many rings or more take of a mesh at most: the squared numbers of nodes of the cells around each node
# that is visited. 12 sweeps of 2,000 hexahedra of 20 nodes (5 to 15 s), or 1,000 of 1,000 six-node triangles.
LARGE, BUDGET = 4, 2e8


class CurvedScore(NamedTuple):
    """How many cells are not certainly valid, before and after. for_good: (C,) those that cannot be valid."""

    before: int
    after: int
    for_good: Mask


def untangle_curved(
    curved: Cells, straight: Topology | Volume | None = None, executor: Executor = serial
) -> CurvedScore:
    """Moves free nodes until as many cells as can be are certainly valid.

    straight: the connectivity of the mesh with straight cells, of whose free nodes corners are; None: straight cells
    are not untangled for themselves.
    """
    before = int((curved.signs(_all(curved)) != 1).sum())
    if straight is not None:
        _untangle_straight(curved, straight, executor)
    return CurvedScore(before, *_mend(curved))


def _all(curved: Cells) -> Ints:
    return np.arange(len(curved.mesh.cells))


def _untangle_straight(curved: Cells, straight: Topology | Volume, executor: Executor) -> None:
    """Takes the mesh with its straight cells untangled, and mended, if fewer cells are invalid and no other ones."""
    every = _all(curved)
    was, before = curved.signs(every), curved.straight_signs(every)
    inverted = int((before != 1).sum())
    if not inverted:
        return
    if isinstance(straight, Volume):
        untangled = untangle_volume(curved.points, straight, curved.precision, executor, inverted).points
    else:
        untangled = untangle(curved.points, straight, curved.precision).points
    moved = np.flatnonzero((untangled != curved.points).any(axis=1) & curved.corner)
    trial = curved.copied()
    trial.go(moved, untangled[moved])
    bad = trial.mesh.cells[trial.signs(every) != 1]
    inner = np.flatnonzero(trial.inner)
    trial.straighten(inner[np.isin(inner, bad)])
    _mend(trial)
    now, after = trial.signs(every), trial.straight_signs(every)
    lost = ((was == 1) & (now != 1)) | ((before != -1) & (after != 1))
    if (now != 1).sum() < (was != 1).sum() and not lost.any():
        curved.become(trial)


def _mend(curved: Cells) -> tuple[int, Mask]:
    """Mends a mesh patch by patch; returns how many cells are not certainly valid, and which cannot be."""
    mesh, nodes = curved.mesh, _Nodes(curved.inner, curved.corner)
    bad, for_good = np.flatnonzero(curved.signs(_all(curved)) != 1), np.zeros(len(mesh.cells), dtype=bool)
    may = nodes.inner | nodes.corner
    for_good[bad] = bad_for_good(curved.points, mesh.cells[bad], mesh.kinds[bad], curved.names, may)
    bad = bad[~for_good[bad]]
    left = BUDGET
    for rings, sweeps, thresholds in TRIES:
        for cells in _patches(mesh, bad, rings):
            spent = _Patch(curved, cells, nodes, for_good).untangle(sweeps, thresholds, left)
            left -= spent if rings >= LARGE else 0.0
        bad = bad[curved.signs(bad) != 1]
        if not bad.size or left <= 0.0:
            break
    return len(bad) + int(np.count_nonzero(for_good)), for_good


def _around(mesh: Any, cells: Ints) -> Ints:
    """The cells that share a node with some, these included."""
    nodes = np.unique(mesh.cells[cells])
    return np.unique(_rows(mesh.cell_start, mesh.cell_of, nodes[nodes >= 0]))


def _rows(start: Ints, items: NDArray[np.int32], nodes: NDArray[np.integer[Any]]) -> Ints:
    """The items of a CSR list that stand beside some nodes."""
    low, count = start[nodes], start[nodes + 1] - start[nodes]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(items[np.repeat(low, count) + within], dtype=np.int64)


def _patches(mesh: Any, bad: Ints, rings: int) -> list[Ints]:
    """The bad cells with so many rings of cells around them; those that meet are one patch."""
    patches: list[Ints] = []
    left = bad
    while left.size:
        seeds = left[:1]
        while True:
            cells = seeds
            for _ in range(rings):
                cells = _around(mesh, cells)
            more = left[np.isin(left, cells)]
            if len(more) == len(seeds):
                break
            seeds = more
        patches.append(cells)
        left = left[~np.isin(left, seeds)]
    return patches


class _Nodes(NamedTuple):
    """(N,) those that may move: the ones that are no corners, and the corners."""

    inner: Mask
    corner: Mask


class _Patch:
    """Some cells, and the nodes that have no other cells: moving these changes none outside.

    for_good: (C,) the cells that stay invalid, which are not counted.
    """

    def __init__(self, curved: Cells, cells: Ints, may: _Nodes, for_good: Mask) -> None:
        self.curved, self.cells = curved, cells
        mesh = curved.mesh
        uses = mesh.cells[cells]
        nodes, count = np.unique(uses[uses >= 0], return_counts=True)
        nodes = nodes[count == mesh.cell_start[nodes + 1] - mesh.cell_start[nodes]]
        self.inner, self.corner = nodes[may.inner[nodes]], nodes[may.corner[nodes]]
        self.nodes, self.at = np.concatenate([self.inner, self.corner]), curved.offsets_at(self.inner, cells)
        self.valid, self.straight = curved.signs(cells), curved.straight_signs(cells)
        self.open = ~for_good[cells]
        self.fewest = int((self.open & (self.valid != 1)).sum())
        self.best = self.state()

    def state(self) -> tuple[Floats, Any]:
        return self.curved.points[self.nodes], self.curved.offsets(self.at)

    def untangle(self, sweeps: int, thresholds: tuple[float, ...], budget: float) -> float:
        """Leaves the best state that is found, the first one if there is no better; returns what it took of BUDGET.

        An interrupted search leaves its best state, too.
        """
        if not (self.fewest and self.nodes.size):
            return 0.0
        try:
            return self._search(sweeps, thresholds, budget)
        finally:
            points, offsets = self.best
            self.curved.points[self.nodes] = points
            self.curved.keep(self.at, offsets)

    def _search(self, most: int, thresholds: tuple[float, ...], budget: float) -> float:
        bad = self.curved.mesh.cells[self.cells[self.open & (self.valid != 1)]]
        self.curved.straighten(self.inner[np.isin(self.inner, bad)])
        spent = 0.0
        if self._judge():
            return spent
        for nodes, sweeps in ((self.inner, INNER_SWEEPS), (self.nodes, most)):
            cost = self._cost(nodes)
            for threshold in thresholds:
                for _ in range(sweeps):
                    if spent >= budget or not self.curved.untangling_sweep(nodes, threshold):
                        break
                    spent += cost
                    if self._judge():
                        return spent
        return spent

    def _cost(self, nodes: Ints) -> float:
        """Of a sweep over some of the nodes: the squared numbers of nodes of all cells around each."""
        mesh = self.curved.mesh
        sizes = np.array([CELLS[name].nodes or 0 for name in self.curved.names], dtype=np.float64)
        around = _rows(mesh.cell_start, mesh.cell_of, nodes)
        return float((sizes[mesh.kinds[around]] ** 2).sum())

    def _judge(self) -> bool:
        """Keeps the state if it is the best so far; True if all cells are certainly valid."""
        sign = self.curved.signs(self.cells)
        fewer = int((self.open & (sign != 1)).sum())
        lost = ((self.valid == 1) & (sign != 1)).any()
        straight = self.curved.straight_signs
        if fewer < self.fewest and not lost and not ((self.straight != -1) & (straight(self.cells) != 1)).any():
            self.fewest, self.best = fewer, self.state()
        return self.fewest == 0
