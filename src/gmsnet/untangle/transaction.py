"""Of an untangled mesh, what can be taken: nothing positive is inverted for it, nothing inverted worse than the worst.

On its way, untangling may invert cells that were positive. Its result is taken whole if, in the end, there are fewer
inverted cells and nothing stands against it. Else nodes of cells that do go back to where they were, until none is
left; a piece in which that leaves nothing mended goes back as a whole. What is inverted then is tried once more by
moves that keep all that at each step.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.simplex.mean_ratio2 import TWO_SQRT3
from gmsnet.kernels.untangle import cells, untangling
from gmsnet.untangle.newton import keep_gains
from gmsnet.untangle.patch import Flags, free_nodes_of
from gmsnet.untangle.result import UntanglingStep
from gmsnet.untangle.state import UntanglingState

BACK_SWEEPS, FINE = 20, 0.1  # a cell between nodes that went back and others may have this 1/q


def take(tangle: UntanglingState) -> str:
    """Takes back what cannot be taken; returns why, or "" if all is taken."""
    if not tangle.left:
        return ""
    precision, topology = tangle.precision, tangle.topology
    violated = np.empty(len(topology.near), dtype=bool)
    floor = tangle.worst
    tried, first = moved(tangle).sum(), 0
    while True:
        count = cells.find_violated(
            tangle.points, tangle.before, topology.simplices, tangle.was_bad, floor, precision.unit, precision.grain,
            violated,
        )  # fmt: skip
        if not count:
            break
        first = first or count
        back = free_nodes_of(topology, violated) & moved(tangle)
        if not back.any():  # else this would never end
            raise RuntimeError("cells are violated of which no node has moved")
        put_back(tangle, back)
    tangle.look()
    keep_gains(tangle, tangle.before, tangle.was_bad)
    if not tried:
        return "no inverted cell has a node that may move"
    if moved(tangle).sum() == tried:
        return ""
    return (
        f"{first} cells that were positive, or better, would have been inverted" if first else "no cell was untangled"
    )


def moved(tangle: UntanglingState) -> Flags:
    """(N,) which nodes are elsewhere than at first."""
    elsewhere: Flags = (tangle.points != tangle.before).any(axis=1)
    return elsewhere


def put_back(tangle: UntanglingState, nodes: Flags) -> None:
    """Nodes (N, bool) go back to where they were at first."""
    tangle.points[nodes] = tangle.before[nodes]


def restore(tangle: UntanglingState) -> UntanglingStep:
    """Nodes that need not be elsewhere go back to their very bits: what was made thin on purpose stays as it was."""
    topology, precision = tangle.topology, tangle.precision
    nodes = tangle.in_order(moved(tangle))
    sweeps = 0
    for _ in range(BACK_SWEEPS):
        sweeps += 1
        if not untangling.go_back(
            tangle.points, tangle.before, nodes, topology.links, FINE / TWO_SQRT3, precision.unit, precision.grain
        ):
            break
    return UntanglingStep("back where possible", len(nodes), sweeps, tangle.left)
