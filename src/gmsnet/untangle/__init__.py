"""Mending tangled meshes by moving free nodes: fewer inverted cells, and none that was positive is lost for it."""

from __future__ import annotations

from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.signs import exact_signs
from gmsnet.topology.topology import Topology
from gmsnet.untangle.cells import first_rows, whole_cells
from gmsnet.untangle.escalation import escalate
from gmsnet.untangle.guarded import what_is_left
from gmsnet.untangle.newton import polish
from gmsnet.untangle.patch import Floats
from gmsnet.untangle.reach import Reach
from gmsnet.untangle.reasons import freeze, reasons
from gmsnet.untangle.result import ALL, NOTHING, PART, StillInverted, Untangled, UntanglingStep
from gmsnet.untangle.state import UntanglingState
from gmsnet.untangle.transaction import moved, restore, take

__all__ = ["ALL", "NOTHING", "PART", "StillInverted", "Untangled", "UntanglingStep", "untangle"]


ROUNDS = 2  # after the first, nodes of cells that cannot be untangled stand still, for the sake of those beside them


def untangle(
    points: Floats, topology: Topology, precision: Precision, reach: Reach | None = None
) -> Untangled:  # fmt: skip
    """Moves free nodes until no cell is inverted, or as few as can be; held nodes and what is far off keep their bits.

    points: (N, 2) float64 by places in memory (``planar_points(mesh)[topology.memory]``); not changed. topology: of the
    mesh. precision: how exactly coordinates are known once they are written (kernels.star.guard). reach: of which mesh
    this is a part, if it is not the whole. Raises BeyondReachError where the part does not suffice.

    A cell is inverted if one of its corners is not positive. It counts as untangled once it is certified: all its
    corners are positive as they will be written. No cell that was positive is not so
    afterwards, and none that stays inverted is worse (in 1/q) than the worst with a free node was. The result follows
    from the arguments alone.
    """
    topology = topology.with_rings_of_free_nodes()
    tangle = UntanglingState(points, topology, precision, reach)
    before = len(first_rows(topology, tangle.was_bad))
    if not before:
        return Untangled(tangle.points, 0, 0, ALL, "", (), ())
    steps, whys = list[UntanglingStep](), list[str]()
    for _ in range(ROUNDS):
        steps += escalate(tangle)
        whys.append(take(tangle))
        tangle.frozen[:] = False
        if not tangle.bad_nodes().any():
            break
        steps.append(what_is_left(tangle))
        if not freeze(tangle):
            break
    why = next(filter(None, whys), "")
    taken = NOTHING if not moved(tangle).any() else PART if why else ALL
    if taken != NOTHING:
        steps += restore(tangle), polish(tangle)
    after = 0
    if tangle.left:  # else all are certified that have moved or were not positive
        tangle.reach.need_all()
        inverted = exact_signs(tangle.points, topology.near, topology.near_orientation) <= 0
        after = len(first_rows(topology, whole_cells(topology, inverted)))
    sweeps = sum(step.sweeps for step in steps)
    return Untangled(
        tangle.points,
        before,
        after,
        taken,
        why,
        tuple(step for step in steps if step.nodes),
        reasons(topology, tangle.points, tangle.bad, sweeps),
    )
