"""Sweeps that do no harm at any step: certified cells stay so, bad ones become less inverted.

They mend what a few nodes alone have done, without moving a neighbour, before anything wilder is tried; and at the end
they get what can be had where not all can be untangled.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.untangle import barrier
from gmsnet.untangle.newton import AVERAGING, closing, keep_gains, sweep
from gmsnet.untangle.patch import Ints, Patch
from gmsnet.untangle.result import UntanglingStep
from gmsnet.untangle.state import UntanglingState

FIRST_SWEEPS, FEW_NODES = 3, 0.1  # only where no more than this share of the free nodes has bad cells
LAST_SWEEPS, RINGS = 30, 2


def worst_nodes(tangle: UntanglingState) -> UntanglingStep:
    """The nodes with bad cells, the worst first, each only if its star is still bad when its turn comes."""
    nodes = tangle.worst_first(tangle.in_order(tangle.bad_nodes()))
    if len(nodes) > FEW_NODES * tangle.reach.free:
        return UntanglingStep("barrier, guarded, worst first", 0, 0, tangle.left)
    return guarded(tangle, nodes, FIRST_SWEEPS, barrier.MENDING, "barrier, guarded, worst first")


def what_is_left(tangle: UntanglingState) -> UntanglingStep:
    """All nodes around bad cells."""
    return guarded(tangle, tangle.around(RINGS).nodes, LAST_SWEEPS, barrier.GUARDED, "barrier, guarded")


def guarded(tangle: UntanglingState, nodes: Ints, most: int, mode: int, name: str) -> UntanglingStep:
    """At most so many sweeps over some nodes; pieces in which no cell is untangled by that go back."""
    patch = Patch.of(tangle.topology, nodes)
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    least = np.empty(patch.parts)
    sweeps, precision = 0, tangle.precision
    before, bad = tangle.points.copy(), tangle.bad.copy()
    while sweeps < most:
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, least)
        sweeps += 1
        if not sweep(tangle, patch, points, scale, closing(least)[patch.part], mode, tangle.worst):
            break
    tangle.put(points, patch)
    tangle.look()
    keep_gains(tangle, before, bad)
    return UntanglingStep(name, patch.count, sweeps, tangle.left)
