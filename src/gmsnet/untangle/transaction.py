"""Of an untangled mesh, what can be taken: nothing positive is inverted for it, nothing inverted worse than the worst.

On its way, untangling may invert cells that were positive. Its result is taken whole if, in the end, there are fewer
inverted cells and nothing stands against it. Else nodes of cells that do go back to where they were, until none is
left; a piece in which that leaves nothing mended goes back as a whole. What is inverted then is tried once more by
moves that keep all that at each step.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels import untangle as kernels
from gmsnet.kernels import untangle_barrier as barrier
from gmsnet.untangle import road
from gmsnet.untangle.patch import Flags, free_nodes_of
from gmsnet.untangle.result import ALL, NOTHING, PART, Stage
from gmsnet.untangle.tangle import Tangle

GUARDED_SWEEPS, GUARDED_RINGS = 30, 2


def take(tangle: Tangle) -> tuple[str, str]:
    """Takes back what cannot be taken; returns how much of what was moved is left, and why not all."""
    if not tangle.left:
        return ALL, ""
    precision, topology = tangle.precision, tangle.topology
    violated = np.empty(len(topology.near), dtype=bool)
    floor = worst(tangle)
    tried, first = moved(tangle).sum(), 0
    while True:
        count = kernels.find_violated(
            tangle.points, tangle.before, topology.near, topology.near_turn, tangle.was_bad, floor, precision.unit,
            precision.grain, violated,
        )  # fmt: skip
        if not count:
            break
        first = first or count
        put_back(tangle, free_nodes_of(topology, violated) & moved(tangle))
    tangle.look()
    road.keep_gains(tangle, tangle.before, tangle.was_bad)
    left = moved(tangle).sum()
    if left == tried:
        return (ALL, "") if left else (NOTHING, "no inverted cell has a node that may move")
    why = f"{first} cells that were positive, or better, would have been inverted" if first else "no cell was mended"
    return (PART if left else NOTHING), why


def worst(tangle: Tangle) -> float:
    """The least D/L of the cells at first."""
    least: float = kernels.least_share(tangle.before, tangle.topology.near, tangle.topology.near_turn)
    return least


def moved(tangle: Tangle) -> Flags:
    """(N,) which nodes are elsewhere than at first."""
    elsewhere: Flags = (tangle.points != tangle.before).any(axis=1)
    return elsewhere


def put_back(tangle: Tangle, nodes: Flags) -> None:
    """Nodes (N, bool) go back to where they were at first."""
    tangle.points[nodes] = tangle.before[nodes]


def guarded(tangle: Tangle) -> Stage:
    """Barrier sweeps around what is left that never do what ``take`` would take back; all or no gain per piece."""
    patch = tangle.around(GUARDED_RINGS)
    points, floor = tangle.points[patch.every], worst(tangle)
    scale = barrier.local_area(points, patch.cells, road.AVERAGING)
    least = np.empty(patch.parts)
    sweeps, precision = 0, tangle.precision
    for _ in range(GUARDED_SWEEPS):
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, least)
        epsilon = road.closing(least)[patch.part]
        sweeps += 1
        if not road.sweep(tangle, patch, points, scale, epsilon, barrier.GUARDED, floor):
            break
    tangle.put(points, patch)
    road.keep_gains(tangle, tangle.before, tangle.was_bad)
    return Stage("barrier, guarded", patch.count, sweeps, tangle.left)
