"""The barrier on a patch, node by node: Newton sweeps, with an ε that follows the worst cell of each piece."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.simplex.mean_ratio2 import TWO_SQRT3
from gmsnet.kernels.untangle import barrier
from gmsnet.kernels.untangle import cells as kernels
from gmsnet.untangle.cells import most_of_cells
from gmsnet.untangle.patch import Flags, Floats, Patch, free_nodes_of
from gmsnet.untangle.result import UntanglingStep
from gmsnet.untangle.state import UntanglingState

SWEEPS = 12
POLISH, SLIVER = 3, 1e-4  # so many sweeps at the end where a cell that was moved has a 1/q below this
LEAST_EPSILON = 1e-3  # in local areas
CLOSING = 0.2  # ε as a share of the worst cell's D while that is negative: Garanzha et al., their listing 1
AVERAGING = 4  # rounds of averaging for the local area


def newton(tangle: UntanglingState, patch: Patch, points: Floats) -> tuple[Flags, int]:
    """Sweeps with an ε of its own for each piece, until all cells are certified; which pieces are not, and sweeps.

    points: (m, 2) of the patch, changed.
    """
    precision = tangle.precision
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    worst = np.empty(patch.parts)
    for done in range(SWEEPS + 1):
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, worst)
        if (worst > 0.0).all() and tangle.certified(points, patch):
            return worst <= 0.0, done
        if done < SWEEPS:
            epsilon = closing(worst)[patch.part]
            sweep(tangle, patch, points, scale, epsilon, barrier.FREELY)
    open_ = ~(worst > 0.0)
    return open_ if open_.any() else ~open_, SWEEPS  # certified but for rounding: which piece is not known


def sweep(
    tangle: UntanglingState,
    patch: Patch,
    points: Floats,
    scale: Floats,
    epsilon: Floats,
    mode: int,
    floor: float = -math.inf,
) -> int:
    """One sweep of Newton steps over the moved nodes of a patch; see the kernel."""
    precision, nodes = tangle.precision, np.arange(patch.count, dtype=np.int32)
    single = mode != barrier.FREELY and precision.single
    moved: int = barrier.sweep(
        points, nodes, patch.stars, scale, epsilon, mode, precision.unit, precision.grain, single, floor
    )
    return moved


def closing(worst: Floats) -> Floats:
    """ε for the worst D over the local area: so wide that the cell still feels it, and narrower as it gets better."""
    return np.sqrt(LEAST_EPSILON**2 + (CLOSING * np.minimum(worst, 0.0)) ** 2)


def polish(tangle: UntanglingState) -> UntanglingStep:
    """A few Newton sweeps on the stars of slivers that untangling has left; certified stars stay so."""
    slivers, topology = np.empty(len(tangle.bad), dtype=bool), tangle.topology
    kernels.find_slivers(tangle.points, tangle.before, topology.simplices, SLIVER / TWO_SQRT3, slivers)
    patch = Patch.of(topology, tangle.in_order(free_nodes_of(topology, slivers)))
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    epsilon = np.full(patch.count, LEAST_EPSILON)
    for _ in range(POLISH):
        sweep(tangle, patch, points, scale, epsilon, barrier.CERTIFIED)
    tangle.put(points, patch)
    return UntanglingStep("barrier, slivers", patch.count, POLISH, tangle.left)  # no cell changes its sign by that


def keep_gains(tangle: UntanglingState, before: Floats, bad: Flags) -> None:
    """Pieces that have moved since some points (N, 2), without fewer cells being bad than were then, go back there."""
    topology = tangle.topology
    patch = Patch.of(topology, tangle.in_order((tangle.points != before).any(axis=1)))
    piece = np.full(len(tangle.points), -1, dtype=np.int32)
    piece[patch.nodes] = patch.part
    rows = np.flatnonzero(bad | tangle.bad)
    rows, of_cell = most_of_cells(topology, rows, piece[topology.near[rows]].max(axis=1, initial=-1))
    # No cell has moved nodes of two.
    rows, of_cell = rows[of_cell >= 0], of_cell[of_cell >= 0]
    was, now = (np.bincount(of_cell[flags[rows]], minlength=patch.parts) for flags in (bad, tangle.bad))
    useless = patch.nodes[(now >= was)[patch.part]]
    tangle.points[useless] = before[useless]
    tangle.look()
