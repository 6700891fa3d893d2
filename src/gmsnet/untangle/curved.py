"""Invalid cells of second-order meshes made valid: straight cells first, then inner middles, then corners.

Where straight cells are inverted, they are untangled as those of first-order meshes are, in a copy, and middles follow.
Then the mesh is mended patch by patch. Each patch of cells around invalid ones is a transaction. What stands at its
end is the best state on the way: the fewest cells that are not certainly valid, none of them valid at first, and no
cell with positive corners at first without them now. Boundary middles and all else that is not free stays.

Source of the idea: T. Toulorge, C. Geuzaine, J.-F. Remacle, J. Lambrechts, "Robust untangling of curvilinear meshes",
Journal of Computational Physics 254, 2013 (patches around invalid cells, bounds from Bernstein coefficients).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.descend import straighten, untangling_sweep
from gmsnet.kernels.curved.stars import CENTRE, NO_EDGE, CurvedMesh, dragged
from gmsnet.kernels.simplex.bernstein import QUAD9
from gmsnet.kernels.simplex.jacobian import judge_cells, straight_signs
from gmsnet.kernels.star.guard import Precision
from gmsnet.topology.topology import Topology
from gmsnet.untangle import untangle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

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


class CurvedScore(NamedTuple):
    """How many cells are not certainly valid, before and after."""

    before: int
    after: int


def free_inner(mesh: CurvedMesh, free: Mask) -> Mask:
    """(N,) the middles and centres that may move by themselves: free ones, with a cell at each side."""
    inner = np.zeros(len(free), dtype=bool)
    inner[mesh.edges[mesh.dragged, 2]] = True
    inner[mesh.cells[mesh.centre_dragged, CENTRE]] = True
    return inner & free


def untangle_curved(
    points: Floats,
    mesh: CurvedMesh,
    free: Mask,
    precision: Precision = Precision(),  # noqa: B008
    straight: Topology | None = None,
) -> CurvedScore:
    """Moves free nodes (N,) until as many cells as can be are certainly valid.

    points: (N, 2) float64, C-contiguous; they and the stored offsets of the mesh change in place. free: corners,
    middles and centres that may move; those of the boundary must not be among them. straight: the connectivity of the
    mesh with straight cells, of whose free nodes corners are; None: straight cells are not untangled for themselves.
    """
    before = int((_signs(points, mesh, np.arange(len(mesh.cells)), precision) != 1).sum())
    if straight is not None:
        _untangle_straight(points, mesh, free, precision, straight)
    return CurvedScore(before, _mend(points, mesh, free, precision))


def _untangle_straight(points: Floats, mesh: CurvedMesh, free: Mask, precision: Precision, straight: Topology) -> None:
    """Takes the mesh with its straight cells untangled, and mended, if fewer cells are invalid and no other ones."""
    every = np.arange(len(mesh.cells))
    if (_straight_signs(points, mesh, every, precision) == 1).all():
        return
    untangled = untangle(points, straight, precision).points
    moved = np.flatnonzero((untangled != points).any(axis=1) & free & mesh.corner)
    trial = points.copy()
    twin = mesh._replace(ratio=mesh.ratio.copy(), centre_ratio=mesh.centre_ratio.copy())
    dragged(trial, twin, moved, untangled[moved], precision.single)
    bad = twin.cells[_signs(trial, twin, every, precision) != 1]
    inner = np.flatnonzero(free_inner(mesh, free))
    straighten(trial, twin, inner[np.isin(inner, bad)], precision.single)
    _mend(trial, twin, free, precision)
    was, now = (_signs(p, m, every, precision) for p, m in ((points, mesh), (trial, twin)))
    before, after = (_straight_signs(p, m, every, precision) for p, m in ((points, mesh), (trial, twin)))
    lost = ((was == 1) & (now != 1)) | ((before != -1) & (after != 1))
    if (now != 1).sum() < (was != 1).sum() and not lost.any():
        points[:], mesh.ratio[:], mesh.centre_ratio[:] = trial, twin.ratio, twin.centre_ratio


def _mend(points: Floats, mesh: CurvedMesh, free: Mask, precision: Precision) -> int:
    """Mends a mesh patch by patch; returns how many cells are not certainly valid."""
    inner = free_inner(mesh, free)
    corner = free & mesh.corner
    bad = np.flatnonzero(_signs(points, mesh, np.arange(len(mesh.cells)), precision) != 1)
    for rings, sweeps, thresholds in TRIES:
        for cells in _patches(mesh, bad, rings):
            _Patch(points, mesh, cells, inner, corner, precision).untangle(sweeps, thresholds)
        bad = bad[_signs(points, mesh, bad, precision) != 1]
        if not bad.size:
            break
    return len(bad)


def _signs(points: Floats, mesh: CurvedMesh, cells: Ints, precision: Precision) -> NDArray[np.int8]:
    sign, quality = np.zeros(len(cells), dtype=np.int8), np.empty(len(cells))
    table, kinds = mesh.cells[cells], mesh.kinds[cells]
    judge_cells(points, table, kinds, precision.unit, precision.grain, 0, len(cells), sign, quality)
    return sign


def _straight_signs(points: Floats, mesh: CurvedMesh, cells: Ints, precision: Precision) -> NDArray[np.int8]:
    sign = np.zeros(len(cells), dtype=np.int8)
    straight_signs(points, mesh.cells[cells], mesh.kinds[cells], *precision[:2], sign)
    return sign


def _around(mesh: CurvedMesh, cells: Ints) -> Ints:
    """The cells that share a node with some, these included."""
    nodes = np.unique(mesh.cells[cells])
    return np.unique(_rows(mesh.cell_start, mesh.cell_of, nodes[nodes >= 0]))


def _rows(start: Ints, items: NDArray[np.int32], nodes: NDArray[np.int32]) -> Ints:
    """The items of a CSR list that stand beside some nodes."""
    low, count = start[nodes], start[nodes + 1] - start[nodes]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(items[np.repeat(low, count) + within], dtype=np.int64)


def _patches(mesh: CurvedMesh, bad: Ints, rings: int) -> list[Ints]:
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


class _Patch:
    """Some cells, and the nodes that have no other cells: moving these changes none outside."""

    def __init__(
        self, points: Floats, mesh: CurvedMesh, cells: Ints, inner: Mask, corner: Mask, precision: Precision
    ) -> None:
        self.points, self.mesh, self.cells, self.precision = points, mesh, cells, precision
        uses = mesh.cells[cells]
        nodes, count = np.unique(uses[uses >= 0], return_counts=True)
        nodes = nodes[count == mesh.cell_start[nodes + 1] - mesh.cell_start[nodes]]
        self.inner, self.corner = nodes[inner[nodes]], nodes[corner[nodes]]
        edges = mesh.edge_of_middle[self.inner]
        self.nodes, self.edges = np.concatenate([self.inner, self.corner]), edges[edges != NO_EDGE]
        self.centred = cells[mesh.kinds[cells] == QUAD9]
        self.valid, self.straight = self.signs(), self.straight_signs()
        self.fewest = int((self.valid != 1).sum())
        self.best = self.state()

    def signs(self) -> NDArray[np.int8]:
        return _signs(self.points, self.mesh, self.cells, self.precision)

    def straight_signs(self) -> NDArray[np.int8]:
        return _straight_signs(self.points, self.mesh, self.cells, self.precision)

    def state(self) -> tuple[Floats, Floats, Floats]:
        mesh = self.mesh
        return self.points[self.nodes], mesh.ratio[self.edges], mesh.centre_ratio[self.centred]

    def untangle(self, sweeps: int, thresholds: tuple[float, ...]) -> None:
        """Leaves the best state that is found, the first one if there is no better."""
        if self.fewest and self.nodes.size:
            self._search(sweeps, thresholds)
            points, ratio, centre_ratio = self.best
            self.points[self.nodes] = points
            self.mesh.ratio[self.edges], self.mesh.centre_ratio[self.centred] = ratio, centre_ratio

    def _search(self, most: int, thresholds: tuple[float, ...]) -> None:
        bad = self.mesh.cells[self.cells[self.valid != 1]]
        straighten(self.points, self.mesh, self.inner[np.isin(self.inner, bad)], self.precision.single)
        if self._judge():
            return
        for nodes, sweeps in ((self.inner, INNER_SWEEPS), (self.nodes, most)):
            for threshold in thresholds:
                for _ in range(sweeps):
                    if not untangling_sweep(self.points, self.mesh, nodes, threshold, self.precision.single):
                        break
                    if self._judge():
                        return

    def _judge(self) -> bool:
        """Keeps the state if it is the best so far; True if all cells are certainly valid."""
        sign = self.signs()
        fewer = int((sign != 1).sum())
        lost = ((self.valid == 1) & (sign != 1)).any()
        if fewer < self.fewest and not lost and not ((self.straight != -1) & (self.straight_signs() != 1)).any():
            self.fewest, self.best = fewer, self.state()
        return self.fewest == 0
