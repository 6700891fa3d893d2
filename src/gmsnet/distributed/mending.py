"""Inverted cells of a mesh that is spread over ranks: the first one mends them with what lies around them.

What the first rank gets are the nodes within some rings of the inverted cells, with their stars. Where untangling would
look farther, it is tried again with more rings, and last with all cells; so it does what it does to the whole mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi
from gmsnet.distributed.loan import SHARE, around, gathered_field
from gmsnet.distributed.part import Part
from gmsnet.distributed.winding import Winding
from gmsnet.measure.report import measure
from gmsnet.measure.signs import exact_signs
from gmsnet.measure.volumes import look
from gmsnet.methods.base import Field
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.run.untangle_stage import note_of
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

if TYPE_CHECKING:  # what untangling needs of SciPy is slow to import
    from gmsnet.untangle.reach import Reach
    from gmsnet.untangle.result import Untangled

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = 4, 12  # around the inverted cells


class Mended(NamedTuple):
    """points: (n, 2), of volumes (n, 4), of a rank in memory order, no cell inverted. cells: how many were.

    note: what to say of it.
    """

    points: Floats
    cells: int
    note: str


def inverted_in(part: Part) -> int:
    """How many cells of the mesh are, by exact signs. All ranks call it."""
    report = measure(part.mesh, part.topology, part.points)
    own = np.concatenate([*part.around.own, np.empty(0, dtype=bool)])
    return int(part.comm.allreduce(int(np.count_nonzero(~report.valid & own[report.cell]))))


def mended(part: Part, topology: Topology | Volume, inverted: int) -> Mended | None:
    """All inverted cells, so many, mended as ``untangle`` of the whole mesh does it; None where they may not all be.

    topology: of the part, with all nodes held that are to be. Its cells are read as those of all ranks. All ranks call
    it.
    """
    free = part.halo.spread(topology.near_free)
    bad = _bad(part, topology)
    if part.comm.allreduce(bool((bad & ~_movable(topology, free)).any()), mpi().LOR):
        return None
    forth = part.forth
    total = int(part.comm.allreduce(int(np.count_nonzero(topology.near_free))))
    for active in _regions(part, topology, bad, total):
        loan = gathered_field(part, Field(part.points, topology, precision_of(part.mesh)), active)
        known = None if active is None else loan.at_nodes(part, free.astype(np.float64)) > 0.0
        note: str = part.comm.bcast(_tried(loan.field, known, forth, inverted, total))
        if note:
            points = part.points.copy()
            loan.give_back(part, points)
            return Mended(points, inverted, note)
    return None


def _regions(part: Part, topology: Topology | Volume, bad: Flags, total: int) -> Iterator[Flags | None]:
    """What may move, (n,) by places in memory, wider and wider; last None, for all.

    bad: (T,) rows. total: free nodes.
    """
    for rings in RINGS:
        chosen = np.zeros(len(topology.memory), dtype=bool)
        chosen[topology.near[bad]] = True
        active = around(part, topology, chosen, rings)
        if part.comm.allreduce(int(np.count_nonzero(active))) > SHARE * total:
            break
        yield active
    yield None


def _bad(part: Part, topology: Topology | Volume) -> Flags:
    """(T,) the rows that are to be mended: in a plane those of inverted cells, in space all uncertain ones."""
    if isinstance(topology, Topology):
        return np.asarray(exact_signs(part.points, topology.near, topology.near_orientation) <= 0)
    bad, inverted = np.empty((2, len(topology.near)), dtype=bool)
    look(part.points, topology.simplices, precision_of(part.mesh), bad, inverted, np.empty(len(topology.near)))
    return bad


def _movable(topology: Topology | Volume, free: Flags) -> Flags:
    """(T,) the rows of the cells that have a node which some rank moves."""
    from gmsnet.untangle.cells import whole_cells

    return whole_cells(topology, np.asarray(free[topology.near].any(axis=1)))


def _tried(field: Field | None, free: Flags | None, forth: bool, inverted: int, total: int) -> str:
    """What to say where all is mended, and the field is changed; "" where not, or where there is no field.

    free: (m,) by places in memory, which nodes some rank moves; None if the field is of all cells. forth: are
    cells read forwards? inverted: how many, total: free nodes of the whole mesh.
    """
    if field is None:
        return ""
    from gmsnet.untangle.reach import BeyondReachError, Reach

    topology = field.topology
    if not Winding.of(topology).reads(forth=forth):  # most of what is here is inverted
        return ""
    edge = None
    if free is not None:
        edge = np.zeros(len(free), dtype=bool)
        edge[topology.near[topology.rows_at(free & ~topology.near_free)]] = True
    try:
        done = _untangled(field, topology, Reach(total, edge), inverted)
    except BeyondReachError:
        return ""
    if done.after or done.unmended or done.before != inverted:
        return ""
    field.points[:] = done.points
    return note_of(done)


def _untangled(field: Field, topology: Topology | Volume, reach: Reach, inverted: int) -> Untangled:
    if isinstance(topology, Volume):
        from gmsnet.untangle.space import untangle_volume

        return untangle_volume(field.points, topology, field.precision, serial, inverted, reach)
    from gmsnet.untangle import untangle

    return untangle(field.points, topology, field.precision, reach)
