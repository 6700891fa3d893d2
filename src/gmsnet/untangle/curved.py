"""Invalid cells of second-order meshes made valid: inner middles first, then corners, patch by patch.

Each patch of cells around invalid ones is a transaction (untangle/curved_patch.py). Boundary middles and all else that
is not free stays.

Source of the idea: T. Toulorge, C. Geuzaine, J.-F. Remacle, J. Lambrechts, "Robust untangling of curvilinear meshes",
Journal of Computational Physics 254, 2013 (patches around invalid cells, bounds from Bernstein coefficients).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.untangle import untangle
from gmsnet.untangle.curved_cells import Cells, Ints, Mask
from gmsnet.untangle.curved_corners import bad_for_good
from gmsnet.untangle.curved_patch import CurvedPatch, Nodes, rows_of
from gmsnet.untangle.space import untangle_volume

# From try to try: rings of cells around the invalid ones, sweeps for each τ, and the τ, over the mean size of a cell's
# coefficients. A large τ spreads room between cells; a small one asks of no cell more than it has to give.
TRIES = (
    (1, 12, (0.3, 0.1, 0.03, 0.01)),
    (2, 25, (0.1, 0.02)),
    (4, 50, (0.3, 0.1, 0.03, 0.01)),
    (8, 200, (0.1, 0.02)),
    (8, 200, (0.02,)),
)
# What tries of so many rings or more take of a mesh at most: the squared numbers of nodes of the cells around each node
# that is visited. 12 sweeps of 2,000 hexahedra of 20 nodes (5 to 15 s), or 1,000 of 1,000 six-node triangles.
LARGE, BUDGET = 4, 2e8
CLOSE = tuple(row for row in TRIES if row[0] < LARGE)  # around what no try has mended: it is given back

# Of what is given back, sweeps by guarded moves go on while they mend a cell: rounds at most, sweeps for each τ.
ROUNDS, SWEEPS, TAUS = 8, 12, (0.3, 0.1, 0.03)
AGAIN = 3  # times at most, all of it while it mends some
LEAST_SHAPE = 0.3  # of a straight cell, 1/q or η, to which they may flatten it


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
    before = left = int((curved.signs(_all(curved)) != 1).sum())
    for _ in range(AGAIN):
        after, for_good = _untangled(curved, straight, executor)
        if after == np.count_nonzero(for_good) or after >= left:
            break
        left = after
    return CurvedScore(before, after, for_good)


def _untangled(curved: Cells, straight: Topology | Volume | None, executor: Executor) -> tuple[int, Mask]:
    """How many cells are not certainly valid once all has been tried, and which cannot be."""
    for give_back in (False, True):  # what is given back stays bent, so that it is the last resort
        if straight is not None:
            _untangle_straight(curved, straight, executor, give_back)
        after, for_good = _mend(curved, give_back)
        if after == np.count_nonzero(for_good):
            return after, for_good
    return _guarded(curved, for_good), for_good


def _all(curved: Cells) -> Ints:
    return np.arange(len(curved.mesh.cells))


def _untangle_straight(curved: Cells, straight: Topology | Volume, executor: Executor, give_back: bool) -> None:
    """Takes the mesh with its straight cells untangled, and mended, if fewer cells are invalid and no other ones."""
    every = _all(curved)
    inverted = int((curved.straight_signs(every) != 1).sum())
    if not inverted:
        return
    if isinstance(straight, Volume):
        untangled = untangle_volume(curved.points, straight, curved.precision, executor, inverted).points
    else:
        untangled = untangle(curved.points, straight, curved.precision).points
    moved = np.flatnonzero((untangled != curved.points).any(axis=1) & curved.corner)
    whole = CurvedPatch(curved, every, _nodes(curved), np.zeros(len(every), dtype=bool), give_back)
    with whole.at_best():
        curved.go(moved, untangled[moved])
        bad = curved.mesh.cells[curved.signs(every) != 1]
        curved.straighten(whole.inner[np.isin(whole.inner, bad)])
        _mend(curved, give_back)
        whole.judge()


def _nodes(curved: Cells) -> Nodes:
    return Nodes(curved.inner, curved.corner)


def _mend(curved: Cells, give_back: bool) -> tuple[int, Mask]:
    """Mends a mesh patch by patch; returns how many cells are not certainly valid, and which cannot be."""
    mesh, nodes = curved.mesh, _nodes(curved)
    bad, for_good = np.flatnonzero(curved.signs(_all(curved)) != 1), np.zeros(len(mesh.cells), dtype=bool)
    may = nodes.inner | nodes.corner
    for_good[bad] = bad_for_good(curved.points, mesh.cells[bad], mesh.kinds[bad], curved.names, may)
    bad = bad[~for_good[bad]]
    left = BUDGET
    for rings, sweeps, thresholds in CLOSE if give_back else TRIES:
        for cells in _patches(mesh, bad, rings):
            patch = CurvedPatch(curved, cells, nodes, for_good, give_back)
            with patch.at_best():
                spent = patch.untangle(sweeps, thresholds, left)
            left -= spent if rings >= LARGE else 0.0
        bad = bad[curved.signs(bad) != 1]
        if not bad.size or left <= 0.0:
            break
    return len(bad) + int(np.count_nonzero(for_good)), for_good


def _guarded(curved: Cells, for_good: Mask) -> int:
    """Mends more of what has been given back by moves that lose no valid cell; returns how many stay invalid.

    Nodes of rounds that mend none go back.
    """
    mesh, may = curved.mesh, curved.inner | curved.corner
    bad = np.flatnonzero(curved.signs(_all(curved)) != 1)
    whole = CurvedPatch(curved, _all(curved), _nodes(curved), for_good, False)
    with whole.at_best():
        for _ in range(ROUNDS):
            before, nodes = len(bad), sorted_unique(mesh.cells[_around(mesh, bad)])
            nodes = nodes[nodes >= 0]
            nodes = nodes[may[nodes]]
            for threshold in TAUS:
                for _ in range(SWEEPS):
                    if not curved.guarded_sweep(nodes, threshold, LEAST_SHAPE):
                        break
            bad = bad[curved.signs(bad) != 1]
            if whole.judge() or len(bad) == before:
                break
    return whole.fewest + int(np.count_nonzero(for_good))


def _around(mesh: Any, cells: Ints) -> Ints:
    """The cells that share a node with some, these included."""
    nodes = sorted_unique(mesh.cells[cells])
    return sorted_unique(rows_of(mesh.cell_start, mesh.cell_of, nodes[nodes >= 0]))


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
